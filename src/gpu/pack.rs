//! The scene packed for the device: storage buffers, or records for kernels with trees.

use crate::kernel::layout::{DiskLight, LightCluster, Material, Surface, single};
use crate::kernel::records::{RECORDS_A_ROW, Records};
use crate::kernel::{Access, trees};
use crate::world::light_tree::{self, LightTree};
use crate::world::{Node, Tree, World, visibility};

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

/// Appends the trees of [`Access::Tree`], one after the other, as `shaders/tree/walk.wgsl` says.
fn pack_trees(
    records: &mut Vec<[u32; 4]>,
    world: &World,
    parted: &trees::Parted,
    surfaces: &[Surface],
) {
    let blocks = visibility::blockers(world);
    for group in &parted.groups {
        debug_assert_eq!(records.len(), group.header);
        let tree = Tree::new(&trees::boxes(world, group));
        let root = &tree.nodes[1];
        records.extend([root.sphere().map(f32::to_bits), [0; 4], [0; 4], [0; 4]]);
        let number = |item: u32| group.numbers[item as usize];
        let code = |item: u32| 2 * (number(item) as u32 + 1) + u32::from(blocks[number(item)]);
        for k in 0..group.nodes() {
            let below = |n: Node| -> [u32; 6] {
                let [x, y, z] = n.min.map(f32::to_bits);
                let [u, v, w] = n.max.map(f32::to_bits);
                match n.item {
                    Some(item) if group.spheres() => {
                        let s = &surfaces[number(item)];
                        let [x, y, z] = s.point.map(f32::to_bits);
                        [x, y, z, s.radius.to_bits(), code(item), u32::MAX]
                    }
                    _ => [x, y, z, u, v, w],
                }
            };
            let children = match (k, tree.nodes[k].item) {
                (0, _) => [Node::EMPTY; 2],
                // One alone.
                (_, Some(_)) if group.spheres() && k == 1 => [*root, Node::EMPTY],
                (_, Some(item)) if group.disks() => {
                    let s = &surfaces[number(item)];
                    let last = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w].map(f32::to_bits);
                    let (a, b) = (last(s.point, s.radius), last(s.axis, s.offset));
                    records.extend([a, b, [code(item), s.faces[0], 0, u32::MAX], [0; 4]]);
                    continue;
                }
                (_, Some(item)) => {
                    records.extend([[code(item), 0, 0, 0], [0; 4], [0, 0, 0, u32::MAX], [0; 4]]);
                    continue;
                }
                _ => [2 * k, 2 * k + 1].map(|c| *tree.nodes.get(c).unwrap_or(&Node::EMPTY)),
            };
            let [[a, b, c, d, e, f], [g, h, i, j, k, l]] = children.map(below);
            let solid = |n: Node| {
                n.item.filter(|_| group.solids()).map_or([0; 2], |item| {
                    let s = &surfaces[number(item)];
                    [s.solid, s.parent]
                })
            };
            let [[m, n], [o, p]] = children.map(solid);
            records.extend([[a, b, c, d], [e, f, g, h], [i, j, k, l], [m, n, o, p]]);
        }
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
fn pack_records(world: &World) -> Vec<[u32; 4]> {
    let Buffers {
        surfaces,
        materials,
        lights,
    } = Buffers::new(world);
    let parted = trees::Parted::new(world);
    let at = Records::new(world, &parted);
    let row = RECORDS_A_ROW as usize;
    let mut records = Vec::with_capacity(at.end.next_multiple_of(row));
    pack_trees(&mut records, world, &parted, &surfaces);
    debug_assert_eq!(records.len(), at.surfaces);
    records.extend_from_slice(bytemuck::cast_slice(&surfaces));
    debug_assert_eq!(records.len(), at.materials);
    records.extend_from_slice(bytemuck::cast_slice(&materials));
    debug_assert_eq!(records.len(), at.lights);
    records.extend_from_slice(bytemuck::cast_slice(&lights));
    debug_assert_eq!(records.len(), at.clusters);
    if light_tree::serves(world.lights.len()) {
        records.extend(pack_lights(world));
    }
    debug_assert_eq!(records.len(), at.end);
    if records.len() > row {
        records.resize(records.len().next_multiple_of(row), [0; 4]);
    }
    records
}

/// Packs a world for kernels of this kind.
pub fn pack(world: &World, access: Access) -> Packed {
    match access {
        Access::Baked => Packed::Baked,
        Access::Buffers => Packed::Buffers(Buffers::new(world).or_defaults()),
        Access::Tree => Packed::Records(pack_records(world)),
    }
}
