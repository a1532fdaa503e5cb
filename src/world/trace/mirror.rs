//! The perfect mirror.

use glam::DVec3;

/// The direction of a ray after its reflection at a surface with this unit normal.
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - normal * (2.0 * normal.dot(direction))).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_out_is_angle_in() {
        let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        let d = DVec3::new(-0.6, 0.0, -0.8);
        let out = reflect(d, normal);
        assert!((out.dot(normal) + d.dot(normal)).abs() < 1e-15);
        assert!((out.cross(normal) - d.cross(normal)).length() < 1e-15);
    }
}
