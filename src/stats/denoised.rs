//! The error of a denoised picture, without a model of the noise or of the denoiser.
//!
//! There are four independent replicates of a picture with mean μ. For each of the six pairs S of them, let F_S be what a denoiser
//! makes of the mean of S, and of things that have no noise of theirs. The other two, c and d, are held out. G is the mean of the six.
//! Then
//!
//! ```text
//! (G − μ)²  ≈  mean over S of (F_S − c)(F_S − d)  −  mean over S of (F_S − G)²
//! ```
//!
//! is right on average in every pixel. Given S, c and d are independent of F_S and of each other, and their mean is μ, so the product has
//! the expected value (F_S − μ)². The last term turns the mean squared error of the six into that of their mean. Nothing else is
//! supposed: not equal variances of the replicates, and nothing about the denoiser, whose bias is in it. If a denoiser does nothing, this
//! *is* the usual squared standard error s² of the mean of four.
//!
//! The same replicates give a **mixture** with the raw picture, X = raw + w (G − raw), where w minimises the expected squared error.
//! It rests on the covariance of G and the raw picture, ¼ (A − C)(F_A − F_C) on average over the three ways to halve the replicates into A
//! and C. The weight of a pixel comes from its surroundings without itself, so that its own noise does not choose it.
//!
//! Surroundings do not see a small highlight that a denoiser loses. So the mixture is made of each half alone, X_S = S + w (F_S − S), and a
//! half keeps its own pixel, w = 0, where both of its replicates are far on the same side of F_S: a firefly is in one of them. X_S is then
//! what another denoiser makes of S. So it is judged as one, by the two replicates that had no part in the choice.
//!
//! The estimate of one pixel is about 1.6 times as noisy as the raw pixel's variance is large. So it is a statement about pictures
//! and areas.

use super::luminance;
use super::pool::{gaussian, hollow};
use std::fmt;

/// Replicates.
const REPLICATES: usize = 4;

/// The pairs of replicates, each denoised alone. The sixth halves the replicates as the first does, the fifth as the second, the fourth as
/// the third.
pub const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Standard deviation in pixels of the surroundings that choose a pixel's weight.
const WEIGHT_SIGMA: f64 = 4.0;

/// A half keeps its own pixel if both of its replicates differ from the denoised value by more than so many standard deviations of a replicate
/// in the surroundings, to the same side. Noise that is alike all around does that in one of 10^9 pixels.
const FAR: f64 = 4.0;

/// Standard deviation in pixels of the surroundings that the indication is a mean over.
const INDICATION_SIGMA: f64 = 4.0;

/// The share of the picture's mean luminance that is added to a pixel's own where errors of dark and bright pixels are weighed.
const FLOOR: f64 = 0.1;

/// The largest relative uncertainty of a number that is stated.
const MOST_UNCERTAIN: f64 = 0.5;

/// If this share of the pixels ...
const FEW: f64 = 1e-3;

/// ... has this share of the squared error, its mean rests on too little. They are those whose replicates differ most. If they were those
/// with the largest estimates, noise alone would bring them there, and the better a denoiser is, the less would be known of it.
const MUCH: f64 = 0.5;

/// What a picture's squared error is averaged over before its spread is taken: as many blocks as this, if they have ...
const BLOCKS: f64 = 256.0;

/// ... at least and at most so many pixels a side. Errors of a denoiser are alike over some pixels.
const BLOCK_SIDE: [usize; 2] = [8, 64];

/// A picture, row by row; linear RGB.
pub type Rgb = Vec<[f32; 3]>;

/// A denoised picture with what is known of its error.
#[derive(Debug, Clone, PartialEq)]
pub struct Denoised {
    /// The mean of the six denoised pictures.
    pub mean: Rgb,
    /// Its mixture with the raw picture.
    pub mixture: Rgb,
    /// The share of the denoised mean in the mixture, 0 to 1.
    pub weight: Vec<f32>,
    /// About how wrong the luminance of the mixture is around each pixel: right within a factor of about 3, so no error.
    pub indication: Vec<f32>,
    /// How wrong the pictures are as a whole.
    pub statement: Statement,
}

