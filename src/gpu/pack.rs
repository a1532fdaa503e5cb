//! Host twins of the kernel's structs, and the scene packed into them.

use crate::kernel::{material_tag, shape_tag};
use crate::scene::Bsdf;
use crate::world::{Geometry, World};
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
    /// Fills the struct to its alignment.
    pub padding: u32,
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
}

fn f(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// Packs a world.
pub fn pack(world: &World) -> Packed {
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
            Params { tile, size, first, end, fresh, seed, groups, first_group, stride }
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
