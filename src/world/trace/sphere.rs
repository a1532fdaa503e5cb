//! Spheres of ordinary size (Haines, Günther & Akenine-Möller, Ray Tracing Gems ch. 7).

use super::Ray;
use glam::DVec3;

/// Distance >= 0 to the sphere from outside.
///
/// A ray that rounding has put just inside meets the sphere at distance 0 if it goes inwards, and not at all if it goes outwards.
pub fn enter(center: DVec3, radius: f64, ray: &Ray) -> Option<f64> {
    let f = ray.origin - center;
    let b = -f.dot(ray.direction);
    let discriminant = discriminant(f, b, radius, ray.direction);
    if b <= 0.0 || discriminant < 0.0 {
        return None;
    }
    let c = (f.length() - radius) * (f.length() + radius);
    Some((c / (b + discriminant.sqrt())).max(0.0))
}

/// Distance >= 0 to the sphere from inside. If the ray starts on the sphere (`on_it`), one root is 0, and the other needs no
/// square root.
pub fn leave(center: DVec3, radius: f64, on_it: bool, ray: &Ray) -> f64 {
    let f = ray.origin - center;
    let b = -f.dot(ray.direction);
    if on_it {
        return (2.0 * b).max(0.0);
    }
    let root = discriminant(f, b, radius, ray.direction).max(0.0).sqrt();
    let t = if b >= 0.0 {
        b + root
    } else {
        let c = (f.length() - radius) * (f.length() + radius);
        c / (b - root)
    };
    t.max(0.0)
}

/// r² minus the squared distance from the centre to the line of the ray.
fn discriminant(f: DVec3, b: f64, radius: f64, direction: DVec3) -> f64 {
    let nearest = f + b * direction;
    radius * radius - nearest.length_squared()
}

/// `p` moved onto the sphere, and the outward unit normal there.
pub fn project(center: DVec3, radius: f64, p: DVec3) -> (DVec3, DVec3) {
    let normal = (p - center).normalize();
    (center + normal * radius, normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::Sampler;
    use crate::world::trace::brute_force::{self, random_direction, random_point};

    fn ray(origin: DVec3, direction: DVec3) -> Ray {
        Ray {
            origin,
            direction: direction.normalize(),
            medium: 0,
            face: 0,
        }
    }

    #[test]
    fn random_rays_agree_with_bisection() {
        let mut rng = Sampler::new(1, 0, 0);
        let (center, radius) = (DVec3::new(0.3, -0.2, 0.5), 0.8);
        let (mut outside, mut inside) = (0, 0);
        for _ in 0..3000 {
            let r = ray(
                random_point([(); 3].map(|()| rng.uniform()), 2.0),
                random_direction([rng.uniform(), rng.uniform()]),
            );
            let found = brute_force::span(&r, |p| p.distance(center) - radius);
            if r.origin.distance(center) > radius {
                let expected = found.filter(|s| s[1] > 0.0).map(|s| s[0]);
                brute_force::assert_same_hit(&r, enter(center, radius, &r), expected);
                outside += u32::from(expected.is_some());
            } else {
                let expected = found.map(|s| s[1]);
                brute_force::assert_same_hit(&r, Some(leave(center, radius, false, &r)), expected);
                inside += 1;
            }
        }
        assert!(outside > 50 && inside > 50, "{outside} {inside}");
    }

    #[test]
    fn chords_from_the_surface_are_2_cos_theta_long() {
        let (center, radius) = (DVec3::new(100.0, 100.0, 100.0), 1.0);
        let mut rng = Sampler::new(2, 0, 0);
        for k in 0..100_000 {
            let normal = random_direction([rng.uniform(), rng.uniform()]);
            let d = random_direction([rng.uniform(), rng.uniform()]);
            // Every other chord is glancing.
            let d = if k % 2 == 0 {
                d
            } else {
                (d - normal * d.dot(normal) * (1.0 - 1e-6)).normalize()
            };
            let d = if d.dot(normal) > 0.0 { -d } else { d };
            let r = ray(center + normal * radius, d);
            let t = leave(center, radius, true, &r);
            assert!((t + 2.0 * d.dot(normal)).abs() < 1e-13, "{t}");
        }
    }

    #[test]
    fn a_unit_sphere_far_away_is_hit_to_one_part_in_ten_million() {
        let mut rng = Sampler::new(3, 0, 0);
        for _ in 0..1000 {
            let to = random_direction([rng.uniform(), rng.uniform()]);
            let center = to * 1e4;
            let across = to
                .cross(random_direction([rng.uniform(), rng.uniform()]))
                .normalize();
            let miss = rng.uniform();
            // Aimed at a point at distance `miss` from the centre, across the line of sight.
            let r = ray(DVec3::ZERO, center + across * miss);
            let angle = (miss / 1e4).atan();
            let expected = 1e4 * angle.cos() - (1.0 - (1e4 * angle.sin()).powi(2)).sqrt();
            let t = enter(center, 1.0, &r).unwrap();
            assert!(
                (t - expected).abs() < 1e-7 / (1.0 - miss).sqrt(),
                "{miss}: {t} {expected}"
            );
        }
    }

    #[test]
    fn tangent_rays_hit_or_miss_in_order() {
        let mut hits = Vec::new();
        for k in -8..=8 {
            let miss = 1.0 - f64::from(k) * (-20f64).exp2();
            let r = ray(DVec3::new(-3.0, miss, 0.0), DVec3::X);
            let t = enter(DVec3::ZERO, 1.0, &r);
            assert!(t.is_none_or(f64::is_finite));
            hits.push(t.is_some());
        }
        let first = hits.iter().position(|&h| h).unwrap();
        assert_eq!(first, 8, "the tangent itself is a hit: {hits:?}");
        assert!(hits[first..].iter().all(|&h| h), "{hits:?}");
    }

    #[test]
    fn a_ray_just_inside_by_rounding_enters_or_is_free() {
        let origin = DVec3::new(1.0 - 1e-16, 0.0, 0.0);
        assert_eq!(enter(DVec3::ZERO, 1.0, &ray(origin, -DVec3::X)), Some(0.0));
        assert_eq!(enter(DVec3::ZERO, 1.0, &ray(origin, DVec3::X)), None);
    }
}
