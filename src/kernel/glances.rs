//! Glances: whether a kernel sends any, and how far they look. `shaders/glance/` says what they are.

use super::access::{Access, BAKED_LIMIT};
use super::trips;
use crate::settings::Settings;
use crate::world::{World, WorldLight};

/// Squared, the glances of a sample in a pixel that may see a light directly.
pub(super) const GLANCES: u32 = 4;

/// The same where they look by way of mirrors and glass alone, unless paths have two vertices at most: indirect light is noisier
/// than the edges that they see. 4 were slower by 8 % on caustic and 3 % on three_materials, for as much noise or a little less.
const CHAIN_GLANCES: u32 = 2;

/// The most glances of a sample.
pub(crate) const MAX_GLANCES: u32 = GLANCES * GLANCES;

/// The last vertex at which they look for a light. A ball of glass takes two before it, and one more in a mirror three.
const LONGEST_GLANCE: u32 = 6;

/// Where in a mark the vertex of glass stands at which one half of the glances is refracted and the other reflected.
pub(crate) const BRANCH_SHIFT: u32 = 8;

/// Where in a mark it stands whether a light may be seen directly.
pub(crate) const DIRECT_SHIFT: u32 = 16;

/// Loop trips, of those that an older driver grants, that glances may use up.
const TRIPS_FOR_GLANCES: u64 = 16_384;

/// The last vertex at which glances look for lights; 0: none are sent.
///
/// It does not depend on which light is kept, unless none of it can be seen: the parts of a picture are made of the same samples, and
/// so add up to the whole.
pub(super) fn sight(world: &World, settings: &Settings, access: Access) -> u32 {
    let eye = world.camera.eye;
    let faces_eye = |l: &WorldLight| l.normal.dot(eye) > l.offset;
    let seen = world.lights.iter().any(faces_eye);
    let affordable = TRIPS_FOR_GLANCES
        / u64::from(MAX_GLANCES)
        / trips::at_vertex(world, settings, access, None);
    let mut used = world
        .primitives
        .iter()
        .map(|p| &world.materials[p.material]);
    let shown = used.any(|b| b.kind().is_specular())
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

/// Squared, the glances of a sample in a pixel that sees lights by way of mirrors and glass alone.
pub(super) fn in_chains(settings: &Settings) -> u32 {
    if settings.max_depth > 2 {
        CHAIN_GLANCES
    } else {
        GLANCES
    }
}
