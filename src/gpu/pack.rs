//! Host twins of the kernel's structs, and the scene packed into them.

use crate::kernel::lights::{self, LightTree};
use crate::kernel::records::{self, RECORDS_A_ROW, Records};
use crate::kernel::{Access, material_tag, shape_tag, trees};
use crate::scene::Bsdf;
use crate::world::{Geometry, Node, Tree, World};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// `Surface` of surface.wgsl.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, Default)]
#[repr(C)]
pub struct Surface {
    point: [f32; 3],
    radius: f32,
    axis: [f32; 3],
    offset: f32,
    faces: [u32; 3],
    material: u32,
    top: f32,
    solid: u32,
    parent: u32,
    shape: u32,
}

/// `Material` of surface.wgsl.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, Default)]
#[repr(C)]
pub struct Material {
    color: [f32; 3],
    kind: u32,
    specular: [f32; 3],
    exponent: f32,
}

/// `DiskLight` of light.wgsl.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, Default)]
#[repr(C)]
pub struct DiskLight {
    center: [f32; 3],
    radius: f32,
    normal: [f32; 3],
    offset: f32,
    radiance: [f32; 3],
    face: u32,
}

/// `LightCluster` of light_tree.wgsl.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, Default)]
#[repr(C)]
pub struct LightCluster {
    center: [f32; 3],
    radius: f32,
    power: [f32; 3],
    cos_cone: f32,
}

/// `Params` of path.wgsl.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable, Default)]
#[repr(C)]
pub struct Params {
    /// Top left pixel of the tile.
    pub tile: [u32; 2],
    /// Width and height of the tile.
    pub size: [u32; 2],
    /// Width times height.
    pub pixels: u32,
    /// Samples of each pixel that the dispatch may do.
    pub most: u32,
    /// Seed of every random number.
    pub seed: u32,
    /// Workgroups of the tile.
    pub groups: u32,
    /// Number of the first one dispatched.
    pub first_group: u32,
    /// Stride through them, coprime to their number.
    pub stride: u32,
    /// Loop trips that an invocation may take.
    pub trips: u32,
    /// 2, for loops that no compiler unrolls: over words of a pixel, and one that tells whether the driver still lets loops go round.
    pub rounds: u32,
}

/// What of a scene lies on the device; never empty, for WGSL has no empty arrays.
#[derive(Debug, Clone)]
pub struct Packed {
    /// Lights first, then the world's primitives.
    pub surfaces: Vec<Surface>,
    /// In the world's order.
    pub materials: Vec<Material>,
    /// In the world's order.
    pub lights: Vec<DiskLight>,
    /// All that a kernel with trees reads, as records.wgsl and tree.wgsl say: one row of their texture, or whole ones.
    pub records: Vec<[u32; 4]>,
}

