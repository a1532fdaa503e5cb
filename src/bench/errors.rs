//! The error of a picture: measured against a reference, and as the picture states it.

use crate::compare::{Side, flip};
use crate::film::Film;
use crate::stats::luminance;

/// Share of the pixels that the trimmed error leaves out.
pub const TRIMMED: f64 = 0.001;

/// The picture that others are compared with.
#[derive(Debug, Clone)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB, row by row.
    rgb: Vec<[f64; 3]>,
    /// Squared standard errors of R, G, B and the luminance; all 0 when they are not known.
    variance: Vec<[f64; 4]>,
    /// Whether they are known.
    pub states_noise: bool,
    /// (0.1 Ȳ)², Ȳ the mean luminance.
    floor: f64,
}

/// Differences from the reference. The expected contribution of the reference's own noise is subtracted from squares, so a
/// value can be negative if the picture is nearly as good as the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Mean over pixels and channels of the squared difference, in units of radiance squared.
    pub mse: f64,
    /// Mean over pixels of ΔY² / (Y² + (0.1 Ȳ)²), Y the reference's luminance: the weights of
    /// [`Film::relative_error`].
    pub relative_mse: f64,
    /// The same without the worst [`TRIMMED`] of the pixels.
    pub trimmed_relative_mse: f64,
    /// Mean [FLIP](flip) of the pictures as a screen shows them. The reference's noise is not subtracted.
    pub flip: f64,
    /// Mean over pixels and channels of the squared standard errors that the picture states; `None` while some pixel
    /// has fewer than two replicates.
    pub claimed_mse: Option<f64>,
    /// [`Film::relative_error`].
    pub claimed_relative_error: Option<f64>,
    /// Its stated uncertainty.
    pub claimed_uncertainty: Option<f64>,
}

impl Truth {
    /// A picture as the reference. The error says why it can't be used.
    pub fn new(picture: &Side) -> Result<Self, String> {
        if let Some(i) = picture.covered.iter().position(|covered| !covered) {
            let (x, y) = (i as u32 % picture.size[0], i as u32 / picture.size[0]);
            return Err(format!(
                "pixel ({x}, {y}) has no samples; a reference must be a whole picture"
            ));
        }
        let n = picture.rgb.len() as f64;
        let mean = picture.rgb.iter().map(|p| luminance(*p)).sum::<f64>() / n;
        let variance = match &picture.noise {
            Some(noise) => noise.error.iter().map(|e| e.map(|s| s * s)).collect(),
            None => vec![[0.0; 4]; picture.rgb.len()],
        };
        Ok(Self {
            size: picture.size,
            rgb: picture.rgb.clone(),
            variance,
            states_noise: picture.noise.is_some(),
            floor: (0.1 * mean).powi(2),
        })
    }

    /// The relative error that the reference itself states; `None` when it states none.
    pub fn noise_floor(&self) -> Option<f64> {
        if !self.states_noise {
            return None;
        }
        let sum: f64 = (0..self.rgb.len()).map(|i| self.relative_noise(i)).sum();
        Some((sum / self.rgb.len() as f64).sqrt())
    }

    /// The contribution of a pixel's noise to its relative squared difference.
    fn relative_noise(&self, i: usize) -> f64 {
        over(self.variance[i][3], self.weight(i))
    }

    fn weight(&self, i: usize) -> f64 {
        luminance(self.rgb[i]).powi(2) + self.floor
    }

    /// The errors of `film`, which holds every pixel of a picture of this size.
    pub fn errors(&self, film: &Film) -> Errors {
        let mut rgb = vec![[0.0; 3]; self.rgb.len()];
        let (mut claimed, mut known) = (0.0, true);
        film.for_each(|x, y, e| {
            rgb[(y * self.size[0] + x) as usize] = e.mean;
            claimed += e.error[..3].iter().map(|s| s * s).sum::<f64>();
            known &= e.replicates >= 2;
        });
        let n = rgb.len() as f64;
        let square = |i: usize| -> f64 {
            let noise = &self.variance[i];
            let channel = |c: usize| (rgb[i][c] - self.rgb[i][c]).powi(2) - noise[c];
            (0..3).map(channel).sum()
        };
        let mut relative: Vec<[f64; 2]> = (0..rgb.len())
            .map(|i| {
                let difference = luminance(rgb[i]) - luminance(self.rgb[i]);
                [
                    over(difference * difference, self.weight(i)),
                    self.relative_noise(i),
                ]
            })
            .collect();
        let kept = |pixels: &[[f64; 2]]| {
            pixels.iter().map(|[d, noise]| d - noise).sum::<f64>() / pixels.len() as f64
        };
        let relative_mse = kept(&relative);
        relative.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let worst = ((TRIMMED * n).ceil() as usize).min(relative.len() - 1);
        let flip_map = flip::flip(self.size, &self.rgb, &rgb, flip::PIXELS_PER_DEGREE);
        let error = film.relative_error();
        Errors {
            mse: (0..rgb.len()).map(square).sum::<f64>() / (3.0 * n),
            relative_mse,
            trimmed_relative_mse: kept(&relative[..relative.len() - worst]),
            flip: flip_map.iter().map(|f| f64::from(*f)).sum::<f64>() / n,
            claimed_mse: known.then_some(claimed / (3.0 * n)),
            claimed_relative_error: error.value,
            claimed_uncertainty: error.uncertainty,
        }
    }
}

