//! Sums over blocks of pixels, for the tests of the verdict.

use super::picture::Side;
use super::verdict::{Block, Kind, ROUNDING};
use crate::film::coverage::Rect;
use crate::stats::luminance;

/// Lower limit of the variance by which a pixel is divided, as a fraction of the picture's mean variance. Without it, pixels
/// without noise (such as those of a lamp) would outweigh all others.
const LEAST_VARIANCE: f64 = 1e-3;

/// A pixel has noise if its error is more than this share of its light: the roundings of sums in f32 are less.
const NOISELESS: f64 = 1e-5;

/// One channel of both pictures; all 0 in pixels without samples.
pub(super) struct Terms {
    size: [u32; 2],
    means: Vec<[f64; 2]>,
    covered: Vec<bool>,
    /// Variance of the difference, as stated.
    variance: Vec<f64>,
    /// Variance of that variance, halved: V² over Σ of these is Satterthwaite's degrees of freedom.
    spread: Vec<f64>,
    /// The mean variance of a pixel and its neighbours.
    around: Vec<f64>,
    /// One over the noise of the pixel's neighbours.
    weight: Vec<f64>,
}

/// All blocks of one side that hold covered pixels.
pub(super) struct Grid {
    pub blocks: Vec<Block>,
}

impl Terms {
    /// Both pictures state their noise and are of one size. Channels are R, G, B, and the luminance.
    pub fn new(a: &Side, b: &Side, channel: usize) -> Self {
        let (Some(na), Some(nb)) = (&a.noise, &b.noise) else {
            unreachable!("only pictures that state their noise are tested");
        };
        let pixels = a.rgb.len();
        let mut terms = Self {
            size: a.size,
            means: (0..pixels)
                .map(|i| [a, b].map(|p| value(p.rgb[i], channel)))
                .collect(),
            covered: a.covered.clone(),
            variance: vec![0.0; pixels],
            spread: vec![0.0; pixels],
            around: vec![0.0; pixels],
            weight: vec![0.0; pixels],
        };
        for i in (0..pixels).filter(|&i| a.covered[i]) {
            let [n, m] = [na.samples[i], nb.samples[i]].map(|n| n as f64);
            let (mut va, mut vb) = (na.error[i][channel].powi(2), nb.error[i][channel].powi(2));
            // Samples of both pictures have the same variance if both were rendered alike. The picture with more samples
            // estimates it better: rare bright samples may be missing from the other.
            if na.unit == nb.unit && va * n / m + vb * m / n > va + vb {
                (va, vb) = (va * n / m, vb * m / n);
            }
            terms.variance[i] = va + vb;
            terms.spread[i] =
                va * va / f64::from(na.replicates - 1) + vb * vb / f64::from(nb.replicates - 1);
        }
        terms.look_around();
        terms
    }

    /// Fills `around` and `weight`.
    fn look_around(&mut self) {
        let covered = self.covered.iter().filter(|c| **c).count();
        let floor = LEAST_VARIANCE * self.variance.iter().sum::<f64>() / covered as f64;
        for i in (0..self.variance.len()).filter(|&i| self.covered[i]) {
            let (x, y) = (i as u32 % self.size[0], i as u32 / self.size[0]);
            let (mut sum, mut n) = (0.0, 0.0);
            self.each(grown(x, y, 1, self.size), |k| {
                sum += self.variance[k];
                n += 1.0;
            });
            self.around[i] = sum / n;
            let others = if n > 1.0 {
                ((sum - self.variance[i]) / (n - 1.0)).max(0.0)
            } else {
                0.0
            };
            let noise = (others + floor).sqrt();
            self.weight[i] = if noise > 0.0 { 1.0 / noise } else { 0.0 };
        }
    }

    /// Every pixel's difference over its noise, B less A, as a test of this pixel alone would have it.
    pub fn scores(&self) -> Vec<f64> {
        let score = |i: usize| {
            let [a, b] = self.means[i];
            let noise = self.variance[i].max(self.around[i]).sqrt();
            if a == b {
                0.0
            } else {
                (b - a) / noise.max(ROUNDING * a.abs().max(b.abs()))
            }
        };
        (0..self.means.len()).map(score).collect()
    }

    /// Calls `f` with the index of every covered pixel of `rect`.
    fn each(&self, rect: Rect, mut f: impl FnMut(usize)) {
        for y in rect.y0..rect.y1 {
            let row = (y * self.size[0]) as usize;
            for i in row + rect.x0 as usize..row + rect.x1 as usize {
                if self.covered[i] {
                    f(i);
                }
            }
        }
    }

    /// The blocks of a side.
    pub fn grid(&self, side: u32, kind: Kind) -> Grid {
        let [width, height] = self.size;
        let corners = (0..height)
            .step_by(side as usize)
            .flat_map(|y| (0..width).step_by(side as usize).map(move |x| (x, y)));
        Grid {
            blocks: corners
                .map(|(x, y)| self.block(x, y, side, kind))
                .filter(|b| b.count > 0.0)
                .collect(),
        }
    }

    fn block(&self, x: u32, y: u32, side: u32, kind: Kind) -> Block {
        let rect = Rect {
            x0: x,
            y0: y,
            x1: self.size[0].min(x + side),
            y1: self.size[1].min(y + side),
        };
        let mut b = Block {
            rect,
            count: 0.0,
            difference: 0.0,
            squares: 0.0,
            variance: 0.0,
            around: 0.0,
            light: 0.0,
            noisy_light: 0.0,
            dof: [f64::INFINITY; 2],
            means: [0.0; 2],
            error: 0.0,
        };
        let mut spread = 0.0;
        self.each(rect, |i| {
            let w = match kind {
                Kind::Standardised => self.weight[i],
                Kind::Small | Kind::Mean => 1.0,
            };
            let [ma, mb] = self.means[i];
            let d = w * (mb - ma);
            b.count += 1.0;
            b.difference += d;
            b.squares += d * d;
            b.variance += w * w * self.variance[i];
            b.around += w * w * self.around[i];
            let light = 0.5 * (ma + mb);
            b.light += w * light;
            if self.variance[i] > (NOISELESS * light).powi(2) {
                b.noisy_light += w * light;
            }
            b.means[0] += ma;
            b.means[1] += mb;
            b.error += self.variance[i];
            spread += self.spread[i];
        });
        if kind == Kind::Small {
            b.dof[0] = freedom(b.variance, spread);
            let (mut v, mut s) = (0.0, 0.0);
            self.each(grown(x, y, side, self.size), |i| {
                v += self.variance[i];
                s += self.spread[i];
            });
            b.dof[1] = freedom(v, s);
        }
        b.means = b.means.map(|m| m / b.count);
        b.error = b.error.sqrt() / b.count;
        b
    }
}

fn value(rgb: [f64; 3], channel: usize) -> f64 {
    rgb.get(channel).copied().unwrap_or_else(|| luminance(rgb))
}

/// Satterthwaite's degrees of freedom of a variance; many for one that is known to be 0.
fn freedom(variance: f64, spread: f64) -> f64 {
    const MANY: f64 = 1e6;
    if spread > 0.0 {
        (variance * variance / spread).clamp(1.0, MANY)
    } else {
        MANY
    }
}

/// A block of pixels and the ring around it.
fn grown(x: u32, y: u32, side: u32, size: [u32; 2]) -> Rect {
    Rect {
        x0: x.saturating_sub(1),
        y0: y.saturating_sub(1),
        x1: size[0].min(x + side + 1),
        y1: size[1].min(y + side + 1),
    }
}
