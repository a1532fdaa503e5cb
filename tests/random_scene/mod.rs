//! Random scenes of every size that the format allows.

#![allow(dead_code, reason = "every test binary uses its own part of it")]

use etendue::Numbers;
use etendue::implicit::{Clip, Grid, Implicit, Volume};
use etendue::scene::{Bsdf, Camera, Light, Material, Place, Primitive, RenderHints, Scene, Shape};
use glam::{DMat3, DVec3};
use proptest::collection::vec;
use proptest::prelude::*;
use std::sync::Arc;

/// Coordinates of every magnitude that is allowed.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        1 => Just(0.0),
        1 => (-1.0..1.0f64, -20..=15i32).prop_map(|(m, e)| m * 10f64.powi(e)),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![
        0.01..10.0,
        (1.0..10.0f64, -15..=14i32).prop_map(|(m, e)| m * 10f64.powi(e))
    ]
}

fn unit() -> impl Strategy<Value = DVec3> {
    point()
        .prop_filter("not null", |v| v.length() > 1e-3)
        .prop_map(DVec3::normalize)
}

fn share() -> impl Strategy<Value = DVec3> {
    [0.0..=1.0, 0.0..=1.0, 0.0..=1.0].prop_map(DVec3::from_array)
}

fn bsdf() -> impl Strategy<Value = Bsdf> {
    prop_oneof![
        share().prop_map(|reflectance| Bsdf::Diffuse { reflectance }),
        share().prop_map(|reflectance| Bsdf::Mirror { reflectance }),
        (1e-6..1e6, share())
            .prop_map(|(ior, transmittance)| Bsdf::Dielectric { ior, transmittance }),
        (share(), share(), 0.0..1e6).prop_map(|(diffuse, x, exponent)| Bsdf::Phong {
            diffuse,
            specular: x * (1.0 - diffuse),
            exponent,
        }),
    ]
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        (point(), radius()).prop_map(|(center, radius)| Shape::Sphere { center, radius }),
        (point(), unit()).prop_map(|(point, normal)| Shape::Plane { point, normal }),
        (point(), unit(), radius()).prop_map(|(center, normal, radius)| Shape::Disk {
            center,
            normal,
            radius
        }),
        (point(), point(), radius())
            .prop_filter("some length", |(base, top, _)| base.distance(*top) >= 1e-15)
            .prop_map(|(base, top, radius)| Shape::Cylinder { base, top, radius }),
    ]
}

/// Trees of everything that a formula may hold: most have no surface that anyone would want, poles and jumps among them.
fn formula() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        6 => prop::sample::select(vec!["x", "y", "z", "a"]).prop_map(str::to_owned),
        1 => Just("pi".to_owned()),
        2 => (-10.0..10.0f64, -3..=3i32).prop_map(|(m, e)| format!("({:?})", m * 10f64.powi(e))),
    ];
    leaf.prop_recursive(4, 24, 3, |part| {
        prop_oneof![
            6 => (part.clone(), prop::sample::select(vec!["+", "-", "*", "/"]), part.clone())
                .prop_map(|(a, o, b)| format!("({a} {o} {b})")),
            2 => (part.clone(), prop::sample::select(vec!["2", "3", "0.5", "-1", "1.7", "64"]))
                .prop_map(|(a, n)| format!("({a})^{n}")),
            4 => (prop::sample::select(vec!["sqrt", "abs", "sin", "cos", "tan", "exp", "log"]), part.clone())
                .prop_map(|(f, a)| format!("{f}({a})")),
            2 => (prop::sample::select(vec!["min", "max"]), part.clone(), part)
                .prop_map(|(f, a, b)| format!("{f}({a}, {b})")),
        ]
    })
}

