//! Tests whether two pictures differ by more than their noise.
//!
//! Blocks of pixels of every dyadic side, from one pixel to the whole picture, are tested in each channel. Let
//! d be the difference of the two pictures in a pixel, and v its variance as the pictures state it. With rare bright
//! samples (a caustic), v is unreliable: if they were missed, v is too small; if every replicate has equally many, v is
//! nearly 0. So no test relies on v alone.
//!
//! *Large blocks* have [`SIGNED_SIDE`] or more pixels per side. For two pictures of the same scene with equal sample counts,
//! the signs of the d are independent fair coins for any noise. Given the magnitudes, Σ d / √Σ d² then has tails at
//! most [`BENTKUS`] times those of the normal distribution \[Bentkus2015\], for any number of pixels and any
//! tails of the noise. The denominator is at least √Σ v. This matters for unequal sample counts, if the picture with fewer
//! samples missed rare bright ones. Every such block is tested twice: as it is ([`Kind::Mean`]), and with each
//! pixel divided by the noise of the pixels around it ([`Kind::Standardised`]). The coins stay fair, since
//! that noise contains neither the pixel's value nor its sign. The second test detects a change beside a caustic.
//!
//! *Small blocks* have too few coins for small probabilities. Two tests must agree there. One is Welch's t with
//! the larger of the block's own variance and the mean variance around it, with Satterthwaite's degrees of freedom over
//! both. The other is Welch's t with only the block's own variance. Its p-value may be as large as the square root of the
//! first one's, since eight replicates can't give smaller ones.
//!
//! The false-alarm rate is divided equally among all scales and kinds, and then among blocks and channels
//! (Bonferroni). No test can detect a bright path that neither picture has sampled.

use super::grid::{Grid, Terms};
use super::picture::Side;
use crate::film::coverage::Rect;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// Side of the smallest blocks that are tested by their signs: 64 coins.
pub const SIGNED_SIDE: u32 = 8;

/// Tails of a sum of coins of any sizes are at most this much heavier than the normal distribution's: 1/(4 Φc(√2)).
pub const BENTKUS: f64 = 3.178_5;

/// Means with a smaller relative difference count as equal: f32 sums of a block of samples have this rounding error.
pub(super) const ROUNDING: f64 = 2e-6;

/// Findings that are kept.
const MOST_FINDINGS: usize = 8;

/// What a test is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Welch's t of a small block.
    Small,
    /// Signs, weighing pixels equally.
    Mean,
    /// Signs, weighing pixels by the noise around them.
    Standardised,
}

/// A block that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Its pixels.
    pub rect: Rect,
    /// Whether they are the whole picture.
    pub whole: bool,
    /// 0, 1, 2, 3: red, green, blue, luminance.
    pub channel: usize,
    /// Which test found it.
    pub kind: Kind,
    /// The probability that one of all tests finds such a difference in equal pictures.
    pub p: f64,
    /// (B - A) over its standard error, as tested.
    pub z: f64,
    /// Mean of the channel over the block in A and B.
    pub means: [f64; 2],
    /// Standard error of the difference of those means, as the pictures state it.
    pub error: f64,
    /// Whether most of its light has no noise: it comes straight from a lamp.
    pub lamp: bool,
}

/// The smallest change that the tests detect with probability [`POWER`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Side of the block; 0 for the whole picture.
    pub side: u32,
    /// Relative change of the block's brightness, the median over blocks; infinite if no change would be detected.
    pub change: f64,
}

/// The probability that [`Sensitivity`] speaks of.
pub const POWER: f64 = 0.95;

/// Standard normal quantile of [`POWER`].
const POWER_QUANTILE: f64 = 1.644_854;

/// The result of the tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// The false-alarm rate over the whole picture.
    pub alpha: f64,
    /// The probability that pictures of the same scene differ as much somewhere; an upper bound.
    pub p: f64,
    /// Tests made.
    pub tests: usize,
    /// What differs: the whole picture if it does, then at most eight disjoint blocks, most certain first, and lamps that are seen
    /// directly after all others: they have no noise, and any change of them is certain.
    pub findings: Vec<Finding>,
    /// The detectable changes, from the whole picture to the smallest blocks.
    pub sensitivity: Vec<Sensitivity>,
}

