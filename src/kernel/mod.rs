//! The kernel made for one scene: the modules of `shaders/` that it needs, constants, and the generated
//! functions that meet its primitives and choose its lights.

mod choice;
mod images;
pub(crate) mod lights;
mod literal;
mod near;
mod preprocess;
mod rays;
pub(crate) mod records;
mod select;
mod tables;
pub(crate) mod trees;

pub use lights::MOST_LOOKED_AT;
pub use select::{Access, BAKED_LIMIT};

use crate::film::{BLOCK, REPLICATES};
use crate::scene::Bsdf;
use crate::settings::{Integrator, LightParts, Settings};
use crate::world::{AIR, Geometry, World, WorldLight, WorldPrimitive};
use literal::{float, vector};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use trees::Parted;

/// Squared, the camera rays that a sample sends in a pixel that may see a light.
const GLANCES: u32 = 4;

/// The same where they look by way of mirrors and glass alone, unless paths have two vertices at most: indirect light is noisier
/// than the edges that they see. 4 were slower by 8 % on caustic and 3 % on three_materials, for as much noise or a little less.
const CHAIN_GLANCES: u32 = 2;

/// The last vertex at which they look for one. A ball of glass takes two before it, and one more in a mirror three.
const LONGEST_GLANCE: u32 = 6;

/// The fourth powers of radii outside this range come near the ends of f32.
const ORDINARY_RADII: RangeInclusive<f64> = 1e-8..=1e8;

/// Where in a mark it stands at which vertex of glass half of the glances are reflected.
pub(crate) const BRANCH_SHIFT: u32 = 8;

/// And whether a light may be seen directly.
pub(crate) const DIRECT_SHIFT: u32 = 16;

/// So many of the loop trips that an older driver grants may be used up by glances.
const TRIPS_FOR_GLANCES: u64 = 16_384;

/// Tags of [`Bsdf`] in `Material.kind`; the names are the kernel's constants.
pub(crate) const MATERIAL_TAGS: [&str; 4] = [
    "MATERIAL_DIFFUSE",
    "MATERIAL_MIRROR",
    "MATERIAL_DIELECTRIC",
    "MATERIAL_PHONG",
];

/// Tags of [`Geometry`] in `Surface.shape`; flat shapes first.
pub(crate) const SHAPE_TAGS: [&str; 5] = [
    "SHAPE_PLANE",
    "SHAPE_DISK",
    "SHAPE_CYLINDER",
    "SHAPE_SPHERE",
    "SHAPE_HUGE_SPHERE",
];

/// Index into [`MATERIAL_TAGS`].
pub(crate) fn material_tag(bsdf: &Bsdf) -> u32 {
    match bsdf {
        Bsdf::Diffuse { .. } => 0,
        Bsdf::Mirror { .. } => 1,
        Bsdf::Dielectric { .. } => 2,
        Bsdf::Phong { .. } => 3,
    }
}

/// Index into [`SHAPE_TAGS`].
pub(crate) fn shape_tag(geometry: &Geometry) -> u32 {
    match geometry {
        Geometry::Plane { .. } => 0,
        Geometry::Disk { .. } => 1,
        Geometry::Cylinder { .. } => 2,
        Geometry::Sphere { .. } => 3,
        Geometry::HugeSphere { .. } => 4,
    }
}

