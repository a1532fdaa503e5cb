//! `intersect` and `occluded`: calls of the shapes' functions for every surface of a scene.

use super::super::access::{Access, BAKED_LIMIT};
use super::super::features::Features;
use super::super::layout::{ShapeKind, Surface};
use super::super::literal::float;
use super::super::trees::{self, Parted};
use crate::world::{Geometry, Side, World, WorldPrimitive, visibility};
use glam::DVec3;
use std::fmt::Write as _;

/// A surface, and the function of the shaders that intersects it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::kernel) struct Target {
    /// Its number in the kernel: lights come first.
    pub number: usize,
    /// The function. Consecutive surfaces with the same function share a loop.
    pub function: Function,
}

/// A function of the shaders that intersects one shape. Its name is `SHAPE_VARIANT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Function {
    pub shape: ShapeKind,
    pub variant: Variant,
}

/// On which side of the shape the rays are, and which rays they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Variant {
    /// From either side: a disk.
    Hit,
    /// From the front of an opaque plane.
    Front,
    /// Always from outside.
    Outside,
    /// Always from inside.
    Inside,
    /// The boundary of a dielectric solid.
    Boundary,
    /// For shadow rays, which need no distance, from outside.
    Shadow,
    /// For shadow rays, the boundary of a solid that holds no light.
    BoundaryShadow,
}

impl Function {
    /// Its name in the shaders.
    pub fn name(self) -> String {
        let variant = match self.variant {
            Variant::Hit => "hit",
            Variant::Front => "front",
            Variant::Outside => "outside",
            Variant::Inside => "inside",
            Variant::Boundary => "boundary",
            Variant::Shadow => "shadow",
            Variant::BoundaryShadow => "boundary_shadow",
        };
        format!("{}_{variant}", self.shape.name())
    }

    /// A call for the surface with key `key`. `field` gives the text of a field's value.
    pub fn call(self, hit: &str, field: impl Fn(&str) -> String, key: &str) -> String {
        let shape = self.shape.constructor(&field);
        self.call_with(hit, &shape, &field, key)
    }

    /// The same, with the text of a struct of the shape that exists already.
    pub fn call_with(
        self,
        hit: &str,
        shape: &str,
        field: impl Fn(&str) -> String,
        key: &str,
    ) -> String {
        let mut arguments = vec![hit.to_owned(), "ray".to_owned(), shape.to_owned()];
        let faces: &[&str] = match self.shape {
            ShapeKind::Cylinder => &["faces.x", "faces.y", "faces.z"],
            _ => &["faces.x"],
        };
        arguments.extend(faces.iter().map(|f| field(f)));
        arguments.push(key.to_owned());
        if matches!(self.variant, Variant::Boundary | Variant::BoundaryShadow) {
            arguments.extend(["solid", "parent"].map(field));
        }
        format!("{}({})", self.name(), arguments.join(", "))
    }
}

