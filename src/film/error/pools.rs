//! Pixels, the pools that say how bright they are, and their terms in the error. `error.rs` says why.

use crate::film::REPLICATES;
use rayon::prelude::*;

/// A pixel stands for itself if so many samples carry its light. Its mean then has a relative error of about 1/4.
const ALONE: f64 = 16.0;

/// Samples that must carry the light of a pool. Its mean then has a relative error of about 0.4. Larger pools mix bright and dark pixels:
/// with 16, errors that pictures of 16 samples stated were off by a quarter on average over 62 scenes, and with so many by a fifth.
const ENOUGH: f64 = 6.25;

/// A pool says as much of its pixel's light as so many samples that have found some.
const BELIEF: f64 = 8.0;

/// Standard deviations by which another pixel of the pool may be darker than its own pixel.
const DARKER: f64 = 2.0;

/// The same, brighter. Less: beside a bright thing there are many brighter pixels, and they would hide noise.
const BRIGHTER: f64 = 1.0;

/// Radii of the squares that are tried, in pixels. Beyond the last one, the mean of the picture is taken if it is less than the
/// pool's.
const RADII: [u32; 5] = [1, 3, 7, 15, 31];

/// What the estimate needs to know of a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::film) struct Light {
    /// Number of samples.
    pub n: f64,
    /// Sum of their luminances.
    pub sum: f64,
    /// Sum of the squares.
    pub squares: f64,
    /// Squared standard error of the mean.
    pub variance: f64,
    /// Means of the replicates, if all of them have equally many samples.
    pub replicates: Option<[f64; REPLICATES]>,
}

impl Light {
    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }

    /// How many samples carry the light.
    pub fn carriers(&self) -> f64 {
        carriers(self.sum, self.squares)
    }

    /// Whether `other` may be as bright as this pixel.
    fn compatible(&self, other: &Self) -> bool {
        let size = (self.squares + other.squares) / (self.sum + other.sum);
        let (a, b) = (self.mean(), other.mean());
        // Each mean has the variance size * mean / n.
        let variance = size * (a / self.n + b / other.n);
        let most = if b > a { BRIGHTER } else { DARKER };
        (a - b).powi(2) <= most * most * variance
    }
}

fn carriers(sum: f64, squares: f64) -> f64 {
    if squares > 0.0 {
        sum * sum / squares
    } else {
        0.0
    }
}

/// A pixel's part in the error.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Term {
    /// s² / (Y² + floor²).
    pub value: f64,
    /// Relative variance of `value` by the pixel's own part in Y.
    own: f64,
    /// -½ of the derivative of `value` by the light of its pool.
    pool: f64,
    /// Derivative of ln `value` by -ln floor², times `value`.
    pub floor: f64,
    /// Radius of the pool; 0 for the pixel alone, `u32::MAX` for the picture.
    radius: u32,
}

/// The pixels of a film, in rows of `width`.
pub(super) struct Square<'a> {
    pixels: &'a [Light],
    /// [`Film::reached`].
    reached: &'a [u8],
    width: u32,
    height: u32,
    /// The light of all samples.
    light: f64,
    /// Sum of the squares.
    squares: f64,
}

/// Relative variances of the sum of all terms, or a pixel's part in them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Noise {
    /// By the terms alone, which are independent.
    pub terms: f64,
    /// By the pixels' Y.
    pub pools: f64,
    /// Twice the covariance of the two.
    pub both: f64,
}

impl std::iter::Sum for Noise {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            terms: a.terms + b.terms,
            pools: a.pools + b.pools,
            both: a.both + b.both,
        })
    }
}

/// The pixels that say how bright a pixel is.
#[derive(Debug, Clone, Copy, Default)]
struct Pool {
    /// Their mean luminance.
    mean: f64,
    /// Sum of the luminances of their samples.
    light: f64,
    /// Sum of the squares.
    squares: f64,
    /// The pixel's own light is part of it.
    own: bool,
    /// As in [`Term`].
    radius: u32,
}

/// A rectangle of a film: columns and rows.
type Window = [std::ops::Range<usize>; 2];

