//! The modified Phong model (Lafortune & Willems 1994): f = kd/π + ks (n+2)/(2π) cosⁿα, where α is the angle between the mirror
//! direction of one ray and the other ray. The lobe is zero where cos α <= 0, even for n = 0.

use super::diffuse;
use super::frame::direction_about;
use crate::world::trace::mirror::reflect;
use glam::DVec3;
use std::f64::consts::PI;

/// The model's parameters.
#[derive(Debug, Clone, Copy)]
pub struct Phong {
    /// kd.
    pub diffuse: DVec3,
    /// ks.
    pub specular: DVec3,
    /// n >= 0.
    pub exponent: f64,
}

impl Phong {
    /// f, per steradian, from the direction `wi` into `wo`, which both point away from the surface; 0 below the surface.
    pub fn evaluate(&self, normal: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
        if normal.dot(wi) <= 0.0 {
            return DVec3::ZERO;
        }
        self.f(self.lobe(reflect(-wo, normal).dot(wi)))
    }

    /// Density per solid angle of [`Phong::sample`].
    pub fn pdf(&self, normal: DVec3, wo: DVec3, wi: DVec3) -> f64 {
        if normal.dot(wi) <= 0.0 {
            return 0.0;
        }
        self.mixture(
            diffuse::pdf(normal, wi),
            self.lobe(reflect(-wo, normal).dot(wi)),
        )
    }

    /// A direction, its weight f cos θ/pdf, and its density per solid angle. `None` for a black surface, and when a sample of the lobe
    /// falls below the surface: the sample then counts as zero.
    pub fn sample(&self, normal: DVec3, wo: DVec3, u: [f64; 3]) -> Option<(DVec3, DVec3, f64)> {
        let mirror = reflect(-wo, normal);
        let p = self.lobe_probability();
        let (wi, power) = if u[0] < p {
            // 1 - u is in (0, 1], and cos α = (1-u)^(1/(n+1)). Its logarithm gives cos α and cosⁿα by one `exp` each.
            let ln = (1.0 - u[1]).ln() / (self.exponent + 1.0);
            let sine = (-(2.0 * ln).exp_m1()).max(0.0).sqrt();
            let wi = direction_about(mirror, ln.exp(), sine, u[2]);
            (wi, (self.exponent * ln).exp())
        } else {
            let wi = diffuse::sample(normal, [u[1], u[2]]);
            (wi, self.lobe(mirror.dot(wi)))
        };
        let cosine = normal.dot(wi);
        let pdf = self.mixture(diffuse::pdf(normal, wi), power);
        (cosine > 0.0 && pdf > 0.0).then(|| (wi, self.f(power) * cosine / pdf, pdf))
    }

    /// cosⁿα, or 0 where cos α <= 0.
    fn lobe(&self, cos_alpha: f64) -> f64 {
        if cos_alpha > 0.0 {
            cos_alpha.min(1.0).powf(self.exponent)
        } else {
            0.0
        }
    }

    fn f(&self, power: f64) -> DVec3 {
        self.diffuse / PI + self.specular * ((self.exponent + 2.0) / (2.0 * PI) * power)
    }

    fn mixture(&self, cosine_pdf: f64, power: f64) -> f64 {
        let p = self.lobe_probability();
        (1.0 - p) * cosine_pdf + p * (self.exponent + 1.0) / (2.0 * PI) * power
    }