/// Errors of pictures: root mean squares of the luminance, over the mean luminance of the raw picture. They include every bias.
#[derive(Debug, Clone, PartialEq)]
pub struct Statement {
    /// Of the raw picture.
    pub raw: Rms,
    /// Of the mean of the six denoised ones.
    pub mean: Rms,
    /// Of the mixture.
    pub mixture: Rms,
    /// How much light the denoiser has added or lost: the relative change of the mean luminance from the raw picture to the mean of the
    /// denoised ones.
    pub light: f64,
    /// The same for the mixture.
    pub mixture_light: f64,
}

/// A root mean square error, if it is known.
#[derive(Debug, Clone, PartialEq)]
pub enum Rms {
    /// With its standard error.
    Known {
        /// Over the mean luminance.
        value: f64,
        /// Of `value`.
        error: f64,
    },
    /// Why it is not.
    Unknown(Why),
}

/// Why an error is not known.
#[derive(Debug, Clone, PartialEq)]
pub enum Why {
    /// The estimate's own standard error is more than half of it.
    Noisy,
    /// A thousandth of the pixels has half of the squared error.
    Few,
    /// The raw picture's own error is in doubt.
    Doubt(String),
    /// There is no light.
    Black,
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Noisy => f.write_str("its own standard error is more than half of it"),
            Self::Few => f.write_str("a thousandth of the pixels has more than half of it"),
            Self::Doubt(doubt) => write!(f, "the raw picture's error is in doubt: {doubt}"),
            Self::Black => f.write_str("the picture is black"),
        }
    }
}

impl fmt::Display for Rms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Known { value, error } => write!(
                f,
                "{} \u{b1} {}",
                super::percent_to(*value, 2),
                super::percent_to(*error, 1)
            ),
            Self::Unknown(why) => write!(f, "not known ({why})"),
        }
    }
}

impl Rms {
    /// The number, if it is known.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Known { value, .. } => Some(*value),
            Self::Unknown(_) => None,
        }
    }

    /// Its standard error, if it is known.
    pub fn error(&self) -> Option<f64> {
        match self {
            Self::Known { error, .. } => Some(*error),
            Self::Unknown(_) => None,
        }
    }

    /// Why it is not known.
    pub fn why(&self) -> Option<&Why> {
        match self {
            Self::Known { .. } => None,
            Self::Unknown(why) => Some(why),
        }
    }
}

impl fmt::Display for Statement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mixture {
            Rms::Known { .. } => write!(
                f,
                "RMS error {} of mean luminance, bias included",
                self.mixture
            )?,
            Rms::Unknown(why) => write!(f, "its RMS error is not known, because {why}")?,
        }
        // What is not known for the same reason is not said again.
        let others = [
            ("of the denoised mean alone", &self.mean),
            ("raw", &self.raw),
        ];
        for (what, rms) in others {
            match rms {
                Rms::Known { .. } => write!(f, "; {what} {rms}")?,
                Rms::Unknown(why) if self.mixture.why() == Some(why) => {}
                Rms::Unknown(why) => write!(f, "; {what} not known, because {why}")?,
            }
        }
        write!(f, "; total light {:+.2} %", 100.0 * self.mixture_light)
    }
}

/// Estimates of squared errors of the luminance, pixel by pixel; some are negative.
#[derive(Debug, Clone, PartialEq)]
pub struct Squares {
    /// Of the raw picture.
    pub raw: Vec<f64>,
    /// Of the mean of the denoised ones.
    pub mean: Vec<f64>,
    /// Covariance of both.
    pub covariance: Vec<f64>,
}

impl Squares {
    /// From the luminances of the replicates and of the six denoised pictures, in the order of [`PAIRS`].
    pub fn new(replicates: &[Vec<f64>; REPLICATES], folds: &[Vec<f64>; PAIRS.len()]) -> Self {
        let count = replicates[0].len();
        let mut out = Self {
            raw: Vec::with_capacity(count),
            mean: Vec::with_capacity(count),
            covariance: Vec::with_capacity(count),
        };
        for i in 0..count {
            let m = replicates.each_ref().map(|r| r[i]);
            let f = folds.each_ref().map(|f| f[i]);
            let raw = m.iter().sum::<f64>() / 4.0;
            out.raw
                .push(m.iter().map(|m| (m - raw).powi(2)).sum::<f64>() / 12.0);
            out.mean.push(square(&m, &f));
            let halves = (0..3).map(|s| {
                let ([a, b], [c, d]) = (PAIRS[s], PAIRS[5 - s]);
                0.25 * (0.5 * (m[a] + m[b]) - 0.5 * (m[c] + m[d])) * (f[s] - f[5 - s])
            });
            out.covariance.push(halves.sum::<f64>() / 3.0);
        }
        out
    }
}

