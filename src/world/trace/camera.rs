//! The pinhole camera.

use super::Ray;
use crate::world::WorldCamera;

/// The ray through the point (`x`, `y`) of the film, in pixels from the top left corner of a picture of `size`.
pub fn camera_ray(camera: &WorldCamera, size: [u32; 2], x: f64, y: f64) -> Ray {
    let right = x - f64::from(size[0]) / 2.0;
    let down = y - f64::from(size[1]) / 2.0;
    Ray {
        origin: camera.eye,
        direction: (camera.forward + right * camera.dx + down * camera.dy).normalize(),
        medium: camera.medium,
        face: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::AIR;
    use glam::DVec3;

    #[test]
    fn corners_of_the_picture_have_the_field_of_view() {
        // 40 x 20 pixels, vertical field of view 90 degrees: the top edge lies at 45 degrees.
        let camera = WorldCamera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            forward: -DVec3::Z,
            dx: DVec3::X * 0.1,
            dy: -DVec3::Y * 0.1,
            medium: AIR,
        };
        let top_left = camera_ray(&camera, [40, 20], 0.0, 0.0);
        assert!(
            (top_left.direction - DVec3::new(-2.0, 1.0, -1.0).normalize()).length() < 1e-15,
            "{top_left:?}"
        );
        let centre = camera_ray(&camera, [40, 20], 20.0, 10.0);
        assert_eq!(centre.direction, -DVec3::Z);
        assert_eq!(centre.origin, camera.eye);
    }
}
