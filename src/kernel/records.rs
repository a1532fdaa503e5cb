//! The layout of the texture of records that kernels with trees read.

use super::trees::{Parted, UNIT};
use crate::world::World;
use crate::world::light_tree::{LIGHTS_A_CLUSTER, ends, serves};
use crate::world::tree::beam::Beam;
use std::fmt::Write as _;

/// Records of four words in a row of the texture.
pub(crate) const RECORDS_A_ROW: u32 = 4096;

/// The squares of pixels of a picture for each of which it is known where its camera rays enter a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cells {
    /// Pixels along a side.
    pub side: u32,
    /// Of the picture.
    size: [u32; 2],
}

impl Cells {
    /// Those of a picture of `size` pixels: small ones, but not too many.
    pub fn new(size: [u32; 2]) -> Self {
        const MOST: usize = 1 << 17;
        let of = |side| Self { side, size };
        let sides = (2..16).map(|k| 1 << k);
        sides
            .map(of)
            .find(|c| c.count() <= MOST)
            .unwrap_or(of(1 << 16))
    }

    /// Along a row and a column.
    pub fn along(&self) -> [u32; 2] {
        self.size.map(|n| n.div_ceil(self.side))
    }

    /// All.
    pub fn count(&self) -> usize {
        let [columns, rows] = self.along().map(|n| n as usize);
        columns * rows
    }

    /// The camera rays of every cell, row by row.
    pub(crate) fn beams(&self, world: &World) -> impl Iterator<Item = Beam> {
        let [columns, rows] = self.along();
        let pixels = |k: u32, i: usize| {
            let begin = k * self.side;
            begin..(begin + self.side).min(self.size[i])
        };
        let beam = move |x, y| Beam::new(&world.camera, self.size, [pixels(x, 0), pixels(y, 1)]);
        (0..rows).flat_map(move |y| (0..columns).map(move |x| beam(x, y)))
    }
}

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
    /// One for each of the [`Cells`], if there are any.
    pub cells: usize,
    /// Trees: the rest.
    pub trees: usize,
}

impl Records {
    /// Depends only on the numbers of surfaces, materials and lights, and of cells.
    pub fn new(world: &World, parted: &Parted, cells: Option<&Cells>) -> Self {
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
        let cells_at = end_of_places.next_multiple_of(UNIT);
        Self {
            surfaces: surfaces_at,
            materials: materials_at,
            lights: lights_at,
            clusters,
            fours,
            places,
            cells: cells_at,
            trees: (cells_at + cells.map_or(0, Cells::count)).next_multiple_of(UNIT),
        }
    }

    /// The constants of the shaders.
    pub fn constants(&self, world: &World, cells: Option<&Cells>) -> String {
        let mut s = format!("const RECORDS_A_ROW: u32 = {RECORDS_A_ROW}u;\n");
        let mut constant = |name: &str, value: usize| {
            let _ = writeln!(s, "const {name}: u32 = {value}u;");
        };
        constant("SURFACE_RECORDS", self.surfaces);
        constant("MATERIAL_RECORDS", self.materials);
        constant("LIGHT_RECORDS", self.lights);
        if let Some(cells) = cells {
            constant("CELL_RECORDS", self.cells);
            constant("CELL_SIDE", cells.side as usize);
            constant("CELLS_A_ROW", cells.along()[0] as usize);
        }
        if serves(world.lights.len()) {
            constant("CLUSTER_RECORDS", self.clusters);
            constant("FOUR_RECORDS", self.fours);
            constant("PLACE_RECORDS", self.places);
        }
        s
    }
}