/// The squared error of the mean of what was made of each half of a pixel's replicates.
fn square(replicates: &[f64; REPLICATES], folds: &[f64; PAIRS.len()]) -> f64 {
    let mean = folds.iter().sum::<f64>() / PAIRS.len() as f64;
    let squares = folds.iter().zip(held_out()).map(|(f, [c, d])| {
        let own = f - mean;
        (f - replicates[c]) * (f - replicates[d]) - own * own
    });
    squares.sum::<f64>() / PAIRS.len() as f64
}

/// The replicates that each of [`PAIRS`] leaves out.
fn held_out() -> impl Iterator<Item = [usize; 2]> {
    PAIRS.into_iter().rev()
}

/// The mean of each of [`PAIRS`]: what is to be denoised.
pub fn half(replicates: &[Rgb; REPLICATES], pair: usize) -> Rgb {
    let [a, b] = PAIRS[pair].map(|r| &replicates[r]);
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c: usize| 0.5 * (a[c] + b[c]));
    a.iter().zip(b).map(mean).collect()
}

/// Judges six denoised pictures of `width` pixels a row, in the order of [`PAIRS`], by the replicates that they were made from. `doubt`
/// says why the raw picture's own error is in doubt, if it is.
///
/// # Panics
/// If pictures differ in length, or have no pixels.
pub fn judge(
    replicates: &[Rgb; REPLICATES],
    folds: &[Rgb; PAIRS.len()],
    width: usize,
    doubt: Option<String>,
) -> Denoised {
    let count = replicates[0].len();
    assert!(count > 0 && replicates.iter().chain(folds).all(|p| p.len() == count));
    let light = |rgb: &[f32; 3]| luminance(rgb.map(f64::from));
    let lights = |rgb: &Rgb| -> Vec<f64> { rgb.iter().map(light).collect() };
    let squares = Squares::new(
        &replicates.each_ref().map(lights),
        &folds.each_ref().map(lights),
    );
    let raw = mean_of(replicates);
    let mean = mean_of(folds);
    let (raw_light, mean_light) = (lights(&raw), lights(&mean));

    // The weight that minimises w² E + (1 − w)² s² + 2 w (1 − w) cov, of the surroundings.
    let average = mean_light.iter().sum::<f64>() / count as f64;
    let scale = |i: usize| {
        let scale = mean_light[i].powi(2) + (FLOOR * average).powi(2);
        if scale > 0.0 { 1.0 / scale } else { 0.0 }
    };
    let gain: Vec<f64> = (0..count)
        .map(|i| (squares.raw[i] - squares.covariance[i]) * scale(i))
        .collect();
    let apart: Vec<f64> = (0..count)
        .map(|i| (mean_light[i] - raw_light[i]).powi(2) * scale(i))
        .collect();
    let gain = hollow(&gain, width, WEIGHT_SIGMA);
    let apart = hollow(&apart, width, WEIGHT_SIGMA);
    let share = gain.iter().zip(&apart).map(|(c, d)| {
        let share = if *d > 0.0 { c / d } else { 0.0 };
        share.clamp(0.0, 1.0)
    });
    // What a replicate's standard deviation is around each pixel.
    let noise = hollow(&squares.raw, width, WEIGHT_SIGMA)
        .into_iter()
        .map(|s| (s.max(0.0) * REPLICATES as f64).sqrt());
    let mut mixture: Rgb = Vec::with_capacity(count);
    let mut mixed = Vec::with_capacity(count);
    let mut weight = Vec::with_capacity(count);
    for (i, (share, noise)) in share.zip(noise).enumerate() {
        let m = replicates.each_ref().map(|r| light(&r[i]));
        let f = folds.each_ref().map(|f| light(&f[i]));
        let kept = |s: usize| {
            let [a, b] = PAIRS[s].map(|r| m[r] - f[s]);
            a * b > 0.0 && a.abs().min(b.abs()) > FAR * noise
        };
        let w: [f64; PAIRS.len()] = std::array::from_fn(|s| if kept(s) { 0.0 } else { share });
        let own = |s: usize| PAIRS[s].map(|r| m[r]).iter().sum::<f64>() / 2.0;
        let parts = std::array::from_fn(|s| own(s) + w[s] * (f[s] - own(s)));
        mixed.push(square(&m, &parts));
        weight.push(w.iter().sum::<f64>() / PAIRS.len() as f64);
        mixture.push(std::array::from_fn(|c| {
            let change = |s: usize| {
                let [a, b] = PAIRS[s].map(|r| f64::from(replicates[r][i][c]));
                w[s] * (f64::from(folds[s][i][c]) - 0.5 * (a + b))
            };
            let change = (0..PAIRS.len()).map(change).sum::<f64>() / PAIRS.len() as f64;
            (f64::from(raw[i][c]) + change) as f32
        }));
    }
    let total: f64 = raw_light.iter().sum();
    let change = |light: f64| {
        if total > 0.0 {
            light / total - 1.0
        } else {
            0.0
        }
    };
    let light_of_all = total / count as f64;
    let rms = |of: &[f64]| rms(of, &squares.raw, width, light_of_all, doubt.as_deref());
    Denoised {
        statement: Statement {
            raw: rms(&squares.raw),
            mean: rms(&squares.mean),
            mixture: rms(&mixed),
            light: change(mean_light.iter().sum()),
            mixture_light: change(mixture.iter().map(light).sum()),
        },
        indication: gaussian(&mixed, width, INDICATION_SIGMA)
            .into_iter()
            .map(|e| e.max(0.0).sqrt() as f32)
            .collect(),
        weight: weight.into_iter().map(|w| w as f32).collect(),
        mean,
        mixture,
    }
}

