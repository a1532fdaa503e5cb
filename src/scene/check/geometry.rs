//! Distances and hits in f64. Only the lints use them, never rendering.

use crate::coincidence::{COINCIDENT, parallel};
use crate::implicit::roots::Start;
use crate::scene::{Light, Shape};
use glam::DVec3;

/// A point relative to a cylinder: height above the base's plane, and distance from the axis.
struct InCylinder {
    height: f64,
    length: f64,
    rho: f64,
}

impl InCylinder {
    fn new(base: DVec3, top: DVec3, p: DVec3) -> Self {
        let axis = top - base;
        let length = axis.length();
        let axis = axis / length;
        let height = axis.dot(p - base);
        let rho = (p - base - axis * height).length();
        Self {
            height,
            length,
            rho,
        }
    }
}

/// Distance from `p` to the surface, negative inside solids and behind planes.
pub(super) fn signed_distance(shape: &Shape, p: DVec3) -> f64 {
    match *shape {
        Shape::Sphere { center, radius } => p.distance(center) - radius,
        Shape::Plane { point, normal } => normal.dot(p - point),
        Shape::Disk {
            center,
            normal,
            radius,
        } => {
            let height = normal.dot(p - center);
            let rho = (p - center - normal * height).length();
            height.hypot((rho - radius).max(0.0))
        }
        Shape::Cylinder { base, top, radius } => {
            let at = InCylinder::new(base, top, p);
            let above = (at.height - at.length).max(-at.height);
            let beside = at.rho - radius;
            if above <= 0.0 && beside <= 0.0 {
                above.max(beside)
            } else {
                above.max(0.0).hypot(beside.max(0.0))
            }
        }
        Shape::Implicit(ref implicit) => {
            let q = implicit.to_local(p);
            let (height, gradient) = implicit.sloped(q);
            // To first order.
            let distance = height / gradient.length().max(f64::MIN_POSITIVE);
            let beyond = -implicit.clip.depth(q);
            let distance = if implicit.closed {
                distance.max(beyond)
            } else {
                distance.abs().max(beyond)
            };
            distance * implicit.scale
        }
    }
}

/// Distance from `p` to the farthest point of a cylinder's surface. That point is on a rim.
pub(super) fn farthest_on_cylinder(base: DVec3, top: DVec3, radius: f64, p: DVec3) -> f64 {
    let at = InCylinder::new(base, top, p);
    let height = at.height.abs().max((at.length - at.height).abs());
    height.hypot(at.rho + radius)
}

/// How far a shape reaches in front of the plane through `point` with this unit normal; negative if all of it is behind.
pub(super) fn reach(shape: &Shape, point: DVec3, normal: DVec3) -> f64 {
    let height = |p: DVec3| normal.dot(p - point);
    let rim = |axis: DVec3, radius: f64| radius * normal.cross(axis).length();
    match *shape {
        Shape::Sphere { center, radius } => height(center) + radius,
        Shape::Plane {
            point: p,
            normal: n,
        } if parallel(n, normal, COINCIDENT) => height(p),
        Shape::Plane { .. } => f64::INFINITY,
        Shape::Disk {
            center,
            normal: n,
            radius,
        } => height(center) + rim(n, radius),
        Shape::Cylinder { base, top, radius } => {
            height(base).max(height(top)) + rim((top - base).normalize(), radius)
        }
        Shape::Implicit(ref implicit) => {
            let (center, radius) = implicit.ball();
            height(center) + radius
        }
    }
}

/// The length that the tolerance is relative to; infinite for planes.
pub(super) fn size(shape: &Shape) -> f64 {
    match *shape {
        Shape::Plane { .. } => f64::INFINITY,
        Shape::Sphere { radius, .. } | Shape::Disk { radius, .. } => radius,
        Shape::Cylinder { base, top, radius } => radius.min(base.distance(top)),
        Shape::Implicit(ref implicit) => implicit.ball().1,
    }
}

