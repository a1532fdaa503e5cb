//! How wrong a film's picture still is, and how well that is known.
//!
//! The relative error is √ mean over pixels of s² / (Y² + (0.1 Ȳ)²): s is the standard error of a pixel's luminance Y, and Ȳ is
//! the mean luminance of the picture. Both are unknown, and they are estimated apart.
//!
//! **s²** is estimated without bias, from the pixel's own replicates.
//!
//! **Y** must not be estimated from the pixel alone. Where light is rare, most pixels have not found any, and a pixel with one
//! bright sample divides that sample's error by that sample. So a *pool* is asked: the smallest square around the pixel in
//! which the light has come from at least `ENOUGH` samples. The number of samples that carry a sum is (Σ y)² / Σ y², after
//! Kish \[Kish1965\]: for n equal samples it is n. What the pixel's own samples say is set against it: the pool's mean counts as much as
//! `BELIEF` samples that have found light. So a pixel at an edge is not taken for as bright as the things beside it. A pixel whose own light has
//! come from `ALONE` samples stands for itself.
//!
//! s² and Y must not come from the same samples. Samples of light are skewed: where they have found too much, both are too large, and
//! the quotient is too small. So the pool of a pixel has a mean without the pixel's own light, s² comes from two of its replicates, and
//! its own part in Y from the other two.
//!
//! A pool holds only pixels that may be as bright as the pixel itself. Otherwise a lamp would hide the noise of the wall beside
//! it, and a black background would exaggerate the noise of an edge. If the light of two pixels comes in samples of size a (which
//! adds a/n to the mean), the difference of their means has the variance a (Y₁ + Y₂) / n. Other pixels of a pool are darker by
//! at most `DARKER` of these standard deviations, or brighter by at most `BRIGHTER`. Where it is known, pixels whose paths
//! have all met nothing are left out.
//!
//! The **uncertainty** of the relative error E follows from the relative variance of E². Light that a pixel has found makes its own term
//! larger, and it makes those terms smaller whose Y it is part of: by its pool, or by Ȳ. If the pixel's term is the share a of their sum, and
//! its light changes the others by the share b, where c samples carry it, its part is a² + 2ab / c + b² / c. For even light both nearly cancel:
//! of n samples that have found light, the relative variance is 1 / n, and not the 1 / n + 4 / n of terms and pools apart.

mod pools;
#[cfg(test)]
mod tests;

use super::{Film, REPLICATES, Reach, replicate_counts};
use crate::stats::{luminance, percent, percent_to};
pub(super) use pools::Light;
use pools::{Square, Term};
use rayon::prelude::*;
use std::fmt;

/// The largest relative uncertainty of an error that is called certain, with the weights below. Measured: see docs/stated-error.md.
const MOST_UNCERTAIN: f64 = 0.091;

/// Weight of the variance that few terms bring. Where such terms were found, the error is more often too large than too small.
const OF_TERMS: f64 = 0.5;

/// Weight of the variance of pools that few samples carry. Before their light is found, the error is too small.
const OF_POOLS: f64 = 2.5;

/// Σ c² / (Σ c)² of equally noisy pixels, times their number: s² of four replicates has the relative variance 2/3.
const EVEN: f64 = 5.0 / 3.0;

/// A pixel is unlit if there is no light within this share of the picture's longer side, across and down.
const AROUND: f64 = 1.0 / 16.0;

/// The largest share of unlit pixels that counts as chance.
const MOST_UNLIT: f64 = 0.01;

/// If so many pixels have found light that mirrors and glass show, and that no light path brings, its error is known from them.
const FEW_FOUND: f64 = 32.0;

/// The largest squared error that light may bring which was not found, over the stated one, without a doubt.
const MOST_MISSING: f64 = 1.0;

/// The largest share of the picture that may be waiting for such light without a doubt.
const MOST_HIDDEN: f64 = 0.003;

/// The radiance of such light over that of the brightest light, or a little less: a matt surface scatters it.
const MATT: f64 = 0.25;

/// An estimate of a picture's relative error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RelativeError {
    /// The relative error; `None` while some pixel has fewer than two samples, and while no light was found. It is too large
    /// while some pixel has a single replicate.
    pub value: Option<f64>,
    /// Standard error of `value`.
    pub uncertainty: Option<f64>,
    /// Why the true error may be far larger.
    pub doubt: Option<Doubt>,
}