impl Verdict {
    /// Whether nothing differs by more than the noise.
    pub fn same(&self) -> bool {
        self.p >= self.alpha
    }
}

/// Tests two pictures of the same size, covered in the same pixels, which both state their noise.
pub fn verdict(a: &Side, b: &Side, alpha: f64) -> Verdict {
    let tested = channels(a, b);
    let terms: Vec<Terms> = tested.iter().map(|&c| Terms::new(a, b, c)).collect();
    let sides = sides(a.size);
    let families: usize = sides.iter().map(|&side| kinds(side).len()).sum();
    let mut all = Vec::new();
    let mut sensitivity = Vec::new();
    let mut tests = 0;
    for &side in sides.iter().rev() {
        let mut seen: Vec<f64> = Vec::new();
        for &kind in kinds(side) {
            let grids = terms.iter().map(|t| t.grid(side, kind));
            let grids: Vec<Grid> = grids.collect();
            let count: usize = grids.iter().map(|g| g.blocks.len()).sum();
            tests += count;
            let share = (count * families) as f64;
            for (&channel, grid) in tested.iter().zip(&grids) {
                let found = grid.blocks.iter().filter_map(|block| {
                    let (p, z) = test(kind, block);
                    let p = (p * share).min(1.0);
                    Some((p, z, block)).filter(|_| p < 1.0)
                });
                all.extend(found.map(|(p, z, block)| Finding {
                    rect: block.rect,
                    whole: block.rect == Rect::whole(a.size),
                    channel,
                    kind,
                    p,
                    z,
                    means: block.means,
                    error: block.error,
                    lamp: block.noisy_light < 0.5 * block.light,
                }));
            }
            if kind != Kind::Small {
                let needed = threshold(alpha / share) + POWER_QUANTILE;
                changes(&mut seen, &grids, needed);
            }
        }
        if !seen.is_empty() {
            let middle = seen.len() / 2;
            let (_, median, _) = seen.select_nth_unstable_by(middle, f64::total_cmp);
            sensitivity.push(Sensitivity {
                side: if sensitivity.is_empty() { 0 } else { side },
                change: *median,
            });
        }
    }
    all.sort_by(|a, b| a.p.total_cmp(&b.p).then(b.z.abs().total_cmp(&a.z.abs())));
    Verdict {
        alpha,
        p: all.first().map_or(1.0, |f| f.p),
        tests,
        findings: pick(all, alpha),
        sensitivity,
    }
}

/// The channels whose noise both pictures state: red, green and blue, or the luminance alone.
fn channels(a: &Side, b: &Side) -> &'static [usize] {
    let alone = |p: &Side| p.noise.as_ref().is_some_and(|n| n.luminance_alone);
    if alone(a) || alone(b) {
        &[3]
    } else {
        &[0, 1, 2]
    }
}

/// Every pixel's difference in luminance over its noise, B less A: for maps and histograms.
pub(super) fn scores(a: &Side, b: &Side) -> Vec<f64> {
    Terms::new(a, b, 3).scores()
}

/// Sides of blocks: powers of two, the last one as wide as the picture or wider.
fn sides(size: [u32; 2]) -> Vec<u32> {
    let longest = size[0].max(size[1]);
    let mut sides = vec![1];
    while sides[sides.len() - 1] < longest {
        sides.push(2 * sides[sides.len() - 1]);
    }
    sides
}

fn kinds(side: u32) -> &'static [Kind] {
    if side < SIGNED_SIDE {
        &[Kind::Small]
    } else {
        &[Kind::Mean, Kind::Standardised]
    }
}

/// Sums over a block of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block {
    pub rect: Rect,
    /// Pixels.
    pub count: f64,
    /// Σ d, weighed as the kind of test wants.
    pub difference: f64,
    /// Σ d², likewise.
    pub squares: f64,
    /// Σ v, likewise.
    pub variance: f64,
    /// The mean of v around, times the pixels.
    pub around: f64,
    /// Σ of the mean of both pictures, weighed; and of those pixels alone that have noise.
    pub light: f64,
    pub noisy_light: f64,
    /// Degrees of freedom of `variance` and of what is around it too.
    pub dof: [f64; 2],
    /// Unweighed means in A and B.
    pub means: [f64; 2],
    /// Standard error of their difference.
    pub error: f64,
}

