//! Generated WGSL: `intersect`, `occluded`, `choose_light` and `light_at` of one scene.

use super::literal::{float, vector};
use super::trees::{self, Parted};
use super::{Access, choice, lights, select::BAKED_LIMIT, tables};
use crate::world::{Bounds, COINCIDENT, Geometry, Side, Tree, World, WorldLight, WorldPrimitive};
use glam::DVec3;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// `parted` is how the world is parted where there are trees.
pub(super) fn generate(
    world: &World,
    access: Access,
    features: &BTreeSet<&str>,
    parted: Option<&Parted>,
) -> String {
    let mut s = String::new();
    let shadows = features.contains("LIGHT_SAMPLING");
    let everything: Vec<Surface> = surfaces(world);
    // With trees the surfaces outside them are met as those of small scenes, if they are no more.
    let (mut one_by_one, each) = match parted {
        Some(parted) if parted.apart.len() <= BAKED_LIMIT => (parted.apart.clone(), Access::Baked),
        Some(parted) => (parted.apart.clone(), Access::Buffers),
        None => (everything, access),
    };
    if let Some(parted) = parted {
        s.push_str(&trees::walks(world, parted, shadows));
    }
    s.push_str(
        "// The nearest surface that the ray meets; coincident ones in the order of the format.\n",
    );
    s.push_str("fn intersect(ray: Ray) -> Hit {\n    var hit = Hit(FAR, NONE);\n");
    calls(&mut s, world, &one_by_one, each, true);
    if let Some(parted) = parted {
        trees::calls(&mut s, parted, "nearest");
    }
    s.push_str("    return hit;\n}\n");
    if shadows {
        s.push_str("\n// Whether anything lies within `distance` of the ray's origin. What cannot come between two points\n");
        s.push_str("// of the room, as its own walls, is not asked.\nfn occluded(ray: Ray, distance: f32, light: u32) -> bool {\n");
        s.push_str("    var hit = Hit(distance, NONE);\n");
        let hull = hull_faces(world);
        one_by_one.retain(|b| can_block(world, b, &hull));
        for b in &mut one_by_one {
            b.function = shadow_function(world, b);
        }
        calls(&mut s, world, &one_by_one, each, false);
        if let Some(parted) = parted {
            trees::calls(&mut s, parted, "any");
        }
        if lights_overlap(world) {
            s.push_str(HIDDEN);
        }
        s.push_str("    return hit.key != NONE;\n}\n\n");
        if features.contains("LIGHT_TREE") {
            s.push_str(choice::CHOSEN);
            s.push_str(&lights::constants(world));
        } else {
            s.push_str(&choice::generate(world, access, features));
        }
    }
    s.push('\n');
    s.push_str(&tables::generate(world, access));
    s
}

/// One thing to meet: a light or a primitive, by its number in the kernel (lights first).
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Surface {
    pub number: usize,
    pub light: bool,
    /// Function name in WGSL; consecutive surfaces with the same one make one loop.
    pub function: &'static str,
}

pub(super) fn surfaces(world: &World) -> Vec<Surface> {
    let lights = (0..world.lights.len()).map(|number| Surface {
        number,
        light: true,
        function: "disk_hit",
    });
    let rest = world.primitives.iter().enumerate().map(|(i, p)| Surface {
        number: world.lights.len() + i,
        light: false,
        function: function(p),
    });
    lights.chain(rest).collect()
}

fn function(p: &WorldPrimitive) -> &'static str {
    match (p.geometry, p.side) {
        (Geometry::Disk { .. }, _) => "disk_hit",
        (Geometry::Cylinder { .. }, Side::Outside) => "cylinder_outside",
        (Geometry::Cylinder { .. }, Side::Inside) => "cylinder_inside",
        (Geometry::Cylinder { .. }, Side::Both) => "cylinder_boundary",
        (Geometry::Plane { .. }, Side::Both) => "plane_boundary",
        (Geometry::Plane { .. }, _) => "plane_front",
        (Geometry::Sphere { .. }, Side::Outside) => "sphere_outside",
        (Geometry::Sphere { .. }, Side::Inside) => "sphere_inside",
        (Geometry::Sphere { .. }, Side::Both) => "sphere_boundary",
        (Geometry::HugeSphere { .. }, Side::Outside) => "huge_sphere_outside",
        (Geometry::HugeSphere { .. }, Side::Inside) => "huge_sphere_inside",
        (Geometry::HugeSphere { .. }, Side::Both) => "huge_sphere_boundary",
    }
}

/// The function that answers for a shadow ray, which needs no distance, what `surface.function` answers for others.
pub(super) fn shadow_function(world: &World, surface: &Surface) -> &'static str {
    let dark = || !primitive(world, surface).holds_light;
    match surface.function {
        "sphere_outside" => "sphere_shadow",
        "cylinder_outside" => "cylinder_shadow",
        "sphere_boundary" if dark() => "sphere_boundary_shadow",
        "cylinder_boundary" if dark() => "cylinder_boundary_shadow",
        other => other,
    }
}

