//! Solid cylinders. A ray is in the solid where it is both within the side and between the caps, so the rim has no gap.

use super::Ray;
use super::plane;
use glam::DVec3;

/// A ray whose squared sine with the axis is below this does not reach the side in any scene: at 10⁻¹² rad that takes a length
/// of 10¹² radii.
const PARALLEL: f64 = 1e-24;

/// Position of the side in [`Cylinder::faces`].
pub const SIDE: usize = 0;
/// Position of the cap at `base` in [`Cylinder::faces`].
pub const BASE: usize = 1;
/// Position of the cap at the far end in [`Cylinder::faces`].
pub const TOP: usize = 2;

/// A solid cylinder, like [`Geometry::Cylinder`](crate::world::Geometry::Cylinder).
#[derive(Debug, Clone, Copy)]
pub struct Cylinder {
    /// Centre of the base cap.
    pub base: DVec3,
    /// Unit vector from base to top.
    pub axis: DVec3,
    /// axis·p of the cap planes.
    pub offsets: [f64; 2],
    /// Radius.
    pub radius: f64,
    /// Identities of side, base cap, top cap.
    pub faces: [u32; 3],
}

/// A distance along a ray, and the position of the face met there in [`Cylinder::faces`].
pub type Crossing = (f64, usize);

impl Cylinder {
    /// Distance >= 0 from outside, and the face met there.
    ///
    /// A ray that rounding has put just inside meets the cylinder at distance 0 if the way out ahead is longer than the way back.
    pub fn enter(&self, ray: &Ray) -> Option<Crossing> {
        if ray.face == self.faces[SIDE] {
            return None;
        }
        let side = self.side_span(ray)?;
        let [near, far] = self.cap_span(ray)?;
        let enter = if side[0] > near.0 {
            (side[0], SIDE)
        } else {
            near
        };
        let exit = side[1].min(far.0);
        let hits = enter.0 <= exit && enter.0 + exit > 0.0;
        hits.then_some((enter.0.max(0.0), enter.1))
    }

    /// Distance >= 0 from inside, and the face met there.
    pub fn leave(&self, ray: &Ray) -> Crossing {
        let side = self.side_span(ray).map_or(0.0, |s| s[1]);
        // A ray parallel to the caps, which rounding has put beyond one of them, meets the side alone.
        let far = self.cap_span(ray).map_or((f64::INFINITY, TOP), |s| s[1]);
        let (t, face) = if side < far.0 { (side, SIDE) } else { far };
        (t.max(0.0), face)
    }

    /// The part of the ray's line that is within the infinite cylinder.
    fn side_span(&self, ray: &Ray) -> Option<[f64; 2]> {
        let across = |v: DVec3| v - self.axis * self.axis.dot(v);
        let m = across(ray.origin - self.base);
        let d = across(ray.direction);
        let a = d.length_squared();
        let b = m.dot(d);
        let on_it = ray.face == self.faces[SIDE];
        let beyond = m.length() - self.radius;
        if a < PARALLEL {
            let within = on_it || beyond <= 0.0;
            return within.then_some([f64::NEG_INFINITY, f64::INFINITY]);
        }
        if on_it {
            // One root is 0.
            return Some([0.0, (-2.0 * b / a).max(0.0)]);
        }
        let nearest = (m - d * (b / a)).length();
        let discriminant = a * (self.radius + nearest) * (self.radius - nearest);
        if discriminant < 0.0 {
            return None;
        }
        let c = beyond * (m.length() + self.radius);
        let q = -(b + discriminant.sqrt().copysign(b));
        if q == 0.0 {
            return Some([0.0, 0.0]);
        }
        let (t0, t1) = (q / a, c / q);
        Some([t0.min(t1), t0.max(t1)])
    }

    /// The part of the ray's line that is between the planes of the caps.
    fn cap_span(&self, ray: &Ray) -> Option<[Crossing; 2]> {
        let at = |end: usize| {
            plane::distance(self.axis, self.offsets[end], self.faces[BASE + end], ray)
                .map(|t| (t, BASE + end))
        };
        match (at(0), at(1)) {
            (Some(base), Some(top)) if self.axis.dot(ray.direction) > 0.0 => Some([base, top]),
            (Some(base), Some(top)) => Some([top, base]),
            _ => {
                let height = self.axis.dot(ray.origin);
                let between = height > self.offsets[0] && height < self.offsets[1];
                between.then_some([(f64::NEG_INFINITY, BASE), (f64::INFINITY, TOP)])
            }
        }
    }

