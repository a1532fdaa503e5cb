//! Dielectric solids whose surfaces cross: the medium inside both is undefined. Solids may nest, touch, or be apart.

use super::geometry::{farthest_on_cylinder, points_on_disk, signed_distance, size};
use super::{Warnings, called, is_dielectric};
use crate::coincidence::{COINCIDENT, parallel, slack};
use crate::implicit::Implicit;
use crate::scene::{Scene, Shape};
use glam::DVec3;

/// One warning for every pair of dielectric solids that cross.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let primitives = scene.primitives.iter();
    let solids: Vec<_> = primitives.filter(|p| is_dielectric(scene, p)).collect();
    let mut warnings = Warnings::default();
    for (i, a) in solids.iter().enumerate() {
        for b in &solids[i + 1..] {
            if cross(&a.shape, &b.shape) {
                warnings.add(b.place(), || {
                    format!(
                        "{} crosses {}; both are dielectric, so the medium inside both is undefined: \
                     nest them or keep them apart",
                        called(b.shape.kind(), b.line),
                        called(a.shape.kind(), a.line)
                    )
                });
            }
        }
    }
    warnings
}

/// Whether the surfaces cross, by more than the tolerance within which they coincide.
fn cross(a: &Shape, b: &Shape) -> bool {
    let slack = slack(size(a).min(size(b)));
    match (a, b) {
        (Shape::Implicit(solid), _) => overlap(solid, b),
        (_, Shape::Implicit(solid)) => overlap(solid, a),
        (&Shape::Plane { normal: n, .. }, &Shape::Plane { normal: m, .. }) => {
            !parallel(n, m, COINCIDENT)
        }
        (&Shape::Plane { .. }, _) => cross(b, a),
        (&Shape::Sphere { center, radius }, &Shape::Plane { .. }) => {
            signed_distance(b, center).abs() < radius - slack
        }
        (&Shape::Cylinder { base, top, radius }, &Shape::Plane { normal, .. }) => {
            // How far a cap reaches along the normal.
            let reach = radius * normal.cross((top - base).normalize()).length();
            let ends = [signed_distance(b, base), signed_distance(b, top)];
            let low = ends[0].min(ends[1]) - reach;
            let high = ends[0].max(ends[1]) + reach;
            low < -slack && high > slack
        }
        (
            &Shape::Sphere { center, radius },
            &Shape::Sphere {
                center: other,
                radius: r,
            },
        ) => {
            let apart = center.distance(other);
            apart > (radius - r).abs() + slack && apart < radius + r - slack
        }
        (
            &Shape::Sphere { center, radius },
            &Shape::Cylinder {
                base,
                top,
                radius: r,
            },
        ) => {
            // The cylinder's surface is connected: it crosses the sphere if some of it is inside and some outside.
            let nearest = signed_distance(b, center).abs();
            let farthest = farthest_on_cylinder(base, top, r, center);
            nearest < radius - slack && farthest > radius + slack
        }
        (&Shape::Cylinder { .. }, &Shape::Sphere { .. }) => cross(b, a),
        (&Shape::Cylinder { .. }, &Shape::Cylinder { .. }) => {
            partly_inside(a, b, slack) || partly_inside(b, a, slack)
        }
        (&Shape::Disk { .. }, _) | (_, &Shape::Disk { .. }) => false,
    }
}

/// Whether the two have points in common, and each has points of its own, well inside: by a grid over both.
fn overlap(solid: &Implicit, other: &Shape) -> bool {
    const SIDE: usize = 24;
    let (center, radius) = solid.ball();
    let (mut low, mut high) = (center - radius, center + radius);
    // What has no bounds has points of its own.
    let mut own = [false, true];
    let ball = match other {
        Shape::Sphere { center, radius } => Some((*center, *radius)),
        Shape::Cylinder { base, top, radius } => Some((
            0.5 * (*base + *top),
            radius.hypot(0.5 * base.distance(*top)),
        )),
        Shape::Implicit(other) => Some(other.ball()),
        Shape::Plane { .. } | Shape::Disk { .. } => None,
    };
    if let Some((center, radius)) = ball {
        if center.distance(solid.ball().0) > radius + solid.ball().1 {
            return false;
        }
        (low, high) = (low.min(center - radius), high.max(center + radius));
        own[1] = false;
    }
    let this = Shape::Implicit(solid.clone().into());
    let margin = slack(size(&this).min(size(other)));
    let mut both = false;
    for k in 0..SIDE.pow(3) {
        let at = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE];
        let at = DVec3::from_array(at.map(|n| (n as f64 + 0.5) / SIDE as f64));
        let p = low + (high - low) * at;
        let [a, b] = [&this, other].map(|s| signed_distance(s, p));
        both |= a < -margin && b < -margin;
        own[0] |= a < -margin && b > margin;
        own[1] |= b < -margin && a > margin;
    }
    both && own[0] && own[1]
}