fn mean_of<const N: usize>(pictures: &[Rgb; N]) -> Rgb {
    let pixel = |i: usize| {
        [0, 1, 2].map(|c: usize| {
            let sum: f64 = pictures.iter().map(|p| f64::from(p[i][c])).sum();
            (sum / N as f64) as f32
        })
    };
    (0..pictures[0].len()).map(pixel).collect()
}

/// The root of the mean of `squares` over `light`, with the standard error that the spread of blocks gives it. `raw` has the squared errors
/// of the raw picture.
fn rms(squares: &[f64], raw: &[f64], width: usize, light: f64, doubt: Option<&str>) -> Rms {
    if let Some(doubt) = doubt {
        return Rms::Unknown(Why::Doubt(doubt.into()));
    }
    if !(light > 0.0 && light.is_finite()) {
        return Rms::Unknown(Why::Black);
    }
    let count = squares.len() as f64;
    let sum: f64 = squares.iter().sum();
    let spread = block_spread(squares, width);
    // Of the root: half the relative error of the square.
    let value = (sum.max(0.0) / count).sqrt() / light;
    if sum <= 0.0 && spread == 0.0 {
        return Rms::Known { value, error: 0.0 };
    }
    let relative = 0.5 * spread / sum;
    if sum <= 0.0 || relative > MOST_UNCERTAIN || relative.is_nan() {
        return Rms::Unknown(Why::Noisy);
    }
    let few = (FEW * count).ceil() as usize;
    let mut order: Vec<usize> = (0..squares.len()).collect();
    order.select_nth_unstable_by(few - 1, |a, b| raw[*b].total_cmp(&raw[*a]));
    if order[..few].iter().map(|i| squares[*i]).sum::<f64>() > MUCH * sum {
        return Rms::Unknown(Why::Few);
    }
    Rms::Known {
        value,
        error: value * relative,
    }
}

/// The standard error of the sum of `squares`, from sums over blocks of pixels. What differs from block to block by nature counts as well, so
/// it is rather too large.
fn block_spread(squares: &[f64], width: usize) -> f64 {
    let height = squares.len() / width;
    let [least, most] = BLOCK_SIDE;
    let side = ((squares.len() as f64 / BLOCKS).sqrt() as usize).clamp(least, most);
    let across = width.div_ceil(side);
    let mut blocks = vec![(0.0, 0.0); across * height.div_ceil(side)];
    for (i, e) in squares.iter().enumerate() {
        let block = &mut blocks[i / width / side * across + i % width / side];
        block.0 += e;
        block.1 += 1.0;
    }
    let n = blocks.len() as f64;
    if n < 2.0 {
        return f64::INFINITY;
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    let spread: f64 = blocks.iter().map(|(sum, k)| (sum - mean * k).powi(2)).sum();
    (spread * n / (n - 1.0)).sqrt()
}

#[cfg(test)]
mod tests;
