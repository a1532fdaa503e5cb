//! What can come between a point that a path reaches and a light.

use super::{Bounds, COINCIDENT, Geometry, Side, Tree, World, WorldLight};
use glam::DVec3;
use std::collections::BTreeSet;

/// By number, whether a surface can lie between a point that a path reaches and a light.
pub(crate) fn blockers(world: &World) -> Vec<bool> {
    let hull = hull_faces(world);
    (0..world.surface_count())
        .map(|n| can_block(world, n, &hull))
        .collect()
}

/// Faces of the convex hull that holds every light: opaque planes that no light reaches behind. A segment from a point in
/// front of such a plane to a light never crosses it.
fn hull_faces(world: &World) -> BTreeSet<u32> {
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
fn can_block(world: &World, number: usize, hull: &BTreeSet<u32>) -> bool {
    let Some(p) = world.primitive(number) else {
        // Flush on the hull it is as much out of the way as the hull; and lights of one plane are never between each
        // other and a point.
        let face = world.lights[number].face;
        return !hull.contains(&face) && world.lights.iter().any(|l| l.face != face);
    };
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
pub(crate) fn lights_overlap(world: &World) -> bool {
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
