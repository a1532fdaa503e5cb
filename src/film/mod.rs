//! The film: the sums of all samples so far, in f64, from which mean and error are computed.
//!
//! Samples of a pixel are numbered from 0. A *round* is strata² consecutive samples, which visit each
//! stratum once; round q belongs to *replicate* q mod [`REPLICATES`]. Rounds of one replicate may be
//! correlated (stratified, low-discrepancy), but replicates are independent and
//! identically distributed, so for every sampler the spread of their means gives the error of the whole.
//! A GPU sums in f32 over *blocks* of [`BLOCK`] consecutive samples, separately for each replicate;
//! blocks are added to f64 sums here. Neither boundary depends on how the work is cut.

pub mod coverage;
pub mod error;
mod left_out;
pub mod merge;
pub mod pilot;
pub mod replicates;
pub mod splats;
mod unlit;

use crate::stats::luminance;
use coverage::{Coverage, Rect};
pub use left_out::LeftOut;
use pilot::Pilot;
use rayon::prelude::*;
use splats::Splats;
use std::fmt;
use std::mem::take;
use std::ops::Range;

/// Independent replicates in every film.
pub const REPLICATES: usize = 4;

/// Samples in a block, from one multiple of this number to the next.
pub const BLOCK: u64 = 256;

/// Sums of one replicate of one pixel: R, G, B and the square of each sample's luminance.
pub type Sums<T> = [T; 4];

/// Accumulated samples of a picture or of a part of it.
#[derive(Clone, PartialEq)]
pub struct Film {
    /// Width and height of the whole picture in pixels.
    pub size: [u32; 2],
    /// The part of the picture that `sums` holds.
    pub bounds: Rect,
    /// Strata per side; fixes which replicate a sample belongs to.
    pub strata: u32,
    /// Which pixels have which samples.
    pub coverage: Coverage,
    /// Finished blocks; rows of `bounds`, for every pixel its replicates.
    sums: Vec<[Sums<f64>; REPLICATES]>,
    /// Running f32 sums of unfinished blocks, in the same order; empty when there are none.
    partial: Vec<[Sums<f32>; REPLICATES]>,
    /// Samples that `coverage` has and no sum has.
    left_out: LeftOut,
    /// The pilots of an adaptive film (`--adaptive`).
    pub pilot: Option<Pilot>,
    /// What light paths have brought.
    splats: Option<Splats>,
    /// How far paths of each pixel have got, as a [`Reach`], in the order of `sums`; 0 where they have met nothing. Empty if that is
    /// so everywhere, or if it is not known.
    reached: Vec<u8>,
}

/// A short summary: a film may hold millions of numbers.
impl fmt::Debug for Film {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Film")
            .field("size", &self.size)
            .field("bounds", &self.bounds)
            .field("strata", &self.strata)
            .field("samples", &self.coverage.samples())
            .field("adaptive", &self.pilot.is_some())
            .field("light_paths", &self.splats.is_some())
            .finish_non_exhaustive()
    }
}

/// How far a path has got. A pixel without light whose paths have met nothing is a background. If they have met no second surface
/// after they scattered, no light but a lamp's own can come, which is sampled. Only further on is there light that may be found rarely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Reach {
    /// It has met a surface, and gone on.
    Surface = 1,
    /// It has met another surface after it had scattered from one.
    Further = 2,
    /// The same, where no light path can arrive: behind mirrors or glass, in a picture that has light paths.
    Hidden = 3,
    /// There, it has found a light by way of mirrors or glass.
    Found = 4,
}

impl Reach {
    /// Every one.
    pub const ALL: [Self; 4] = [Self::Surface, Self::Further, Self::Hidden, Self::Found];
}

/// The estimate of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// Mean radiance, linear RGB.
    pub mean: [f64; 3],
    /// Standard error of the mean of R, G, B, and of the luminance.
    pub error: [f64; 4],
    /// Number of samples.
    pub samples: u64,
    /// Independent replicates behind `error`; 0 or 1: see [`Film::estimate`].
    pub replicates: u32,
}