/// Why a stated error is not reliable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// No path has found any light.
    NoLight,
    /// In this share of the picture paths have met surfaces, but found no light.
    Unlit(f64),
    /// In this share of the picture paths went on behind mirrors or glass, but hardly any has found light there by way of other mirrors
    /// and glass.
    Hidden(f64),
    /// The error rests on few bright samples, or on a single replicate.
    Uncertain,
}

impl RelativeError {
    /// Of a black picture that is known to be right.
    pub const ZERO: Self = Self {
        value: Some(0.0),
        uncertainty: Some(0.0),
        doubt: None,
    };

    /// The same, but for a picture in which nothing can shine, which is right to be black.
    pub fn of_black(self, black: bool) -> Self {
        if black && self.doubt == Some(Doubt::NoLight) {
            Self::ZERO
        } else {
            self
        }
    }

    /// The error that is compared with a wanted one: the error plus twice its uncertainty. `None` while it is not known, and while
    /// parts of the picture have found no light.
    pub fn upper(&self) -> Option<f64> {
        match self.doubt {
            Some(Doubt::NoLight | Doubt::Unlit(_)) => None,
            _ => Some(self.value? + 2.0 * self.uncertainty?),
        }
    }
}

/// As a percentage with its uncertainty, and what there is to doubt.
impl fmt::Display for RelativeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(value), Some(uncertainty)) = (self.value, self.uncertainty) else {
            return match self.doubt {
                Some(doubt) => doubt.fmt(f),
                None => f.write_str("unknown"),
            };
        };
        f.write_str(&percent(value))?;
        if !uncertainty.is_finite() {
            f.write_str(" \u{b1} unknown")?;
        } else if uncertainty > 0.0 {
            write!(f, " \u{b1} {}", percent_to(uncertainty, 2))?;
        }
        match self.doubt {
            None => Ok(()),
            Some(Doubt::Uncertain) => f.write_str(" (uncertain)"),
            Some(doubt) => write!(f, " ({doubt})"),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLight => f.write_str("no light found yet"),
            Self::Unlit(share) => write!(
                f,
                "no light found yet in {:.0} % of the picture",
                (share * 100.0).max(1.0)
            ),
            Self::Hidden(share) => write!(
                f,
                "light that mirrors and glass show in {:.0} % of the picture was found too rarely",
                (share * 100.0).max(1.0)
            ),
            Self::Uncertain => f.write_str("it rests on too few samples"),
        }
    }
}

impl Film {
    /// The picture's relative error with its uncertainty.
    pub fn relative_error(&self) -> RelativeError {
        if self.coverage.samples().0 < 2 || self.replicates().0 == 0 {
            return RelativeError::default();
        }
        let pixels = self.light();
        let covered = pixels.iter().filter(|p| p.n > 0.0);
        let (count, brightness) = covered.fold((0.0, 0.0), |t, p| (t.0 + 1.0, t.1 + p.mean()));
        let mean = brightness / count;
        if !(mean > 0.0 && mean.is_finite()) {
            return RelativeError {
                doubt: Some(Doubt::NoLight),
                ..RelativeError::default()
            };
        }
        let floor = (0.1 * mean).powi(2);
        let width = self.bounds.width();
        let picture = Square::new(&pixels, &self.reached, width);
        let terms: Vec<Term> = (0..pixels.len())
            .into_par_iter()
            .map(|i| picture.term(i, mean, floor))
            .collect();
        let sum: f64 = terms.iter().map(|t| t.value).sum();
        let value = (sum / count).sqrt();
        let [mut uncertainty, mut by_rare_light] = [0.0; 2];
        if sum > 0.0 {
            let noise = picture.noise(&terms, sum);
            uncertainty = 0.5 * (noise.terms + noise.pools + noise.both).max(0.0).sqrt();
            let surplus = (noise.terms - EVEN / count).max(0.0);
            let weighted = OF_TERMS * surplus + OF_POOLS * noise.pools + noise.both;
            by_rare_light = 0.5 * weighted.max(0.0).sqrt();
        }
        let single = self.replicates().0 < 2;
        if single {
            uncertainty = 1.0;
        }
        let most_missing = MOST_MISSING * value * value;
        let [unlit, unfound] = self.unlit(&pixels, floor, count);
        let [hidden, missing] = self.hidden(&pixels, mean, count);
        let doubt = if unlit > MOST_UNLIT && unfound > most_missing {
            Some(Doubt::Unlit(unlit))
        } else if hidden > MOST_HIDDEN && missing > most_missing {
            Some(Doubt::Hidden(hidden))
        } else {
            (single || by_rare_light > MOST_UNCERTAIN).then_some(Doubt::Uncertain)
        };
        RelativeError {
            value: Some(value),
            uncertainty: Some(value * uncertainty),
            doubt,
        }
    }

