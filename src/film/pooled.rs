//! The errors of pixels that have found no light, among others that have found none.
//!
//! Such a pixel's samples agree by chance: all are zero. Its standard error is not zero. It is the same as that of its neighbours,
//! a few of which have found a bright sample and state an error that is too large for themselves alone. So these pixels share the
//! mean of their squared errors. That leaves the sum of the squares as it was, which is right on average.
//!
//! A pixel of few samples may be dark without light being rare, so pixels with fewer than [`ENOUGH`] keep what they state.

use super::{Film, REPLICATES, replicate_counts};
use rayon::prelude::*;

/// A pixel shares its error if its light has come from fewer samples than this, after Kish \[Kish1965\]: from none or one.
const FEW: f64 = 2.0;

/// Samples that must carry the light of those that share.
const ENOUGH: f64 = 16.0;

/// Radii of the squares that are tried, in pixels.
const RADII: [usize; 5] = [1, 3, 7, 15, 31];

/// Rows that are worked on together, without the margin of the largest square.
const BAND: usize = 256;

/// Sums over a rectangle of pixels that may share: how many they are, how many have no light, their light and its squares, and the
/// squared errors of R, G, B and luminance.
type Sums = [f64; 8];

impl Film {
    /// The errors of the pixels of the film's bounds that share theirs with their neighbours, row by row; `None` for the others, and
    /// in all where no pixel does.
    pub(crate) fn shared_errors(&self) -> Option<Vec<Option<[f32; 4]>>> {
        if self.reached.is_empty() {
            return None;
        }
        let width = self.bounds.width() as usize;
        let height = self.bounds.height() as usize;
        let pixels = self.light();
        let may_share =
            |i: usize| pixels[i].n >= ENOUGH && pixels[i].carriers() < FEW && self.reached[i] > 0;
        let any = (0..pixels.len())
            .into_par_iter()
            .any(|i| may_share(i) && pixels[i].sum == 0.0);
        if !any {
            return None;
        }
        let errors = self.squared_errors();
        let mut out = vec![None; pixels.len()];
        let margin = RADII[RADII.len() - 1];
        for (band, rows) in out.chunks_mut(BAND * width).enumerate() {
            let first = (band * BAND).saturating_sub(margin);
            let last = ((band + 1) * BAND + margin).min(height);
            let item = |i: usize| -> Sums {
                let (p, e) = (&pixels[i], &errors[i]);
                if may_share(i) {
                    let dark = f64::from(p.sum == 0.0);
                    [1.0, dark, p.sum, p.squares, e[0], e[1], e[2], e[3]]
                } else {
                    Sums::default()
                }
            };
            let table = Table::new(width, first..last, item);
            rows.par_iter_mut().enumerate().for_each(|(k, out)| {
                let i = band * BAND * width + k;
                if may_share(i) {
                    *out = table.shared(i % width, i / width);
                }
            });
        }
        Some(out)
    }

    /// The squared errors of R, G, B and luminance of every pixel.
    fn squared_errors(&self) -> Vec<[f64; 4]> {
        let mut errors = vec![[0.0; 4]; self.bounds.area() as usize];
        for (rect, ranges) in self.coverage.cells() {
            let counts: [u64; REPLICATES] = replicate_counts(ranges, self.strata);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    errors[self.index(x, y)] = self.estimate(x, y, &counts).error.map(|e| e * e);
                }
            }
        }
        errors
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

    /// The errors that pixel (x, y) shares, if most of those that share them have found no light.
    fn shared(&self, x: usize, y: usize) -> Option<[f32; 4]> {
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
        let [count, dark, _, _, errors @ ..] = sums;
        let share = |e: f64| (e.max(0.0) / count).sqrt() as f32;
        (2.0 * dark > count).then_some(errors.map(share))
    }
}
