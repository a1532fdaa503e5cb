//! The kernel made for one scene: the modules of `shaders/` that it needs, constants, and generated functions that meet its
//! primitives, choose its lights and dispatch over its materials.

mod access;
mod bulbs;
mod emit;
mod features;
mod glances;
pub(crate) mod layout;
pub(crate) mod light_paths;
mod literal;
mod modules;
mod preprocess;
pub(crate) mod records;
mod streams;
pub(crate) mod trees;
pub(crate) mod trips;

pub use access::{Access, BAKED_LIMIT};
pub(crate) use emit::grid::{FIRST_BINDING, holds_heights, volumes};
pub(crate) use features::GROUP_SIDE;
pub(crate) use glances::{BRANCH_SHIFT, MANY_SHIFT};
pub(crate) use streams::pilot_seed;

use crate::settings::Settings;
use crate::world::aims::Aims;
use crate::world::{World, light_tree};
use features::{Features, constant};
use light_paths::LightPaths;
use modules::Module;
pub use records::Cells;
use records::Records;
use std::fmt::Write as _;
use trees::Parted;

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
    /// For which squares of pixels it asks where their camera rays enter the tree, if for any.
    pub cells: Option<Cells>,
    /// The kernel that traces light paths, if the scene has any use for them.
    pub light: Option<LightKernel>,
}

/// The kernel that traces light paths.
#[derive(Debug, Clone)]
pub struct LightKernel {
    /// Its WGSL: entry point `trace`, 64 invocations a workgroup.
    pub wgsl: String,
    /// Where light paths are aimed.
    pub(crate) aims: Aims,
    /// Light paths of a pass, which goes with one sample of every pixel.
    pub photons: u32,
    /// The most loop trips that a light path can take of an invocation, without walks through trees.
    pub trips_per_path: u64,
    /// Whether the path kernel reads the aims from their buffer.
    pub aims_bound: bool,
}

/// Composes the kernel of `world` under `settings`; `access` overrides the rule of [`Access::choose`].
pub fn compose(world: &World, settings: &Settings, access: Option<Access>) -> Kernel {
    compose_with(world, settings, access, true)
}

/// The same. Without `queues` no ray waits in a queue, for tests that compare the two.
pub(crate) fn compose_with(
    world: &World,
    settings: &Settings,
    access: Option<Access>,
    queues: bool,
) -> Kernel {
    let access = access.unwrap_or_else(|| Access::choose(world));
    let aims = light_paths::aims(world, settings);
    let paths = (aims.as_ref()).map(|aims| LightPaths::new(world, settings, access, aims));
    let parted = (access == Access::Tree).then(|| Parted::new(world));
    let parted = parted.as_ref();
    let mut features = Features::new(world, settings, access, paths);
    features.queued = queues && parted.is_some_and(|p| features.gains_by_queue(world, p));
    let light = aims.map(|aims| light_kernel(world, settings, &features, parted, aims));
    let mut wgsl = String::from("// Made for one scene by etendue.\n");
    append(&mut wgsl, &features, &modules::of_path(&features));
    wgsl.push_str(&scene_text(world, settings, &features, parted));
    if !features.bulbs.is_empty() {
        wgsl.push_str(&bulbs::text(world, &features.bulbs));
    }
    if let Some(LightKernel { aims, photons, .. }) = light.as_ref().filter(|l| !l.aims_bound) {
        wgsl.push_str(&light_paths::aims_in_text(world, aims, *photons));
    }
    Kernel {
        wgsl,
        access,
        trips_per_sample: trips::per_sample(world, settings, &features),
        sight: features.sight,
        cells: features.queued.then(|| Cells::new(settings.size)),
        light,
    }
}

