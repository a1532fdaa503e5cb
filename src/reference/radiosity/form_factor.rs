//! Form factors in closed form, from points to rectangles and disks.
//!
//! An integral over a rectangle is a sum of one antiderivative at its corners, with signs. So a grid of rectangles costs one
//! evaluation for each node.

use std::f64::consts::PI;

/// Antiderivative in x and y of the form factor d²/(π (x² + y² + d²)²) from a receiver to an element of a plane at (`x`, `y`). The
/// receiver is a point at height `d` over the origin of the plane, and is parallel to the plane.
pub fn point_parallel(x: f64, y: f64, d: f64) -> f64 {
    let (a, b) = (x.hypot(d), y.hypot(d));
    (x / a * (y / a).atan() + y / b * (x / b).atan()) / (2.0 * PI)
}

/// The same for a receiver that faces along +x: x d/(π (x² + y² + d²)²). `x` >= 0 and `d` >= 0, and not both are 0.
pub fn point_across(x: f64, y: f64, d: f64) -> f64 {
    let s = x.hypot(d);
    -d / (2.0 * PI * s) * (y / s).atan()
}

/// Form factors to a disk of radius `r` from a point at distance `a` from its axis and height `h` > 0 in front of it. The first is for
/// a receiver parallel to the disk, and the second for a receiver that faces the axis, if its horizon does not cut the disk.
pub fn disk(a: f64, h: f64, r: f64) -> [f64; 2] {
    let s = a * a + h * h - r * r;
    let q = s.hypot(2.0 * h * r);
    let cap = if s > 0.0 {
        2.0 * h * r * r / (q + s)
    } else {
        (q - s) / (2.0 * h)
    };
    let z = a * a + h * h + r * r;
    [h * cap / q, 2.0 * h * r * r * a / (q * (z + q))]
}

/// The area that a disk around the origin has in common with the rectangle `x` times `y`.
pub fn disk_in_rectangle(r: f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    // Green's theorem: the sum of the areas that the edges span with the centre. That is a triangle where an edge is inside the disk,
    // and a sector where it is outside.
    (0..4)
        .map(|k| spanned(r, corners[k], corners[(k + 1) % 4]))
        .sum()
}

/// Signed area of the part of the disk that the edge from `a` to `b` spans with the centre.
fn spanned(r: f64, a: [f64; 2], b: [f64; 2]) -> f64 {
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let d = [b[0] - a[0], b[1] - a[1]];
    let (qa, qb, qc) = (dot(d, d), dot(a, d), dot(a, a) - r * r);
    let root = (qb * qb - qa * qc).max(0.0).sqrt();
    let [t0, t1] = [-1.0, 1.0].map(|sign| ((-qb + sign * root) / qa).clamp(0.0, 1.0));
    let [p, q] = [at(t0), at(t1)];
    let sector = |a, b| 0.5 * r * r * f64::atan2(cross(a, b), dot(a, b));
    sector(a, p) + 0.5 * cross(p, q) + sector(q, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint rule over the unit square.
    fn quadrature(f: impl Fn(f64, f64) -> f64) -> f64 {
        const STEPS: usize = 400;
        let at = |k: usize| (k as f64 + 0.5) / STEPS as f64;
        let sum: f64 = (0..STEPS * STEPS)
            .map(|k| f(at(k % STEPS), at(k / STEPS)))
            .sum();
        sum / (STEPS * STEPS) as f64
    }

    fn corners(x: [f64; 2], y: [f64; 2], f: impl Fn(f64, f64) -> f64) -> f64 {
        f(x[1], y[1]) - f(x[0], y[1]) - f(x[1], y[0]) + f(x[0], y[0])
    }

    #[test]
    fn points_see_rectangles_as_quadrature_does() {
        let (x, y, d) = ([0.2, 1.1], [-0.4, 0.7], 0.6);
        let area = (x[1] - x[0]) * (y[1] - y[0]);
        let integral = |k: &dyn Fn(f64) -> f64| {
            area * quadrature(|u, v| {
                let (px, py) = (x[0] + u * (x[1] - x[0]), y[0] + v * (y[1] - y[0]));
                k(px) * d / (PI * (px * px + py * py + d * d).powi(2))
            })
        };
        let closed = corners(x, y, |x, y| point_parallel(x, y, d));
        assert!((closed - integral(&|_| d)).abs() < 1e-6, "{closed}");
        let closed = corners(x, y, |x, y| point_across(x, y, d));
        assert!((closed - integral(&|x| x)).abs() < 1e-6, "{closed}");
    }

    #[test]
    fn a_point_sees_all_of_a_half_space() {
        let far = 1e9;
        let all = corners([-far, far], [-far, far], |x, y| point_parallel(x, y, 1.0));
        assert!((all - 1.0).abs() < 1e-8, "{all}");
        let half = corners([0.0, far], [-far, far], |x, y| point_across(x, y, 1.0));
        assert!((half - 0.5).abs() < 1e-8, "{half}");
    }

    #[test]
    fn disks_cover_what_they_cover() {
        let whole = disk_in_rectangle(0.5, [-1.0, 1.0], [-1.0, 2.0]);
        assert!((whole - PI * 0.25).abs() < 1e-15, "{whole}");
        assert_eq!(disk_in_rectangle(0.5, [0.6, 1.0], [-1.0, 1.0]), 0.0);
        let inside = disk_in_rectangle(2.0, [0.1, 0.6], [-0.3, 0.7]);
        assert!((inside - 0.5).abs() < 1e-15, "{inside}");
        // A quarter, and rectangles that cut the rim and add up.
        let quarter = disk_in_rectangle(1.0, [0.0, 3.0], [0.0, 3.0]);
        assert!((quarter - PI / 4.0).abs() < 1e-15, "{quarter}");
        let cut: f64 = [[0.0, 0.3], [0.3, 0.9], [0.9, 3.0]]
            .iter()
            .flat_map(|&x| [[0.0, 0.7], [0.7, 3.0]].map(|y| disk_in_rectangle(1.0, x, y)))
            .sum();
        assert!((cut - PI / 4.0).abs() < 1e-15, "{cut}");
    }
}
