//! Where a ray meets a convex solid, by search and bisection. Only unit tests use it.

use super::Ray;
use glam::DVec3;
use std::f64::consts::TAU;

/// Distance from the ray's origin to which its line is searched, in both directions.
const REACH: f64 = 50.0;

/// Where a ray's line enters and leaves the convex solid {p : f(p) <= 0}, f convex; `None` if it misses.
pub fn span(ray: &Ray, f: impl Fn(DVec3) -> f64) -> Option<[f64; 2]> {
    let along = |t: f64| f(ray.at(t));
    let (mut lo, mut hi) = (-REACH, REACH);
    // Ternary search for the minimum of a convex function. After 300 steps an interval of 100·(2/3)³⁰⁰ is left.
    for _ in 0..300 {
        let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if along(a) < along(b) {
            hi = b;
        } else {
            lo = a;
        }
    }
    let inside = (lo + hi) / 2.0;
    if along(inside) > 0.0 {
        return None;
    }
    Some([-REACH, REACH].map(|outside| bisect(outside, inside, &along)))
}

fn bisect(mut outside: f64, mut inside: f64, f: &impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = (outside + inside) / 2.0;
        if f(middle) > 0.0 {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    inside
}

/// Panics unless both miss, or both hit at the same distance.
pub fn assert_same_hit(ray: &Ray, found: Option<f64>, expected: Option<f64>) {
    match (found, expected) {
        (None, None) => {}
        // Near a tangent the distance changes with the square root of the rounding, √10⁻¹⁵.
        (Some(a), Some(b)) => assert!((a - b).abs() < 1e-7, "{ray:?}: {a}, bisection says {b}"),
        _ => panic!("{ray:?}: {found:?}, bisection says {expected:?}"),
    }
}

/// A point of a cube of half width `half`, from three uniform numbers.
pub fn random_point(u: [f64; 3], half: f64) -> DVec3 {
    half * (2.0 * DVec3::from_array(u) - 1.0)
}

/// A point of the unit sphere, from two uniform numbers.
pub fn random_direction(u: [f64; 2]) -> DVec3 {
    let y = 2.0 * u[0] - 1.0;
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let across = (1.0 - y * y).sqrt();
    DVec3::new(across * cos, y, -across * sin).normalize()
}
