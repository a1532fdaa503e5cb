//! Loop trips of old Mesa: the host's part.
//!
//! Mesa's llvmpipe lets the loops of an invocation take 65 535 trips in all, and then silently ends every loop (seen with 22.3, not with
//! 25.0). So kernels without trees get no more samples in a dispatch than [`Kernel::trips_per_sample`] allows, and kernels with trees
//! count their trips: see `shaders/trips/`. Delete this file, `shaders/trips/counted.wgsl` and the code that calls them when Mesa 22 is
//! gone.
//!
//! [`Kernel::trips_per_sample`]: super::Kernel::trips_per_sample

use super::access::Access;
use super::features::Features;
use super::glances::MAX_GLANCES;
use super::trees::Parted;
use crate::settings::Settings;
use crate::world::{AIR, Geometry, World, WorldLight, WorldPrimitive, light_tree, visibility};

/// The most loop trips that an invocation may take on this adapter. A driver that names no version counts as old.
pub(crate) fn limit(adapter: &str, driver: &str) -> u64 {
    let llvmpipe = adapter.to_lowercase().contains("llvmpipe");
    let mesa = driver
        .split("Mesa ")
        .nth(1)
        .and_then(|v| v.split('.').next())
        .and_then(|v| v.parse::<u32>().ok());
    if llvmpipe && mesa.is_none_or(|v| v < 25) {
        65_000
    } else {
        u64::from(u32::MAX)
    }
}

/// The error message for a path that may take more trips than the driver grants.
pub(crate) fn too_many(path: &str, trips: u64, advice: &str) -> String {
    format!(
        "{path} {trips} loop iterations{advice}, but this driver silently stops an invocation at 65535; lower max_depth, or render on the CPU reference (backend cpu)"
    )
}

/// The most loop trips that a vertex can take, without walks through the trees of `parted`, which count their own.
pub(super) fn at_vertex(
    world: &World,
    settings: &Settings,
    access: Access,
    parted: Option<&Parted>,
) -> u64 {
    // Loops over all surfaces for a ray, and over all lights to choose one.
    let (ray, choice) = match access {
        Access::Baked => (0, 0),
        Access::Buffers => (world.surface_count() as u64, world.lights.len() as u64),
        // A loop over the surfaces outside the trees, if they are many. The light tree is walked down to choose a light, and up for the
        // probability of one.
        Access::Tree => (
            parted.map_or(0, |p| p.apart.len() as u64),
            2 * u64::from(light_tree::levels(world.lights.len())),
        ),
    };
    // A vertex finds the nearest hit. For each shadow ray it chooses a light and traces the ray.
    let shadow_rays = u64::from(settings.shadow_rays);
    let inner = ray + shadow_rays * (choice + ray);
    let shadow_loop = if shadow_rays > 1 { shadow_rays } else { 0 };
    let hidden = if visibility::lights_overlap(world) {
        shadow_rays * world.lights.len() as u64
    } else {
        0
    };
    // A ray to a light in a glass ball.
    let in_glass = |l: &WorldLight| l.medium.is_some_and(|m| m != AIR);
    let bulb = if world.lights.iter().any(in_glass) {
        ray
    } else {
        0
    };
    1 + inner + bulb + shadow_loop + hidden + onto_surfaces(world)
}

/// The loop trips that moving a hit onto an implicit surface takes. Meeting one counts its own.
fn onto_surfaces(world: &World) -> u64 {
    let implicit = |p: &&WorldPrimitive| matches!(p.geometry, Geometry::Implicit(_));
    2 * world.primitives.iter().filter(implicit).count() as u64
}

/// The loop trips that the choice of a place in the pixel can take.
const STRATA_LOOP: u64 = 32;

/// The loop trips that loading and storing a pixel's numbers takes: three, four and four.
const LOOPS_AROUND: u64 = 11;

/// The most loop trips that one sample can take; 0 if the kernel counts them itself.
pub(super) fn per_sample(world: &World, settings: &Settings, features: &Features) -> u64 {
    if features.counts_trips() {
        return 0;
    }
    // Every glance counts as a whole vertex: while one lane sends a glance, another may go through all the loops of a vertex.
    let turns = u64::from(features.last_depth) + u64::from(MAX_GLANCES * features.sight);
    turns
        .saturating_mul(at_vertex(world, settings, features.access, None))
        .saturating_add(STRATA_LOOP + LOOPS_AROUND)
}

/// The loop trips that the choice of a light path's pair can take, in kernels whose pairs are as many as they may be.
const PAIR_LOOP: u64 = 21;

/// The most loop trips that one light path can take, without walks through trees.
pub(super) fn per_light_path(world: &World, settings: &Settings, features: &Features) -> u64 {
    u64::from(features.last_depth)
        .saturating_mul(at_vertex(world, settings, features.access, None))
        .saturating_add(PAIR_LOOP)
}

/// The loop trips that a kernel that counts subtracts before its first sample, and at each vertex.
pub(super) fn counted(
    world: &World,
    settings: &Settings,
    features: &Features,
    parted: Option<&Parted>,
) -> [u64; 2] {
    let glances = u64::from(MAX_GLANCES * features.sight);
    // Light paths begin at any vertex, and have no glances or strata.
    let start = glances + STRATA_LOOP + LOOPS_AROUND;
    [start, at_vertex(world, settings, features.access, parted)]
}

#[cfg(test)]
mod tests {
    use super::limit;

    #[test]
    fn old_mesa_alone_is_limited() {
        let all = u64::from(u32::MAX);
        assert_eq!(
            limit(
                "llvmpipe (LLVM 15.0.6, 256 bits)",
                "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
            ),
            65_000
        );
        assert_eq!(
            limit(
                "llvmpipe (LLVM 19.1.7, 512 bits)",
                "Mesa 25.0.7-2 (LLVM 19.1.7)"
            ),
            all
        );
        assert_eq!(limit("llvmpipe", "unknown"), 65_000);
        assert_eq!(limit("NVIDIA H200", "580.159.04"), all);
    }
}