fn f(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// Appends the trees of [`Access::Tree`], one after the other, as tree.wgsl says.
fn pack_trees(
    records: &mut Vec<[u32; 4]>,
    world: &World,
    parted: &trees::Parted,
    surfaces: &[Surface],
) {
    let blocks = trees::blockers(world);
    for group in &parted.groups {
        debug_assert_eq!(records.len(), group.header);
        let tree = Tree::new(&trees::boxes(world, group));
        let root = &tree.nodes[1];
        let reach: f32 = root.min.iter().chain(&root.max).map(|x| x.abs()).sum();
        records.extend([[reach.to_bits(), 0, 0, 0], [0; 4], [0; 4], [0; 4]]);
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

/// The light clusters of a world, and which lights are where, as light_tree.wgsl says.
fn pack_lights(world: &World) -> Vec<[u32; 4]> {
    let tree = LightTree::new(world);
    let clusters: Vec<LightCluster> = tree
        .clusters
        .iter()
        .map(|c: &lights::Cluster| LightCluster {
            center: f(c.center),
            radius: c.radius as f32,
            power: f(c.power),
            cos_cone: c.cos_cone as f32,
        })
        .collect();
    let mut records: Vec<[u32; 4]> = bytemuck::cast_slice(&clusters).to_vec();
    // See [`Records::clusters`].
    records.resize(2 * records.len(), [0; 4]);
    records.extend(tree.order);
    records.extend(tree.places.chunks(lights::LIGHTS_A_CLUSTER).map(|four| {
        let mut record = [0; lights::LIGHTS_A_CLUSTER];
        record[..four.len()].copy_from_slice(four);
        record
    }));
    records
}

/// Everything for a kernel with trees.
fn pack_records(
    world: &World,
    surfaces: &[Surface],
    materials: &[Material],
    lights: &[DiskLight],
) -> Vec<[u32; 4]> {
    let parted = trees::Parted::new(world);
    let at = Records::new(world, &parted);
    let row = RECORDS_A_ROW as usize;
    let mut records = Vec::with_capacity(at.end.next_multiple_of(row));
    pack_trees(&mut records, world, &parted, surfaces);
    debug_assert_eq!(records.len(), at.surfaces);
    records.extend_from_slice(bytemuck::cast_slice(surfaces));
    debug_assert_eq!(records.len(), at.materials);
    records.extend_from_slice(bytemuck::cast_slice(materials));
    debug_assert_eq!(records.len(), at.lights);
    records.extend_from_slice(bytemuck::cast_slice(lights));
    debug_assert_eq!(records.len(), at.clusters);
    if records::clustered(world) {
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
    let mut surfaces = Vec::with_capacity(world.lights.len() + world.primitives.len());
    for l in &world.lights {
        surfaces.push(Surface {
            point: f(l.center),
            radius: l.radius as f32,
            axis: f(l.normal),
            offset: l.offset as f32,
            faces: [l.face, 0, 0],
            shape: 1,
            ..Surface::default()
        });
    }
    for p in &world.primitives {
        let mut s = Surface {
            faces: p.faces,
            material: p.material as u32,
            solid: p.solid,
            parent: p.parent,
            shape: shape_tag(&p.geometry),
            ..Surface::default()
        };
        match p.geometry {
            Geometry::Disk {
                center,
                normal,
                offset,
                radius,
            } => {
                (s.point, s.radius, s.axis, s.offset) =
                    (f(center), radius as f32, f(normal), offset as f32);
            }
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                (s.point, s.radius, s.axis) = (f(base), radius as f32, f(axis));
                (s.offset, s.top) = (offsets[0] as f32, offsets[1] as f32);
            }
            Geometry::Plane { normal, offset } => (s.axis, s.offset) = (f(normal), offset as f32),
            Geometry::Sphere { center, radius } => (s.point, s.radius) = (f(center), radius as f32),
            Geometry::HugeSphere {
                pole,
                normal,
                radius,
            } => {
                (s.point, s.radius, s.axis, s.offset) =
                    (f(pole), radius as f32, f(normal), (1.0 / radius) as f32);
            }
        }
        surfaces.push(s);
    }
    let mut materials: Vec<Material> = world
        .materials
        .iter()
        .map(|bsdf| {
            let (color, specular, exponent) = match *bsdf {
                Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => {
                    (reflectance, DVec3::ZERO, 0.0)
                }
                Bsdf::Dielectric { ior, transmittance } => (transmittance, DVec3::ZERO, ior),
                Bsdf::Phong {
                    diffuse,
                    specular,
                    exponent,
                } => (diffuse, specular, exponent),
            };
            Material {
                color: f(color),
                kind: material_tag(bsdf),
                specular: f(specular),
                exponent: exponent as f32,
            }
        })
        .collect();
    let mut lights: Vec<DiskLight> = world
        .lights
        .iter()
        .map(|l| DiskLight {
            center: f(l.center),
            radius: l.radius as f32,
            normal: f(l.normal),
            offset: l.offset as f32,
            radiance: f(l.radiance),
            face: l.face,
        })
        .collect();
    let mut records = match access {
        Access::Tree => pack_records(world, &surfaces, &materials, &lights),
        Access::Baked | Access::Buffers => Vec::new(),
    };
    if records.is_empty() {
        records.push([0; 4]);
    }
    if surfaces.is_empty() {
        surfaces.push(Surface::default());
    }
    if materials.is_empty() {
        materials.push(Material::default());
    }
    if lights.is_empty() {
        lights.push(DiskLight::default());
    }
    Packed {
        surfaces,
        materials,
        lights,
        records,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::MODULES;
    use std::mem::offset_of;

    /// (struct, size, fields with their offsets) of the host.
    macro_rules! layout {
        ($($name:ident { $($field:ident),* $(,)? })*) => {
            vec![$((stringify!($name), size_of::<$name>(), vec![$((stringify!($field), offset_of!($name, $field))),*])),*]
        };
    }

    #[test]
    fn host_structs_lie_as_the_kernel_reads_them() {
        let host = layout! {
            Surface { point, radius, axis, offset, faces, material, top, solid, parent, shape }
            Material { color, kind, specular, exponent }
            DiskLight { center, radius, normal, offset, radiance, face }
            LightCluster { center, radius, power, cos_cone }
            Params { tile, size, pixels, most, seed, groups, first_group, stride, trips, rounds }
        };
        // Struct declarations are all that is needed, wherever they stand.
        let mut text = String::new();
        for (_, module) in MODULES
            .iter()
            .chain(&[("path", include_str!("../../shaders/path.wgsl"))])
        {
            for part in module.split("\nstruct ").skip(1) {
                let body = part.split_once('}').expect("closed").0;
                if host
                    .iter()
                    .any(|(name, ..)| body.starts_with(&format!("{name} {{")))
                {
                    text += &format!("struct {body}}}\n");
                }
            }
        }
        let module = naga::front::wgsl::parse_str(&text).expect("structs parse");
        let mut layouter = naga::proc::Layouter::default();
        layouter
            .update(module.to_ctx())
            .expect("structs have layouts");
        for (name, size, fields) in host {
            let (handle, ty) = module
                .types
                .iter()
                .find(|(_, t)| t.name.as_deref() == Some(name))
                .unwrap_or_else(|| panic!("no {name}"));
            let naga::TypeInner::Struct { members, .. } = &ty.inner else {
                panic!("{name} is a struct")
            };
            let shader: Vec<(&str, usize)> = members
                .iter()
                .map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize))
                .collect();
            assert_eq!(fields, shader, "{name}");
            assert_eq!(
                layouter[handle].to_stride() as usize,
                size,
                "stride of {name}"
            );
        }
    }
}
