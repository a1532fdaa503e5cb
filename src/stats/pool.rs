//! Weighted means over the surroundings of each pixel.

use rayon::prelude::*;

/// Standard deviations at which a Gaussian ends.
const REACH: f64 = 3.0;

/// The mean by a Gaussian of standard deviation `sigma` pixels. Beyond its edges the picture is mirrored.
pub fn gaussian(values: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    let kernel = kernel(sigma);
    let height = values.len() / width;
    let along = |row: &[f64], x: usize| sum(&kernel, x, width, |k| row[k]);
    let mut rows = vec![0.0; values.len()];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = &values[y * width..(y + 1) * width];
        for (x, out) in out.iter_mut().enumerate() {
            *out = along(row, x);
        }
    });
    let mut all = vec![0.0; values.len()];
    all.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (x, out) in out.iter_mut().enumerate() {
            *out = sum(&kernel, y, height, |k| rows[k * width + x]);
        }
    });
    all
}

/// The same mean without the pixel itself and its eight neighbours.
pub fn hollow(values: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    let kernel = kernel(sigma);
    let height = values.len() / width;
    let middle = kernel.len() / 2;
    let near = &kernel[middle - 1..=middle + 1];
    let share: f64 = near.iter().sum::<f64>().powi(2);
    let mut all = gaussian(values, width, sigma);
    all.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (x, out) in out.iter_mut().enumerate() {
            let own = sum(near, y, height, |v| {
                sum(near, x, width, |u| values[v * width + u])
            });
            *out = (*out - own) / (1.0 - share);
        }
    });
    all
}

fn kernel(sigma: f64) -> Vec<f64> {
    let reach = (REACH * sigma + 0.5) as i32;
    let weights = (-reach..=reach).map(|x| (-f64::from(x * x) / (2.0 * sigma * sigma)).exp());
    let weights: Vec<f64> = weights.collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / total).collect()
}

/// The sum of the kernel's weights around `at` times the values there.
fn sum(kernel: &[f64], at: usize, length: usize, value: impl Fn(usize) -> f64) -> f64 {
    let first = at as isize - (kernel.len() / 2) as isize;
    let terms = kernel.iter().zip(first..);
    terms.map(|(w, k)| w * value(mirrored(k, length))).sum()
}

/// The index that stands for `k` in a row of `length` that is mirrored at its ends again and again.
fn mirrored(k: isize, length: usize) -> usize {
    let length = length as isize;
    let k = k.rem_euclid(2 * length);
    k.min(2 * length - 1 - k) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_stay_and_a_point_spreads() {
        let flat = vec![3.0; 7 * 5];
        for all in [gaussian(&flat, 7, 4.0), hollow(&flat, 7, 4.0)] {
            assert!(all.iter().all(|v| (v - 3.0).abs() < 1e-12), "{all:?}");
        }
        let mut point = vec![0.0; 41 * 41];
        point[20 * 41 + 20] = 1.0;
        let spread = gaussian(&point, 41, 2.0);
        assert!((spread.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let ratio = spread[20 * 41 + 22] / spread[20 * 41 + 20];
        assert!((ratio - (-0.5f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn a_pixel_and_its_neighbours_are_not_in_their_own_mean() {
        let mut point = vec![0.0; 31 * 31];
        point[15 * 31 + 15] = 1.0;
        let spread = hollow(&point, 31, 4.0);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            assert!(spread[(15 + dy) * 31 + 15 + dx].abs() < 1e-15);
        }
        assert!(spread[15 * 31 + 17] > 1e-3);
    }

    #[test]
    fn small_pictures_are_mirrored_many_times() {
        let all: Vec<usize> = (-5..5).map(|k| mirrored(k, 2)).collect();
        assert_eq!(all, [0, 0, 1, 1, 0, 0, 1, 1, 0, 0]);
        assert_eq!(mirrored(-40, 1), 0);
    }
}