impl<'a> Square<'a> {
    pub fn new(pixels: &'a [Light], reached: &'a [u8], width: u32) -> Self {
        Self {
            pixels,
            reached,
            width,
            height: (pixels.len() / width as usize) as u32,
            light: pixels.iter().map(|p| p.sum).sum(),
            squares: pixels.iter().map(|p| p.squares).sum(),
        }
    }

    /// Pixel number i's part in the error. `mean` and `floor` are Ȳ and (0.1 Ȳ)².
    pub fn term(&self, i: usize, mean: f64, floor: f64) -> Term {
        let pixel = &self.pixels[i];
        if !(pixel.n > 0.0 && pixel.variance > 0.0) {
            return Term::default();
        }
        let pool = self.pool(i, mean);
        // How many samples of the pixel find light if it is as bright as its pool.
        let size = (pool.squares + pixel.squares) / (pool.light + pixel.sum);
        let finds = pixel.n * pool.mean / size;
        // The pool's part in Y. Half of the pixel's samples are in the two replicates that the rest comes from.
        let weight = match pool {
            Pool { radius: 0, .. } => 0.0,
            Pool { own: true, .. } => 1.0,
            _ => BELIEF / (BELIEF + 0.5 * finds),
        };
        let [value, by_y] = match pixel.replicates {
            Some(replicates) => crossed(replicates, weight, pool.mean, floor),
            None => {
                let y2 = pool.mean * pool.mean;
                let value = pixel.variance / (y2 + floor);
                [value, value * y2 / (y2 + floor)]
            }
        };
        let own = (1.0 - weight) * by_y / value;
        Term {
            value,
            own: 4.0 * own * own / finds.max(1.0),
            pool: if pool.light > 0.0 {
                weight * by_y / pool.light
            } else {
                0.0
            },
            floor: value - by_y,
            radius: pool.radius,
        }
    }

    /// Relative variances of `sum`, the sum of the terms.
    pub fn noise(&self, terms: &[Term], sum: f64) -> Noise {
        let total = |f: fn(&Term) -> f64| terms.iter().map(f).sum::<f64>();
        let of_picture = |t: &Term| if t.radius == u32::MAX { t.pool } else { 0.0 };
        let everywhere = total(of_picture) + total(|t| t.floor) / self.light;
        let in_pools = self.in_pools(terms);
        let of_pixel = |k: usize| {
            let (pixel, term) = (&self.pixels[k], &terms[k]);
            let value = term.value / sum;
            let by_light = -2.0 * pixel.sum * (in_pools[k] + everywhere) / sum;
            let carriers = pixel.carriers().max(1.0);
            Noise {
                terms: value * value,
                pools: value * value * term.own + by_light * by_light / carriers,
                both: 2.0 * value * by_light / carriers,
            }
        };
        let width = self.width as usize;
        // Row by row, so that the sum does not depend on the number of threads.
        let rows: Vec<Noise> = (0..self.height as usize)
            .into_par_iter()
            .map(|y| (y * width..(y + 1) * width).map(of_pixel).sum())
            .collect();
        rows.into_iter().sum()
    }

    /// For each pixel, the sum of [`Term::pool`] of the other pixels whose pools it is in.
    fn in_pools(&self, terms: &[Term]) -> Vec<f64> {
        /// Rows that a thread fills.
        const BAND: usize = 16;
        let (width, height) = (self.width as usize, self.height as usize);
        let farthest = RADII[RADII.len() - 1] as usize;
        let mut sums = vec![0.0; terms.len()];
        let bands = sums.par_chunks_mut(BAND * width).enumerate();
        bands.for_each(|(band, sums)| {
            let first = band * BAND;
            let end = first + sums.len() / width;
            let near = first.saturating_sub(farthest)..height.min(end + farthest);
            let from = near.start * width;
            for (i, term) in (from..).zip(&terms[from..near.end * width]) {
                if term.pool == 0.0 || term.radius == u32::MAX {
                    continue;
                }
                let [columns, rows] = window(i, term.radius, self.width, self.height);
                for y in rows.start.max(first)..rows.end.min(end) {
                    for x in columns.clone() {
                        let k = y * width + x;
                        if k != i && self.in_pool(i, k) {
                            sums[k - first * width] += term.pool;
                        }
                    }
                }
            }
        });
        sums
    }

