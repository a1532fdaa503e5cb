//! Splats: light that light paths have brought to the pixels.
//!
//! Light paths are traced in *passes*. A pass is numbered like a sample and belongs to the same replicate; it brings light to every
//! pixel of the film. So a pixel's radiance is the mean of its samples plus the mean of its passes, replicate by replicate.
//!
//! A path that is traced again somewhere else, after other paths, must add the same light. So splats are added as whole numbers, whose
//! sum does not depend on the order. A splat is rounded up or down at random, in proportion, so that faint ones count right on average;
//! the random number is a hash of the splat itself.

use super::coverage::{Coverage, Rect};
use super::{Film, REPLICATES, Sums, replicate_counts};
use crate::stats::luminance;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Whole numbers a unit of [`SplatSetup::scale`].
const STEPS: f64 = (1u64 << 40) as f64;

/// What all passes of a film have in common.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SplatSetup {
    /// Light paths of a pass.
    pub paths: u32,
    /// Radiance of 2^40 steps, a power of two: about that of the brightest light.
    pub scale: f64,
}

/// The most pixels of a picture with light paths: a splat has the number of its pixel in this many bits.
pub const MAX_PIXELS: u64 = 1 << PIXEL_BITS;

const PIXEL_BITS: u32 = 30;

/// Light on its way to a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Splat {
    /// The number of the pixel, row by row, and above it the replicate of the pass.
    place: u32,
    /// What it adds to the sum of the pass: linear RGB, not negative.
    pub value: [f32; 3],
}

impl Splat {
    /// Adds `value` to a replicate of a pixel of a picture that is so wide.
    pub fn new([x, y]: [u32; 2], width: u32, replicate: usize, value: [f32; 3]) -> Self {
        let place = (y * width + x) | ((replicate as u32) << PIXEL_BITS);
        Self { place, value }
    }

    /// As the kernel writes it.
    pub(crate) fn from_words([place, r, g, b]: [u32; 4]) -> Self {
        Self {
            place,
            value: [r, g, b].map(f32::from_bits),
        }
    }

    /// The pixel of a picture that is so wide.
    fn pixel(&self, width: u32) -> [u32; 2] {
        let number = self.place & ((1 << PIXEL_BITS) - 1);
        [number % width, number / width]
    }

    /// Whether it falls into `rect` of a picture that is so wide.
    pub(crate) fn is_within(&self, rect: Rect, width: u32) -> bool {
        let [x, y] = self.pixel(width);
        rect.contains(x, y)
    }

    fn replicate(&self) -> usize {
        (self.place >> PIXEL_BITS) as usize
    }
}

/// All splats of some passes, on their way to a film.
#[derive(Debug, Clone)]
pub struct Passes {
    numbers: Range<u64>,
    /// Pixels in a row of the picture.
    width: u32,
    /// Row by row.
    splats: Vec<Splat>,
    /// Where each row of the picture begins in `splats`, and the end of the last one that has any.
    rows: Vec<usize>,
}

impl Passes {
    /// The passes of these numbers have these splats on a picture that is so wide, in any order.
    pub fn new(numbers: Range<u64>, width: u32, mut splats: Vec<Splat>) -> Self {
        let row = |s: &Splat| s.pixel(width)[1] as usize;
        let mut rows = vec![0; splats.iter().map(row).max().map_or(1, |last| last + 2)];
        splats.iter().for_each(|s| rows[row(s) + 1] += 1);
        for y in 1..rows.len() {
            rows[y] += rows[y - 1];
        }
        // Each splat is swapped into the next place of its row. A sorted copy would take as much memory again.
        let mut next = rows.clone();
        for y in 0..rows.len() - 1 {
            while next[y] < rows[y + 1] {
                let at = next[y];
                let home = row(&splats[at]);
                splats.swap(at, next[home]);
                next[home] += 1;
            }
        }
        Self {
            numbers,
            width,
            splats,
            rows,
        }
    }

    /// Their numbers.
    pub fn numbers(&self) -> Range<u64> {
        self.numbers.clone()
    }

    /// Splats on pixels of `rect`.
    fn within(&self, rect: Rect) -> impl Iterator<Item = &Splat> {
        let start = |y: u32| self.rows[(y as usize).min(self.rows.len() - 1)];
        let rows = &self.splats[start(rect.y0)..start(rect.y1)];
        rows.iter()
            .filter(move |s| (rect.x0..rect.x1).contains(&s.pixel(self.width)[0]))
    }
}

