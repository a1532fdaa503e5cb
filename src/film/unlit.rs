//! The errors of pixels that have found no light, among others that have found little.
//!
//! The samples of such a pixel agree by chance: all are zero. Its standard error is not zero. What it is wrong by is the light that it
//! should have, and its neighbours tell how much that is: a few of them have found a bright sample. So its error is their mean light, with
//! the dark ones among them.
//!
//! A pixel that has found such a sample keeps what it states, about as much as it has found: that is what it is wrong by. If λ is the share
//! of the pixels that have found one, of light h, then the squared errors are (λ h)² for most and h² for a share of λ, as they are in truth.
//! With their root mean square √λ h for all of them, a pixel with light would be off by 1/√λ of its errors, and two pictures of the same
//! scene would differ by more than they state.
//!
//! A pixel of few samples may be dark without light being rare, so pixels with fewer than [`ENOUGH`] keep what they state.

use super::{Film, REPLICATES, replicate_counts};
use crate::stats::luminance;
use rayon::prelude::*;

/// A pixel has found little if its light has come from at most so many samples, after Kish \[Kish1965\]. Where half of the
/// pixels have found none, one in a thousand has found more.
const LITTLE: f64 = 4.0;

/// Samples that must carry the light of those that have found little.
const ENOUGH: f64 = 16.0;

/// Radii of the squares that are tried, in pixels.
const RADII: [usize; 5] = [1, 3, 7, 15, 31];

/// Rows that are worked on together, without the margin of the largest square.
const BAND: usize = 256;

/// Sums over the pixels of a rectangle that have found little: how many they are, how many have no light, the luminance of their samples
/// and its squares, and their radiance in R, G and B.
type Sums = [f64; 7];

impl Film {
    /// The errors of R, G, B and luminance of the pixels of the film's bounds that have found no light where some must be, row by row;
    /// `None` for the others, and in all where there are none.
    pub(crate) fn errors_of_unlit(&self) -> Option<Vec<Option<[f32; 4]>>> {
        if self.reached.is_empty() {
            return None;
        }
        let width = self.bounds.width() as usize;
        let height = self.bounds.height() as usize;
        let pixels = self.light();
        let found_little = |i: usize| {
            pixels[i].n >= ENOUGH && pixels[i].carriers() <= LITTLE && self.reached[i] > 0
        };
        let is_unlit = |i: usize| found_little(i) && pixels[i].sum == 0.0;
        if !(0..pixels.len()).into_par_iter().any(is_unlit) {
            return None;
        }
        let radiance = self.means();
        let mut out = vec![None; pixels.len()];
        let margin = RADII[RADII.len() - 1];
        for (band, rows) in out.chunks_mut(BAND * width).enumerate() {
            let first = (band * BAND).saturating_sub(margin);
            let last = ((band + 1) * BAND + margin).min(height);
            let item = |i: usize| -> Sums {
                let (p, [r, g, b]) = (&pixels[i], radiance[i]);
                if found_little(i) {
                    [1.0, f64::from(p.sum == 0.0), p.sum, p.squares, r, g, b]
                } else {
                    Sums::default()
                }
            };
            let table = Table::new(width, first..last, item);
            rows.par_iter_mut().enumerate().for_each(|(k, out)| {
                let i = band * BAND * width + k;
                if is_unlit(i) {
                    *out = table.missing_light(i % width, i / width);
                }
            });
        }
        Some(out)
    }

    /// The mean radiance of every pixel.
    fn means(&self) -> Vec<[f64; 3]> {
        let mut means = vec![[0.0; 3]; self.bounds.area() as usize];
        for (rect, ranges) in self.coverage.cells() {
            let counts: [u64; REPLICATES] = replicate_counts(ranges, self.strata);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    means[self.index(x, y)] = self.estimate(x, y, &counts).mean;
                }
            }
        }
        means
    }
}

/// Sums over all pixels of a band above and to the left of each corner.
struct Table {
    columns: usize,
    rows: std::ops::Range<usize>,
    sums: Vec<Sums>,
}

impl Table {
    fn new(width: usize, rows: std::ops::Range<usize>, item: impl Fn(usize) -> Sums) -> Self {
        let columns = width + 1;
        let mut sums = vec![Sums::default(); columns * (rows.len() + 1)];
        for y in 0..rows.len() {
            let mut row = Sums::default();
            for x in 0..width {
                let here = item((rows.start + y) * width + x);
                let above = sums[y * columns + x + 1];
                for c in 0..row.len() {
                    row[c] += here[c];
                    sums[(y + 1) * columns + x + 1][c] = above[c] + row[c];
                }
            }
        }
        Self {
            columns,
            rows,
            sums,
        }
    }

    /// The mean light around (x, y), in R, G, B and luminance, if most of the pixels there that have found little have found none.
    fn missing_light(&self, x: usize, y: usize) -> Option<[f32; 4]> {
        let [width, height] = [self.columns - 1, self.rows.len()];
        let y = y - self.rows.start;
        let mut sums = Sums::default();
        for radius in RADII {
            let (x0, x1) = (x.saturating_sub(radius), width.min(x + radius + 1));
            let (y0, y1) = (y.saturating_sub(radius), height.min(y + radius + 1));
            let at = |x: usize, y: usize| &self.sums[y * self.columns + x];
            sums = std::array::from_fn(|c| {
                at(x1, y1)[c] - at(x0, y1)[c] - at(x1, y0)[c] + at(x0, y0)[c]
            });
            if sums[3] > 0.0 && sums[2] * sums[2] >= ENOUGH * sums[3] {
                break;
            }
        }
        let [count, dark, _, _, light @ ..] = sums;
        let [r, g, b] = light.map(|l| l.max(0.0) / count);
        let errors = [r, g, b, luminance([r, g, b])].map(|e| e as f32);
        (2.0 * dark > count).then_some(errors)
    }
}