/// The modules of `shaders/`, in the order in which they are read.
pub const MODULES: [(&str, &str); 19] = [
    ("ray", include_str!("../../shaders/ray.wgsl")),
    ("frame", include_str!("../../shaders/frame.wgsl")),
    ("sampler", include_str!("../../shaders/sampler.wgsl")),
    ("camera", include_str!("../../shaders/camera.wgsl")),
    ("disk", include_str!("../../shaders/disk.wgsl")),
    ("cylinder", include_str!("../../shaders/cylinder.wgsl")),
    ("plane", include_str!("../../shaders/plane.wgsl")),
    ("sphere", include_str!("../../shaders/sphere.wgsl")),
    (
        "huge_sphere",
        include_str!("../../shaders/huge_sphere.wgsl"),
    ),
    ("light", include_str!("../../shaders/light.wgsl")),
    ("diffuse", include_str!("../../shaders/diffuse.wgsl")),
    ("mirror", include_str!("../../shaders/mirror.wgsl")),
    ("dielectric", include_str!("../../shaders/dielectric.wgsl")),
    ("phong", include_str!("../../shaders/phong.wgsl")),
    ("surface", include_str!("../../shaders/surface.wgsl")),
    ("image", include_str!("../../shaders/image.wgsl")),
    ("records", include_str!("../../shaders/records.wgsl")),
    ("tree", include_str!("../../shaders/tree.wgsl")),
    ("light_tree", include_str!("../../shaders/light_tree.wgsl")),
];

/// The entry point and the path loop, and what the loop does at a vertex.
const PATH: [(&str, &str); 2] = [
    ("path", include_str!("../../shaders/path.wgsl")),
    ("scatter", include_str!("../../shaders/scatter.wgsl")),
];

/// A composed kernel.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// Its WGSL: entry point `render`, 64 invocations a workgroup.
    pub wgsl: String,
    /// How it reaches the scene's values.
    pub access: Access,
    /// The most loop trips that one sample can take of an invocation; 0 where the kernel counts them itself, and leaves
    /// what it cannot finish to the next dispatch.
    pub trips_per_sample: u64,
    /// The last vertex at which it looks for lights by extra camera rays, in pixels that the host marks; 0: it reads no marks.
    pub sight: u32,
}

/// Composes the kernel of `world` under `settings`; `access` overrides the rule of [`Access::choose`].
pub fn compose(world: &World, settings: &Settings, access: Option<Access>) -> Kernel {
    let access = access.unwrap_or_else(|| Access::choose(world));
    let features = features(world, settings, access);
    let sight = sight(world, settings, access);
    let mut wgsl = String::from("// Made for one scene by etendue.\n\n");
    wgsl.push_str(&scene_text(world, settings, access, &features));
    for (name, text) in PATH {
        let _ = write!(
            wgsl,
            "\n// ---- {name}.wgsl\n\n{}",
            preprocess::run(text, &features)
        );
    }
    let trips_per_sample = match access {
        Access::Tree => 0,
        Access::Baked | Access::Buffers => {
            // While one lane glances another may do all that a vertex asks for.
            let turns = u64::from(last_depth(settings)) + u64::from(GLANCES * GLANCES * sight);
            let trips = turns
                .saturating_mul(trips_at_vertex(world, settings, access, None))
                .saturating_add(STRATA_LOOP + LOOPS_AROUND);
            // The loop over turns is in one of its own then, which goes round no more often.
            trips
                + if features.contains("IMAGES") {
                    turns
                } else {
                    0
                }
        }
    };
    Kernel {
        wgsl,
        access,
        trips_per_sample,
        sight,
    }
}

/// The loop trips that a vertex can take of an invocation; but for walks through the trees of `parted`, which count theirs.
fn trips_at_vertex(
    world: &World,
    settings: &Settings,
    access: Access,
    parted: Option<&Parted>,
) -> u64 {
    // Loops over all surfaces for a ray, and over all lights to choose one.
    let (ray, choice) = match access {
        Access::Baked => (0, 0),
        Access::Buffers => (surfaces(world), world.lights.len() as u64),
        // Surfaces without bounds, if they are many.
        Access::Tree => (
            parted.map_or(0, |p| p.apart.len() as u64),
            2 * lights::trips(world),
        ),
    };
    // Every vertex: nearest hit, and for each shadow ray a choice and a ray.
    let inner = ray + u64::from(settings.shadow_rays) * (choice + ray);
    let shadow_loop = if settings.shadow_rays > 1 {
        u64::from(settings.shadow_rays)
    } else {
        0
    };
    let hidden = if rays::lights_overlap(world) {
        u64::from(settings.shadow_rays) * world.lights.len() as u64
    } else {
        0
    };
    1 + inner + shadow_loop + hidden
}

