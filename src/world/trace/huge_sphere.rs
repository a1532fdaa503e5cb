//! Spheres far larger than the scene, given by the point of the surface nearest the scene, and by the curvature.

use super::Ray;
use glam::DVec3;

/// The points p with k v·v + 2 n·v = 0, where v = p - pole, k = 1/radius, and n is the outward normal at the pole. No number in
/// this equation is larger than the scene.
#[derive(Debug, Clone, Copy)]
pub struct HugeSphere {
    /// The point of the surface nearest the scene.
    pub pole: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// Radius.
    pub radius: f64,
}

impl HugeSphere {
    /// Like [`sphere::enter`](super::sphere::enter).
    pub fn enter(&self, ray: &Ray) -> Option<f64> {
        let (b, c) = self.coefficients(ray);
        let discriminant = b * b - c / self.radius;
        if b >= 0.0 || discriminant < 0.0 {
            return None;
        }
        Some((c / (-b + discriminant.sqrt())).max(0.0))
    }

    /// Like [`sphere::leave`](super::sphere::leave).
    pub fn leave(&self, on_it: bool, ray: &Ray) -> f64 {
        let (b, c) = self.coefficients(ray);
        if on_it {
            return (-2.0 * b * self.radius).max(0.0);
        }
        let root = (b * b - c / self.radius).max(0.0).sqrt();
        let t = if b <= 0.0 {
            (-b + root) * self.radius
        } else {
            -c / (b + root)
        };
        t.max(0.0)
    }

    /// B and C of k t² + 2 B t + C = 0.
    fn coefficients(&self, ray: &Ray) -> (f64, f64) {
        let v = ray.origin - self.pole;
        (
            v.dot(ray.direction) / self.radius + self.normal.dot(ray.direction),
            v.length_squared() / self.radius + 2.0 * self.normal.dot(v),
        )
    }

    /// Like [`sphere::project`](super::sphere::project), by one Newton step along the gradient, whose length is 1 on the surface.
    pub fn project(&self, p: DVec3) -> (DVec3, DVec3) {
        let v = p - self.pole;
        let gradient = self.normal + v / self.radius;
        let height = (v.length_squared() / self.radius + 2.0 * self.normal.dot(v)) / 2.0;
        (p - gradient * height, gradient.normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::Sampler;
    use crate::world::trace::brute_force::{random_direction, random_point};
    use crate::world::trace::sphere;

    fn ray(origin: DVec3, direction: DVec3) -> Ray {
        Ray {
            origin,
            direction: direction.normalize(),
            medium: 0,
            face: 0,
        }
    }

    #[test]
    fn the_huge_form_agrees_with_the_ordinary_one() {
        let normal = DVec3::new(0.2, 1.0, -0.3).normalize();
        let radius = 1e5;
        let huge = HugeSphere {
            pole: DVec3::new(0.1, -1.0, 0.4),
            normal,
            radius,
        };
        let center = huge.pole - normal * radius;
        let mut rng = Sampler::new(4, 0, 0);
        for _ in 0..2000 {
            let r = ray(
                random_point([(); 3].map(|()| rng.uniform()), 3.0),
                random_direction([rng.uniform(), rng.uniform()]),
            );
            // One ulp of the ordinary form's numbers, 1e5, is 1.5e-11; glancing rays magnify it.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-7 * (1.0 + a.abs());
            if r.origin.distance(center) > radius {
                match (huge.enter(&r), sphere::enter(center, radius, &r)) {
                    (Some(a), Some(b)) => {
                        assert!(close(a, b), "{a} {b}");
                        let (p, n) = huge.project(r.at(a));
                        assert!((p.distance(center) - radius).abs() < 1e-10);
                        assert!((n - (p - center) / radius).length() < 1e-12);
                    }
                    (a, b) => assert_eq!(a, b),
                }
            } else {
                let (a, b) = (
                    huge.leave(false, &r),
                    sphere::leave(center, radius, false, &r),
                );
                assert!(close(a, b), "{a} {b}");
                let (p, _) = huge.project(r.at(huge.leave(false, &r)));
                let back = Ray {
                    origin: p,
                    direction: -r.direction,
                    ..r
                };
                let through = huge.leave(true, &back);
                assert!(close(
                    huge.leave(
                        false,
                        &Ray {
                            origin: p - r.direction * 1e-3,
                            ..back
                        }
                    ),
                    through - 1e-3
                ));
            }
        }
    }

    #[test]
    fn a_sphere_of_infinite_radius_is_a_plane() {
        let plane = HugeSphere {
            pole: DVec3::ZERO,
            normal: DVec3::Y,
            radius: f64::INFINITY,
        };
        let r = ray(DVec3::new(0.0, 3.0, 0.0), DVec3::new(3.0, -4.0, 0.0));
        assert!((plane.enter(&r).unwrap() - 3.75).abs() < 1e-15);
    }
}
