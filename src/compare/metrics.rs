//! Distances between two pictures, noise included.

use super::flip;
use super::picture::Side;
use crate::stats::luminance;

/// Distances over all pixels that were rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct Metrics {
    /// √ mean squared difference of R, G and B, in units of radiance.
    pub rmse: f64,
    /// Mean of ΔY² / (Y² + (0.1 Ȳ)²): Y the luminance of A, Ȳ its mean; the weights of the
    /// [relative error](crate::film::Film::relative_error).
    pub relative_mse: f64,
    /// Peak signal-to-noise ratio in dB, of the pictures as a PNG would show them; infinite for equal ones.
    pub psnr: f64,
    /// Mean of `flip_map`.
    pub flip: f64,
    /// [FLIP](flip) of each pixel of the pictures as a PNG would show them.
    pub flip_map: Vec<f32>,
    /// Mean radiance of A and B.
    pub means: [[f64; 3]; 2],
}

impl Metrics {
    /// Both pictures have the same size and are covered in the same pixels.
    pub(super) fn new(a: &Side, b: &Side) -> Self {
        let pairs = || {
            let pixels = a.rgb.iter().zip(&b.rgb).zip(&a.covered);
            pixels.filter(|(_, covered)| **covered).map(|(p, _)| p)
        };
        let n = pairs().count() as f64;
        let mean = |f: &dyn Fn(&[f64; 3], &[f64; 3]) -> f64| {
            pairs().map(|(p, q)| f(p, q)).sum::<f64>() / n
        };
        let squares = |p: &[f64; 3], q: &[f64; 3]| {
            p.iter().zip(q).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / 3.0
        };
        let floor = (0.1 * mean(&|p, _| luminance(*p))).powi(2);
        let relative = |p: &[f64; 3], q: &[f64; 3]| {
            let difference = luminance(*p) - luminance(*q);
            if difference == 0.0 {
                0.0
            } else {
                difference.powi(2) / (luminance(*p).powi(2) + floor)
            }
        };
        let shown = |p: &[f64; 3]| p.map(flip::encode_srgb);
        let flip_map = flip::flip(a.size, &a.rgb, &b.rgb, flip::PIXELS_PER_DEGREE);
        let covered = flip_map.iter().zip(&a.covered).filter(|(_, c)| **c);
        Self {
            rmse: mean(&squares).sqrt(),
            relative_mse: mean(&relative),
            psnr: -10.0 * mean(&|p, q| squares(&shown(p), &shown(q))).log10(),
            flip: covered.map(|(f, _)| f64::from(*f)).sum::<f64>() / n,
            flip_map,
            means: [
                [0, 1, 2].map(|c| mean(&|p, _| p[c])),
                [0, 1, 2].map(|c| mean(&|_, q| q[c])),
            ],
        }
    }

    /// √ of [`Metrics::relative_mse`].
    pub fn relative_rmse(&self) -> f64 {
        self.relative_mse.sqrt()
    }
}