/// The loop trips that the choice of a place in the pixel can take.
const STRATA_LOOP: u64 = 32;

/// Those that reading and writing a pixel's numbers take, before its first sample and after its last: three, four and four.
const LOOPS_AROUND: u64 = 11;

/// The last vertex at which glances look for lights; 0: there are none. Not by which light is kept, unless none can be: the parts of
/// a picture are made of the same samples, and so add up to the whole.
fn sight(world: &World, settings: &Settings, access: Access) -> u32 {
    let eye = world.camera.eye;
    let faces_eye = |l: &WorldLight| l.normal.dot(eye) > l.offset;
    let seen = world.lights.iter().any(faces_eye);
    let affordable = TRIPS_FOR_GLANCES
        / u64::from(GLANCES * GLANCES)
        / trips_at_vertex(world, settings, access, None);
    let mut specular = world
        .primitives
        .iter()
        .map(|p| &world.materials[p.material]);
    let shown = specular.any(|b| matches!(b, Bsdf::Mirror { .. } | Bsdf::Dielectric { .. }))
        && !world.lights.is_empty()
        && world.primitives.len() + world.lights.len() <= BAKED_LIMIT;
    let sight = if access == Access::Tree {
        // The host looks at all surfaces for what mirrors show, which would take too long.
        1
    } else if shown {
        LONGEST_GLANCE
            .min(settings.max_depth)
            .min(affordable as u32)
    } else {
        affordable.min(1) as u32
    };
    let kept = (0..sight).any(|scatterings| settings.light.keeps(scatterings));
    if kept && (sight > 1 || seen) {
        sight
    } else {
        0
    }
}

/// All that the path loop of a scene calls: constants, modules, and what is generated for the scene.
fn scene_text(
    world: &World,
    settings: &Settings,
    access: Access,
    features: &BTreeSet<&str>,
) -> String {
    let mut s = String::new();
    tags(&mut s);
    s.push_str(&constants(world, settings));
    let parted = (access == Access::Tree).then(|| Parted::new(world));
    if let Some(parted) = &parted {
        let vertex = trips_at_vertex(world, settings, access, Some(parted));
        let glances = u64::from(GLANCES * GLANCES * sight(world, settings, access));
        let start = glances + STRATA_LOOP + LOOPS_AROUND;
        let _ = writeln!(
            s,
            "const TRIPS_AT_VERTEX: u32 = {vertex}u;\nconst TRIPS_AT_START: u32 = {start}u;"
        );
        s.push_str(&records::Records::new(world, parted).constants(world));
    }
    for (name, text) in MODULES {
        if needs(name, features) {
            let _ = write!(
                s,
                "\n// ---- {name}.wgsl\n\n{}",
                preprocess::run(text, features)
            );
        }
    }
    s.push_str("\n// ---- this scene\n\n");
    s.push_str(&rays::generate(world, access, features, parted.as_ref()));
    if features.contains("IMAGES") {
        let images = images::of(world, settings, access);
        s.push_str(&images::generate(world, &images));
    }
    s
}