impl Film {
    /// An empty film for the part `bounds` of a picture of `size` pixels.
    pub fn new(size: [u32; 2], bounds: Rect, strata: u32) -> Self {
        let pixels = bounds.area() as usize;
        Self {
            size,
            bounds,
            strata,
            coverage: Coverage::default(),
            sums: vec![Default::default(); pixels],
            partial: Vec::new(),
            left_out: LeftOut::default(),
            pilot: None,
            splats: None,
            reached: Vec::new(),
        }
    }

    /// A film from its stored parts. `partial` is empty or as long as `sums`, which has an element for
    /// every pixel of `bounds`.
    pub fn from_parts(
        size: [u32; 2],
        bounds: Rect,
        strata: u32,
        coverage: Coverage,
        sums: Vec<[Sums<f64>; REPLICATES]>,
        partial: Vec<[Sums<f32>; REPLICATES]>,
    ) -> Self {
        assert_eq!(sums.len(), bounds.area() as usize);
        assert!(partial.is_empty() || partial.len() == sums.len());
        Self {
            size,
            bounds,
            strata,
            coverage,
            sums,
            partial,
            left_out: LeftOut::default(),
            pilot: None,
            splats: None,
            reached: Vec::new(),
        }
    }

    /// Finished blocks, rows of `bounds`.
    pub fn sums(&self) -> &[[Sums<f64>; REPLICATES]] {
        &self.sums
    }

    /// Unfinished blocks, rows of `bounds`; empty when there are none.
    pub fn partial(&self) -> &[[Sums<f32>; REPLICATES]] {
        &self.partial
    }

    /// Position of pixel (x, y) of the picture in [`Film::sums`]; it must lie in `bounds`.
    pub fn index(&self, x: u32, y: u32) -> usize {
        debug_assert!(self.bounds.contains(x, y));
        (y - self.bounds.y0) as usize * self.bounds.width() as usize + (x - self.bounds.x0) as usize
    }

    /// The running sums of pixel (x, y)'s unfinished block; zeros when none is begun.
    pub fn partial_at(&self, x: u32, y: u32) -> [Sums<f32>; REPLICATES] {
        if self.partial.is_empty() {
            Default::default()
        } else {
            self.partial[self.index(x, y)]
        }
    }

    /// Takes the GPU's result for `samples`, which lie in one block, over `rect`: the running f32 sums
    /// of that block for each pixel, row by row. They replace the film's running sums, and
    /// are added to the f64 sums when `samples` ends the block.
    pub fn put_block(
        &mut self,
        rect: Rect,
        samples: Range<u64>,
        running: impl Fn(u32, u32) -> [Sums<f32>; REPLICATES] + Sync,
    ) {
        assert!(
            samples.start < samples.end && samples.start / BLOCK == (samples.end - 1) / BLOCK,
            "one block at a time"
        );
        let ends = samples.end.is_multiple_of(BLOCK);
        let fresh = samples.start.is_multiple_of(BLOCK);
        if !ends && self.partial.is_empty() {
            self.partial = vec![Default::default(); self.sums.len()];
        }
        let (bounds, columns) = (self.bounds, rect.x0..rect.x1);
        let width = bounds.width() as usize;
        let rows = (rect.y0 - bounds.y0) as usize * width..(rect.y1 - bounds.y0) as usize * width;
        let across = (columns.start - bounds.x0) as usize..(columns.end - bounds.x0) as usize;
        // A fast GPU makes a block in less time than one thread takes to fold it.
        let sums = self.sums[rows.clone()].par_chunks_mut(width);
        let of_row = |y: usize| columns.clone().map(move |x| (x, rect.y0 + y as u32));
        if self.partial.is_empty() {
            sums.enumerate().for_each(|(y, sums)| {
                for (sums, (x, y)) in sums[across.clone()].iter_mut().zip(of_row(y)) {
                    fold(sums, &running(x, y));
                }
            });
        } else {
            let partial = self.partial[rows].par_chunks_mut(width);
            (sums.zip(partial).enumerate()).for_each(|(y, (sums, partial))| {
                let pixels = sums[across.clone()]
                    .iter_mut()
                    .zip(&mut partial[across.clone()]);
                for ((sums, partial), (x, y)) in pixels.zip(of_row(y)) {
                    let new = running(x, y);
                    if fresh {
                        // The running sums in the film belong to another block.
                        fold(sums, &take(partial));
                    }
                    if ends {
                        fold(sums, &new);
                        *partial = Default::default();
                    } else {
                        *partial = new;
                    }
                }
            });
        }
        self.coverage.add(rect, samples);
    }