/// The splats of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct Splats {
    /// Of every pass.
    pub setup: SplatSetup,
    /// Which pixels have which passes.
    pub coverage: Coverage,
    /// Sums of R, G, B, in steps, and of squared luminances, in steps of scale²; for every pixel of the film's bounds its replicates.
    sums: Vec<[[u64; 4]; REPLICATES]>,
    /// Passes of every replicate of every pixel, as `coverage` has them.
    passes: Vec<[u32; REPLICATES]>,
}

impl Splats {
    fn new(setup: SplatSetup, pixels: usize) -> Self {
        Self {
            setup,
            coverage: Coverage::default(),
            sums: vec![Default::default(); pixels],
            passes: vec![Default::default(); pixels],
        }
    }

    /// Sums in steps, in the order of the film's.
    pub fn sums(&self) -> &[[[u64; 4]; REPLICATES]] {
        &self.sums
    }

    /// What the splats of pixel number `i` add to the sums of its samples, of which replicate r has `counts[r]`.
    fn beside(&self, i: usize, counts: &[u64; REPLICATES]) -> [Sums<f64>; REPLICATES] {
        let (sums, passes) = (&self.sums[i], &self.passes[i]);
        let unit = self.setup.scale / STEPS;
        let units = [unit, unit, unit, unit * self.setup.scale];
        let all: u64 = passes.iter().map(|n| u64::from(*n)).sum();
        std::array::from_fn(|r| {
            let of = |c: usize| -> (f64, f64) {
                match passes[r] {
                    // No pass of this replicate yet: the others stand for it.
                    0 => {
                        let sum: f64 = sums.iter().map(|s| s[c] as f64).sum();
                        (sum * units[c], all as f64)
                    }
                    n => (sums[r][c] as f64 * units[c], f64::from(n)),
                }
            };
            std::array::from_fn(|c| {
                let (sum, n) = of(c);
                if n == 0.0 {
                    return 0.0;
                }
                let share = counts[r] as f64 / n;
                sum * if c == 3 { share * share } else { share }
            })
        })
    }

    /// Whether some replicate of some pixel has no pass.
    pub(super) fn lacks_passes(&self) -> bool {
        self.passes.iter().flatten().any(|n| *n == 0)
    }

    fn count(&mut self, bounds: Rect, rect: Rect, ranges: &[Range<u64>], strata: u32) {
        let more = replicate_counts(ranges, strata);
        let width = bounds.width() as usize;
        for y in rect.y0..rect.y1 {
            let row = (y - bounds.y0) as usize * width;
            for x in rect.x0..rect.x1 {
                let passes = &mut self.passes[row + (x - bounds.x0) as usize];
                for (n, more) in passes.iter_mut().zip(more) {
                    *n += more as u32;
                }
            }
        }
    }

    /// Adds those of `other`, a film with `bounds` like this one.
    pub(super) fn merge(&mut self, other: &Self, bounds: [Rect; 2], strata: u32) {
        let [own, theirs] = bounds;
        let width = theirs.width() as usize;
        for (k, sums) in other.sums.iter().enumerate() {
            let (x, y) = (
                theirs.x0 + (k % width) as u32,
                theirs.y0 + (k / width) as u32,
            );
            let i = (y - own.y0) as usize * own.width() as usize + (x - own.x0) as usize;
            let pairs = self.sums[i].iter_mut().flatten().zip(sums.iter().flatten());
            pairs.for_each(|(a, b)| *a = a.saturating_add(*b));
        }
        for (rect, ranges) in other.coverage.cells() {
            self.count(own, rect, ranges, strata);
            for passes in ranges {
                self.coverage.add(rect, passes.clone());
            }
        }
    }

    /// Moves the pixels of a film that grows.
    pub(super) fn move_rows(&mut self, old: Rect, new: Rect) {
        super::merge::move_rows(&mut self.sums, old, new);
        super::merge::move_rows(&mut self.passes, old, new);
    }
}

impl Film {
    /// The splats; `None` in a film without light paths.
    pub fn splats(&self) -> Option<&Splats> {
        self.splats.as_ref()
    }

    /// Makes room for splats in an empty film.
    pub fn begin_splats(&mut self, setup: SplatSetup) {
        self.splats = Some(Splats::new(setup, self.sums.len()));
    }