/// A shader whose entry point `probe` runs `body` on 16 floats `x` into 16 floats `y`, beside the modules that need no
/// scene.
pub(crate) fn probe_source(features: &[&'static str], body: &str) -> String {
    let features: BTreeSet<&str> = features.iter().copied().collect();
    let mut s = String::new();
    tags(&mut s);
    for (name, text) in MODULES {
        let of_scenes = ["camera", "surface", "records", "tree", "light_tree"].contains(&name);
        if !of_scenes && (name != "image" || features.contains("IMAGES")) {
            s.push_str(&preprocess::run(text, &features));
        }
    }
    s.push_str(&probe_entry(body));
    s
}

/// A shader whose entry point `probe` runs `body` on 16 floats `x` into 16 floats `y`, beside all that the kernel of `world` has but
/// its path loop: `intersect`, `occluded` and so on. For [`Probe::compile`](crate::gpu::probe::Probe::compile).
pub fn scene_probe_source(
    world: &World,
    settings: &Settings,
    access: Access,
    body: &str,
) -> String {
    let mut s = scene_text(world, settings, access, &features(world, settings, access));
    s.push_str(&probe_entry(body));
    s
}

fn probe_entry(body: &str) -> String {
    format!(
        "
@group(1) @binding(0) var<storage, read> inputs: array<array<f32, 16>>;
@group(1) @binding(1) var<storage, read_write> outputs: array<array<f32, 16>>;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {{
    if id.x >= arrayLength(&inputs) {{
        return;
    }}
    let x = inputs[id.x];
    var y = outputs[id.x];
{body}
    outputs[id.x] = y;
}}
"
    )
}

fn tags(s: &mut String) {
    for names in [&MATERIAL_TAGS[..], &SHAPE_TAGS[..]] {
        for (tag, name) in names.iter().enumerate() {
            let _ = writeln!(s, "const {name}: u32 = {tag}u;");
        }
    }
}

/// Lights and primitives.
fn surfaces(world: &World) -> u64 {
    (world.lights.len() + world.primitives.len()) as u64
}

/// Number of the last vertex that can matter, for the light that is kept.
fn last_depth(settings: &Settings) -> u32 {
    settings.max_depth.min(needed_depth(settings))
}

/// Vertices beyond which none of the light that is kept can be found.
fn needed_depth(settings: &Settings) -> u32 {
    match settings.light {
        LightParts { indirect: true, .. } => u32::MAX,
        LightParts { direct: true, .. } => 2,
        _ => 1,
    }
}

/// Names that are true for this scene, for `#if` in the modules and for [`needs`].
fn features(world: &World, settings: &Settings, access: Access) -> BTreeSet<&'static str> {
    let mut f = BTreeSet::new();
    let mut set = |name, on: bool| {
        if on {
            f.insert(name);
        }
    };
    let used: Vec<&Bsdf> = world
        .primitives
        .iter()
        .map(|p| &world.materials[p.material])
        .collect();
    let any = |tag: u32| used.iter().any(|b| material_tag(b) == tag);
    let (diffuse, mirror, dielectric, phong) = (any(0), any(1), any(2), any(3));
    set("DIFFUSE", diffuse);
    set("MIRROR", mirror);
    set("DIELECTRIC", dielectric);
    set("PHONG", phong);

    let shape = |tag: u32| {
        world
            .primitives
            .iter()
            .any(|p| shape_tag(&p.geometry) == tag)
    };
    set("PLANE", shape(0));
    set("CYLINDER", shape(2));
    set("SPHERE", shape(3));
    set("HUGE", shape(4));
    let lit = |p: &WorldPrimitive| {
        let caps = matches!(p.geometry, Geometry::Cylinder { .. }).then_some(&p.faces[1..]);
        let mut faces = caps.into_iter().flatten();
        faces.any(|f| world.lights.iter().any(|l| l.face == *f))
    };
    set("LIT_CAPS", world.primitives.iter().any(lit));
    set("FLAT", shape(0) || shape(1) || shape(2));
    set("ROUND", shape(2) || shape(3) || shape(4));

    let depth = last_depth(settings);
    let sampling = depth > 1 && !world.lights.is_empty() && (diffuse || phong);
    set("LIGHT_SAMPLING", sampling);
    set("TREE", access == Access::Tree);
    set("BRANCHES", access != Access::Baked);
    set(
        "LIGHT_TREE",
        sampling && access == Access::Tree && records::clustered(world),
    );
    let several = sampling && world.lights.len() > 1;
    set("SEVERAL_LIGHTS", several);
    set("GLOSSY", sampling && phong);
    let images = !images::of(world, settings, access).is_empty();
    set("IMAGES", images);
    set("LIGHT_WEIGHTS", images || several || (sampling && phong));
    set(
        "EXTREME_LIGHTS",
        world
            .lights
            .iter()
            .any(|l| !ORDINARY_RADII.contains(&l.radius)),
    );
    set("LIGHT_SCALES", world.light_scales.is_some());
    set("SEVERAL_SHADOW_RAYS", settings.shadow_rays > 1);
    // What a cosine-distributed bounce finds of a light, cap sampling finds as well, unless it is near.
    let near = sampling && diffuse && near::light_near_diffuse(world);
    set("MIS_DIFFUSE", near);
    set("MIS", sampling && (phong || near));
    let sight = sight(world, settings, access);
    set("SEEN_LIGHTS", sight > 0);
    set("GLANCES_GO_ON", sight > 1);
    set("WHITTED", settings.integrator == Integrator::Whitted);
    set("ALL_LIGHT", settings.light == LightParts::ALL);
    set(
        "COUNT_TRUNCATED",
        settings.max_depth < needed_depth(settings),
    );
    set("STRATA", settings.strata > 1);
    set(
        "STRATA_NOT_A_POWER_OF_TWO",
        !settings.strata.is_power_of_two(),
    );
    f
}