/// `intersect`, and `occluded` if lights are sampled by straight shadow rays. `parted` says which surfaces lie in trees, if there are trees.
pub(in crate::kernel) fn generate(
    world: &World,
    features: &Features,
    parted: Option<&Parted>,
) -> String {
    let mut s = String::new();
    // Surfaces outside the trees are baked like those of a small scene, if there are no more of them than in a small scene.
    let (mut one_by_one, each) = match parted {
        Some(parted) if parted.apart.len() <= BAKED_LIMIT => (parted.apart.clone(), Access::Baked),
        Some(parted) => (parted.apart.clone(), Access::Buffers),
        None => (targets(world), features.access),
    };
    // Rays in a queue meet what lies in trees by themselves.
    let queued = features.queued;
    let apart = if queued { "_apart" } else { "" };
    if let Some(parted) = parted.filter(|_| !queued) {
        s.push_str(&trees::walks(world, parted, features.direct));
    }
    let _ = write!(
        s,
        "// The nearest surface that the ray meets; coincident ones in the order of the format.
fn intersect{apart}(ray: Ray) -> Hit {{
    var hit = Hit(FAR, NONE);
",
    );
    calls(&mut s, world, &one_by_one, each, true);
    if let Some(parted) = parted.filter(|_| !queued) {
        trees::calls(&mut s, parted, "nearest");
    }
    s.push_str("    return hit;\n}\n\n");
    if !features.direct {
        return s;
    }
    let _ = write!(
        s,
        "// Whether anything lies within `distance` of the ray's origin. What cannot come between two points of the room, as its own
// walls, is not asked.
fn occluded{apart}(ray: Ray, distance: f32, light: u32) -> bool {{
    var hit = Hit(distance, NONE);
",
    );
    let blocks = visibility::blockers(world);
    one_by_one.retain(|t| blocks[t.number]);
    for t in &mut one_by_one {
        t.function = for_shadows(world, t);
    }
    calls(&mut s, world, &one_by_one, each, false);
    if let Some(parted) = parted.filter(|_| !queued) {
        trees::calls(&mut s, parted, "any");
    }
    let hidden = if features.hidden_lights {
        " || hidden_by_light(ray, distance, light)"
    } else {
        ""
    };
    let _ = writeln!(s, "    return hit.key != NONE{hidden};\n}}\n");
    if let Some(parted) = parted.filter(|_| queued) {
        s.push_str(&trees::queue(parted));
    }
    s
}

/// Every surface of a world, by number.
pub(in crate::kernel) fn targets(world: &World) -> Vec<Target> {
    let disk = Function {
        shape: ShapeKind::Disk,
        variant: Variant::Hit,
    };
    let lights = world.lights.iter().map(|_| disk);
    let functions = lights.chain(world.primitives.iter().map(function));
    let numbered = functions.enumerate();
    numbered
        .map(|(number, function)| Target { number, function })
        .collect()
}

fn function(p: &WorldPrimitive) -> Function {
    let shape = ShapeKind::of(&p.geometry);
    let variant = match (shape, p.side) {
        (ShapeKind::Disk | ShapeKind::Implicit, _) => Variant::Hit,
        (_, Side::Both) => Variant::Boundary,
        (ShapeKind::Plane, _) => Variant::Front,
        (_, Side::Outside) => Variant::Outside,
        (_, Side::Inside) => Variant::Inside,
    };
    Function { shape, variant }
}

/// The function that takes the place of `target.function` for shadow rays, which need no distance.
pub(in crate::kernel) fn for_shadows(world: &World, target: &Target) -> Function {
    let f = target.function;
    let round = matches!(f.shape, ShapeKind::Sphere | ShapeKind::Cylinder);
    let dark = || {
        world
            .primitive(target.number)
            .is_some_and(|p| !p.holds_light)
    };
    let variant = match f.variant {
        Variant::Outside if round => Variant::Shadow,
        Variant::Boundary if round && dark() => Variant::BoundaryShadow,
        other => other,
    };
    Function { variant, ..f }
}

/// Calls that set `hit` to the nearest of itself and the hits of `list`. For the `nearest` hit, planes that face each other share a call.
fn calls(s: &mut String, world: &World, list: &[Target], access: Access, nearest: bool) {
    match access {
        Access::Baked => {
            let mut paired = vec![false; list.len()];
            for (k, target) in list.iter().enumerate() {
                if paired[k] {
                    continue;
                }
                let call = match facing_plane(world, list, k).filter(|_| nearest) {
                    Some(m) => {
                        paired[m] = true;
                        pair_call(world, target, &list[m])
                    }
                    None => baked_call(world, target),
                };
                let _ = writeln!(s, "    hit = {call};");
            }
        }
        Access::Buffers | Access::Tree => {
            for run in list.chunk_by(|a, b| a.function == b.function && a.number + 1 == b.number) {
                if run[0].function.shape == ShapeKind::Implicit {
                    // Each has a function of its own.
                    for target in run {
                        let _ = writeln!(s, "    hit = {};", baked_call(world, target));
                    }
                    continue;
                }
                let (begin, end) = (run[0].number, run[run.len() - 1].number + 1);
                let call = run[0].function.call("hit", |f| format!("s.{f}"), "i * 4u");
                let _ = write!(
                    s,
                    "    for (var i = {begin}u; i < {end}u; i++) {{
        let s = surface_at(i << 2u);
        hit = {call};
    }}
"
                );
            }
        }
    }
}

/// Normal and offset of an opaque plane; `None` for any other surface.
fn opaque_plane(world: &World, t: &Target) -> Option<(DVec3, f64)> {
    match world.primitive(t.number)?.geometry {
        Geometry::Plane { normal, offset } if t.function.variant == Variant::Front => {
            Some((normal, offset))
        }
        _ => None,
    }
}

/// The first opaque plane later in the list that faces plane `k`.
fn facing_plane(world: &World, list: &[Target], k: usize) -> Option<usize> {
    let (normal, offset) = opaque_plane(world, &list[k])?;
    let later = list.iter().enumerate().skip(k + 1);
    // The eye is between them: n.p > offset and n.p < high.
    let faces =
        |t: &Target| opaque_plane(world, t).is_some_and(|(n, o)| n == -normal && -o > offset);
    later.filter(|(_, t)| faces(t)).map(|(m, _)| m).next()
}

/// Whether the last component that is not 0 is positive. This is true for exactly one of a normal and its opposite.
fn points_up(normal: DVec3) -> bool {
    let [x, y, z] = normal.to_array();
    [z, y, x]
        .into_iter()
        .find(|c| *c != 0.0)
        .is_some_and(|c| c > 0.0)
}

fn pair_call(world: &World, a: &Target, b: &Target) -> String {
    let up = |t: &Target| opaque_plane(world, t).is_some_and(|(normal, _)| points_up(normal));
    let (low, high) = if up(a) { (a, b) } else { (b, a) };
    let far = opaque_plane(world, high).map_or(0.0, |(_, offset)| -offset);
    let surface = Surface::of(world, low.number);
    let plane = ShapeKind::Plane.constructor(|f| surface.literal(f));
    let [low, high] = [low, high].map(|t| 4 * t.number);
    format!(
        "plane_pair(hit, ray, {plane}, {}, {low}u, {high}u)",
        float(far)
    )
}

fn baked_call(world: &World, t: &Target) -> String {
    if t.function.shape == ShapeKind::Implicit {
        return format!("{}(hit, ray)", super::implicit::name(t.number));
    }
    let mut surface = Surface::of(world, t.number);
    if t.function.shape == ShapeKind::Disk && !points_up(surface.axis.map(f64::from).into()) {
        // A disk is two-sided, so its normal may be turned. If all normals point the same way, parallel disks share their quotients.
        surface.axis = surface.axis.map(|x| -x);
        surface.offset = -surface.offset;
    }
    let field = |name: &str| match name.split_once('.') {
        None => surface.literal(name),
        Some(("faces", part)) => {
            let k = ["x", "y", "z"].iter().position(|p| *p == part).unwrap_or(0);
            format!("{}u", surface.faces[k])
        }
        Some(_) => unreachable!("no other field is asked for by component"),
    };
    t.function.call("hit", field, &format!("{}u", 4 * t.number))
}
