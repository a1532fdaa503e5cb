//! A mean that does not drift however long a run takes.

mod common;

use common::{add, gpu, named_scene, settings};
use etendue::film::Film;
use etendue::film::coverage::Rect;

/// A quarter of a workgroup of 64: software adapters skip the vectors of the others.
const SIZE: [u32; 2] = [4, 4];

/// By chance once in 10 000 runs: about forty comparisons of at least a dozen degrees of freedom, as a few pixels on the
/// light's rim make most of the error.
const LARGEST_T: f64 = 7.0;

/// The picture's mean and its squared standard error, for each channel.
fn mean(film: &Film) -> [(f64, f64); 3] {
    let mut sums = [(0.0, 0.0); 3];
    let pixels = f64::from(SIZE[0] * SIZE[1]);
    film.for_each(|_, _, e| {
        for (c, sum) in sums.iter_mut().enumerate() {
            sum.0 += e.mean[c] / pixels;
            sum.1 += (e.error[c] / pixels).powi(2);
        }
    });
    sums
}

#[test]
fn a_million_samples_say_what_a_thousand_say() {
    let s = named_scene("diffuse");
    let settings = settings(&s, SIZE, 0);
    let mut engine = gpu(&s, &settings, None);
    let mut film = Film::new(SIZE, Rect::whole(SIZE), settings.strata);
    let mut stages: Vec<(u64, [(f64, f64); 3])> = Vec::new();
    for power in 10..=20 {
        let at = stages.last().map_or(0, |s| s.0);
        add(&mut engine, &mut film, at..1 << power);
        stages.push((1 << power, mean(&film)));
    }
    for pair in stages.windows(2) {
        for c in 0..3 {
            let ((early, v), (whole, w)) = (pair[0].1[c], pair[1].1[c]);
            // The later half alone is 2 whole - early, and each half's variance about twice the whole's.
            let late = 2.0 * whole - early;
            let t = (late - early) / (v + 2.0 * w).sqrt();
            let samples = pair[1].0;
            println!("{samples} samples, channel {c}: {early} then {late}, t = {t:.2}");
            assert!(
                t.abs() < LARGEST_T,
                "{samples} samples, channel {c}: {early} then {late}"
            );
        }
    }
    let (first, last) = (stages[0].1, stages[stages.len() - 1].1);
    for c in 0..3 {
        let t = (first[c].0 - last[c].0) / (first[c].1 + last[c].1).sqrt();
        assert!(t.abs() < LARGEST_T, "channel {c}: {first:?} {last:?}");
        let relative = last[c].1.sqrt() / last[c].0;
        assert!(
            relative < 2e-3,
            "channel {c}: too noisy to tell, {relative}"
        );
    }
}
