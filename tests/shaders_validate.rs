//! naga validates the kernel of every combination of primitives, materials and modes: no GPU needed.

mod common;

use common::scene;
use etendue::Numbers;
use etendue::implicit::{Grid, Implicit, Volume};
use etendue::kernel::{Access, compose};
use etendue::scene::{Primitive, Scene, Shape};
use etendue::settings::{Integrator, LightParts, Overrides, Settings};
use etendue::world::World;
use glam::DVec3;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::sync::Arc;

const MATERIALS: [(&str, &str); 4] = [
    (
        "diffuse",
        "type = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]",
    ),
    ("mirror", "type = \"mirror\""),
    ("glass", "type = \"dielectric\""),
    (
        "gloss",
        "type = \"phong\"\ndiffuse = [0.3, 0.3, 0.3]\nspecular = [0.4, 0.4, 0.4]\nexponent = 60.0",
    ),
];

const SHAPES: [(&str, &str); 5] = [
    ("sphere", "center = [0.0, 0.0, 0.0]\nradius = 0.5"),
    (
        "plane",
        "point = [0.0, -1.0, 0.0]\nnormal = [0.0, 1.0, 0.0]",
    ),
    (
        "disk",
        "center = [0.0, 0.0, -1.0]\nnormal = [0.0, 0.0, 1.0]\nradius = 0.5",
    ),
    (
        "cylinder",
        "base = [1.0, 0.0, 0.0]\ntop = [1.0, 1.0, 0.0]\nradius = 0.2",
    ),
    // Far larger than the rest: the curvature form.
    ("sphere", "center = [0.0, -1e6, 0.0]\nradius = 999999.0"),
];

/// The bits of all shapes, and of all materials.
const EVERY_SHAPE: usize = (1 << SHAPES.len()) - 1;
const EVERY_MATERIAL: usize = (1 << MATERIALS.len()) - 1;

#[test]
fn every_material_of_the_format_is_here() {
    let schema = etendue::scene::schema::schema();
    let kinds = &schema["properties"]["material"]["additionalProperties"]["oneOf"];
    assert_eq!(kinds.as_array().expect("a list").len(), MATERIALS.len());
}

/// A scene with the shapes and materials whose bits are set, every shape with every material that it may have.
fn text(shapes: usize, materials: usize, lights: usize, eye_inside: bool) -> Option<String> {
    let mut s = format!(
        "[camera]\neye = [0.0, {}, {}]\nlook_at = [0.0, 0.2, -3.0]\nvfov = 40.0\nresolution = [4, 3]\n",
        if eye_inside { "0.1" } else { "0.5" },
        if eye_inside { "0.1" } else { "3.0" },
    );
    let mut any = false;
    for (m, (name, body)) in MATERIALS
        .iter()
        .enumerate()
        .filter(|(m, _)| materials >> m & 1 == 1)
    {
        s += &format!("[material.{name}]\n{body}\n");
        for (_, (kind, body)) in SHAPES
            .iter()
            .enumerate()
            .filter(|(k, _)| shapes >> k & 1 == 1)
        {
            if !(m == 2 && *kind == "disk") {
                any = true;
                s += &format!("[[{kind}]]\n{body}\nmaterial = \"{name}\"\n");
            }
        }
    }
    for i in 0..lights {
        s += &format!(
            "[[light]]\ncenter = [{i}.0, 2.0, 0.0]\nnormal = [0.0, -1.0, 0.0]\nradius = 0.3\nradiance = [5.0, 5.0, 5.0]\n"
        );
    }
    any.then_some(s)
}

fn validate(wgsl: &str, what: &str) {
    let module = naga::front::wgsl::parse_str(wgsl)
        .unwrap_or_else(|e| panic!("{what}: {}\n{wgsl}", e.emit_to_string(wgsl)));
    Validator::new(ValidationFlags::all(), Capabilities::default())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{what}: {}", e.emit_to_string(wgsl)));
}