    /// Takes stored splats, as [`Splats::sums`] and [`Splats::coverage`] have them.
    pub(crate) fn set_splats(
        &mut self,
        setup: SplatSetup,
        coverage: Coverage,
        sums: Vec<[[u64; 4]; REPLICATES]>,
    ) {
        assert_eq!(sums.len(), self.sums.len());
        let mut splats = Splats::new(setup, 0);
        splats.passes = vec![Default::default(); sums.len()];
        splats.sums = sums;
        for (rect, ranges) in coverage.cells() {
            splats.count(self.bounds, rect, ranges, self.strata);
        }
        splats.coverage = coverage;
        self.splats = Some(splats);
    }

    /// Adds passes to the pixels of `rect`, which have none of them, with all their splats there.
    ///
    /// # Panics
    /// If the film has no room for splats.
    pub fn put_passes(&mut self, rect: Rect, passes: &Passes) {
        let (bounds, strata) = (self.bounds, self.strata);
        let own = self.splats.as_mut().expect("a film with light paths");
        let scale = 1.0 / own.setup.scale;
        for splat in passes.within(rect) {
            let [x, y] = splat.pixel(passes.width);
            let i = (y - bounds.y0) as usize * bounds.width() as usize + (x - bounds.x0) as usize;
            let value = splat.value.map(|v| f64::from(v) * scale);
            let lightness = luminance(value);
            let added = [value[0], value[1], value[2], lightness * lightness];
            let dither = hash([x, y], splat.value);
            let sums = &mut own.sums[i][splat.replicate()];
            for (sum, v) in sums.iter_mut().zip(added) {
                // A float to an integer saturates.
                *sum = sum.saturating_add((v * STEPS + dither) as u64);
            }
        }
        own.count(bounds, rect, std::slice::from_ref(&passes.numbers), strata);
        own.coverage.add(rect, passes.numbers());
    }

    /// The same for those pixels of `rect` that lack all of these passes; others have all of them.
    pub fn put_lacking_passes(&mut self, rect: Rect, passes: &Passes) {
        for (_, parts) in self.lacking_passes(&[rect], passes.numbers()) {
            parts
                .into_iter()
                .for_each(|part| self.put_passes(part, passes));
        }
    }

    /// Which of `passes` the pixels of disjoint `rects` lack: ranges, each with the pixels that lack it.
    pub fn lacking_passes(
        &self,
        rects: &[Rect],
        passes: Range<u64>,
    ) -> Vec<(Range<u64>, Vec<Rect>)> {
        let mut out: Vec<(Range<u64>, Vec<Rect>)> = Vec::new();
        let Some(splats) = &self.splats else {
            return out;
        };
        for rect in joined(rects) {
            for (part, ranges) in splats.coverage.missing(rect, passes.clone()) {
                for range in ranges {
                    match out.iter_mut().find(|(r, _)| *r == range) {
                        Some((_, parts)) => parts.push(part),
                        None => out.push((range, vec![part])),
                    }
                }
            }
        }
        out
    }

    /// The sums of all samples of pixel (x, y), and beside them those of its splats, brought to as many passes. `counts`: how many
    /// samples of each replicate the pixel has.
    pub(super) fn all_light(
        &self,
        x: u32,
        y: u32,
        counts: &[u64; REPLICATES],
    ) -> [Sums<f64>; REPLICATES] {
        let mut total = self.total(x, y);
        if let Some(splats) = &self.splats {
            let beside = splats.beside(self.index(x, y), counts);
            let pairs = total.iter_mut().flatten().zip(beside.iter().flatten());
            pairs.for_each(|(sum, more)| *sum += more);
        }
        total
    }
}