/// Calls that make `hit` the nearest of itself and `list`.
fn calls(s: &mut String, world: &World, list: &[Surface], access: Access, nearest: bool) {
    match access {
        Access::Baked => {
            let mut paired = vec![false; list.len()];
            for (k, surface) in list.iter().enumerate() {
                if paired[k] {
                    continue;
                }
                if nearest && let Some((m, other)) = facing_plane(world, list, k) {
                    paired[m] = true;
                    let _ = writeln!(s, "    hit = {};", pair_call(world, surface, other));
                    continue;
                }
                let _ = writeln!(s, "    hit = {};", baked_call(world, surface));
            }
        }
        Access::Buffers | Access::Tree => {
            for run in list.chunk_by(|a, b| a.function == b.function && a.number + 1 == b.number) {
                let (begin, end) = (run[0].number, run[run.len() - 1].number + 1);
                let _ = writeln!(s, "    for (var i = {begin}u; i < {end}u; i++) {{");
                let _ = writeln!(
                    s,
                    "        let s = surfaces[i];\n        hit = {};\n    }}",
                    buffer_call(run[0].function)
                );
            }
        }
    }
}

pub(super) fn primitive(world: &World, s: &Surface) -> WorldPrimitive {
    world.primitives[s.number - world.lights.len()]
}

/// An opaque plane later in the list that faces plane `k` and coincides with nothing.
fn facing_plane<'a>(world: &World, list: &'a [Surface], k: usize) -> Option<(usize, &'a Surface)> {
    let plane = |s: &Surface| match (s.function, s.light) {
        ("plane_front", false) => match primitive(world, s).geometry {
            Geometry::Plane { normal, offset } => Some((normal, offset)),
            _ => None,
        },
        _ => None,
    };
    let (normal, offset) = plane(&list[k])?;
    list.iter().enumerate().skip(k + 1).find(|(_, s)| {
        // The eye is between them: n.p > offset and n.p < high.
        plane(s).is_some_and(|(n, o)| n == -normal && -o > offset)
    })
}

/// Whether the last component that is not 0 is positive: true of one of a normal and its opposite.
fn points_up(normal: DVec3) -> bool {
    let [x, y, z] = normal.to_array();
    [z, y, x]
        .into_iter()
        .find(|c| *c != 0.0)
        .is_some_and(|c| c > 0.0)
}

fn pair_call(world: &World, low: &Surface, high: &Surface) -> String {
    let points_up = |s: &Surface| matches!(primitive(world, s).geometry, Geometry::Plane { normal, .. } if points_up(normal));
    let (low, high) = if points_up(low) {
        (low, high)
    } else {
        (high, low)
    };
    let (a, b) = (primitive(world, low), primitive(world, high));
    let (Geometry::Plane { normal, offset }, Geometry::Plane { offset: far, .. }) =
        (a.geometry, b.geometry)
    else {
        unreachable!("facing_plane finds planes");
    };
    format!(
        "plane_pair(hit, ray, Plane({}, {}), {}, {}u, {}u)",
        vector(normal),
        float(offset),
        float(-far),
        4 * low.number,
        4 * high.number
    )
}

fn baked_call(world: &World, s: &Surface) -> String {
    let key = 4 * s.number;
    if s.light {
        let l = &world.lights[s.number];
        return format!(
            "disk_hit(hit, ray, {}, {}u, {key}u)",
            disk(l.center, l.radius, l.normal, l.offset),
            l.face
        );
    }
    let p = primitive(world, s);
    let f = p.faces;
    let shape = match p.geometry {
        Geometry::Disk {
            center,
            normal,
            offset,
            radius,
        } => disk(center, radius, normal, offset),
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => format!(
            "Cylinder({}, {}, {}, vec2f({}, {}))",
            vector(base),
            float(radius),
            vector(axis),
            float(offsets[0]),
            float(offsets[1])
        ),
        Geometry::Plane { normal, offset } => {
            format!("Plane({}, {})", vector(normal), float(offset))
        }
        Geometry::Sphere { center, radius } => {
            format!("Sphere({}, {})", vector(center), float(radius))
        }
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => {
            format!(
                "HugeSphere({}, {}, {})",
                vector(pole),
                float(1.0 / radius),
                vector(normal)
            )
        }
    };
    let faces = match p.geometry {
        Geometry::Cylinder { .. } => format!("{}u, {}u, {}u, ", f[0], f[1], f[2]),
        _ => format!("{}u, ", f[0]),
    };
    let solid = if p.side == Side::Both && !matches!(p.geometry, Geometry::Disk { .. }) {
        format!(", {}u, {}u", p.solid, p.parent)
    } else {
        String::new()
    };
    format!("{}(hit, ray, {shape}, {faces}{key}u{solid})", s.function)
}

