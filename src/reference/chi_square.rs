//! χ² tests of direction samplers against their densities. Only unit tests use them.
//!
//! Each call rejects a correct sampler with probability 3·10⁻⁶ ([`LIMIT`]). Seeds are fixed, so a test that passes once always
//! passes.

use super::frame::Frame;
use glam::DVec3;
use std::f64::consts::PI;

/// One-sided normal quantile for the false-alarm rate 3.4·10⁻⁶.
const LIMIT: f64 = 4.5;

/// Cells of the midpoint rule along each side of a bin.
const CELLS: usize = 24;

/// Rows (in cos θ) and columns (in φ) of bins.
const ROWS: usize = 32;
const COLUMNS: usize = 16;

/// Panics if `observed` counts differ from `expected` ones by more than Poisson noise.
pub fn assert_agrees(what: &str, observed: &[f64], expected: &[f64]) {
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut rest_observed, mut rest_expected) = (0.0, 0.0);
    for (o, e) in observed.iter().zip(expected) {
        // Cochran's rule: χ² wants five expected counts in each bin, so bins with fewer are put together.
        if *e < 5.0 {
            rest_observed += o;
            rest_expected += e;
        } else {
            statistic += (o - e).powi(2) / e;
            bins += 1.0;
        }
    }
    if rest_expected >= 5.0 {
        statistic += f64::powi(rest_observed - rest_expected, 2) / rest_expected;
        bins += 1.0;
    } else {
        assert!(
            rest_observed <= rest_expected + 6.0 * rest_expected.sqrt() + 6.0,
            "{what}: {rest_observed} samples where {rest_expected} were due"
        );
    }
    assert!(bins > 2.0, "{what}: no bins to compare");
    // Wilson & Hilferty's cube root makes χ² normal.
    let k = bins - 1.0;
    let z = ((statistic / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
    assert!(
        z < LIMIT,
        "{what}: χ² = {statistic} with {k} degrees of freedom, z = {z}"
    );
}

/// Panics unless directions from `sample` have the density `pdf`, per solid angle. The outcome `None`, "no sample", should have the
/// probability by which the integral of `pdf` falls short of 1. Choose `axis` so that edges of `pdf` lie between bins.
pub fn assert_density(
    what: &str,
    axis: DVec3,
    count: usize,
    mut sample: impl FnMut() -> Option<DVec3>,
    pdf: impl Fn(DVec3) -> f64,
) {
    let frame = Frame::around(axis);
    let mut observed = vec![0.0; ROWS * COLUMNS + 1];
    for _ in 0..count {
        let bin = match sample() {
            None => ROWS * COLUMNS,
            Some(d) => {
                let local = frame.to_local(d);
                let row = ((local.z + 1.0) / 2.0 * ROWS as f64) as usize;
                let column = (local.y.atan2(local.x) / (2.0 * PI) + 0.5) * COLUMNS as f64;
                row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
            }
        };
        observed[bin] += 1.0;
    }
    let solid_angle = 4.0 * PI / (ROWS * COLUMNS * CELLS * CELLS) as f64;
    let mut expected = vec![0.0; ROWS * COLUMNS + 1];
    for i in 0..ROWS * CELLS {
        for j in 0..COLUMNS * CELLS {
            let z = 2.0 * (i as f64 + 0.5) / (ROWS * CELLS) as f64 - 1.0;
            let phi = PI * (2.0 * (j as f64 + 0.5) / (COLUMNS * CELLS) as f64 - 1.0);
            let d = frame.to_world(polar(z, phi));
            expected[i / CELLS * COLUMNS + j / CELLS] += count as f64 * solid_angle * pdf(d);
        }
    }
    let total: f64 = expected.iter().sum();
    let none = count as f64 - total;
    // The midpoint rule is accurate to a fraction of the noise, 1/√count.
    assert!(
        none > -0.5 * (count as f64).sqrt(),
        "{what}: pdf integrates to {}",
        total / count as f64
    );
    expected[ROWS * COLUMNS] = none.max(0.0);
    assert_agrees(what, &observed, &expected);
}

fn polar(z: f64, phi: f64) -> DVec3 {
    let s = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(s * phi.cos(), s * phi.sin(), z)
}

/// The mean of `count` values, and its standard error.
pub fn mean_and_error(count: usize, mut value: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..count {
        let v = value();
        sum += v;
        squares += v * v;
    }
    let n = count as f64;
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
}
