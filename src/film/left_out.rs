//! Samples that were not finite. They are in no sum, so they must not be counted either.

use super::REPLICATES;
use std::collections::BTreeMap;

/// How many samples of each replicate were left out of a pixel. Sparse, since there should be none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LeftOut(BTreeMap<[u32; 2], [u64; REPLICATES]>);

impl LeftOut {
    /// Leaves `samples` of each replicate of pixel (x, y) out.
    pub(super) fn add(&mut self, x: u32, y: u32, samples: [u64; REPLICATES]) {
        if samples != [0; REPLICATES] {
            let sum = self.0.entry([y, x]).or_default();
            sum.iter_mut().zip(samples).for_each(|(s, n)| *s += n);
        }
    }

    /// Leaves out what `other` does, too.
    pub(super) fn merge(&mut self, other: &Self) {
        other.iter().for_each(|(x, y, n)| self.add(x, y, n));
    }

    /// What is left of `counts`, the samples of each replicate that pixel (x, y) was given.
    pub fn remaining(&self, x: u32, y: u32, counts: &[u64; REPLICATES]) -> [u64; REPLICATES] {
        match self.0.get(&[y, x]) {
            Some(out) => std::array::from_fn(|r| counts[r].saturating_sub(out[r])),
            None => *counts,
        }
    }

    /// Pixels (x, y) in row order, with the samples left out of them.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32, [u64; REPLICATES])> {
        self.0.iter().map(|(&[y, x], &n)| (x, y, n))
    }

    /// Rows x, y, and samples of each replicate, as films store them.
    pub(super) fn rows(&self) -> Vec<[u64; 2 + REPLICATES]> {
        let row = |(x, y, [a, b, c, d]): (u32, u32, [u64; REPLICATES])| {
            [u64::from(x), u64::from(y), a, b, c, d]
        };
        self.iter().map(row).collect()
    }
}