/// Whether some points of `a`'s surface are inside `b`, and some outside.
fn partly_inside(a: &Shape, b: &Shape, slack: f64) -> bool {
    let (mut inside, mut outside) = (false, false);
    for p in points_on_cylinder(a, b) {
        let d = signed_distance(b, p);
        inside |= d < -slack;
        outside |= d > slack;
    }
    inside && outside
}

/// Points spread over the surface of the cylinder `a`, and more points where it comes near the axis of `b`, so that thin rods do not
/// slip between them.
fn points_on_cylinder(a: &Shape, b: &Shape) -> Vec<DVec3> {
    /// Points on each cap, and rings along the side.
    const FINENESS: usize = 32;

    let (
        &Shape::Cylinder { base, top, radius },
        &Shape::Cylinder {
            base: b0, top: b1, ..
        },
    ) = (a, b)
    else {
        return Vec::new();
    };
    let length = base.distance(top);
    let axis = (top - base) / length;
    let mut points: Vec<DVec3> = points_on_disk(base, axis, radius, FINENESS).collect();
    points.extend(points_on_disk(top, axis, radius, FINENESS));

    let along = |p: DVec3| axis.dot(p - base);
    let mut heights: Vec<f64> = (0..=FINENESS)
        .map(|i| length * i as f64 / FINENESS as f64)
        .collect();
    heights.extend([along(b0), along(b1)]);
    // Where the two axes are nearest each other. Parallel ones are so everywhere.
    let other = b1 - b0;
    let across = other - axis * axis.dot(other);
    if across.length_squared() > 0.0 {
        let t = across.dot(base - b0) / across.length_squared();
        heights.push(along(b0 + other * t.clamp(0.0, 1.0)));
    }
    let (x, y) = axis.any_orthonormal_pair();
    for h in heights {
        let h = h.clamp(0.0, length);
        for k in 0..FINENESS {
            let turn = k as f64 / FINENESS as f64 * std::f64::consts::TAU;
            points.push(base + axis * h + (x * turn.cos() + y * turn.sin()) * radius);
        }
        // The point of the ring that faces the axis of `b`.
        let center = base + axis * h;
        let s = (center - b0).dot(other) / other.length_squared();
        let towards = b0 + other * s.clamp(0.0, 1.0) - center;
        let towards = (towards - axis * axis.dot(towards)).normalize_or_zero();
        if towards != DVec3::ZERO {
            points.push(center + towards * radius);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, warned};

    /// Whether two glass things are found to cross, in either order in the file.
    fn crossing(a: &str, b: &str) -> bool {
        let text = |a: &str, b: &str| format!("{a}\nmaterial = 'glass'\n{b}\nmaterial = 'glass'\n");
        let found = super::warnings(&scene(&text(a, b))).first;
        let other = super::warnings(&scene(&text(b, a))).first;
        assert_eq!(found.len(), other.len(), "{a} {b}");
        let opaque = format!("{a}\nmaterial = 'glass'\n{b}\nmaterial = 'white'\n");
        assert!(
            super::warnings(&scene(&opaque)).first.is_empty(),
            "opaque things may be inside"
        );
        found.len() == 1
    }

    fn ball(center: &str, radius: f64) -> String {
        format!("[[sphere]]\ncenter = {center}\nradius = {radius}")
    }

    fn rod(base: &str, top: &str, radius: f64) -> String {
        format!("[[cylinder]]\nbase = {base}\ntop = {top}\nradius = {radius}")
    }

    const WATER: &str = "[[plane]]\npoint = [0,0,0]\nnormal = [0,1,0]";

    #[test]
    fn balls() {
        let ball_at = |x: f64, r: f64| ball(&format!("[{x},0,0]"), r);
        assert!(crossing(&ball_at(0.0, 1.0), &ball_at(1.9, 1.0)));
        assert!(
            !crossing(&ball_at(0.0, 1.0), &ball_at(2.0, 1.0)),
            "touching"
        );
        assert!(!crossing(&ball_at(0.0, 1.0), &ball_at(2.1, 1.0)), "apart");
        assert!(!crossing(&ball_at(0.0, 1.0), &ball_at(0.5, 0.4)), "nested");
        assert!(
            !crossing(&ball_at(0.0, 1.0), &ball_at(0.5, 0.5)),
            "touching inside"
        );
        assert!(crossing(&ball_at(0.0, 1.0), &ball_at(0.5, 0.6)));
    }

    #[test]
    fn balls_and_rods_with_half_spaces() {
        assert!(crossing(WATER, &ball("[0,0.5,0]", 1.0)));
        assert!(!crossing(WATER, &ball("[0,1,0]", 1.0)));
        assert!(!crossing(WATER, &ball("[0,-2,0]", 1.0)));
        assert!(crossing(WATER, &rod("[0,-0.1,0]", "[0,1,0]", 0.3)));
        assert!(!crossing(WATER, &rod("[0,0,0]", "[0,1,0]", 0.3)));
        assert!(
            !crossing(WATER, &rod("[0,0.3,0]", "[2,0.3,0]", 0.3)),
            "lying"
        );
        assert!(crossing(WATER, &rod("[0,0.2,0]", "[2,0.2,0]", 0.3)));
        assert!(crossing(
            WATER,
            "[[plane]]\npoint = [0,0,0]\nnormal = [1,1,0]"
        ));
        assert!(!crossing(
            WATER,
            "[[plane]]\npoint = [0,1,0]\nnormal = [0,-1,0]"
        ));
    }

    #[test]
    fn balls_with_rods() {
        let upright = rod("[0,0,0]", "[0,4,0]", 1.0);
        assert!(
            crossing(&upright, &ball("[1.2,2,0]", 0.5)),
            "through the side"
        );
        assert!(crossing(&upright, &ball("[0,4.2,0]", 0.5)), "through a cap");
        assert!(!crossing(&upright, &ball("[1.5,2,0]", 0.5)), "touching");
        assert!(!crossing(&upright, &ball("[0,2,0]", 0.9)), "inside");
        assert!(!crossing(&upright, &ball("[0,2,0]", 2.3)), "around");
        assert!(
            crossing(&upright, &ball("[0,2,0]", 2.2)),
            "the rims stick out"
        );
    }

    #[test]
    fn rods() {
        let upright = rod("[0,0,0]", "[0,4,0]", 1.0);
        assert!(
            crossing(&upright, &rod("[-3,2,0]", "[3,2,0]", 0.1)),
            "skewer"
        );
        assert!(
            !crossing(&upright, &rod("[-3,2,1.1]", "[3,2,1.1]", 0.1)),
            "touching"
        );
        assert!(
            crossing(&upright, &rod("[-3,2,1.09]", "[3,2,1.09]", 0.1)),
            "barely"
        );
        assert!(
            !crossing(&upright, &rod("[0.2,1,0]", "[0.2,3,0]", 0.3)),
            "inside"
        );
        assert!(
            crossing(&upright, &rod("[0.2,1,0]", "[0.2,5,0]", 0.3)),
            "sticks out"
        );
        assert!(
            !crossing(&upright, &rod("[0,4,0]", "[0,5,0]", 0.3)),
            "stands on it"
        );
        let needles = crossing(
            &rod("[-50,0,0.01]", "[51,0,0.01]", 0.01),
            &rod("[0.123,-70,0]", "[0.123,60,0]", 0.01),
        );
        assert!(needles, "thin and long");
        let aslant = crossing(
            &rod("[-50,0,0.01]", "[51,0,0.01]", 0.01),
            &rod("[-34.877,-70,0]", "[30.123,60,0]", 0.01),
        );
        assert!(aslant, "thin, long and not at right angles");
    }

    #[test]
    fn the_lint_speaks() {
        let two = format!(
            "{}\nmaterial = 'glass'\n{}\nmaterial = 'glass'\n",
            ball("[0,0,0]", 1.0),
            ball("[1,0,0]", 1.0)
        );
        assert!(warned(&two, "crosses the sphere at line"));
    }
}
