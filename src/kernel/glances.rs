//! Glances: whether a kernel sends any, and how far they look. `shaders/glance/` says what they are.

use super::access::{Access, BAKED_LIMIT};
use super::trips;
use crate::settings::Settings;
use crate::world::{World, WorldLight};

/// The square of this is the number of glances of a sample, in a pixel that may see a light directly, or a very small image of one.
pub(super) const GLANCES: u32 = 4;

/// The same, in a pixel that sees lights only by way of mirrors and glass, if paths may have more than two vertices. Then indirect light
/// is noisier than the edges that glances see. With 4, caustic was slower by 8 % and three_materials by 3 %, for as much noise or a
/// little less.
const CHAIN_GLANCES: u32 = 2;

/// The most glances of a sample.
pub(crate) const MAX_GLANCES: u32 = GLANCES * GLANCES;

/// The greatest number of the vertex at which glances look for a light. A ball of glass takes two vertices before it, and a second ball,
/// seen in a mirror, takes three more.
const LONGEST_GLANCE: u32 = 6;

/// The first of the eight bits of a mark that hold the vertex of glass at which half of the glances are refracted and half reflected.
pub(crate) const BRANCH_SHIFT: u32 = 8;

/// The bit of a mark that says whether the pixel gets more glances.
pub(crate) const MANY_SHIFT: u32 = 16;

/// The most loop trips that glances may use, of those that an older driver grants: see [`trips`].
const TRIPS_FOR_GLANCES: u64 = 16_384;

/// The last vertex at which glances look for lights; 0 if none are sent.
///
/// It does not depend on which parts of the light the picture keeps, unless glances can see none of them. So pictures of the parts are
/// made of the same samples, and add up to the whole.
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
        // To find what mirrors show, the host tests all surfaces. Here that would take too long.
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

/// The square of this is the number of glances of a sample, in a pixel that sees lights only by way of mirrors and glass.
pub(super) fn in_chains(settings: &Settings) -> u32 {
    if settings.max_depth > 2 {
        CHAIN_GLANCES
    } else {
        GLANCES
    }
}