    /// `p` moved onto the face at position `face`, and the outward unit normal there.
    pub fn project(&self, face: usize, p: DVec3) -> (DVec3, DVec3) {
        match face {
            SIDE => {
                let on_axis = self.base + self.axis * self.axis.dot(p - self.base);
                let normal = (p - on_axis).normalize();
                (on_axis + normal * self.radius, normal)
            }
            BASE => (plane::project(self.axis, self.offsets[0], p), -self.axis),
            _ => (plane::project(self.axis, self.offsets[1], p), self.axis),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::Sampler;
    use crate::world::trace::brute_force::{self, random_direction, random_point};

    fn upright(radius: f64, height: f64) -> Cylinder {
        Cylinder {
            base: DVec3::ZERO,
            axis: DVec3::Y,
            offsets: [0.0, height],
            radius,
            faces: [11, 12, 13],
        }
    }

    fn ray(origin: DVec3, direction: DVec3, face: u32) -> Ray {
        Ray {
            origin,
            direction: direction.normalize(),
            medium: 0,
            face,
        }
    }

    #[test]
    fn random_rays_agree_with_bisection() {
        let axis = DVec3::new(0.5, 1.0, -0.7).normalize();
        let base = DVec3::new(-0.3, -0.4, 0.2);
        let offset = axis.dot(base);
        let solid = Cylinder {
            base,
            axis,
            offsets: [offset, offset + 1.3],
            radius: 0.6,
            faces: [1, 2, 3],
        };
        let f = |p: DVec3| {
            let h = axis.dot(p - base);
            let radial = (p - base - axis * h).length() - 0.6;
            radial.max(-h).max(h - 1.3)
        };
        let mut rng = Sampler::new(5, 0, 0);
        let mut faces = [[0; 3]; 2];
        for _ in 0..5000 {
            let r = ray(
                random_point([(); 3].map(|()| rng.uniform()), 1.5),
                random_direction([rng.uniform(), rng.uniform()]),
                0,
            );
            let found = brute_force::span(&r, f);
            let inside = f(r.origin) < 0.0;
            let (met, expected) = if inside {
                (Some(solid.leave(&r)), found.map(|s| s[1]))
            } else {
                let ahead = found.filter(|s| s[1] > 0.0).map(|s| s[0]);
                (solid.enter(&r), ahead)
            };
            brute_force::assert_same_hit(&r, met.map(|m| m.0), expected);
            if let Some((t, face)) = met {
                let (p, normal) = solid.project(face, r.at(t));
                assert!(p.distance(r.at(t)) < 1e-13 && f(p).abs() < 1e-14);
                assert_eq!(normal.dot(r.direction) > 0.0, inside, "{r:?}");
                faces[usize::from(inside)][face] += 1;
            }
        }
        assert!(faces.as_flattened().iter().all(|&n| n > 20), "{faces:?}");
    }

    #[test]
    fn from_inside_out_through_a_cap() {
        let solid = upright(1.0, 2.0);
        let r = ray(DVec3::new(0.2, 0.5, 0.0), DVec3::new(0.1, 1.0, 0.0), 0);
        let (t, face) = solid.leave(&r);
        assert_eq!(face, TOP);
        assert!((t - 1.5 * 1.01f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn in_through_one_cap_and_out_through_the_other() {
        let solid = upright(1.0, 2.0);
        let r = ray(DVec3::new(0.3, 5.0, 0.2), DVec3::new(-0.1, -1.0, 0.0), 0);
        let (t, face) = solid.enter(&r).unwrap();
        assert_eq!(face, TOP);
        assert!((t - 3.0 * 1.01f64.sqrt()).abs() < 1e-14);
        let on = ray(r.at(t), r.direction, solid.faces[TOP]);
        let (t, face) = solid.leave(&on);
        assert_eq!(face, BASE);
        assert!((t - 2.0 * 1.01f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn along_the_axis_only_the_caps_are_met_and_exactly() {
        let solid = upright(1.0, 2.0);
        for x in [0.0, 0.5, 1.0 - 1e-9] {
            let above = ray(DVec3::new(x, 7.0, 0.0), -DVec3::Y, 0);
            assert_eq!(solid.enter(&above), Some((5.0, TOP)));
            let within = ray(DVec3::new(x, 0.5, 0.0), DVec3::Y, 0);
            assert_eq!(solid.leave(&within), (1.5, TOP));
        }
        let beside = ray(DVec3::new(1.0 + 1e-9, 7.0, 0.0), -DVec3::Y, 0);
        assert_eq!(solid.enter(&beside), None);
    }

    #[test]
    fn a_ray_nearly_along_a_long_tube_meets_it_at_r_over_tan() {
        let solid = upright(1.0, 2e4);
        let slope = 1e-4f64;
        let r = ray(DVec3::ZERO, DVec3::new(slope.sin(), slope.cos(), 0.0), 12);
        let (t, face) = solid.leave(&r);
        assert_eq!(face, SIDE);
        assert!((t * slope.cos() - 1.0 / slope.tan()).abs() < 1e-6, "{t}");
    }

    #[test]
    fn chords_from_the_side_divide_the_known_root_out() {
        let solid = upright(1.0, 100.0);
        let mut rng = Sampler::new(6, 0, 0);
        for _ in 0..10_000 {
            let (s, c) = (7.0 * rng.uniform()).sin_cos();
            let normal = DVec3::new(c, 0.0, s);
            let d = random_direction([rng.uniform(), rng.uniform()]);
            let d = if d.dot(normal) > 0.0 { -d } else { d };
            let r = ray(normal + DVec3::Y * 50.0, d, 11);
            let (t, face) = solid.leave(&r);
            let across = 1.0 - d.y * d.y;
            let expected = -2.0 * d.dot(normal) / across;
            if face == SIDE {
                assert!(
                    (t - expected).abs() < 1e-12 * (1.0 + expected),
                    "{t} {expected}"
                );
            } else {
                assert!((t * d.y.abs() - 50.0).abs() < 1e-12 && t <= expected);
            }
            let out = ray(r.origin, -d, 11);
            assert_eq!(solid.enter(&out), None, "left from outside");
        }
    }

    #[test]
    fn standing_on_a_shared_cap_plane_the_cap_is_at_no_distance() {
        let solid = upright(1.0, 2.0);
        let origin = DVec3::new(0.5, 1e-12, 0.0);
        assert_eq!(
            solid.enter(&ray(origin, DVec3::Y, 12)),
            Some((0.0, BASE)),
            "into the solid"
        );
        assert_eq!(solid.enter(&ray(origin, -DVec3::Y, 12)), None, "away");
        assert_eq!(solid.leave(&ray(origin, -DVec3::Y, 12)), (0.0, BASE));
        assert_eq!(solid.leave(&ray(origin, DVec3::Y, 12)), (2.0 - 1e-12, TOP));
    }

    #[test]
    fn a_ray_just_inside_by_rounding_enters_or_is_free() {
        let solid = upright(1.0, 2.0);
        for (origin, outward, face) in [
            (DVec3::new(1.0 - 1e-15, 1.0, 0.0), DVec3::X, SIDE),
            (DVec3::new(0.3, 2.0 - 1e-15, 0.0), DVec3::Y, TOP),
        ] {
            assert_eq!(solid.enter(&ray(origin, outward, 0)), None);
            assert_eq!(solid.enter(&ray(origin, -outward, 0)), Some((0.0, face)));
        }
    }

    #[test]
    fn rays_across_the_axis_miss_beyond_the_caps() {
        let solid = upright(1.0, 2.0);
        let at = |y: f64| solid.enter(&ray(DVec3::new(-5.0, y, 0.0), DVec3::X, 0));
        assert_eq!(at(1.0), Some((4.0, SIDE)));
        assert_eq!(at(2.5), None);
        assert_eq!(at(-0.5), None);
        let tangent = |z: f64| solid.enter(&ray(DVec3::new(-5.0, 1.0, z), DVec3::X, 0));
        assert!(tangent(1.0 - 1e-9).is_some());
        assert_eq!(tangent(1.0 + 1e-9), None);
    }
}