    /// Whether pixel number k may be as bright as number i, so that it is in the pool of i if it is near.
    fn in_pool(&self, i: usize, k: usize) -> bool {
        let other = &self.pixels[k];
        other.n > 0.0 && self.reached.get(k) != Some(&0) && self.pixels[i].compatible(other)
    }

    /// A pixel's pool.
    fn pool(&self, i: usize, mean: f64) -> Pool {
        let pixel = &self.pixels[i];
        let own = pixel.carriers();
        if own >= ALONE {
            return Pool {
                mean: pixel.mean(),
                light: pixel.sum,
                squares: pixel.squares,
                own: true,
                radius: 0,
            };
        }
        let mut widest = Pool::default();
        for radius in RADII {
            let [columns, rows] = window(i, radius, self.width, self.height);
            let whole = columns.len() == self.width as usize && rows.len() == self.height as usize;
            let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
            for y in rows {
                for k in
                    y * self.width as usize + columns.start..y * self.width as usize + columns.end
                {
                    let p = &self.pixels[k];
                    if k == i || self.in_pool(i, k) {
                        n += p.n;
                        sum += p.sum;
                        squares += p.squares;
                    }
                }
            }
            widest = Pool {
                mean: sum / n,
                light: sum,
                squares,
                own: true,
                radius,
            };
            let enough = carriers(sum, squares) >= ENOUGH;
            let others = n - pixel.n;
            if enough && others > 0.0 {
                // The pixel's own light would hide its own noise.
                let light = sum - pixel.sum;
                return Pool {
                    mean: light / others,
                    light,
                    squares: squares - pixel.squares,
                    own: false,
                    radius,
                };
            }
            if enough || whole {
                return widest;
            }
        }
        if mean < widest.mean {
            return Pool {
                mean,
                light: self.light,
                squares: self.squares,
                own: true,
                radius: u32::MAX,
            };
        }
        widest
    }
}

/// s² / (Y² + floor) of a pixel, and its derivative by -ln Y, halved. Where its samples are skewed, a mean that is too bright comes with a
/// variance that is too large, and their quotient is too small. So each pair of replicates gives a variance, and the other two a mean
/// that is independent of it. Y is that mean and, with the given `weight`, the pool's. The last factor takes off what the noise of the
/// former adds (to second order).
fn crossed(replicates: [f64; REPLICATES], weight: f64, pool: f64, floor: f64) -> [f64; 2] {
    /// The expansion is of no use where the noise is as large as the mean.
    const MOST: f64 = 0.5;
    let mut sums = [0.0; 2];
    for (a, b, c, d) in [
        (0, 1, 2, 3),
        (0, 2, 1, 3),
        (0, 3, 1, 2),
        (1, 2, 0, 3),
        (1, 3, 0, 2),
        (2, 3, 0, 1),
    ] {
        let [a, b, c, d] = [a, b, c, d].map(|r: usize| replicates[r]);
        let y = weight * pool + (1.0 - weight) * 0.5 * (c + d);
        let noise = ((1.0 - weight) * 0.5 * (c - d)).powi(2);
        let scale = y * y + floor;
        let curvature = (3.0 * y * y - floor) / (scale * scale);
        let correction = 1.0 - (curvature * noise).clamp(-MOST, MOST);
        let term = 0.125 * (a - b).powi(2) / scale * correction / 6.0;
        sums[0] += term;
        sums[1] += term * y * y / scale;
    }
    sums
}

/// The columns and rows within `radius` of pixel number i.
fn window(i: usize, radius: u32, width: u32, height: u32) -> Window {
    let [width, height, radius] = [width, height, radius].map(|n| n as usize);
    let around = |at: usize, length: usize| {
        at.saturating_sub(radius)..length.min(at.saturating_add(radius + 1))
    };
    [around(i % width, width), around(i / width, height)]
}
