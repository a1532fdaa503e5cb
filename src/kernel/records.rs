//! The layout of the texture of records that kernels with trees read.

use super::trees::{Parted, UNIT};
use crate::world::World;
use crate::world::light_tree::{LIGHTS_A_CLUSTER, ends, serves};
use std::fmt::Write as _;

/// Records of four words in a row of the texture.
pub(crate) const RECORDS_A_ROW: u32 = 4096;

/// The number of the first record of each kind. The headers of trees begin at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Records {
    /// Four for each surface.
    pub surfaces: usize,
    /// Two for each material.
    pub materials: usize,
    /// Three for each light.
    pub lights: usize,
    /// Two for each light cluster, if lights are chosen by clusters, and as many empty ones. Lanes that take no part in a choice read
    /// those: other records hold integers, which read as subnormal numbers would cost all lanes a hundred cycles a product.
    pub clusters: usize,
    /// One for each cluster at the end of the tree.
    pub fours: usize,
    /// A word for each light.
    pub places: usize,
    /// Trees: the rest.
    pub trees: usize,
}

impl Records {
    /// Depends only on the numbers of surfaces, materials and lights.
    pub fn new(world: &World, parted: &Parted) -> Self {
        let lights = world.lights.len();
        let ends = if serves(world.lights.len()) {
            ends(lights)
        } else {
            0
        };
        let surfaces_at = parted.end();
        let materials_at = surfaces_at + 4 * (lights + world.primitives.len());
        let lights_at = materials_at + 2 * world.materials.len();
        let clusters = lights_at + 3 * lights;
        let fours = clusters + 2 * 4 * ends;
        let places = fours + ends;
        let end_of_places = places
            + if ends > 0 {
                lights.div_ceil(LIGHTS_A_CLUSTER)
            } else {
                0
            };
        Self {
            surfaces: surfaces_at,
            materials: materials_at,
            lights: lights_at,
            clusters,
            fours,
            places,
            trees: end_of_places.next_multiple_of(UNIT),
        }
    }

    /// The constants of the shaders.
    pub fn constants(&self, world: &World) -> String {
        let mut s = format!("const RECORDS_A_ROW: u32 = {RECORDS_A_ROW}u;\n");
        let mut constant = |name: &str, value: usize| {
            let _ = writeln!(s, "const {name}_RECORDS: u32 = {value}u;");
        };
        constant("SURFACE", self.surfaces);
        constant("MATERIAL", self.materials);
        constant("LIGHT", self.lights);
        if serves(world.lights.len()) {
            constant("CLUSTER", self.clusters);
            constant("FOUR", self.fours);
            constant("PLACE", self.places);
        }
        s
    }
}