fn clip() -> impl Strategy<Value = Clip> {
    let half = || 0.01..10.0;
    prop_oneof![
        radius().prop_map(|radius| Clip::Ball { radius }),
        ([half(), half(), half()], -1.0..1.0).prop_map(|(half, shift)| {
            let half = DVec3::from_array(half);
            Clip::Box {
                min: half * (shift - 1.0),
                max: half * (shift + 1.0),
            }
        }),
    ]
}

/// Well-known surfaces, and formulas that nobody would write.
fn formula_surface() -> impl Strategy<Value = Shape> {
    let known = prop::sample::select(vec![
        "x^2 + y^2 + z^2 - a^2",
        "(x^2 + y^2 + z^2 + 1 - a^2/16)^2 - 4 (x^2 + y^2)",
        "abs(sin(a x) cos(a y) + sin(a y) cos(a z) + sin(a z) cos(a x)) - 0.2",
        "x^4 + y^4 + z^4 - x^2 - y^2 - z^2 + 0.3",
        "max(abs(x), abs(y), abs(z)) - 0.5",
        "z - sin(a x) exp(-y^2)",
    ]);
    let formula = prop_oneof![known.prop_map(str::to_owned), formula()];
    let level = prop_oneof![Just(0.0), -1.0..1.0];
    let place = (point(), radius(), unit(), -180.0..180.0f64);
    (formula, -3.0..3.0f64, level, place, clip(), any::<bool>()).prop_filter_map(
        "numbers that stay in range",
        |(text, a, level, (center, scale, axis, angle), clip, closed)| {
            let mut shape = Implicit::new(&text, &[("a", a)]).ok()?;
            shape.level = level;
            shape.center = center;
            shape.scale = scale;
            shape.rotation = DMat3::from_axis_angle(axis, angle.to_radians());
            shape.clip = clip;
            shape.closed = closed;
            Some(Shape::Implicit(Arc::new(shape)))
        },
    )
}

/// Volumes of a few points, whose numbers have any magnitude, and of which many are equal.
fn volume() -> impl Strategy<Value = Shape> {
    let number = prop_oneof![Just(0.0), -1.0..1.0, coordinate().prop_map(|x| x * 1e200)];
    let numbers = [2..5usize, 2..5usize, 2..5usize].prop_flat_map(move |size| {
        let count = size.iter().product::<usize>();
        let kinds = prop_oneof![
            vec(any::<u8>(), count).prop_map(Numbers::U8),
            vec(any::<u16>(), count).prop_map(Numbers::U16),
            vec(-1.0..1.0f32, count).prop_map(Numbers::F32),
            vec(number.clone(), count).prop_map(Numbers::F64),
        ];
        (Just(size), kinds)
    });
    let spacing = [radius(), radius(), radius()].prop_map(DVec3::from_array);
    let place = (point(), unit(), -180.0..180.0f64);
    let ways = (any::<bool>(), any::<bool>(), any::<bool>());
    (numbers, 0.0..=1.0f64, spacing, place, ways).prop_filter_map(
        "numbers that stay in range",
        |((size, numbers), share, spacing, (center, axis, angle), (above, closed, smooth))| {
            let mut grid = Grid::new(Volume::new(size, numbers).ok()?, spacing);
            (grid.above, grid.smooth) = (above, smooth);
            let [low, high] = grid.volume.range();
            let mut shape = Implicit::of_volume(grid, low * (1.0 - share) + high * share);
            shape.center = center;
            shape.rotation = DMat3::from_axis_angle(axis, angle.to_radians());
            shape.closed = closed;
            Some(Shape::Implicit(Arc::new(shape)))
        },
    )
}

fn light() -> impl Strategy<Value = Light> {
    (point(), unit(), radius(), share(), 0.0..1e15).prop_map(
        |(center, normal, radius, color, power)| Light {
            center,
            normal,
            radius,
            radiance: color * power,
            line: 0,
            column: 0,
        },
    )
}

