//! The scene packed for the device: storage buffers, or records for kernels with trees.

mod trees;

use crate::kernel::layout::{DiskLight, LightCluster, Material, Surface, single};
use crate::kernel::records::{RECORDS_A_ROW, Records};
use crate::kernel::trees::Parted;
use crate::kernel::{Access, Cells};
use crate::world::World;
use crate::world::light_tree::{self, LightTree};

/// What of a scene lies on the device, by how its kernel reaches it.
#[derive(Debug, Clone)]
pub enum Packed {
    /// Nothing: all is in the kernel's text.
    Baked,
    /// Arrays for storage buffers.
    Buffers(Buffers),
    /// One row of the texture of records, or whole ones, as `shaders/fetch/records.wgsl` and `shaders/tree/walk.wgsl` say.
    Records(Vec<[u32; 4]>),
}

/// Arrays; none is empty, for WGSL has no empty arrays.
#[derive(Debug, Clone)]
pub struct Buffers {
    /// Lights first, then the world's primitives.
    pub surfaces: Vec<Surface>,
    /// In the world's order.
    pub materials: Vec<Material>,
    /// In the world's order.
    pub lights: Vec<DiskLight>,
}

impl Buffers {
    fn new(world: &World) -> Self {
        let numbers = 0..world.surface_count();
        Self {
            surfaces: numbers.map(|n| Surface::of(world, n)).collect(),
            materials: world.materials.iter().map(Material::of).collect(),
            lights: world.lights.iter().map(DiskLight::of).collect(),
        }
    }

    fn or_defaults(mut self) -> Self {
        if self.surfaces.is_empty() {
            self.surfaces.push(Surface::default());
        }
        if self.materials.is_empty() {
            self.materials.push(Material::default());
        }
        if self.lights.is_empty() {
            self.lights.push(DiskLight::default());
        }
        self
    }
}

/// The light clusters of a world, and which lights are where, as `shaders/light/choose_by_tree.wgsl` says.
fn pack_lights(world: &World) -> Vec<[u32; 4]> {
    let tree = LightTree::new(world);
    let clusters: Vec<LightCluster> = tree
        .clusters
        .iter()
        .map(|c| LightCluster {
            center: single(c.center),
            radius: c.radius as f32,
            power: single(c.power),
            cos_cone: c.cos_cone as f32,
        })
        .collect();
    let mut records: Vec<[u32; 4]> = bytemuck::cast_slice(&clusters).to_vec();
    // See [`Records::clusters`].
    records.resize(2 * records.len(), [0; 4]);
    records.extend(tree.order);
    records.extend(
        tree.places
            .chunks(light_tree::LIGHTS_A_CLUSTER)
            .map(|four| {
                let mut record = [0; light_tree::LIGHTS_A_CLUSTER];
                record[..four.len()].copy_from_slice(four);
                record
            }),
    );
    records
}

/// Everything for a kernel with trees.
fn pack_records(world: &World, cells: Option<&Cells>) -> Vec<[u32; 4]> {
    let Buffers {
        surfaces,
        materials,
        lights,
    } = Buffers::new(world);
    let parted = Parted::new(world);
    let at = Records::new(world, &parted, cells);
    let row = RECORDS_A_ROW as usize;
    // Headers are filled in when their trees are built.
    let mut records = vec![[0; 4]; at.surfaces];
    records.extend_from_slice(bytemuck::cast_slice(&surfaces));
    debug_assert_eq!(records.len(), at.materials);
    records.extend_from_slice(bytemuck::cast_slice(&materials));
    debug_assert_eq!(records.len(), at.lights);
    records.extend_from_slice(bytemuck::cast_slice(&lights));
    debug_assert_eq!(records.len(), at.clusters);
    if light_tree::serves(world.lights.len()) {
        records.extend(pack_lights(world));
    }
    records.resize(at.trees, [0; 4]);
    trees::append(
        &mut records,
        world,
        &parted,
        &surfaces,
        cells.map(|c| (c, at.cells)),
    );
    if records.len() > row {
        records.resize(records.len().next_multiple_of(row), [0; 4]);
    }
    records
}

/// Packs a world for kernels of this kind, with the places where the camera rays of `cells` enter its tree.
pub fn pack(world: &World, access: Access, cells: Option<&Cells>) -> Packed {
    match access {
        Access::Baked => Packed::Baked,
        Access::Buffers => Packed::Buffers(Buffers::new(world).or_defaults()),
        Access::Tree => Packed::Records(pack_records(world, cells)),
    }
}
