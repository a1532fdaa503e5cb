//! Planes n·p = offset: infinite planes, and the planes of disks, lights and caps.

use super::Ray;
use glam::DVec3;

/// Distance along `ray`, of either sign, to the plane of face `face`. It is exactly 0 for a ray that starts on that face, and
/// `None` for a ray parallel to the plane.
///
/// All flat faces use this formula, so faces with the same equation are met at the same distance, to the last bit.
pub fn distance(normal: DVec3, offset: f64, face: u32, ray: &Ray) -> Option<f64> {
    let along = normal.dot(ray.direction);
    if along == 0.0 {
        None
    } else if ray.face == face {
        Some(0.0)
    } else {
        Some((offset - normal.dot(ray.origin)) / along)
    }
}

/// Distance >= 0 to the plane for a ray in front of it, or behind it if `inside`; `None` unless the ray goes towards the plane.
/// A ray that rounding has put on the wrong side meets the plane at distance 0.
pub fn intersect(normal: DVec3, offset: f64, face: u32, inside: bool, ray: &Ray) -> Option<f64> {
    let along = normal.dot(ray.direction);
    let towards = if inside { along > 0.0 } else { along < 0.0 };
    if !towards {
        return None;
    }
    distance(normal, offset, face, ray).map(|t| t.max(0.0))
}

/// `p` moved onto the plane.
pub fn project(normal: DVec3, offset: f64, p: DVec3) -> DVec3 {
    p - normal * (normal.dot(p) - offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: DVec3, direction: DVec3, face: u32) -> Ray {
        Ray {
            origin,
            direction: direction.normalize(),
            medium: 0,
            face,
        }
    }

    #[test]
    fn a_floor_is_met_from_above_going_down_only() {
        let down = ray(DVec3::new(5.0, 3.0, 0.0), DVec3::new(3.0, -4.0, 0.0), 0);
        let t = intersect(DVec3::Y, 1.0, 7, false, &down).unwrap();
        assert!((t - 2.5).abs() < 1e-15, "{t}");
        let up = ray(DVec3::ZERO, DVec3::Y, 0);
        assert_eq!(intersect(DVec3::Y, 1.0, 7, false, &up), None);
        assert_eq!(intersect(DVec3::Y, 1.0, 7, true, &up), Some(1.0));
    }

    #[test]
    fn a_parallel_ray_meets_nothing_even_in_the_plane() {
        for y in [0.5, 1.0, 2.0] {
            let along = ray(DVec3::new(0.0, y, 0.0), DVec3::X, 0);
            assert_eq!(distance(DVec3::Y, 1.0, 7, &along), None);
            assert_eq!(intersect(DVec3::Y, 1.0, 7, false, &along), None);
        }
    }

    #[test]
    fn a_ray_rounded_below_the_floor_or_starting_on_it_meets_it_at_distance_0() {
        let below = ray(DVec3::new(0.0, 1.0 - 1e-15, 0.0), -DVec3::Y, 0);
        assert_eq!(intersect(DVec3::Y, 1.0, 7, false, &below), Some(0.0));
        let on = ray(
            DVec3::new(0.0, 1.0 + 1e-9, 0.0),
            DVec3::new(1.0, -1e-3, 0.0),
            7,
        );
        assert_eq!(intersect(DVec3::Y, 1.0, 7, false, &on), Some(0.0));
    }

    #[test]
    fn the_turned_plane_is_met_at_the_same_bits() {
        let n = DVec3::new(0.3, -0.7, 0.2).normalize();
        for k in 0..100 {
            let k = f64::from(k);
            let r = ray(
                DVec3::new(k.sin(), 2.0 * k.cos(), 0.1 * k),
                DVec3::new(k.cos(), (3.0 * k).sin(), 0.4),
                0,
            );
            assert_eq!(distance(n, 0.37, 1, &r), distance(-n, -0.37, 2, &r));
        }
    }
}