/// A two-sided disk; which way its normal points is no matter, and one way makes equal quotients.
fn disk(center: DVec3, radius: f64, normal: DVec3, offset: f64) -> String {
    let sign = if points_up(normal) { 1.0 } else { -1.0 };
    let (normal, offset) = (sign * normal, sign * offset);
    format!(
        "Disk({}, {}, {}, {})",
        vector(center),
        float(radius),
        vector(normal),
        float(offset)
    )
}

pub(super) fn buffer_call(function: &str) -> String {
    let (shape, faces) = if function.starts_with("disk") {
        ("Disk(s.point, s.radius, s.axis, s.offset)", "s.faces.x, ")
    } else if function.starts_with("cylinder") {
        (
            "Cylinder(s.point, s.radius, s.axis, vec2f(s.offset, s.top))",
            "s.faces.x, s.faces.y, s.faces.z, ",
        )
    } else if function.starts_with("plane") {
        ("Plane(s.axis, s.offset)", "s.faces.x, ")
    } else if function.starts_with("huge") {
        ("HugeSphere(s.point, s.offset, s.axis)", "s.faces.x, ")
    } else {
        ("Sphere(s.point, s.radius)", "s.faces.x, ")
    };
    let solid = if function.contains("_boundary") {
        ", s.solid, s.parent"
    } else {
        ""
    };
    format!("{function}(hit, ray, {shape}, {faces}i * 4u{solid})")
}

/// Faces of the convex hull that holds every light: opaque planes that no light reaches behind. A segment from a point in
/// front of such a plane to a light never crosses it.
pub(super) fn hull_faces(world: &World) -> BTreeSet<u32> {
    let in_front = |normal: DVec3, offset: f64| {
        world.lights.iter().all(|l| {
            let lowest = normal.dot(l.center) - l.radius * normal.cross(l.normal).length();
            lowest >= offset - COINCIDENT * l.radius
        })
    };
    world
        .primitives
        .iter()
        .filter_map(|p| match p.geometry {
            Geometry::Plane { normal, offset }
                if p.side == Side::Outside && in_front(normal, offset) =>
            {
                Some(p.faces[0])
            }
            _ => None,
        })
        .collect()
}

/// Whether a surface can lie between a point that a path reaches and a light.
pub(super) fn can_block(world: &World, s: &Surface, hull: &BTreeSet<u32>) -> bool {
    if s.light {
        // Flush on the hull it is as much out of the way as the hull; and lights of one plane are never between each
        // other and a point.
        let face = world.lights[s.number].face;
        return !hull.contains(&face) && world.lights.iter().any(|l| l.face != face);
    }
    let p = primitive(world, s);
    match p.geometry {
        Geometry::Plane { .. } => !(p.side == Side::Outside && hull.contains(&p.faces[0])),
        Geometry::Disk { .. } => !hull.contains(&p.faces[0]),
        // The solid around the eye is convex: it hides no light that lies inside it.
        Geometry::Sphere { center, radius } if p.side == Side::Inside => {
            !world.lights.iter().all(|l| {
                let v = l.center - center;
                let along = v.dot(l.normal);
                let across = (v - l.normal * along).length() + l.radius;
                along.hypot(across) <= radius * (1.0 + COINCIDENT)
            })
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } if p.side == Side::Inside => !world
            .lights
            .iter()
            .all(|l| light_in_cylinder(l, base, axis, offsets, radius)),
        _ => true,
    }
}

fn light_in_cylinder(
    l: &WorldLight,
    base: DVec3,
    axis: DVec3,
    offsets: [f64; 2],
    radius: f64,
) -> bool {
    let height = axis.dot(l.center);
    let reach = l.radius * axis.cross(l.normal).length();
    let v = l.center - base;
    let out = (v - axis * axis.dot(v)).length() + l.radius;
    let slack = COINCIDENT * radius;
    height - reach >= offsets[0] - slack
        && height + reach <= offsets[1] + slack
        && out <= radius + slack
}

/// Whether two lights share a plane and some of it, where the first in the file hides the others.
pub(super) fn lights_overlap(world: &World) -> bool {
    let boxes: Vec<Bounds> = world
        .lights
        .iter()
        .map(|l| Bounds::disk(l.center, l.normal, l.radius))
        .collect();
    let tree = Tree::new(&boxes);
    world
        .lights
        .iter()
        .zip(&boxes)
        .enumerate()
        .any(|(i, (a, around))| {
            let mut overlap = false;
            tree.touching(around, |k| {
                let b = &world.lights[k];
                overlap |=
                    k < i && a.face == b.face && a.center.distance(b.center) < a.radius + b.radius;
            });
            overlap
        })
}

const HIDDEN: &str = "\
    // Lights that lie in one plane hide those that come after them.
    let on_light = ray.o + distance * ray.d;
    for (var i = 0u; i < light; i++) {
        let before = lights[i];
        let v = on_light - before.center;
        if before.face == ray.target_face && dot(v, v) <= before.radius * before.radius {
            hit.key = 4u * i;
        }
    }
";