/// The shape of a light.
pub(super) fn disk_of(light: &Light) -> Shape {
    Shape::Disk {
        center: light.center,
        normal: light.normal,
        radius: light.radius,
    }
}

/// Distance along the unit vector `d` from `o` to the first point of the surface.
pub(super) fn hit(shape: &Shape, o: DVec3, d: DVec3) -> Option<f64> {
    match *shape {
        Shape::Sphere { center, radius } => {
            let f = o - center;
            let b = -f.dot(d);
            let discriminant = radius * radius - (f + d * b).length_squared();
            if discriminant < 0.0 {
                return None;
            }
            // Ray Tracing Gems, chapter 7: no difference of nearly equal numbers.
            let q = b + discriminant.sqrt().copysign(b);
            let other = (f.length_squared() - radius * radius) / q;
            first(q.min(other), q.max(other))
        }
        Shape::Plane { point, normal } => {
            let t = normal.dot(point - o) / normal.dot(d);
            (t > 0.0 && t.is_finite()).then_some(t)
        }
        Shape::Disk {
            center,
            normal,
            radius,
        } => {
            let t = normal.dot(center - o) / normal.dot(d);
            let on_disk = (o + d * t).distance(center) <= radius;
            (t > 0.0 && on_disk).then_some(t)
        }
        Shape::Cylinder { base, top, radius } => {
            let length = base.distance(top);
            let axis = (top - base) / length;
            let (m, n) = (axis.dot(o - base), axis.dot(d));
            // Where the ray is between the caps, and where inside the endless cylinder.
            let (t0, t1) = ((0.0 - m) / n, (length - m) / n);
            let caps = if n == 0.0 {
                (m > 0.0 && m < length).then_some((f64::NEG_INFINITY, f64::INFINITY))?
            } else {
                (t0.min(t1), t0.max(t1))
            };
            let (across, away) = (d - axis * n, o - base - axis * m);
            let a = across.length_squared();
            let side = if a == 0.0 {
                (away.length() < radius).then_some((f64::NEG_INFINITY, f64::INFINITY))?
            } else {
                let middle = -away.dot(across) / a;
                let closest = away + across * middle;
                let half = (radius * radius - closest.length_squared()) / a;
                (half > 0.0).then(|| (middle - half.sqrt(), middle + half.sqrt()))?
            };
            let (enter, leave) = (caps.0.max(side.0), caps.1.min(side.1));
            (enter < leave).then(|| first(enter, leave)).flatten()
        }
        Shape::Implicit(ref implicit) => {
            let inside = implicit.holds(o);
            let start = Start { inside, on: None };
            implicit.meet_roughly(o, d, start).map(|h| h.0)
        }
    }
}

/// The smaller positive one of two distances in order.
fn first(near: f64, far: f64) -> Option<f64> {
    [near, far].into_iter().find(|&t| t > 0.0 && t.is_finite())
}

/// `count` points spread evenly over a disk, none on its rim (a sunflower's, by Vogel).
pub(super) fn points_on_disk(
    center: DVec3,
    normal: DVec3,
    radius: f64,
    count: usize,
) -> impl Iterator<Item = DVec3> {
    let (x, y) = normal.any_orthonormal_pair();
    (0..count).map(move |i| {
        let r = radius * ((i as f64 + 0.5) / count as f64).sqrt();
        let (sin, cos) = (i as f64 * golden_angle()).sin_cos();
        center + (x * cos + y * sin) * r
    })
}

/// `count` directions spread evenly over the sphere.
pub(super) fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        // Half a step on, for none to be level with two axes, where walls never end.
        let (sin, cos) = ((i as f64 + 0.5) * golden_angle()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    })
}