    /// Adds f64 samples directly, as the CPU reference makes them: for each pixel of `rect`, row by
    /// row, `add` adds its samples to the pixel's sums, one after another.
    pub fn put_samples(
        &mut self,
        rect: Rect,
        samples: Range<u64>,
        pixels: Vec<[Sums<f64>; REPLICATES]>,
    ) {
        assert_eq!(pixels.len(), rect.area() as usize);
        for (k, new) in pixels.into_iter().enumerate() {
            let (x, y) = (
                rect.x0 + k as u32 % rect.width(),
                rect.y0 + k as u32 / rect.width(),
            );
            let i = self.index(x, y);
            self.sums[i] = new;
        }
        self.coverage.add(rect, samples);
    }

    /// Does not count `samples` of each replicate of pixel (x, y), which were given with its sums. They were not finite, and
    /// added 0 to the sums.
    pub fn leave_out(&mut self, x: u32, y: u32, samples: [u64; REPLICATES]) {
        debug_assert!(self.bounds.contains(x, y));
        self.left_out.add(x, y, samples);
    }

    /// Notes how far a path of pixel (x, y) has got. Only engines that look for light by chance say so: without them (direct light
    /// alone, Whitted's integrator), light that no light sample finds is not there.
    pub fn reach(&mut self, x: u32, y: u32, how: Reach) {
        if self.reached.is_empty() {
            self.reached = vec![0; self.sums.len()];
        }
        let i = self.index(x, y);
        self.reached[i] = self.reached[i].max(how as u8);
    }

    /// Whether a path of pixel (x, y) has met a surface and gone on to look for light.
    pub fn has_reached(&self, x: u32, y: u32) -> bool {
        self.reached.get(self.index(x, y)).is_some_and(|r| *r > 0)
    }

    /// What [`reach`](Self::reach) has noted for each pixel, or 0; empty if there is nothing.
    pub(crate) fn reached(&self) -> &[u8] {
        &self.reached
    }

    /// Takes what [`reached`](Self::reached) has given; empty, or as long as the sums.
    pub(crate) fn set_reached(&mut self, reached: Vec<u8>) {
        assert!(reached.is_empty() || reached.len() == self.sums.len());
        self.reached = reached;
    }

    /// Samples that were not finite.
    pub fn left_out(&self) -> &LeftOut {
        &self.left_out
    }

    /// Finished and unfinished sums of a pixel's samples together, without its splats.
    pub fn total(&self, x: u32, y: u32) -> [Sums<f64>; REPLICATES] {
        let i = self.index(x, y);
        let mut total = self.sums[i];
        if let Some(p) = self.partial.get(i) {
            fold(&mut total, p);
        }
        total
    }

    /// The estimate of pixel (x, y), given how many samples of each replicate [`Film::coverage`] has of it.
    ///
    /// With R >= 2 replicates of n_r samples and mean m_r, the squared standard error of the mean m of all n
    /// samples is Σ n_r (m_r - m)² / ((R - 1) n). With a single replicate the samples' own second moment
    /// is used: √(Σ Y²)/n for the luminance, distributed over the channels in proportion to their
    /// means. On average it is not too small (E Y² >= Var Y). `replicates` is then 1.
    pub fn estimate(&self, x: u32, y: u32, counts: &[u64; REPLICATES]) -> Estimate {
        let counts = self.left_out.remaining(x, y, counts);
        estimate(&self.all_light(x, y, &counts), &counts)
    }

