//! Finds where two curves of cost against number cross.

/// Which of two is cheaper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Crossing {
    /// They are even here; the first is cheaper below, the second above.
    At(f64),
    /// The first is cheaper up to the largest count that both have.
    Beyond(usize),
    /// The second is cheaper from the smallest count on that both have.
    Before(usize),
}

/// Where the `first` curve, of rising counts and costs above 0, stays above the `second` from then on. Interpolates linearly
/// on log axes. `None` if they have no count in common.
pub fn crossing(first: &[(usize, f64)], second: &[(usize, f64)]) -> Option<Crossing> {
    let other = |count: usize| second.iter().find(|(n, _)| *n == count);
    // By how much the first is dearer, at the counts of both.
    let dearer: Vec<(usize, f64)> = first
        .iter()
        .filter_map(|&(n, cost)| Some((n, (cost / other(n)?.1).ln())))
        .collect();
    let last = dearer.last()?.0;
    let Some(below) = dearer.iter().rposition(|&(_, d)| d <= 0.0) else {
        return Some(Crossing::Before(dearer[0].0));
    };
    let Some(&(n1, d1)) = dearer.get(below + 1) else {
        return Some(Crossing::Beyond(last));
    };
    let (n0, d0) = dearer[below];
    let (n0, n1) = (n0 as f64, n1 as f64);
    Some(Crossing::At(n0 * (n1 / n0).powf(d0 / (d0 - d1))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(cost: impl Fn(f64) -> f64, counts: &[usize]) -> Vec<(usize, f64)> {
        counts.iter().map(|&n| (n, cost(n as f64))).collect()
    }

    #[test]
    fn powers_cross_where_they_are_equal() {
        let counts = [1, 2, 4, 8, 16, 32, 64, 128];
        // Straight on log axes, so that between counts they are known: n and 10 √n are even at 100.
        let linear = line(|n| n, &counts);
        let root = line(|n| 10.0 * n.sqrt(), &counts);
        let Some(Crossing::At(n)) = crossing(&linear, &root) else {
            panic!("they cross");
        };
        assert!((n - 100.0).abs() < 1e-9, "{n}");
        // At a count that was measured.
        let flat = line(|_| 16.0, &counts);
        assert_eq!(crossing(&linear, &flat), Some(Crossing::At(16.0)));
    }

    #[test]
    fn the_last_crossing_counts() {
        let flat = line(|_| 1.0, &[1, 2, 4, 8]);
        let noisy = [(1, 0.5), (2, 1.1), (4, 0.5), (8, 2.0)];
        let Some(Crossing::At(n)) = crossing(&noisy, &flat) else {
            panic!("they cross");
        };
        assert!((n - 32f64.sqrt()).abs() < 1e-9, "{n}");
    }

    #[test]
    fn lines_need_not_cross_nor_have_the_same_counts() {
        let flat = line(|_| 3.0, &[1, 2, 4, 8, 16, 32]);
        let low = line(|_| 1.0, &[1, 2, 4]);
        let high = line(|_| 5.0, &[2, 4, 8, 100]);
        assert_eq!(crossing(&low, &flat), Some(Crossing::Beyond(4)));
        assert_eq!(crossing(&high, &flat), Some(Crossing::Before(2)));
        assert_eq!(crossing(&line(|n| n, &[3, 5]), &flat), None);
        assert_eq!(crossing(&[], &flat), None);
    }
}
