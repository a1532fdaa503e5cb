//! Host twins of the kernel's structs, and the scene packed into them.

use crate::kernel::lights::{self, LightTree};
use crate::kernel::{Access, material_tag, shape_tag, trees};
use crate::scene::Bsdf;
use crate::world::{Geometry, Tree, World};
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
    /// Number of the first sample.
    pub first: u32,
    /// One past the last.
    pub end: u32,
    /// 1 when the running sums start at zero.
    pub fresh: u32,
    /// Seed of every random number.
    pub seed: u32,
    /// Workgroups of the tile.
    pub groups: u32,
    /// Number of the first one dispatched.
    pub first_group: u32,
    /// Stride through them, coprime to their number.
    pub stride: u32,
    /// 1: goes on where the last dispatch could not finish.
    pub resume: u32,
    /// Loop trips that an invocation may take.
    pub trips: u32,
    /// 2: rounds of a loop that tells whether the driver still lets loops go round.
    pub rounds: u32,
}

/// The storage buffers of a scene; never empty, for WGSL has no empty arrays.
#[derive(Debug, Clone)]
pub struct Packed {
    /// Lights first, then the world's primitives.
    pub surfaces: Vec<Surface>,
    /// In the world's order.
    pub materials: Vec<Material>,
    /// In the world's order.
    pub lights: Vec<DiskLight>,
    /// The trees of a kernel that walks them, as tree.wgsl says: one row of their texture, or whole ones.
    pub nodes: Vec<[u32; 4]>,
    /// The clusters of a kernel that chooses lights by them.
    pub clusters: Vec<LightCluster>,
    /// The lights in their order.
    pub places: Vec<u32>,
}

fn f(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// The trees of [`Access::Tree`], one after the other, as tree.wgsl says.
fn pack_trees(world: &World, surfaces: &[Surface]) -> Vec<[u32; 4]> {
    let corner = |x: [f32; 3], last: u32| {
        let [x, y, z] = x.map(f32::to_bits);
        [x, y, z, last]
    };
    let blocks = trees::blockers(world);
    let mut nodes: Vec<[u32; 4]> = Vec::new();
    for group in &trees::Parted::new(world).groups {
        debug_assert_eq!(nodes.len(), 2 * group.header);
        let tree = Tree::new(&trees::boxes(world, group));
        let first = group.header as u32 + 1;
        let reach = tree.nodes.first().map_or(0.0, |root| {
            root.min.iter().chain(&root.max).map(|x| x.abs()).sum()
        });
        nodes.extend([corner([reach, 0.0, 0.0], 0), [0; 4]]);
        for n in &tree.nodes {
            let escape = first + n.escape;
            let Some(item) = n.item else {
                nodes.extend([corner(n.min, escape), corner(n.max, 0)]);
                continue;
            };
            let number = group.numbers[item as usize];
            let word = 2 * (number as u32 + 1) + u32::from(blocks[number]);
            if group.spheres() {
                let s = &surfaces[number];
                nodes.push(corner(s.point, escape));
                nodes.push([s.radius.to_bits(), s.solid, s.parent, word]);
            } else {
                nodes.extend([corner(n.min, escape), corner(n.max, word)]);
            }
        }
        let end = group.end() as u32;
        nodes.extend([corner([2e30; 3], end), corner([-2e30; 3], 0)]);
    }
    let row = 2 * trees::NODES_A_ROW as usize;
    if nodes.len() > row {
        nodes.resize(nodes.len().next_multiple_of(row), [0; 4]);
    }
    nodes
}

/// The light clusters of a world, and the lights in their order.
fn pack_lights(world: &World) -> (Vec<LightCluster>, Vec<u32>) {
    let tree = LightTree::new(world);
    let cluster = |c: &lights::Cluster| LightCluster {
        center: f(c.center),
        radius: c.radius as f32,
        power: f(c.power),
        cos_cone: c.cos_cone as f32,
    };
    (tree.clusters.iter().map(cluster).collect(), tree.places)
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
    let (mut nodes, mut clusters, mut places) = Default::default();
    if access == Access::Tree {
        nodes = pack_trees(world, &surfaces);
        (clusters, places) = pack_lights(world);
    }
    if nodes.is_empty() {
        nodes.push([0; 4]);
    }
    if clusters.is_empty() {
        clusters.push(LightCluster::default());
        places.push(0);
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
        nodes,
        clusters,
        places,
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
            Params { tile, size, first, end, fresh, seed, groups, first_group, stride, resume, trips, rounds }
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
