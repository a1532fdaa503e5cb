//! `surface_at`, `face_at`, `material_at` and `light_at`, for kernels with the scene's values in their text.
//!
//! They are chains of selections among literals. If the index of a load from a buffer differs from lane to lane, a software adapter
//! accesses memory separately for every lane and word, and that would take most of a path's time.

use super::super::layout::{DiskLight, Material, ShapeKind, Surface};
use crate::world::{World, face, key};
use std::fmt::Write as _;

/// Names and values of a struct's scalars.
pub(in crate::kernel) type Scalars = Vec<(String, String)>;

/// All four functions.
pub(in crate::kernel) fn generate(world: &World) -> String {
    let first = world.lights.len();
    let numbers = first..world.surface_count();
    let surfaces: Vec<(u32, Scalars)> = numbers.map(|n| (n as u32, surface(world, n))).collect();
    let used = |m: &usize| world.primitives.iter().any(|p| p.material == *m);
    let materials: Vec<(u32, Scalars)> = (0..world.materials.len())
        .filter(used)
        .map(|m| (m as u32, Material::of(&world.materials[m]).scalars()))
        .collect();
    let lights: Vec<(u32, Scalars)> = (0..)
        .zip(world.lights.iter().map(|l| DiskLight::of(l).scalars()))
        .collect();
    [
        chain(
            "fn surface_at(key: u32) -> Surface",
            "Surface",
            "(key >> 2u)",
            &surfaces,
        ),
        faces(world),
        chain(
            "fn material_at(index: u32) -> Material",
            "Material",
            "index",
            &materials,
        ),
        chain(
            "fn light_at(index: u32) -> DiskLight",
            "DiskLight",
            "index",
            &lights,
        ),
    ]
    .concat()
}

/// The fields of a surface that `vertex_at` and materials read. They read no faces, and no point or radius of a flat surface.
fn surface(world: &World, number: usize) -> Scalars {
    let surface = Surface::of(world, number);
    let flat = [ShapeKind::Plane, ShapeKind::Disk]
        .map(|k| k as u32)
        .contains(&surface.shape);
    let read = |name: &str| {
        let unread: &[&str] = if flat {
            &["faces", "point", "radius"]
        } else {
            &["faces"]
        };
        !unread.contains(&name.split('.').next().unwrap_or(name))
    };
    surface
        .scalars()
        .into_iter()
        .filter(|(name, _)| read(name))
        .collect()
}

/// `face_at`. A face has an identity of its own, unless it lies in the plane of an earlier one.
fn faces(world: &World) -> String {
    let mut s =
        String::from("fn face_at(key: u32, s: Surface) -> u32 {\n    var face = key + 1u;\n");
    for (i, p) in world.primitives.iter().enumerate() {
        for part in 0..p.geometry.parts() {
            let own = key(world.lights.len() + i, part);
            if p.faces[part] != face(own) {
                let shared = p.faces[part];
                let _ = writeln!(s, "    face = select(face, {shared}u, key == {own}u);");
            }
        }
    }
    s + "    return face;\n}\n\n"
}

/// A function that returns a struct of type `kind`: the one of `elements` whose number is `index`. Fields that are equal in all elements
/// are set once. Zeros are not set, because a variable starts as zero.
pub(in crate::kernel) fn chain(
    head: &str,
    kind: &str,
    index: &str,
    elements: &[(u32, Scalars)],
) -> String {
    let mut s = format!("{head} {{\n    var s: {kind};\n");
    let zero = |v: &str| v == "0.0" || v == "0u";
    let mut common: Vec<&str> = Vec::new();
    if let Some((_, first)) = elements.first() {
        for entry in first {
            if elements.iter().all(|(_, scalars)| scalars.contains(entry)) {
                let (field, v) = entry;
                common.push(field);
                if !zero(v) {
                    let _ = writeln!(s, "    s.{field} = {v};");
                }
            }
        }
    }
    for (number, scalars) in elements {
        let own = |(field, v): &&(String, String)| !common.contains(&field.as_str()) && !zero(v);
        let set: Vec<_> = scalars.iter().filter(own).collect();
        if set.is_empty() {
            continue;
        }
        let _ = writeln!(s, "    let is_{number} = {index} == {number}u;");
        for (field, v) in set {
            let _ = writeln!(s, "    s.{field} = select(s.{field}, {v}, is_{number});");
        }
    }
    s + "    return s;\n}\n\n"
}
