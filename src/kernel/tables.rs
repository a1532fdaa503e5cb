//! Generated WGSL: `surface_at`, `face_at`, `material_at` and `light_at`, which fetch by number what the ray functions
//! found, and `light_scale`.
//!
//! Baked, they are chains of selections among literals: a load from a buffer at an index that differs from lane to lane
//! costs a software adapter a trip through memory for every lane and word, which is most of a path's time.

use super::literal::float;
use super::{Access, material_tag, shape_tag};
use crate::scene::Bsdf;
use crate::world::{Geometry, World, WorldLight, WorldPrimitive, face, key};
use glam::DVec3;
use std::fmt::Write as _;

pub(super) fn generate(world: &World, access: Access) -> String {
    let scales = world.light_scales.as_deref().map(light_scale);
    fetches(world, access) + &scales.unwrap_or_default()
}

/// See [`World::light_scales`]. Media that follow each other with one scale make one line.
fn light_scale(scales: &[f64]) -> String {
    let mut s = format!(
        "\nfn light_scale(medium: u32) -> f32 {{\n    var scale = {};\n",
        float(scales[0])
    );
    let mut first = 1;
    for run in scales[1..].chunk_by(|a, b| a == b) {
        let (x, last) = (float(run[0]), first + run.len() - 1);
        let _ = writeln!(
            s,
            "    scale = select(scale, {x}, medium >= {first}u && medium <= {last}u);"
        );
        first = last + 1;
    }
    s + "    return scale;\n}\n"
}

fn fetches(world: &World, access: Access) -> String {
    match access {
        Access::Baked => baked(world),
        // What records.wgsl has.
        Access::Tree => String::new(),
        Access::Buffers => "\
fn surface_at(key: u32) -> Surface {
    return surfaces[key >> 2u];
}

fn face_at(key: u32, s: Surface) -> u32 {
    return face_of(s, key & 3u);
}

fn material_at(index: u32) -> Material {
    return materials[index];
}

fn light_at(index: u32) -> DiskLight {
    return lights[index];
}
"
        .to_string(),
    }
}