const ACCESSES: [Access; 3] = [Access::Baked, Access::Buffers, Access::Tree];

/// Validates the kernels of a scene, of paths and of light paths, for every access; their number.
fn validate_all(scene: &Scene, flags: &Overrides, what: &str) -> usize {
    let settings = Settings::resolve(scene, flags);
    let world = World::new(scene, settings.size);
    let mut count = 0;
    for access in ACCESSES {
        let kernel = compose(&world, &settings, Some(access));
        for (name, wgsl) in [
            ("path", Some(&kernel.wgsl)),
            ("light", kernel.light.as_ref().map(|l| &l.wgsl)),
        ] {
            if let Some(wgsl) = wgsl {
                validate(wgsl, &format!("{name} {access:?} {flags:?}\n{what}"));
                count += 1;
            }
        }
    }
    count
}

#[test]
fn every_combination_of_primitives_and_materials_is_valid() {
    let mut count = 0;
    for shapes in 1..1 << SHAPES.len() {
        for materials in 1..1 << MATERIALS.len() {
            let lights = 1 + (shapes + materials) % 2;
            let Some(text) = text(shapes, materials, lights, (shapes ^ materials) & 4 == 4) else {
                continue;
            };
            count += validate_all(&scene(&text), &Overrides::default(), &text);
        }
    }
    assert!(count > 1400, "only {count} kernels");
}

/// The surface of a formula, that of a volume, and one with smooth normals.
fn implicits() -> [Implicit; 3] {
    let formula = Implicit::new("x^2 + y^4 + sin(z) - 0.3", &[]).expect("a formula");
    let grid = Grid::new(
        Volume::new([2, 2, 2], Numbers::U8((0..8).collect())).expect("a volume"),
        DVec3::ONE,
    );
    let smooth = Grid {
        smooth: true,
        ..grid.clone()
    };
    [
        formula,
        Implicit::of_volume(grid, 2.5),
        Implicit::of_volume(smooth, 2.5),
    ]
}

/// A scene with the implicit surfaces and the materials whose bits are set, every surface with every material, alone or beside others.
fn with_implicits(surfaces: usize, materials: usize, alone: bool) -> Scene {
    let mut scene = scene(&text(EVERY_SHAPE, materials, 2, false).expect("has primitives"));
    if alone {
        scene.primitives.clear();
    }
    for (_, implicit) in implicits()
        .into_iter()
        .enumerate()
        .filter(|(k, _)| surfaces >> k & 1 == 1)
    {
        for material in 0..scene.materials.len() {
            scene.primitives.push(Primitive {
                shape: Shape::Implicit(Arc::new(implicit.clone())),
                material,
                line: 0,
                column: 0,
            });
        }
    }
    scene
}

#[test]
fn implicit_surfaces_of_every_material_are_valid() {
    for surfaces in 1..8 {
        for materials in 1..1 << MATERIALS.len() {
            let alone = (surfaces + materials) % 2 == 1;
            let scene = with_implicits(surfaces, materials, alone);
            let what = format!("surfaces {surfaces}, materials {materials}, alone: {alone}");
            validate_all(&scene, &Overrides::default(), &what);
        }
    }
}

