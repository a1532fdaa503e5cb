//! What other renderers state of their noise: the variance of the luminance over the samples of a pixel.
//!
//! Mitsuba's integrator `moment` writes the means of X, Y and Z of what it holds, and the means of their squares, `m2_`. pbrt-v4's
//! film `gbuffer` writes the variances of what its sensor measures: X, Y and Z too, by default, though the layers are called
//! `Variance.R`, `.G` and `.B`. Neither tells how channels vary together, so the noise of R, G and B is not known from them.

/// The spread of the luminance over the samples of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    /// The variance, row by row, at least 0.
    variance: Vec<f64>,
    /// Whether its divisor is one less than the number of samples.
    unbiased: bool,
}

impl Moments {
    /// From variances with a divisor of one less than the number of samples.
    pub(super) fn from_variance(variance: &[f32]) -> Self {
        let variance = variance.iter().map(|v| f64::from(*v).max(0.0)).collect();
        Self {
            variance,
            unbiased: true,
        }
    }

    /// From means and means of squares.
    pub(super) fn from_means(mean: &[f32], square: &[f32]) -> Self {
        let pairs = mean
            .iter()
            .zip(square)
            .map(|(m, s)| (f64::from(*m), f64::from(*s)));
        // What is left of two numbers in f32 is no spread.
        let spread = |(m, s): (f64, f64)| {
            let left = s - m * m;
            if left > 4.0 * f64::from(f32::EPSILON) * s {
                left
            } else {
                0.0
            }
        };
        Self {
            variance: pairs.map(spread).collect(),
            unbiased: false,
        }
    }

    /// Standard errors of the mean luminance over `samples` of a pixel, at least 2.
    pub fn errors(&self, samples: u64) -> Vec<f64> {
        let n = samples as f64;
        let divisor = if self.unbiased { n } else { n - 1.0 };
        self.variance.iter().map(|v| (v / divisor).sqrt()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_are_the_standard_error_of_the_mean() {
        // Samples 1, 2, 4, 9: mean 4, mean of squares 25.5, variance 38/3, of the mean 38/12.
        let error = (38.0f64 / 12.0).sqrt();
        let close = |e: Vec<f64>| (e[0] - error).abs() < 1e-6;
        assert!(close(Moments::from_variance(&[38.0 / 3.0]).errors(4)));
        assert!(close(Moments::from_means(&[4.0], &[25.5]).errors(4)));
        // Of equal samples rounding alone is left.
        let (m, s) = (18.1, 18.1f32 * 18.1);
        assert_eq!(Moments::from_means(&[m], &[s - 3e-5]).errors(4), [0.0]);
        assert_eq!(Moments::from_means(&[m], &[s + 3e-5]).errors(4), [0.0]);
    }
}