    /// Calls `f(x, y, estimate)` for every pixel of the film that has samples.
    pub fn for_each(&self, mut f: impl FnMut(u32, u32, Estimate)) {
        for (rect, ranges) in self.coverage.cells() {
            let counts = replicate_counts(ranges, self.strata);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    f(x, y, self.estimate(x, y, &counts));
                }
            }
        }
    }

    /// Mean luminance over the pixels that have samples; 0 if there are none.
    pub fn mean_luminance(&self) -> f64 {
        let (mut sum, mut n) = (0.0, 0u64);
        self.for_each(|_, _, e| {
            sum += luminance(e.mean);
            n += 1;
        });
        if n == 0 { 0.0 } else { sum / n as f64 }
    }

    /// The smallest and largest number of replicates behind any pixel's error; (0, 0) for an empty film.
    pub fn replicates(&self) -> (u32, u32) {
        let (mut fewest, mut most) = (u32::MAX, 0);
        let mut see = |counts: &[u64; REPLICATES]| {
            let n = counts.iter().filter(|&&n| n > 0).count() as u32;
            (fewest, most) = (fewest.min(n), most.max(n));
        };
        for (rect, ranges) in self.coverage.cells() {
            let counts = replicate_counts(ranges, self.strata);
            see(&counts);
            for (x, y, _) in self.left_out.iter() {
                if rect.contains(x, y) {
                    see(&self.left_out.remaining(x, y, &counts));
                }
            }
        }
        (fewest.min(most), most)
    }
}

fn fold(sums: &mut [Sums<f64>; REPLICATES], block: &[Sums<f32>; REPLICATES]) {
    for (s, b) in sums.iter_mut().zip(block) {
        for (s, b) in s.iter_mut().zip(b) {
            *s += f64::from(*b);
        }
    }
}

fn estimate(sums: &[Sums<f64>; REPLICATES], counts: &[u64; REPLICATES]) -> Estimate {
    let samples: u64 = counts.iter().sum();
    if samples == 0 {
        return Estimate::default();
    }
    let n = samples as f64;
    let mean = [0, 1, 2].map(|c| sums.iter().map(|s| s[c]).sum::<f64>() / n);
    let replicates = counts.iter().filter(|&&k| k > 0).count() as u32;
    let mut error = [0.0; 4];
    if replicates < 2 {
        let second_moment = sums.iter().map(|s| s[3]).sum::<f64>();
        let y = luminance(mean);
        error[3] = second_moment.max(0.0).sqrt() / n;
        for c in 0..3 {
            error[c] = if y > 0.0 { error[3] * mean[c] / y } else { 0.0 };
        }
    } else {
        let y = luminance(mean);
        for (s, &k) in sums.iter().zip(counts) {
            if k == 0 {
                continue;
            }
            let k = k as f64;
            for c in 0..3 {
                error[c] += k * (s[c] / k - mean[c]).powi(2);
            }
            error[3] += k * (luminance([s[0] / k, s[1] / k, s[2] / k]) - y).powi(2);
        }
        for e in &mut error {
            *e = (*e / (f64::from(replicates - 1) * n)).sqrt();
        }
    }
    Estimate {
        mean,
        error,
        samples,
        replicates,
    }
}

/// How many of the sample numbers in `ranges` fall to each replicate.
pub fn replicate_counts(ranges: &[Range<u64>], strata: u32) -> [u64; REPLICATES] {
    let round = u64::from(strata) * u64::from(strata);
    std::array::from_fn(|r| {
        ranges
            .iter()
            .map(|s| {
                samples_before(s.end, r as u64, round) - samples_before(s.start, r as u64, round)
            })
            .sum()
    })
}

/// How many samples numbered below `s` belong to replicate `r`; rounds have `round` samples.
pub fn samples_before(s: u64, r: u64, round: u64) -> u64 {
    let period = round * REPLICATES as u64;
    let rest = s % period;
    s / period * round + rest.saturating_sub(r * round).min(round)
}

#[cfg(test)]
mod tests;
