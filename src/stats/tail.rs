//! Measures how heavy the tail of positive numbers is, and whether their mean is reliable.
//!
//! Beyond a high threshold almost every distribution is close to a generalised Pareto distribution. Its shape k decides which
//! moments exist: the mean for k < 1, the variance for k < 1/2. From k = 1/2 on, the mean of a sample has no standard error. It
//! is usually below the true mean, since the numbers that would raise it are rare and large.

/// The fraction of largest numbers that [`Tail::top_share`] adds up.
const TOP: f64 = 1e-3;

/// If the exceedances are a smaller fraction of the sum, there is no tail: the numbers are equal up to rounding.
const NEGLIGIBLE: f64 = 1e-3;

/// The smallest tail that a shape is fitted to.
const LEAST_EXCEEDANCES: usize = 20;

/// The tail of a sample of positive numbers.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tail {
    /// Share of the sum that the largest thousandth of the numbers carries.
    pub top_share: f64,
    /// Shape k of the generalised Pareto distribution fitted to the largest; negative where the tail ends. Infinite where
    /// fewer than five numbers make the sum.
    pub shape: f64,
    /// Beyond this shape the mean of so many numbers is not reliable: 1/2, or less for fewer than a hundred. (The 0.7 of
    /// [Vehtari2024] is for means whose tail has been smoothed.)
    pub largest_safe_shape: f64,
    /// Whether `shape` is beyond it.
    #[serde(rename = "unsafe")]
    pub unsafe_mean: bool,
}

/// The tail of `values`, which this reorders. `None` where they are too few, or sum to nothing.
pub fn tail(values: &mut [f64]) -> Option<Tail> {
    let n = values.len();
    // As many as Vehtari et al. take.
    let count = (0.2 * n as f64).min(3.0 * (n as f64).sqrt()).ceil() as usize;
    let sum: f64 = values.iter().sum();
    if count < LEAST_EXCEEDANCES || !(sum > 0.0 && sum.is_finite()) {
        return None;
    }
    // The threshold is the largest number that is not in the tail.
    let (_, &mut threshold, largest) =
        values.select_nth_unstable_by(n - count - 1, |a, b| a.total_cmp(b));
    largest.sort_unstable_by(|a, b| a.total_cmp(b));
    let top = (TOP * n as f64).ceil() as usize;
    let top_share = largest[count - top.min(count)..].iter().sum::<f64>() / sum;
    let exceedances: Vec<f64> = largest
        .iter()
        .map(|x| x - threshold)
        .filter(|&x| x > 0.0)
        .collect();
    let shape = if exceedances.iter().sum::<f64>() < NEGLIGIBLE * sum {
        -1.0
    } else {
        pareto_shape(&exceedances)
    };
    let largest_safe_shape = (1.0 - 1.0 / (n as f64).log10()).min(0.5);
    Some(Tail {
        top_share,
        shape,
        largest_safe_shape,
        unsafe_mean: shape > largest_safe_shape,
    })
}