/// Whether a kernel with these features contains module `name`.
fn needs(name: &str, features: &BTreeSet<&str>) -> bool {
    let has = |f: &str| features.contains(f);
    match name {
        "cylinder" => has("CYLINDER"),
        "plane" => has("PLANE"),
        "sphere" => has("SPHERE"),
        "huge_sphere" => has("HUGE"),
        "diffuse" => has("DIFFUSE") || has("PHONG"),
        "mirror" => has("MIRROR") || has("DIELECTRIC") || has("PHONG"),
        "dielectric" => has("DIELECTRIC"),
        "phong" => has("PHONG"),
        "image" => has("IMAGES"),
        "records" | "tree" => has("TREE"),
        "light_tree" => has("LIGHT_TREE"),
        _ => true,
    }
}

fn constants(world: &World, settings: &Settings) -> String {
    let mut s = String::new();
    let mut constant = |name: &str, kind: &str, value: String| {
        let _ = writeln!(s, "const {name}: {kind} = {value};");
    };
    let c = &world.camera;
    constant("CAMERA_EYE", "vec3f", vector(c.eye));
    constant("CAMERA_FORWARD", "vec3f", vector(c.forward));
    constant("CAMERA_DX", "vec3f", vector(c.dx));
    constant("CAMERA_DY", "vec3f", vector(c.dy));
    let [w, h] = settings.size.map(|n| float(f64::from(n) / 2.0));
    constant("CAMERA_CENTER", "vec2f", format!("vec2f({w}, {h})"));
    constant("CAMERA_MEDIUM", "u32", format!("{}u", c.medium));
    debug_assert_eq!(AIR, 0, "the kernel's comments say so");
    constant("LIGHT_KEYS", "u32", format!("{}u", 4 * world.lights.len()));
    constant("GLANCES", "u32", format!("{GLANCES}u"));
    let chain = if settings.max_depth > 2 {
        CHAIN_GLANCES
    } else {
        GLANCES
    };
    constant("CHAIN_GLANCES", "u32", format!("{chain}u"));
    constant("BRANCH_SHIFT", "u32", format!("{BRANCH_SHIFT}u"));
    constant("DIRECT_SHIFT", "u32", format!("{DIRECT_SHIFT}u"));
    constant("BLOCK", "u32", format!("{BLOCK}u"));
    constant("REPLICATES", "u32", format!("{REPLICATES}u"));
    constant("STRATA", "u32", format!("{}u", settings.strata));
    constant("ROUND_SAMPLES", "u32", format!("{}u", settings.round()));
    constant("SHADOW_RAYS", "f32", float(f64::from(settings.shadow_rays)));
    constant("LAST_DEPTH", "u32", format!("{}u", last_depth(settings)));
    if settings.light != LightParts::ALL {
        constant("KEEP_EMITTED", "bool", settings.light.emitted.to_string());
        constant("KEEP_DIRECT", "bool", settings.light.direct.to_string());
        constant("KEEP_INDIRECT", "bool", settings.light.indirect.to_string());
    }
    s
}