/// The turn that never comes back near where it was: 2π (1 − 1/φ).
fn golden_angle() -> f64 {
    std::f64::consts::PI * (3.0 - 5f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYLINDER: Shape = Shape::Cylinder {
        base: DVec3::new(0.0, 0.0, 0.0),
        top: DVec3::new(0.0, 3.0, 0.0),
        radius: 2.0,
    };

    /// Rounding of a few operations on numbers near 1.
    const ROUNDING: f64 = 1e-12;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < ROUNDING
    }

    #[test]
    fn distances_to_a_cylinder() {
        for (p, d) in [
            (DVec3::new(0.0, 1.5, 0.0), -1.5),
            (DVec3::new(1.5, 1.5, 0.0), -0.5),
            (DVec3::new(5.0, 7.0, 0.0), 5.0),
            (DVec3::new(1.0, -2.0, 0.0), 2.0),
        ] {
            assert!(near(signed_distance(&CYLINDER, p), d), "{p}");
        }
        let far = farthest_on_cylinder(DVec3::ZERO, DVec3::Y * 3.0, 2.0, DVec3::new(1.0, 7.0, 0.0));
        assert!(near(far, 58f64.sqrt()), "{far}");
    }

    #[test]
    fn how_far_shapes_reach() {
        let above = |shape: &Shape, y: f64| reach(shape, DVec3::Y * y, DVec3::Y);
        assert!(near(above(&CYLINDER, 1.0), 2.0));
        assert!(near(reach(&CYLINDER, DVec3::X, DVec3::X), 1.0));
        let ball = Shape::Sphere {
            center: DVec3::ZERO,
            radius: 1.5,
        };
        assert!(near(above(&ball, 2.0), -0.5));
        let tilted = Shape::Disk {
            center: DVec3::Y,
            normal: DVec3::new(0.6, 0.8, 0.0),
            radius: 2.0,
        };
        assert!(near(above(&tilted, 0.0), 2.2));
        let plane = |normal| Shape::Plane {
            point: DVec3::Y,
            normal,
        };
        assert!(near(above(&plane(DVec3::NEG_Y), 4.0), -3.0));
        assert_eq!(above(&plane(DVec3::X), 4.0), f64::INFINITY);
    }

    /// A hit lies on the surface and nothing lies before it, for rays from all over.
    #[test]
    fn hits_are_the_first_points_of_the_surface() {
        let shapes = [
            CYLINDER,
            Shape::Sphere {
                center: DVec3::new(1.0, 0.0, 0.0),
                radius: 1.5,
            },
            Shape::Disk {
                center: DVec3::Y,
                normal: DVec3::new(0.6, 0.8, 0.0),
                radius: 2.0,
            },
            Shape::Plane {
                point: DVec3::Z,
                normal: DVec3::Z,
            },
        ];
        for shape in &shapes {
            let mut hits = 0;
            for (i, d) in directions(400).enumerate() {
                let o = DVec3::new(
                    (i % 7) as f64 - 3.0,
                    (i % 5) as f64 - 1.5,
                    (i % 3) as f64 - 1.0,
                );
                // Steps of 0.01 see every crossing but the shallowest.
                let side = |t: f64| signed_distance(shape, o + d * t);
                if let Some(t) = hit(shape, o, d) {
                    hits += 1;
                    assert!(side(t).abs() < 1e-9, "{shape:?} {o} {d} {t}");
                    let before = (1..)
                        .map(|k| 0.01 * f64::from(k))
                        .take_while(|&s| s < t - 0.01);
                    let same = |s: f64| side(s).signum() == side(1e-9).signum();
                    assert!(before.clone().all(same), "{shape:?} {o} {d} {t}");
                } else {
                    let along = (1..1000).map(|k| 0.01 * f64::from(k));
                    assert!(
                        along
                            .clone()
                            .all(|s| side(s).signum() == side(1e-9).signum()),
                        "{shape:?} {o} {d}"
                    );
                }
            }
            assert!((40..400).contains(&hits), "{hits} hits prove little");
        }
    }
}
