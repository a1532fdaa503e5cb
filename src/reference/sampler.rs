//! Random numbers. They are counter-based: the numbers of a sample depend only on seed, pixel and sample number.

/// Step between the states of SplitMix64 (Steele, Lea & Flood 2014).
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Keeps the keys of stratum shuffles different from those of samples.
const SHUFFLE: u64 = 0x5348_5546_464c_4500;

/// The output function of SplitMix64: a bijection of u64 whose values look random.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(GOLDEN);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

fn key_of(parts: [u64; 4]) -> u64 {
    parts.into_iter().fold(0, |key, part| mix(key ^ part))
}

/// The random numbers of one sample of one pixel.
#[derive(Debug, Clone)]
pub struct Sampler {
    key: u64,
    dimension: u64,
}

impl Sampler {
    /// The numbers of sample `sample` of pixel number `pixel` of the whole picture.
    pub fn new(seed: u32, pixel: u64, sample: u64) -> Self {
        Self {
            key: key_of([u64::from(seed), pixel, sample, 0]),
            dimension: 0,
        }
    }

    /// Goes to the numbers of path vertex `vertex`; 0 is the camera. So numbers that one vertex leaves unused do not shift those of the
    /// next.
    pub fn start_vertex(&mut self, vertex: u32) {
        self.dimension = u64::from(vertex) << 32;
    }

    /// The next number, uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn uniform(&mut self) -> f64 {
        let bits = mix(self.key ^ mix(self.dimension));
        self.dimension += 1;
        (bits >> 11) as f64 * (-53f64).exp2()
    }
}

/// Column and row of the cell, out of `strata` x `strata`, that sample `sample` of a pixel falls in. Each round of strata² samples
/// visits every cell once, in an order of its own.
pub fn stratum(seed: u32, pixel: u64, sample: u64, strata: u32) -> [u32; 2] {
    let cells = u64::from(strata) * u64::from(strata);
    let key = key_of([u64::from(seed), pixel, sample / cells, SHUFFLE]);
    // The permutation is not perfectly random. The rotation makes sure that every cell is equally often at every place of the
    // round.
    let turned = u128::from(permuted(sample % cells, cells, key)) + u128::from(mix(key) % cells);
    let cell = (turned % u128::from(cells)) as u64;
    [
        (cell % u64::from(strata)) as u32,
        (cell / u64::from(strata)) as u32,
    ]
}

/// Element `index` of a permutation of 0..cells that `key` chooses: a Feistel network over the next power of four, applied
/// again until the result is below `cells` (Black & Rogaway 2002).
fn permuted(index: u64, cells: u64, key: u64) -> u64 {
    let bits = u64::BITS - (cells - 1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mask = (1u64 << half) - 1;
    let mut x = index;
    loop {
        let (mut left, mut right) = (x >> half, x & mask);
        for round in 0..6 {
            let f = mix(key ^ mix(right | round << 48));
            (left, right) = (right, left ^ (f & mask));
        }
        x = left << half | right;
        if x < cells {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::chi_square;
    use std::collections::HashSet;

    #[test]
    fn every_round_visits_every_cell_once() {
        for strata in [1, 2, 3, 5, 16] {
            let cells = u64::from(strata * strata);
            for round in 0..50 {
                let seen: HashSet<[u32; 2]> = (0..cells)
                    .map(|k| stratum(7, 123, round * cells + k, strata))
                    .collect();
                assert_eq!(
                    seen.len() as u64,
                    cells,
                    "strata {strata}, round {round}: {seen:?}"
                );
            }
        }
    }

    #[test]
    fn all_24_orders_of_four_cells_are_equally_likely() {
        let mut counts = std::collections::HashMap::new();
        let rounds = 48_000;
        for round in 0..rounds {
            let order: Vec<_> = (0..4).map(|k| stratum(1, 5, round * 4 + k, 2)).collect();
            *counts.entry(order).or_insert(0.0) += 1.0;
        }
        assert_eq!(counts.len(), 24);
        let observed: Vec<f64> = counts.into_values().collect();
        chi_square::assert_agrees("orders", &observed, &[rounds as f64 / 24.0; 24]);
    }

    #[test]
    fn the_largest_rounds_stay_in_range() {
        let strata = u32::MAX;
        for sample in [0, 1, u64::MAX] {
            let [x, y] = stratum(0, 0, sample, strata);
            assert!(x < strata && y < strata);
        }
    }

    #[test]
    fn pairs_of_neighbouring_dimensions_and_samples_fill_the_square() {
        let n = 16;
        let mut by_dimension = vec![0.0; n * n];
        let mut by_sample = vec![0.0; n * n];
        let bin = |u: f64| (u * n as f64) as usize;
        let count = 100_000;
        for sample in 0..count {
            let mut rng = Sampler::new(0, 3, sample);
            rng.start_vertex(2);
            let (a, b) = (rng.uniform(), rng.uniform());
            let mut next = Sampler::new(0, 3, sample + 1);
            next.start_vertex(2);
            let c = next.uniform();
            by_dimension[bin(a) * n + bin(b)] += 1.0;
            by_sample[bin(a) * n + bin(c)] += 1.0;
        }
        let expected = vec![count as f64 / (n * n) as f64; n * n];
        chi_square::assert_agrees("dimensions", &by_dimension, &expected);
        chi_square::assert_agrees("samples", &by_sample, &expected);
    }
}