/// The kernel that traces light paths, beside a path kernel with `features`.
fn light_kernel(
    world: &World,
    settings: &Settings,
    features: &Features,
    parted: Option<&Parted>,
    aims: Aims,
) -> LightKernel {
    let own = features.of_light_paths();
    let mut wgsl = String::from("// Made for one scene by etendue.\n");
    append(&mut wgsl, &own, &modules::of_light_paths(&own));
    wgsl.push_str(&scene_text(world, settings, &own, parted));
    wgsl.push_str(&emit::lights::medium(world));
    wgsl.push_str(&bulbs::shells(world, &own.bulbs));
    LightKernel {
        wgsl,
        photons: light_paths::photons(&aims, settings.size),
        aims,
        trips_per_path: trips::per_light_path(world, settings, &own),
        aims_bound: features.light_paths.as_ref().is_some_and(|p| !p.in_text),
    }
}

/// All that the path loop of a scene calls: constants, modules, and what is generated for the scene. `parted` says which surfaces lie in
/// trees, if there are trees.
fn scene_text(
    world: &World,
    settings: &Settings,
    features: &Features,
    parted: Option<&Parted>,
) -> String {
    let mut s = features.constants();
    s.push_str(&features.scene_constants(world, settings));
    if features.counts_trips() {
        let [start, vertex] = trips::counted(world, settings, features, parted);
        constant(&mut s, "TRIPS_AT_START", "u32", format!("{start}u"));
        constant(&mut s, "TRIPS_AT_VERTEX", "u32", format!("{vertex}u"));
    }
    if let Some(parted) = parted {
        let cells = features.queued.then(|| Cells::new(settings.size));
        let records = Records::new(world, parted, cells.as_ref());
        s.push_str(&records.constants(world, cells.as_ref()));
        if light_tree::serves(world.lights.len()) {
            let ends = light_tree::ends(world.lights.len());
            constant(&mut s, "LIGHT_CLUSTERS", "u32", format!("{ends}u"));
            constant(&mut s, "LIGHT_LEVELS", "u32", format!("{}u", ends.ilog2()));
        }
    }
    append(&mut s, features, &modules::of_scene(features));
    s.push_str("\n// ---- this scene\n\n");
    s.push_str(&emit::materials::predicates(features));
    s.push_str(&emit::materials::dispatch(features));
    s.push_str(&emit::implicit::generate(world, features));
    s.push_str(&emit::surfaces::generate(world, features, parted));
    s.push_str(&emit::lights::scale(world));
    s.push_str(&emit::lights::keeps(settings.light));
    if features.direct {
        s.push_str(&emit::lights::choose(world, features));
    }
    if features.access == Access::Baked {
        s.push_str(&emit::fetch::generate(world));
    }
    s
}

/// Appends modules, without what `features` leaves out.
fn append(s: &mut String, features: &Features, modules: &[Module]) {
    for Module { name, text } in modules {
        let text = preprocess::run(text, |flag| features.flag(flag));
        let _ = write!(s, "\n// ---- {name}.wgsl\n\n{text}");
    }
}

/// Which variants of the shaders a probe without a scene has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeFeatures {
    /// Lights are sampled for glossy receivers, not for matt ones.
    pub glossy: bool,
    /// Strata along a pixel's side.
    pub strata: u32,
    /// Places in the pixel are drawn together with points on lights, as in kernels with trees. Strata are a power of two.
    pub draws_together: bool,
}

impl Default for ProbeFeatures {
    fn default() -> Self {
        Self {
            glossy: false,
            strata: 1,
            draws_together: false,
        }
    }
}

/// A shader whose entry point `probe` runs `body` on 16 floats `x` into 16 floats `y`, beside the modules that need no
/// scene.
pub(crate) fn probe_source(probe: &ProbeFeatures, body: &str) -> String {
    let features = Features::of_probe(probe);
    let mut s = features.constants();
    let of_scenes = ["camera", "light/chosen"];
    let modules: Vec<Module> = modules::of_scene(&features)
        .into_iter()
        .filter(|m| !of_scenes.contains(&m.name))
        .collect();
    append(&mut s, &features, &modules);
    s.push_str(&emit::materials::predicates(&features));
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
    let features = Features::new(world, settings, access, None);
    let parted = (access == Access::Tree).then(|| Parted::new(world));
    let mut s = scene_text(world, settings, &features, parted.as_ref());
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
