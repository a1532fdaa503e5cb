//! Orthonormal frames around a direction.

use glam::DVec3;
use std::f64::consts::PI;

/// A right-handed orthonormal frame; `z` is the direction that it was made around.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Frame {
    /// A frame around the unit vector `z` (Duff et al., JCGT 2017).
    pub fn around(z: DVec3) -> Self {
        let sign = 1f64.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: DVec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The world vector with these local coordinates.
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The local coordinates of a world vector.
    #[cfg(test)]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }
}

/// The unit vector at polar angle acos(`cosine`), whose sine is `sine`, and azimuth 2π `turn`, about
/// `axis`.
pub fn direction_about(axis: DVec3, cosine: f64, sine: f64, turn: f64) -> DVec3 {
    let (sin_phi, cos_phi) = (2.0 * PI * turn).sin_cos();
    let local = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
    Frame::around(axis).to_world(local).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed_in_every_direction() {
        let mut directions = vec![DVec3::Z, -DVec3::Z, DVec3::X, -DVec3::Y];
        directions.push(DVec3::new(1e-9, -1e-9, -1.0).normalize());
        directions.push(DVec3::new(1e-9, 1e-9, -0.0).normalize());
        directions.push(DVec3::new(3.0, -4.0, 12.0) / 13.0);
        for z in directions {
            let f = Frame::around(z);
            assert!((f.x.cross(f.y) - f.z).length() < 1e-15, "{z}");
            assert!((f.x.length() - 1.0).abs() < 1e-15, "{z}");
            assert!((f.y.length() - 1.0).abs() < 1e-15, "{z}");
            assert!(f.x.dot(f.y).abs() < 1e-15, "{z}");
            assert!((f.to_world(DVec3::Z) - z).length() < 1e-15, "{z}");
        }
    }
}