/// a / b, and 0 for 0 / 0: the error of a black picture is 0.
fn over(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Noise;
    use crate::film::coverage::{Coverage, Rect};

    const SIZE: [u32; 2] = [40, 50];

    /// A picture of `SIZE` pixels, grey `value` and standard errors `error`.
    fn grey(value: f64, error: Option<f64>) -> Side {
        let n = (SIZE[0] * SIZE[1]) as usize;
        Side {
            name: "reference".into(),
            size: SIZE,
            rgb: vec![[value; 3]; n],
            covered: vec![true; n],
            noise: error.map(|e| Noise {
                error: vec![[e; 4]; n],
                luminance_alone: false,
                samples: vec![8; n],
                unit: crate::compare::Unit::Sample,
                replicates: 4,
            }),
            clipped: false,
            origin: Vec::new(),
        }
    }

    /// A film of 8 samples per pixel with two replicates of equal means: pixel i has `value(i)`, and states no error.
    fn film(value: impl Fn(usize) -> f64) -> Film {
        let rect = Rect::whole(SIZE);
        let mut coverage = Coverage::default();
        coverage.add(rect, 0..8);
        let sums = (0..rect.area() as usize)
            .map(|i| {
                let half = [4.0 * value(i); 4];
                [half, half, [0.0; 4], [0.0; 4]]
            })
            .collect();
        Film::from_parts(SIZE, rect, 2, coverage, sums, Vec::new())
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    #[test]
    fn errors_of_a_known_pair() {
        let truth = Truth::new(&grey(0.5, None)).unwrap();
        // One pixel in four hundred is 2.5 off, the others 0.1.
        let e = truth.errors(&film(|i| if i % 400 == 0 { 3.0 } else { 0.6 }));
        let weight = 0.25 + 0.0025;
        assert!(close(e.mse, (6.25 + 399.0 * 0.01) / 400.0), "{e:?}");
        assert!(close(e.relative_mse, e.mse / weight), "{e:?}");
        // Two of the five bad pixels among two thousand are left out.
        let rest = (3.0 * 6.25 + 1995.0 * 0.01) / 1998.0;
        assert!(close(e.trimmed_relative_mse, rest / weight), "{e:?}");
        assert!(e.flip > 0.0 && e.flip < 1.0, "{e:?}");
        assert_eq!(e.claimed_mse, Some(0.0));
        assert_eq!(truth.noise_floor(), None);
    }

    #[test]
    fn the_errors_are_those_of_compare() {
        let reference = grey(0.5, None);
        let film = film(|i| 0.5 + 0.001 * i as f64);
        let e = Truth::new(&reference).unwrap().errors(&film);
        let mut other = reference.clone();
        for (i, p) in other.rgb.iter_mut().enumerate() {
            *p = [0.5 + 0.001 * i as f64; 3];
        }
        let limits = crate::compare::Limits {
            max_flip: Some(1.0),
            ..Default::default()
        };
        let m = crate::compare::compare(&reference, &other, &limits)
            .unwrap()
            .metrics;
        assert!(close(e.mse, m.rmse * m.rmse));
        assert!(close(e.relative_mse, m.relative_mse));
        assert!((e.flip - m.flip).abs() < 1e-6);
    }

    #[test]
    fn the_noise_of_the_reference_is_subtracted() {
        let (quiet, noisy) = (grey(0.5, None), grey(0.5, Some(0.05)));
        let film = film(|_| 0.6);
        let [a, b] = [quiet, noisy].map(|p| Truth::new(&p).unwrap().errors(&film));
        assert!(close(a.mse - b.mse, 0.0025));
        assert!(close(a.relative_mse - b.relative_mse, 0.0025 / 0.2525));
        assert!(close(
            a.trimmed_relative_mse - b.trimmed_relative_mse,
            0.0025 / 0.2525
        ));
        let floor = Truth::new(&grey(0.5, Some(0.05))).unwrap().noise_floor();
        assert!(close(floor.unwrap(), 0.05 / 0.2525f64.sqrt()));
    }

    #[test]
    fn black_pictures_and_parts_of_pictures() {
        let e = Truth::new(&grey(0.0, None)).unwrap().errors(&film(|_| 0.0));
        assert_eq!((e.mse, e.relative_mse, e.flip), (0.0, 0.0, 0.0));
        let mut part = grey(0.5, None);
        part.covered[41] = false;
        assert!(Truth::new(&part).unwrap_err().contains("pixel (1, 1)"));
    }
}
