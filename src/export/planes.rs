//! Infinite planes, cut to what can be seen of them.

use super::frame;
use crate::scene::{Bsdf, Scene, Shape};
use glam::{DMat3, DVec3};

/// A plane that no other plane bounds ends at so many times the size of the scene.
const HORIZON: f64 = 1000.0;

/// A rectangle is so much wider than what is seen of its plane, so that no gap is left where two planes meet.
const MARGIN: f64 = 1e-3;

/// A part of a plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rectangle {
    pub center: DVec3,
    /// Its axes, of unit length: along its sides, and the plane's normal.
    pub axes: DMat3,
    /// Half of its width and of its height.
    pub half: [f64; 2],
}

/// What can be seen of a plane.
pub(super) enum Cut {
    /// This part.
    Rectangle(Rectangle),
    /// This part, and more in the distance.
    Horizon(Rectangle),
    /// Nothing: it is behind other planes.
    Hidden,
}

/// Centre and radius of a ball about the eye, the lights, and everything that has an end.
pub(super) fn extent(scene: &Scene) -> (DVec3, f64) {
    let mut balls = vec![(scene.camera.eye, 0.0), (scene.camera.look_at, 0.0)];
    balls.extend(scene.lights.iter().map(|l| (l.center, l.radius)));
    balls.extend(scene.primitives.iter().filter_map(|p| match p.shape {
        Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
            Some((center, radius))
        }
        Shape::Cylinder { base, top, radius } => {
            Some((0.5 * (base + top), radius + 0.5 * base.distance(top)))
        }
        Shape::Implicit(ref implicit) => Some(implicit.ball()),
        Shape::Plane { .. } => None,
    }));
    let low = balls
        .iter()
        .fold(DVec3::MAX, |m, (c, r)| m.min(c - DVec3::splat(*r)));
    let high = balls
        .iter()
        .fold(DVec3::MIN, |m, (c, r)| m.max(c + DVec3::splat(*r)));
    (0.5 * (low + high), 0.5 * low.distance(high))
}

/// What can be seen of the plane of primitive `index`. No path passes an opaque plane, so only the part on the eye's side of all the
/// others counts.
pub(super) fn cut(scene: &Scene, index: usize, point: DVec3, normal: DVec3) -> Cut {
    let (middle, radius) = extent(scene);
    let reach = HORIZON * radius.max(middle.distance(point) * MARGIN);
    let foot = middle - normal * (middle - point).dot(normal);
    let axes = frame::around(normal);
    let corner = |x: f64, y: f64| foot + reach * (x * axes.x_axis + y * axes.y_axis);
    let mut polygon = vec![
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    // The longest edge on another plane gives the rectangle its direction.
    let mut edge: Option<DVec3> = None;
    for (k, other) in scene.primitives.iter().enumerate() {
        let Shape::Plane {
            point: q,
            normal: n,
        } = other.shape
        else {
            continue;
        };
        let clear = matches!(
            scene.materials[other.material].bsdf,
            Bsdf::Dielectric { .. }
        );
        if k == index || clear {
            continue;
        }
        let side = if (scene.camera.eye - q).dot(n) < 0.0 {
            -n
        } else {
            n
        };
        let height = |p: DVec3| (p - q).dot(side);
        // One that coincides with it, or has it in full view, cuts nothing.
        let least = 1e-9 * reach;
        if polygon.iter().all(|p| height(*p) >= -least) {
            continue;
        }
        polygon = clip(&polygon, height);
        if polygon.is_empty() {
            return Cut::Hidden;
        }
        edge = edge.or(normal.cross(n).try_normalize());
    }
    let axes = edge.map_or(axes, |edge| frame::along(normal, edge));
    let [x, y] = [axes.x_axis, axes.y_axis].map(|axis| {
        let along = polygon.iter().map(|p| (*p - foot).dot(axis));
        along.fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)))
    });
    let far = |(a, b): (f64, f64)| a.abs().max(b.abs()) >= 0.99 * reach;
    let mid = |(a, b): (f64, f64)| 0.5 * (a + b);
    let half = |(a, b): (f64, f64)| 0.5 * (b - a) * (1.0 + MARGIN);
    let rectangle = Rectangle {
        center: foot + mid(x) * axes.x_axis + mid(y) * axes.y_axis,
        axes,
        half: [half(x), half(y)],
    };
    if far(x) || far(y) {
        Cut::Horizon(rectangle)
    } else {
        Cut::Rectangle(rectangle)
    }
}

/// The part of a convex polygon where `height` is not negative (Sutherland and Hodgman).
fn clip(polygon: &[DVec3], height: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let [ha, hb] = [height(a), height(b)];
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha < 0.0) != (hb < 0.0) {
            kept.push(a.lerp(b, ha / (ha - hb)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(text: &str) -> Vec<Cut> {
        let rest = "[camera]\neye = [0, 1, 0]\nlook_at = [0, 1, -1]\nvfov = 40\nresolution = [8, 8]\n\
                    [material.m]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
                    [material.g]\ntype = 'dielectric'\n\
                    [[light]]\ncenter = [0, 1.5, 0]\nnormal = [0, -1, 0]\nradius = 0.2\nradiance = [1, 1, 1]\n";
        let scene = Scene::parse(&(rest.to_owned() + text)).unwrap();
        let shapes = scene.primitives.iter().enumerate();
        let cut = |(k, p): (usize, &crate::scene::Primitive)| match p.shape {
            Shape::Plane { point, normal } => Some(cut(&scene, k, point, normal)),
            _ => None,
        };
        shapes.filter_map(cut).collect()
    }

    fn plane(point: [f64; 3], normal: [f64; 3], material: &str) -> String {
        format!("[[plane]]\npoint = {point:?}\nnormal = {normal:?}\nmaterial = '{material}'\n")
    }

    #[test]
    fn a_closed_room_has_walls_of_its_size() {
        let walls = [
            ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 2.0, 0.0], [0.0, 1.0, 0.0]),
            ([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ([3.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ([0.0, 0.0, -4.0], [0.0, 0.0, 1.0]),
            ([0.0, 0.0, 4.0], [0.0, 0.0, 1.0]),
        ];
        let text: String = walls.iter().map(|(p, n)| plane(*p, *n, "m")).collect();
        // Water in it cuts nothing, and a wall behind a wall is not seen.
        let more = plane([0.0, 0.5, 0.0], [0.0, 1.0, 0.0], "g")
            + &plane([0.0, 0.0, 9.0], [0.0, 0.0, 1.0], "m");
        let cuts = planes(&(text + &more));
        let sizes = [
            [3.0, 4.0],
            [3.0, 4.0],
            [1.0, 4.0],
            [1.0, 4.0],
            [1.0, 3.0],
            [1.0, 3.0],
            [3.0, 4.0],
        ];
        for (cut, size) in cuts.iter().zip(sizes) {
            let Cut::Rectangle(r) = cut else {
                panic!("a rectangle")
            };
            let mut half = r.half;
            half.sort_by(f64::total_cmp);
            for (half, size) in half.iter().zip(size) {
                assert!((half / size - 1.0).abs() < 2.0 * MARGIN, "{half} {size}");
            }
        }
        assert!(matches!(cuts[7], Cut::Hidden));
    }

    #[test]
    fn an_open_floor_ends_at_the_horizon() {
        let cuts = planes(&plane([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], "m"));
        let Cut::Horizon(r) = &cuts[0] else {
            panic!("a horizon")
        };
        assert!(r.half[0] > 500.0 && r.axes.z_axis == DVec3::Y && r.center.y == 0.0);
    }
}