    /// Probability that [`Phong::sample`] chooses the lobe; 0 for a black surface.
    fn lobe_probability(&self) -> f64 {
        let (d, s) = (self.diffuse.element_sum(), self.specular.element_sum());
        if s > 0.0 { s / (d + s) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::chi_square::{assert_density, mean_and_error};
    use crate::reference::sampler::Sampler;
    use crate::world::trace::brute_force::random_direction;
    use std::f64::consts::FRAC_1_PI;

    fn gloss(kd: f64, ks: f64, exponent: f64) -> Phong {
        Phong {
            diffuse: DVec3::splat(kd),
            specular: DVec3::splat(ks),
            exponent,
        }
    }

    fn at_angle(degrees: f64) -> DVec3 {
        let (s, c) = degrees.to_radians().sin_cos();
        DVec3::new(s, 0.0, c)
    }

    #[test]
    fn both_mixtures_and_the_lobe_alone_have_the_density_stated() {
        for (kd, ks, n) in [
            (0.3, 0.4, 0.0),
            (0.5, 0.2, 5.0),
            (0.0, 0.9, 1.0),
            (0.1, 0.8, 40.0),
        ] {
            let material = gloss(kd, ks, n);
            for degrees in [0.0, 50.0, 85.0] {
                let wo = at_angle(degrees);
                let mut rng = Sampler::new(1, 0, 0);
                assert_density(
                    &format!("kd {kd}, ks {ks}, n {n} at {degrees} degrees"),
                    DVec3::Z,
                    200_000,
                    || {
                        let u = [rng.uniform(), rng.uniform(), rng.uniform()];
                        material.sample(DVec3::Z, wo, u).map(|s| s.0)
                    },
                    |d| material.pdf(DVec3::Z, wo, d),
                );
            }
        }
    }

    #[test]
    fn sampled_weights_and_densities_are_those_evaluated() {
        let normal = DVec3::new(0.6, 0.0, 0.8);
        for n in [0.0, 1.0, 60.0, 1e5] {
            let material = gloss(0.3, 0.6, n);
            let mut rng = Sampler::new(4, 0, 0);
            let wo = (normal + 0.9 * random_direction([rng.uniform(), rng.uniform()])).normalize();
            for _ in 0..500 {
                let u = [rng.uniform(), rng.uniform(), rng.uniform()];
                let Some((wi, weight, pdf)) = material.sample(normal, wo, u) else {
                    continue;
                };
                let expected = material.pdf(normal, wo, wi);
                // cos α has 16 digits, and its nth power loses as many digits as n has.
                let tolerance = 1e-13 * (10.0 + n);
                assert!(
                    (pdf / expected - 1.0).abs() < tolerance,
                    "{n}: {pdf} {expected}"
                );
                let f = material.evaluate(normal, wo, wi) * normal.dot(wi) / expected;
                assert!((weight - f).length() < tolerance, "{n}: {weight} {f}");
            }
        }
    }

    #[test]
    fn reciprocity() {
        let normal = DVec3::new(0.0, 0.6, 0.8);
        let mut rng = Sampler::new(2, 0, 0);
        for n in [0.0, 1.0, 10.0, 50.0, 1000.0, 1e5] {
            let material = gloss(0.2, 0.7, n);
            for _ in 0..1000 {
                let wo =
                    (normal + 0.999 * random_direction([rng.uniform(), rng.uniform()])).normalize();
                let near = 3.0 / (1.0 + n).sqrt() * rng.uniform();
                let wi = (reflect(-wo, normal)
                    + near * random_direction([rng.uniform(), rng.uniform()]))
                .normalize();
                if normal.dot(wi) <= 0.0 {
                    continue;
                }
                let (there, back) = (
                    material.evaluate(normal, wo, wi).x,
                    material.evaluate(normal, wi, wo).x,
                );
                assert!(
                    (there / back - 1.0).abs() < 1e-13 * (10.0 + n),
                    "{n}: {there} {back}"
                );
            }
        }
    }

    #[test]
    fn albedo_in_a_white_furnace() {
        // Each row: the exponent, and the albedo at 0, 30, 60, 85 and 90 degrees for ks = 1, from quadrature.
        let table = [
            (1.0, [1.0, 0.88084, 0.60900, 0.36310, FRAC_1_PI]),
            (10.0, [1.0, 0.86603, 0.50474, 0.17127, 0.12305]),
            (50.0, [1.0, 0.86603, 0.50000, 0.11006, 0.05614]),
            (1000.0, [1.0, 0.86603, 0.50000, 0.08718, 0.01261]),
        ];
        for (n, row) in table {
            for (degrees, expected) in [0.0, 30.0, 60.0, 85.0, 90.0].into_iter().zip(row) {
                check_albedo(n, degrees, expected);
            }
        }
        check_albedo(0.0, 90.0, 0.5);
        check_albedo(1e5, 0.0, 1.0);
    }

    fn check_albedo(n: f64, degrees: f64, expected: f64) {
        let material = gloss(0.0, 1.0, n);
        let mut rng = Sampler::new(3, 0, 0);
        let (mean, error) = mean_and_error(100_000, || {
            let u = [rng.uniform(), rng.uniform(), rng.uniform()];
            let sample = material.sample(DVec3::Z, at_angle(degrees), u);
            sample.map_or(0.0, |s| s.1.x)
        });
        // Four standard errors, and half a unit of the table's last digit.
        assert!(
            (mean - expected).abs() < 4.0 * error + 5.1e-6,
            "n {n} at {degrees} degrees: {mean} ± {error}, expected {expected}"
        );
    }

    #[test]
    fn the_lobe_ends_at_a_right_angle_and_at_the_surface() {
        let material = gloss(0.0, 1.0, 0.0);
        let wo = at_angle(60.0);
        assert!(material.evaluate(DVec3::Z, wo, at_angle(-60.0)).x > 0.0);
        assert_eq!(material.evaluate(DVec3::Z, wo, at_angle(31.0)).x, 0.0);
        assert_eq!(material.evaluate(DVec3::Z, wo, at_angle(-91.0)).x, 0.0);
        assert_eq!(material.pdf(DVec3::Z, wo, at_angle(31.0)), 0.0);
    }

    #[test]
    fn end_points_of_the_sampler_are_finite_or_no_sample() {
        let ends = [
            0.0,
            (-24f64).exp2(),
            1.0 - (-24f64).exp2(),
            1.0 - (-53f64).exp2(),
        ];
        let wo = at_angle(20.0);
        let check = |material: Phong, u: [f64; 3]| {
            if let Some((d, weight, pdf)) = material.sample(DVec3::Z, wo, u) {
                assert!(d.is_finite() && weight.is_finite(), "{material:?} {u:?}");
                assert!(pdf.is_finite() && pdf > 0.0, "{material:?} {u:?}");
            }
        };
        for n in [0.0, 1.0, 1e5, 1e12] {
            for (u, v) in ends.into_iter().flat_map(|u| ends.map(|v| (u, v))) {
                for w in ends {
                    check(gloss(0.0, 1.0, n), [u, v, w]);
                    check(gloss(0.5, 0.5, n), [u, v, w]);
                }
            }
        }
        let black = gloss(0.0, 0.0, 5.0).sample(DVec3::Z, wo, [0.5; 3]);
        assert!(black.is_none_or(|s| s.1 == DVec3::ZERO), "{black:?}");
    }
}