/// A number in [0, 1) made of a splat's bits.
fn hash(pixel: [u32; 2], value: [f32; 3]) -> f64 {
    let [r, g, b] = value.map(|v| u64::from(v.to_bits()));
    let [x, y] = pixel.map(u64::from);
    let mut h = (r ^ g << 32) ^ (b ^ x << 32).rotate_left(17) ^ (y << 3).rotate_left(41);
    // The finalizer of SplitMix64 [Steele2014].
    h = (h ^ h >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ h >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^= h >> 31;
    (h >> 11) as f64 * (-53f64).exp2()
}

/// Rectangles joined where one continues another downwards: fewer to look through.
fn joined(rects: &[Rect]) -> Vec<Rect> {
    let mut out: Vec<Rect> = Vec::new();
    for rect in rects {
        let above = |r: &&mut Rect| r.y1 == rect.y0 && (r.x0, r.x1) == (rect.x0, rect.x1);
        match out.iter_mut().find(above) {
            Some(above) => above.y1 = rect.y1,
            None => out.push(*rect),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [3, 2];

    fn splat(x: u32, replicate: usize, value: [f32; 3]) -> Splat {
        Splat::new([x, 0], SIZE[0], replicate, value)
    }

    fn film() -> Film {
        let mut film = Film::new(SIZE, Rect::whole(SIZE), 1);
        film.begin_splats(SplatSetup {
            paths: 64,
            scale: 16.0,
        });
        film
    }

    #[test]
    fn order_does_not_matter_and_faint_splats_count_on_average() {
        let faint = |k: u32| splat(1, 0, [1e-12 * (1.0 + k as f32 * 1e-4), 3.0, 7.5]);
        let mut all: Vec<Splat> = (0..4000).map(faint).collect();
        let [mut one, mut other] = [film(), film()];
        one.put_passes(Rect::whole(SIZE), &Passes::new(0..4, SIZE[0], all.clone()));
        all.reverse();
        let (a, b) = all.split_at(1234);
        let whole = Rect::whole(SIZE);
        other.put_passes(whole, &Passes::new(0..2, SIZE[0], a.to_vec()));
        other.put_passes(whole, &Passes::new(2..4, SIZE[0], b.to_vec()));
        assert_eq!(one, other);
        let light = one.all_light(1, 0, &[1; REPLICATES]);
        let expected: f64 = all.iter().map(|s| f64::from(s.value[0])).sum();
        // Each is a fifteenth of a step.
        assert!((light[0][0] / expected - 1.0).abs() < 0.2, "{light:?}");
        assert!((light[0][1] - 12_000.0).abs() < 1e-3);
    }

    #[test]
    fn no_carry_of_a_large_sum_is_lost() {
        let mut film = film();
        let scale = film.splats().expect("splats").setup.scale as f32;
        let (large, small) = (scale * 16f32.exp2(), scale * (-40f32).exp2());
        let mut splats = vec![splat(1, 0, [large, 0.0, 0.0]); 200];
        splats.extend(vec![splat(1, 0, [small, 0.0, 0.0]); 100]);
        let whole = Rect::whole(SIZE);
        film.put_passes(whole, &Passes::new(0..1, SIZE[0], splats.clone()));
        let sum = |film: &Film| film.splats().expect("splats").sums()[1][0][0];
        assert_eq!(sum(&film), 200 * (1 << 56) + 100);
        // What is beyond its range stays the largest number, and does not begin at 0 again.
        film.put_passes(whole, &Passes::new(4..5, SIZE[0], splats));
        assert_eq!(sum(&film), u64::MAX);
    }

    #[test]
    fn a_pixel_is_the_mean_of_its_samples_plus_that_of_its_passes() {
        let mut film = film();
        let whole = Rect::whole(SIZE);
        film.put_samples(whole, 0..8, vec![[[2.0, 2.0, 2.0, 2.0]; REPLICATES]; 6]);
        let passes: Vec<Splat> = (0..4).map(|r| splat(2, r, [r as f32 + 1.0; 3])).collect();
        film.put_passes(whole, &Passes::new(0..4, SIZE[0], passes));
        let counts = [2; REPLICATES];
        assert_eq!(film.estimate(0, 0, &counts).mean, [1.0; 3]);
        let lit = film.estimate(2, 0, &counts);
        assert_eq!(lit.mean, [1.0 + 2.5; 3]);
        // Replicates' means are 2, 3, 4 and 5.
        let expected = (5.0f64 / 3.0 / 4.0).sqrt();
        assert!((lit.error[0] - expected).abs() < 1e-9, "{lit:?}");
    }

    #[test]
    fn splats_outside_the_wanted_pixels_are_left_out() {
        let mut film = film();
        let left = Rect {
            x1: 1,
            ..Rect::whole(SIZE)
        };
        let all = [splat(2, 0, [1.0; 3]), splat(0, 0, [1.0; 3])];
        film.put_passes(left, &Passes::new(0..1, SIZE[0], all.to_vec()));
        assert!(film.splats().expect("splats").sums()[2][0][0] == 0);
        assert!(film.splats().expect("splats").sums()[0][0][0] > 0);
    }

    #[test]
    fn rectangles_that_continue_each_other_are_joined() {
        let whole = Rect::whole([10, 12]);
        let bands: Vec<Rect> = (0..4)
            .map(|k| Rect {
                y0: 3 * k,
                y1: 3 * k + 3,
                ..whole
            })
            .collect();
        assert_eq!(joined(&bands), [whole]);
    }
}
