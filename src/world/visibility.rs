//! Which surfaces can come between a light and a point that a path reaches.

use super::{Bounds, Geometry, Side, Tree, World, WorldLight, WorldPrimitive};
use crate::coincidence::{COINCIDENT, slack};
use glam::DVec3;
use std::collections::BTreeSet;

/// For each surface, by its number, whether it can lie between a light and a point that a path reaches.
pub(crate) fn blockers(world: &World) -> Vec<bool> {
    let hull = hull_faces(world);
    (0..world.surface_count())
        .map(|n| can_block(world, n, &hull))
        .collect()
}

/// The faces of opaque planes that have every light wholly in front. They are walls of a convex hull around the lights: a segment to a
/// light never crosses such a plane if it starts in front.
fn hull_faces(world: &World) -> BTreeSet<u32> {
    let in_front = |normal: DVec3, offset: f64| {
        world.lights.iter().all(|l| {
            let lowest = normal.dot(l.center) - l.radius * normal.cross(l.normal).length();
            lowest >= offset - slack(l.radius)
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

/// Whether some ray of a path may meet nothing: opaque walls are not all around.
pub(crate) fn rays_escape(world: &World) -> bool {
    let opaque_walls = || world.primitives.iter().filter(|p| p.side != Side::Both);
    let encloses =
        |p: &WorldPrimitive| p.side == Side::Inside || matches!(p.geometry, Geometry::Implicit(_));
    if opaque_walls().any(encloses) {
        return false;
    }
    let normals: Vec<DVec3> = opaque_walls()
        .filter_map(|p| match p.geometry {
            Geometry::Plane { normal, .. } => Some(normal),
            _ => None,
        })
        .collect();
    // Directions that lead away from all planes, or along them, are a cone. If there are any, one of them lies along two planes, or the
    // planes have a direction in common.
    let leads_away = |d: DVec3| d != DVec3::ZERO && normals.iter().all(|n| n.dot(d) >= -1e-9);
    let pairs = || {
        let with = |i: usize| normals[..i].iter().map(move |b| (i, *b));
        (0..normals.len()).flat_map(with)
    };
    let edges = pairs().map(|(i, b)| normals[i].cross(b).normalize_or_zero());
    let mut edges = edges.flat_map(|d| [d, -d]);
    edges.any(leads_away) || pairs().all(|(i, b)| normals[i].cross(b).length() < 1e-9)
}

/// Whether a surface can lie between a light and a point that a path reaches.
fn can_block(world: &World, number: usize, hull: &BTreeSet<u32>) -> bool {
    let Some(p) = world.primitive(number) else {
        // A light. If it lies flush on a wall of the hull, it blocks as little as the wall does. And if all lights lie in one plane,
        // none can block another.
        let face = world.lights[number].face;
        return !hull.contains(&face) && world.lights.iter().any(|l| l.face != face);
    };
    match p.geometry {
        Geometry::Plane { .. } => !(p.side == Side::Outside && hull.contains(&p.faces[0])),
        Geometry::Disk { .. } => !hull.contains(&p.faces[0]),
        // A solid around the eye is convex, so it hides no light that lies inside it.
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

/// Whether a light lies inside a cylinder, or touches it from inside.
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
    let slack = slack(radius);
    height - reach >= offsets[0] - slack
        && height + reach <= offsets[1] + slack
        && out <= radius + slack
}

/// Whether any two lights lie in one plane and overlap there. The first of them in the file hides the other.
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
        .any(|(i, (a, bounds))| {
            let mut overlap = false;
            tree.touching(bounds, |k| {
                let b = &world.lights[k];
                overlap |=
                    k < i && a.face == b.face && a.center.distance(b.center) < a.radius + b.radius;
            });
            overlap
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;

    /// Whether rays escape from between planes, each a point in front of which it lies and its normal.
    fn escape(planes: &[([f64; 3], [f64; 3])], more: &str) -> bool {
        let mut text =
            "[camera]\neye = [0, 0, 0]\nlook_at = [0, 0, -1]\nvfov = 40\nresolution = [8, 8]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
             [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
             [[light]]\ncenter = [0, 0, -0.5]\nnormal = [0, 1, 0]\nradius = 0.1\nradiance = [1, 1, 1]\n"
                .to_owned();
        for (point, normal) in planes {
            text +=
                &format!("[[plane]]\npoint = {point:?}\nnormal = {normal:?}\nmaterial = 'white'\n");
        }
        let scene = parse_str("room.toml".as_ref(), &(text + more)).expect("a scene");
        rays_escape(&World::new(&scene, [8, 8]))
    }

    /// A plane at distance 1 from the eye, which lies in this direction.
    fn wall(towards: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        (towards, towards.map(|x| -x))
    }

    #[test]
    fn rays_escape_unless_walls_are_all_around() {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let [left, floor, back] = [x, y, z].map(|v| v.map(|c| -c));
        let room = [x, y, z, left, floor, back].map(wall);
        assert!(!escape(&room, ""));
        // Without a wall; a tube; a gap between two planes; a floor; nothing but a ball.
        assert!(escape(&room[1..], ""));
        assert!(escape(&[x, y, left, floor].map(wall), ""));
        assert!(escape(&[y, floor].map(wall), ""));
        assert!(escape(&[floor].map(wall), ""));
        let ball = |center: &str, material: &str| {
            format!("[[sphere]]\ncenter = {center}\nradius = 1\nmaterial = '{material}'\n")
        };
        assert!(escape(&[], &ball("[0, 0, -3]", "white")));
        assert!(escape(&[], &ball("[0, 0, 0]", "glass")));
        assert!(!escape(&[], &ball("[0, 0, 0]", "white")));
        // A tetrahedron, and three of its sides.
        let sides = [
            [0.5, 0.5, 0.5],
            [0.5, -0.5, -0.5],
            [-0.5, 0.5, -0.5],
            [-0.5, -0.5, 0.5],
        ]
        .map(wall);
        assert!(!escape(&sides, ""));
        assert!(escape(&sides[1..], ""));
    }
}