/// Shape of the generalised Pareto distribution that `sorted` positive exceedances, ascending, are drawn from: the
/// posterior mean of [Zhang2009], drawn towards ½ as if by ten more of them [Vehtari2024]. Infinite for fewer than five:
/// they tell nothing.
fn pareto_shape(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    if n < 5 {
        return f64::INFINITY;
    }
    let largest = sorted[n - 1];
    let quartile = sorted[(n as f64 / 4.0 + 0.5) as usize - 1];
    let shape_of = |theta: f64| sorted.iter().map(|x| (-theta * x).ln_1p()).sum::<f64>() / n as f64;
    // Profile log-likelihoods over a grid of θ = -k/σ.
    let points = 30 + (n as f64).sqrt() as usize;
    let grid = (1..=points).map(|j| {
        let theta =
            1.0 / largest + (1.0 - (points as f64 / (j as f64 - 0.5)).sqrt()) / (3.0 * quartile);
        let k = shape_of(theta);
        (theta, n as f64 * ((-theta / k).ln() - k - 1.0))
    });
    let grid: Vec<(f64, f64)> = grid.filter(|(_, l)| l.is_finite()).collect();
    let best = grid.iter().fold(f64::NEG_INFINITY, |m, (_, l)| m.max(*l));
    let (sum, weights) = grid.iter().fold((0.0, 0.0), |(sum, weights), (theta, l)| {
        let weight = (l - best).exp();
        (sum + theta * weight, weights + weight)
    });
    let k = shape_of(sum / weights);
    (k * n as f64 + 0.5 * 10.0) / (n as f64 + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Sampler;

    /// `n` numbers made from uniform ones.
    fn sample(n: usize, seed: u64, quantile: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut rng = Sampler::new(0, seed, 0);
        (0..n).map(|_| quantile(1.0 - rng.uniform())).collect()
    }

    fn shapes(quantile: impl Fn(f64) -> f64) -> Vec<Tail> {
        (0..20)
            .map(|seed| tail(&mut sample(20_000, seed, &quantile)).unwrap())
            .collect()
    }

    fn mean_shape(tails: &[Tail]) -> f64 {
        tails.iter().map(|t| t.shape).sum::<f64>() / tails.len() as f64
    }

    #[test]
    fn pareto_s_shape_is_found() {
        for k in [0.2, 0.5, 1.0, 2.0] {
            let tails = shapes(|u| u.powf(-k));
            let mean = mean_shape(&tails);
            assert!((mean - k).abs() < 0.06, "{k}: {mean}");
        }
    }

    #[test]
    fn light_tails_are_safe_and_those_without_a_mean_are_not() {
        let exponential = shapes(|u| -u.ln());
        let mean = mean_shape(&exponential);
        assert!(mean.abs() < 0.08, "{mean}");
        let uniform = shapes(|u| u);
        assert!(mean_shape(&uniform) < -0.7, "{}", mean_shape(&uniform));
        // Squares of normal numbers (Box and Muller's, one of each pair).
        let mut rng = Sampler::new(0, 7, 0);
        let mut squares: Vec<f64> = (0..20_000)
            .map(|_| {
                let (u, v) = (1.0 - rng.uniform(), rng.uniform());
                -2.0 * u.ln() * (2.0 * std::f64::consts::PI * v).cos().powi(2)
            })
            .collect();
        let squares = tail(&mut squares).unwrap();
        assert!(squares.shape < 0.4, "{squares:?}");
        let heavy = shapes(|u| u.powf(-1.2));
        for t in exponential.iter().chain(&uniform).chain([&squares]) {
            assert!(!t.unsafe_mean && t.top_share < 0.02, "{t:?}");
        }
        assert!(
            heavy.iter().all(|t| t.unsafe_mean && t.top_share > 0.3),
            "{heavy:?}"
        );
    }

    #[test]
    fn a_mean_that_is_safe_is_near_and_one_that_is_not_is_often_far() {
        // The mean of Pareto's numbers with k = 0.3 has a standard error, with k = 0.75 it has none.
        for (k, is_unsafe) in [(0.3, 0), (0.75, 20)] {
            let tails = shapes(|u| u.powf(-k));
            let found = tails.iter().filter(|t| t.unsafe_mean).count();
            assert!(found.abs_diff(is_unsafe) <= 1, "{k}: {found}");
        }
    }

    #[test]
    fn samples_without_a_tail_are_recognised() {
        assert_eq!(tail(&mut [1.0; 50]), None);
        assert_eq!(tail(&mut vec![0.0; 10_000]), None);
        let same = tail(&mut vec![2.0; 10_000]).unwrap();
        assert!(
            !same.unsafe_mean && (same.top_share - 1e-3).abs() < 1e-9,
            "{same:?}"
        );
        let mut few = vec![0.0; 10_000];
        few[17] = 1.0;
        let few = tail(&mut few).unwrap();
        assert!(few.unsafe_mean && few.top_share == 1.0, "{few:?}");
    }
}