/// The fields of a struct, by name; WGSL's zero is their default.
pub(super) type Fields = Vec<(&'static str, String)>;

fn vector(fields: &mut Fields, names: [&'static str; 3], v: DVec3) {
    for (name, x) in names.into_iter().zip(v.to_array()) {
        fields.push((name, float(x)));
    }
}

const POINT: [&str; 3] = ["point.x", "point.y", "point.z"];
const AXIS: [&str; 3] = ["axis.x", "axis.y", "axis.z"];

fn surface_fields(p: &WorldPrimitive) -> Fields {
    let mut f = vec![
        ("material", format!("{}u", p.material)),
        ("solid", format!("{}u", p.solid)),
        ("parent", format!("{}u", p.parent)),
        ("shape", format!("{}u", shape_tag(&p.geometry))),
    ];
    match p.geometry {
        // The point of a flat thing is not asked for.
        Geometry::Disk { normal, offset, .. } | Geometry::Plane { normal, offset } => {
            vector(&mut f, AXIS, normal);
            f.push(("offset", float(offset)));
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            vector(&mut f, POINT, base);
            vector(&mut f, AXIS, axis);
            f.push(("radius", float(radius)));
            f.push(("offset", float(offsets[0])));
            f.push(("top", float(offsets[1])));
        }
        Geometry::Sphere { center, radius } => {
            vector(&mut f, POINT, center);
            f.push(("radius", float(radius)));
        }
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => {
            vector(&mut f, POINT, pole);
            vector(&mut f, AXIS, normal);
            f.push(("radius", float(radius)));
            f.push(("offset", float(1.0 / radius)));
        }
    }
    f
}

fn material_fields(bsdf: &Bsdf) -> Fields {
    let mut f = vec![("kind", format!("{}u", material_tag(bsdf)))];
    let color = ["color.x", "color.y", "color.z"];
    match *bsdf {
        Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => {
            vector(&mut f, color, reflectance);
        }
        Bsdf::Dielectric { ior, transmittance } => {
            vector(&mut f, color, transmittance);
            f.push(("exponent", float(ior)));
        }
        Bsdf::Phong {
            diffuse,
            specular,
            exponent,
        } => {
            vector(&mut f, color, diffuse);
            vector(&mut f, ["specular.x", "specular.y", "specular.z"], specular);
            f.push(("exponent", float(exponent)));
        }
    }
    f
}

pub(super) fn light_fields(l: &WorldLight) -> Fields {
    let mut f = vec![
        ("radius", float(l.radius)),
        ("offset", float(l.offset)),
        ("face", format!("{}u", l.face)),
    ];
    vector(&mut f, ["center.x", "center.y", "center.z"], l.center);
    vector(&mut f, ["normal.x", "normal.y", "normal.z"], l.normal);
    vector(
        &mut f,
        ["radiance.x", "radiance.y", "radiance.z"],
        l.radiance,
    );
    f
}

/// A function that selects a struct of type `kind` by `index`: element k of `elements` where `index` is its number.
/// What all elements have in common is set once; zeros need not be set.
pub(super) fn chain(name: &str, kind: &str, index: &str, elements: &[(u32, Fields)]) -> String {
    let mut s = format!("    var s: {kind};\n");
    let zero = |v: &str| v == "0.0" || v == "0u";
    let value =
        |fields: &Fields, name: &str| fields.iter().find(|f| f.0 == name).map(|f| f.1.clone());
    let mut common: Vec<&str> = Vec::new();
    if let Some((_, first)) = elements.first() {
        for (field, v) in first {
            if elements
                .iter()
                .all(|(_, f)| value(f, field).as_ref() == Some(v))
            {
                common.push(field);
                if !zero(v) {
                    let _ = writeln!(s, "    s.{field} = {v};");
                }
            }
        }
    }
    for (number, fields) in elements {
        let set: Vec<_> = fields
            .iter()
            .filter(|(f, v)| !common.contains(f) && !zero(v))
            .collect();
        if set.is_empty() {
            continue;
        }
        let _ = writeln!(s, "    let is_{number} = {index} == {number}u;");
        for (field, v) in set {
            let _ = writeln!(s, "    s.{field} = select(s.{field}, {v}, is_{number});");
        }
    }
    format!("{name} {{\n{s}    return s;\n}}\n")
}

fn baked(world: &World) -> String {
    let first = world.lights.len();
    let surfaces: Vec<(u32, Fields)> = world
        .primitives
        .iter()
        .enumerate()
        .map(|(i, p)| ((first + i) as u32, surface_fields(p)))
        .collect();
    let mut s = String::new();
    s.push_str(&chain(
        "fn surface_at(key: u32) -> Surface",
        "Surface",
        "(key >> 2u)",
        &surfaces,
    ));

    // A face has its own identity, but for those that lie in the plane of an earlier one.
    s.push_str("\nfn face_at(key: u32, s: Surface) -> u32 {\n    var face = key + 1u;\n");
    for (i, p) in world.primitives.iter().enumerate() {
        for part in 0..p.geometry.parts() {
            let own = key(first + i, part);
            if p.faces[part] != face(own) {
                let _ = writeln!(
                    s,
                    "    face = select(face, {}u, key == {own}u);",
                    p.faces[part]
                );
            }
        }
    }
    s.push_str("    return face;\n}\n\n");

    let materials: Vec<(u32, Fields)> = world
        .materials
        .iter()
        .enumerate()
        .filter(|(m, _)| world.primitives.iter().any(|p| p.material == *m))
        .map(|(m, bsdf)| (m as u32, material_fields(bsdf)))
        .collect();
    s.push_str(&chain(
        "fn material_at(index: u32) -> Material",
        "Material",
        "index",
        &materials,
    ));
    let lights: Vec<(u32, Fields)> = world
        .lights
        .iter()
        .enumerate()
        .map(|(i, l)| (i as u32, light_fields(l)))
        .collect();
    s.push('\n');
    s.push_str(&chain(
        "fn light_at(index: u32) -> DiskLight",
        "DiskLight",
        "index",
        &lights,
    ));
    s
}