/// The p-value (two-sided, not corrected), and the signed statistic.
fn test(kind: Kind, block: &Block) -> (f64, f64) {
    let d = block.difference;
    if d == 0.0 {
        return (1.0, 0.0);
    }
    let rounding = (ROUNDING * block.light).powi(2);
    let over = |variance: f64| d / (variance + rounding).sqrt();
    if kind != Kind::Small {
        let z = over(block.variance.max(block.squares));
        return ((BENTKUS * two_sided_normal(z)).min(1.0), z);
    }
    let pooled = over(block.variance.max(block.around));
    let own = two_sided_t(over(block.variance), block.dof[0]);
    (two_sided_t(pooled, block.dof[1]).max(own * own), pooled)
}

fn two_sided_normal(z: f64) -> f64 {
    erfc(z.abs() / SQRT_2)
}

/// Two-sided p-value of Student's t.
pub fn two_sided_t(t: f64, dof: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, dof) {
        Ok(dist) if t.is_finite() => 2.0 * dist.cdf(-t.abs()),
        _ => 0.0,
    }
}

/// The statistic of a large block whose p-value is `p`.
fn threshold(p: f64) -> f64 {
    SQRT_2 * erfc_inv((p / BENTKUS).min(1.0))
}

/// For each block the smallest relative change of its light that brings the statistic of some channel to `needed`. Light without
/// noise does not count if there is other light: it comes straight from a lamp, and a change of the scene's reflection leaves it as it
/// is. A change adds to Σ d² too: of n pixels no statistic exceeds √n.
fn changes(seen: &mut Vec<f64>, grids: &[Grid], needed: f64) {
    let of = |block: &Block| {
        let room = 1.0 - needed * needed / block.count;
        let light = if block.noisy_light > 0.0 {
            block.noisy_light
        } else {
            block.light
        };
        if room > 0.0 && light > 0.0 {
            needed * (block.variance / room).sqrt() / light
        } else {
            f64::INFINITY
        }
    };
    for k in 0..grids[0].blocks.len() {
        let least = grids
            .iter()
            .map(|g| of(&g.blocks[k]))
            .fold(f64::INFINITY, f64::min);
        // The first kind has been here when the second comes.
        match seen.get_mut(k) {
            Some(have) => *have = have.min(least),
            None => seen.push(least),
        }
    }
}

/// The findings to report: those that are significant, and among overlapping blocks only the most significant one. Of lamps there is
/// one at least, if there are any.
fn pick(all: Vec<Finding>, alpha: f64) -> Vec<Finding> {
    let certain = all.into_iter().filter(|f| f.p < alpha);
    let (whole, blocks): (Vec<Finding>, Vec<Finding>) = certain.partition(|f| f.whole);
    let blocks = blocks.into_iter();
    let (lamps, others): (Vec<Finding>, Vec<Finding>) = blocks.partition(|f| f.lamp);
    let room_of_others = MOST_FINDINGS - usize::from(!lamps.is_empty());
    let mut kept: Vec<Finding> = Vec::new();
    for (findings, most) in [(others, room_of_others), (lamps, MOST_FINDINGS)] {
        for finding in findings {
            let told = |k: &Finding| k.rect.intersection(&finding.rect).is_some();
            if kept.len() < most && !kept.iter().any(told) {
                kept.push(finding);
            }
        }
    }
    whole.into_iter().take(1).chain(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_come_last_and_one_of_them_is_told() {
        let finding = |x0: u32, p: f64, lamp: bool| Finding {
            rect: Rect {
                x0,
                y0: 0,
                x1: x0 + 1,
                y1: 1,
            },
            whole: false,
            channel: 0,
            kind: Kind::Small,
            p,
            z: 9.0,
            means: [1.0, 2.0],
            error: 0.1,
            lamp,
        };
        let lamps = (0..20).map(|k| finding(k, 0.0, true));
        let others = (20..40).map(|k| finding(k, 1e-9, false));
        let all: Vec<Finding> = lamps.clone().chain(others).collect();
        let told: Vec<u32> = pick(all, 1e-3).iter().map(|f| f.rect.x0).collect();
        assert_eq!(told, [20, 21, 22, 23, 24, 25, 26, 0]);
        assert_eq!(pick(lamps.collect(), 1e-3).len(), MOST_FINDINGS);
    }
}