    /// What is known of every pixel of the film's bounds, row by row.
    pub(super) fn light(&self) -> Vec<Light> {
        let mut pixels = vec![Light::default(); self.bounds.area() as usize];
        for (rect, ranges) in self.coverage.cells() {
            let given = replicate_counts(ranges, self.strata);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    let counts = self.left_out.remaining(x, y, &given);
                    let sums = self.all_light(x, y, &counts);
                    let light = |r: usize| luminance([sums[r][0], sums[r][1], sums[r][2]]);
                    let error = super::estimate(&sums, &counts).error[3];
                    pixels[self.index(x, y)] = Light {
                        n: counts.iter().sum::<u64>() as f64,
                        sum: (0..REPLICATES).map(light).sum(),
                        squares: sums.iter().map(|s| s[3]).sum(),
                        variance: error * error,
                        replicates: counts
                            .iter()
                            .all(|n| *n > 0 && *n == counts[0])
                            .then(|| std::array::from_fn(|r| light(r) / counts[r] as f64)),
                    };
                }
            }
        }
        pixels
    }

    /// The share of pixels whose paths have gone on where no light path can arrive, and the squared relative error that may be missing
    /// there, because hardly any path has found light by way of mirrors and glass.
    fn hidden(&self, pixels: &[Light], mean: f64, count: f64) -> [f64; 2] {
        let Some(splats) = &self.splats else {
            return [0.0; 2];
        };
        let far = |least: Reach| {
            let reached = pixels.iter().zip(&self.reached);
            reached.filter(move |(_, r)| **r >= least as u8)
        };
        let samples: f64 = far(Reach::Hidden).map(|(p, _)| p.n).sum();
        let found = far(Reach::Found).count() as f64;
        if samples == 0.0 || found >= FEW_FOUND {
            return [0.0; 2];
        }
        let pixels = far(Reach::Hidden).count() as f64;
        let light = MATT * splats.setup.scale;
        let variance = missed_chance(found, samples) * light * light * pixels / samples;
        let share = pixels / count;
        [share, share * variance / (mean * mean)]
    }

    /// The share of pixels where paths have met surfaces beyond the first, but found no light, nor have the pixels around them; and the
    /// squared relative error that may be missing there, if light that was not found is as bright as the brightest that was.
    fn unlit(&self, pixels: &[Light], floor: f64, count: f64) -> [f64; 2] {
        if self.reached.is_empty() {
            return [0.0; 2];
        }
        let around = (AROUND * f64::from(self.size[0].max(self.size[1]))).ceil() as usize;
        let width = self.bounds.width() as usize;
        let height = pixels.len() / width;
        // Lit pixels above and to the left of each corner.
        let stride = width + 1;
        let mut before = vec![0u32; stride * (height + 1)];
        for (y, row) in pixels.chunks_exact(width).enumerate() {
            let mut of_row = 0;
            for (x, pixel) in row.iter().enumerate() {
                of_row += u32::from(pixel.sum > 0.0);
                before[(y + 1) * stride + x + 1] = before[y * stride + x + 1] + of_row;
            }
        }
        let near = |k: usize, n: usize| [k.saturating_sub(around), n.min(k + around + 1)];
        let dark = |i: &usize| {
            let [left, right] = near(i % width, width);
            let [top, bottom] = near(i / width, height).map(|y| y * stride);
            pixels[*i].n > 0.0
                && self.reached[*i] >= Reach::Further as u8
                && before[bottom + right] + before[top + left]
                    == before[bottom + left] + before[top + right]
        };
        let dark: Vec<usize> = (0..pixels.len()).into_par_iter().filter(dark).collect();
        if dark.is_empty() {
            return [0.0; 2];
        }
        let samples: f64 = dark.iter().map(|i| pixels[*i].n).sum();
        let lit = pixels.iter().filter(|p| p.sum > 0.0);
        let brightest = lit.map(|p| p.squares / p.sum).fold(0.0, f64::max);
        let n = samples / dark.len() as f64;
        let variance = missed_chance(0.0, samples) * brightest * brightest / n;
        let share = dark.len() as f64 / count;
        [share, share * variance / floor]
    }
}

/// The chance of a sample to find light that these samples may have missed, beside what they have found: at most, in 19 of 20 pictures.
fn missed_chance(found: f64, samples: f64) -> f64 {
    (3.0 + 2.0 * found.sqrt()) / samples
}
