//! Lambert's reflection, f = reflectance/π.

use super::frame::direction_about;
use glam::DVec3;
use std::f64::consts::PI;

/// f, per steradian; 0 below the surface.
pub fn evaluate(reflectance: DVec3, normal: DVec3, wi: DVec3) -> DVec3 {
    if normal.dot(wi) > 0.0 {
        reflectance / PI
    } else {
        DVec3::ZERO
    }
}

/// Density per solid angle of [`sample`].
pub fn pdf(normal: DVec3, wi: DVec3) -> f64 {
    normal.dot(wi).max(0.0) / PI
}

/// A cosine-distributed direction about `normal`. Its weight f cos θ/pdf is the reflectance.
pub fn sample(normal: DVec3, u: [f64; 2]) -> DVec3 {
    direction_about(normal, (1.0 - u[0]).sqrt(), u[0].sqrt(), u[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::chi_square::assert_density;
    use crate::reference::sampler::Sampler;

    #[test]
    fn directions_have_the_density_stated() {
        let normal = DVec3::new(0.6, -0.48, 0.64);
        let mut rng = Sampler::new(1, 0, 0);
        assert_density(
            "cosine",
            normal,
            400_000,
            || Some(sample(normal, [rng.uniform(), rng.uniform()])),
            |d| pdf(normal, d),
        );
    }

    #[test]
    fn f_cosine_over_pdf_is_the_reflectance() {
        let reflectance = DVec3::new(0.2, 0.5, 1.0);
        let mut rng = Sampler::new(1, 0, 0);
        for _ in 0..100 {
            let d = sample(DVec3::Y, [rng.uniform(), rng.uniform()]);
            let weight = evaluate(reflectance, DVec3::Y, d) * d.y / pdf(DVec3::Y, d);
            assert!((weight - reflectance).length() < 1e-14);
        }
        assert_eq!(evaluate(reflectance, DVec3::Y, -DVec3::Y), DVec3::ZERO);
    }

    #[test]
    fn end_points_lie_above_the_surface() {
        for u in [0.0, 1.0 - (-24f64).exp2(), 1.0 - (-53f64).exp2()] {
            for v in [0.0, 1.0 - (-53f64).exp2()] {
                let d = sample(DVec3::Y, [u, v]);
                assert!(d.is_finite() && pdf(DVec3::Y, d) > 0.0, "{u} {v}: {d}");
            }
        }
    }
}
