//! Flat disks, among them lights.

use super::Ray;
use super::plane;
use glam::DVec3;

/// Distance > 0 to the disk, from either side; `None` for a ray that starts in its plane.
pub fn intersect(
    center: DVec3,
    normal: DVec3,
    offset: f64,
    radius: f64,
    face: u32,
    ray: &Ray,
) -> Option<f64> {
    // The distance is 0 for a ray that starts in the plane.
    let t = plane::distance(normal, offset, face, ray)?;
    let hits = t > 0.0 && ray.at(t).distance_squared(center) <= radius * radius;
    hits.then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(origin: DVec3, direction: DVec3, face: u32) -> Option<f64> {
        let ray = Ray {
            origin,
            direction: direction.normalize(),
            medium: 0,
            face,
        };
        intersect(DVec3::new(1.0, 2.0, 0.0), DVec3::Y, 2.0, 0.5, 9, &ray)
    }

    #[test]
    fn a_disk_is_met_from_both_sides_within_its_radius() {
        let above = DVec3::new(1.4, 5.0, 0.0);
        assert_eq!(hit(above, -DVec3::Y, 0), Some(3.0));
        assert_eq!(hit(DVec3::new(1.0, 0.0, -0.49), DVec3::Y, 0), Some(2.0));
        assert_eq!(hit(DVec3::new(1.51, 5.0, 0.0), -DVec3::Y, 0), None);
        assert_eq!(hit(above, DVec3::Y, 0), None, "behind the origin");
    }

    #[test]
    fn rays_in_its_plane_or_starting_on_it_miss() {
        assert_eq!(hit(DVec3::new(-5.0, 2.0, 0.0), DVec3::X, 0), None);
        assert_eq!(hit(DVec3::new(1.0, 2.0 + 1e-12, 0.1), -DVec3::Y, 9), None);
    }

    #[test]
    fn slanted_rays_hit_where_the_plane_equation_says() {
        // 45 degrees, aimed at points left and right of the rim.
        for (x, expected) in [(1.499_999, true), (1.500_001, false)] {
            let target = DVec3::new(x, 2.0, 0.0);
            let d = DVec3::new(1.0, -1.0, 0.0);
            let t = hit(target - d * 4.0, d, 0);
            assert_eq!(t.is_some(), expected, "{x}: {t:?}");
            if let Some(t) = t {
                assert!((t - 4.0 * 2f64.sqrt()).abs() < 1e-14);
            }
        }
    }
}