/// A lamp in a hollow glass ball, one in a solid ball, and one in the open, over a floor of this material. The first lamp has this radiance.
fn with_bulbs(material: usize, size: f64, radiance: f64) -> String {
    let (name, keys) = MATERIALS[material];
    let lamp = |x: f64, radiance: f64| {
        let (x, r) = (x * size, 0.1 * size);
        format!(
            "[[light]]\ncenter = [{x:e}, 0.0, 0.0]\nnormal = [0.0, -1.0, 0.0]\nradius = {r:e}\n\
             radiance = [{radiance:e}, 0.0, 0.0]\n"
        )
    };
    let ball = |x: f64, radius: f64, material: &str| {
        let (x, r) = (x * size, radius * size);
        format!(
            "[[sphere]]\ncenter = [{x:e}, 0.0, 0.0]\nradius = {r:e}\nmaterial = \"{material}\"\n"
        )
    };
    let mut text = format!(
        "[camera]\neye = [0.0, 0.0, 8.0]\nlook_at = [0.0, 0.0, 0.0]\nvfov = 40.0\nresolution = [16, 16]\n\
         [material.{name}]\n{keys}\n[material.solid]\ntype = \"dielectric\"\n\
         [material.bubble]\ntype = \"dielectric\"\nior = 0.65789\n\
         [[plane]]\npoint = [0.0, {:e}, 0.0]\nnormal = [0.0, 1.0, 0.0]\nmaterial = \"{name}\"\n",
        -size
    );
    text += &(lamp(0.0, radiance) + &ball(0.0, 0.9, "solid") + &ball(0.0, 0.8, "bubble"));
    text += &(lamp(2.0, 1.0) + &ball(2.0, 0.9, "solid") + &lamp(4.0, 1.0));
    text
}

#[test]
fn every_mode_is_valid() {
    let everything = scene(&text(EVERY_SHAPE, EVERY_MATERIAL, 3, false).expect("has primitives"));
    let only_mirrors = scene(&text(1, 2, 1, false).expect("has primitives"));
    let smooth_mirrors = with_implicits(4, 2, true);
    let smooth_gloss = with_implicits(4, 8, true);
    let [matt_bulbs, glossy_bulbs] = [0, 3].map(|m| scene(&with_bulbs(m, 1.0, 1.0)));
    for scene in [
        &everything,
        &only_mirrors,
        &smooth_mirrors,
        &smooth_gloss,
        &matt_bulbs,
        &glossy_bulbs,
    ] {
        for light in 1..8 {
            for integrator in [Integrator::Path, Integrator::Whitted] {
                for shadow_rays in [1, 4] {
                    for (strata, max_depth) in [(1, 1), (2, 2), (3, 64)] {
                        let flags = Overrides {
                            strata: Some(strata),
                            max_depth: Some(max_depth),
                            shadow_rays: Some(shadow_rays),
                            light: Some(LightParts {
                                emitted: light & 1 == 1,
                                direct: light & 2 == 2,
                                indirect: light & 4 == 4,
                            }),
                            integrator: Some(integrator),
                            ..Overrides::default()
                        };
                        validate_all(scene, &flags, "");
                    }
                }
            }
        }
    }
}

#[test]
fn bulbs_of_any_brightness_and_size_are_valid() {
    for radiance in [1e-15, 1.0, 1e15] {
        for size in [1e-14, 1.0, 1e14] {
            let text = with_bulbs(0, size, radiance);
            validate_all(&scene(&text), &Overrides::default(), &text);
        }
    }
}

#[test]
fn a_kernel_holds_only_what_its_scene_needs() {
    let kernel = |text: Option<String>, access| {
        let scene = scene(&text.expect("has primitives"));
        let settings = Settings::resolve(&scene, &Overrides::default());
        compose(&World::new(&scene, settings.size), &settings, access).wgsl
    };
    let plane = kernel(text(2, 1, 1, false), None);
    let everything = ACCESSES
        .map(|access| kernel(text(EVERY_SHAPE, EVERY_MATERIAL, 3, false), Some(access)))
        .concat()
        + &kernel(Some(with_bulbs(0, 1.0, 1.0)), None);
    for unneeded in [
        "fn cylinder_",
        "fn sphere_",
        "fn huge_sphere_",
        "fn sample_mirror",
        "fn sample_dielectric",
        "fn sample_phong",
        "fn light_weight",
        "var<storage, read> surfaces",
        "var records",
        "trips_left",
        "fn bulb_ray",
    ] {
        assert!(everything.contains(unneeded), "no kernel has {unneeded}");
        assert!(
            !plane.contains(unneeded),
            "a diffuse plane needs no {unneeded}"
        );
    }
    assert!(plane.contains("plane_front") && plane.contains("sample_diffuse"));
}