fn camera() -> impl Strategy<Value = Camera> {
    let view = (point(), point(), unit());
    (view, 0.1..179.9, [1..=65536u32, 1..=65536u32])
        .prop_filter("a view not along up", |((eye, look_at, up), _, _)| {
            let view = *look_at - *eye;
            view.length() > 1e-6 && view.normalize().cross(*up).length() > 1e-6
        })
        .prop_map(|((eye, look_at, up), vfov, resolution)| Camera {
            eye,
            look_at,
            up,
            vfov,
            resolution,
        })
}

/// What is in a random scene beside spheres, planes, disks and cylinders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Implicits {
    None,
    /// One to three.
    Formulas,
    /// One to three.
    Volumes,
}

/// Valid scenes; the names of materials are such that TOML must quote some.
pub fn scenes(implicits: Implicits) -> BoxedStrategy<Scene> {
    let implicit = match implicits {
        Implicits::None => return scenes_of(shape()).boxed(),
        Implicits::Formulas => formula_surface().boxed(),
        Implicits::Volumes => volume().boxed(),
    };
    let shapes = prop_oneof![2 => shape(), 1 => implicit.clone()];
    let with_one_more = (scenes_of(shapes), implicit).prop_map(|(mut scene, shape)| {
        let mut count = 0;
        scene.primitives.retain(|p| {
            let is_implicit = matches!(p.shape, Shape::Implicit(_));
            count += usize::from(is_implicit);
            count < 3 || !is_implicit
        });
        let glass = |m: usize| matches!(scene.materials[m].bsdf, Bsdf::Dielectric { .. });
        let solid = matches!(&shape, Shape::Implicit(s) if s.closed);
        if let Some(material) = (0..scene.materials.len()).find(|&m| solid || !glass(m)) {
            scene.primitives.push(Primitive {
                shape,
                material,
                line: 0,
                column: 0,
            });
        }
        scene
    });
    with_one_more.boxed()
}

fn scenes_of(shape: impl Strategy<Value = Shape>) -> impl Strategy<Value = Scene> {
    let materials = vec(("[a-z .\"\\\\é-]{0,4}", bsdf()), 1..5);
    let primitives = vec((shape, any::<prop::sample::Index>()), 1..12);
    let hint = || prop::option::of(1..1000u32);
    let rest = (prop::option::of(".*"), hint(), hint(), hint());
    (camera(), materials, primitives, vec(light(), 1..4), rest).prop_map(
        |(camera, materials, primitives, lights, (title, max_depth, strata, seed))| {
            let materials: std::collections::BTreeMap<String, Bsdf> =
                materials.into_iter().collect();
            let materials: Vec<Material> = materials
                .into_iter()
                .map(|(name, bsdf)| Material {
                    name,
                    bsdf,
                    place: Place::default(),
                })
                .collect();
            let primitives = primitives.into_iter().filter_map(|(shape, index)| {
                let material = index.index(materials.len());
                let is_glass = matches!(materials[material].bsdf, Bsdf::Dielectric { .. });
                let open = matches!(&shape, Shape::Implicit(s) if !s.closed);
                let refused = is_glass && (open || matches!(shape, Shape::Disk { .. }));
                (!refused).then_some(Primitive {
                    shape,
                    material,
                    line: 0,
                    column: 0,
                })
            });
            let mut primitives: Vec<Primitive> = primitives.collect();
            if primitives.is_empty() {
                primitives.push(Primitive {
                    shape: Shape::Sphere {
                        center: DVec3::ZERO,
                        radius: 1.0,
                    },
                    material: 0,
                    line: 0,
                    column: 0,
                });
            }
            primitives.sort_by_key(|p| {
                ["sphere", "plane", "disk", "cylinder", "implicit"]
                    .iter()
                    .position(|&kind| kind == p.shape.kind())
            });
            Scene {
                path: "random.toml".into(),
                row_files: Vec::new(),
                title,
                camera,
                render: RenderHints {
                    max_depth,
                    strata,
                    seed,
                },
                materials,
                primitives,
                lights,
            }
        },
    )
}
