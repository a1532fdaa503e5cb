//! A mean that does not drift however long a run takes.

mod common;

use common::{add, gpu, named_scene, settings, two_sided};
use etendue::film::coverage::Rect;
use etendue::film::{Film, REPLICATES};
use etendue::selftest::build::{Build, MIRROR, plane, v};
use glam::DVec3;

/// A quarter of a workgroup of 64: software adapters skip the vectors of the others.
const SIZE: [u32; 2] = [4, 4];

/// Rate of false alarms over all comparisons together (Bonferroni).
const FALSE_ALARM: f64 = 1e-4;

/// Powers of two of the samples per pixel at which the mean is looked at.
const POWERS: std::ops::RangeInclusive<u32> = 10..=20;

/// What the largest standard error of the whole run's mean may be, of the mean. Four replicates of sixteen pixels tell the error
/// itself to a quarter or so; it is 1.7·10⁻⁴ at most.
const PRECISION: f64 = 4e-4;

/// A channel's mean over the picture.
#[derive(Clone, Copy)]
struct Mean {
    mean: f64,
    /// Squared standard error.
    variance: f64,
    /// Sum over the pixels of the squares of their parts of it, over their degrees of freedom.
    spread: f64,
}

fn mean(film: &Film) -> [Mean; 3] {
    let zero = Mean {
        mean: 0.0,
        variance: 0.0,
        spread: 0.0,
    };
    let mut sums = [zero; 3];
    let pixels = f64::from(SIZE[0] * SIZE[1]);
    film.for_each(|_, _, e| {
        for (c, sum) in sums.iter_mut().enumerate() {
            let variance = (e.error[c] / pixels).powi(2);
            sum.mean += e.mean[c] / pixels;
            sum.variance += variance;
            sum.spread += variance * variance / (REPLICATES as f64 - 1.0);
        }
    });
    sums
}

/// Two-sided p-value of a difference of means whose variances, times `weights`, add up to its own (Welch and Satterthwaite).
fn p_value(difference: f64, [a, b]: [&Mean; 2], weights: [f64; 2]) -> f64 {
    let variance = weights[0] * a.variance + weights[1] * b.variance;
    let spread = weights[0].powi(2) * a.spread + weights[1].powi(2) * b.spread;
    two_sided(difference / variance.sqrt(), variance * variance / spread)
}

#[test]
fn a_million_samples_agree_with_a_thousand() {
    let s = named_scene("diffuse");
    let settings = settings(&s, SIZE, 0);
    let mut engine = gpu(&s, &settings, None);
    let mut film = Film::new(SIZE, Rect::whole(SIZE), settings.strata);
    let mut stages: Vec<(u64, [Mean; 3])> = Vec::new();
    for power in POWERS {
        let at = stages.last().map_or(0, |s| s.0);
        add(&mut engine, &mut film, at..1 << power);
        stages.push((1 << power, mean(&film)));
    }
    let (first, last) = (stages[0].1, stages[stages.len() - 1].1);
    let comparisons = 3 * stages.len();
    let check = |what: &str, difference: f64, means: [&Mean; 2], weights| {
        let p = p_value(difference, means, weights);
        println!(
            "{what}: {} then {}, p = {p:.1e}",
            means[0].mean,
            means[0].mean + difference
        );
        assert!(
            p * comparisons as f64 >= FALSE_ALARM,
            "{what}: off by {difference}, p = {p:.1e}"
        );
    };
    for c in 0..3 {
        for pair in stages.windows(2) {
            let (early, whole) = (&pair[0].1[c], &pair[1].1[c]);
            // The later half alone is 2 whole - early, and each half's variance about twice the whole's.
            let late = 2.0 * whole.mean - early.mean;
            let what = format!("{} samples, channel {c}", pair[1].0);
            check(&what, late - early.mean, [early, whole], [1.0, 2.0]);
        }
        let drift = last[c].mean - first[c].mean;
        check(
            &format!("first and last, channel {c}"),
            drift,
            [&first[c], &last[c]],
            [1.0, 1.0],
        );
        let relative = last[c].variance.sqrt() / last[c].mean;
        println!("channel {c}: standard error {relative:.1e} of the mean");
        assert!(
            relative < PRECISION,
            "channel {c}: too noisy to tell, {relative}"
        );
    }
}

/// Row 37 of the hard cases, every sample of it made. The light is seen in a mirror, for a light that the eye faces costs
/// sixteen rays a sample.
#[test]
fn a_constant_pixel_stays_what_it_is_for_2_to_the_24_samples() {
    let build = Build::new(v(30.0, 0.0, 1.0), v(15.0, 0.0, -1.0), 1.0)
        .size(1, 1)
        .add(plane(-DVec3::Z, DVec3::Z), MIRROR)
        .light(DVec3::ZERO, -DVec3::Z, 9.0, 0.1);
    let settings = build.settings();
    let mut engine = gpu(&build.0, &settings, None);
    let mut film = Film::new([1, 1], Rect::whole([1, 1]), settings.strata);
    add(&mut engine, &mut film, 0..1 << 24);
    film.for_each(|_, _, e| {
        println!("{e:?}");
        for mean in e.mean {
            assert!((mean - 0.1).abs() <= 1e-6 * 0.1, "{mean}");
        }
    });
    assert_eq!(film.coverage.samples(), (1 << 24, 1 << 24));
}
