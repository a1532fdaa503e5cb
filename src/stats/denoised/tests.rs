//! The estimator on simulated replicates of a picture that is known.

use super::*;
use crate::reference::sampler::Sampler;
use rayon::prelude::*;

const WIDTH: usize = 64;
const HEIGHT: usize = 48;
const SEEDS: u32 = 64;

/// A gradient, a dark half with an edge, and a bright spot.
fn truth() -> Rgb {
    let pixel = |i: usize| {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        let base = 0.2 + x / WIDTH as f32;
        let base = if y > 20.0 + 0.3 * x { 0.1 * base } else { base };
        let spot = if (x - 40.0).hypot(y - 10.0) < 3.0 {
            1.5
        } else {
            0.0
        };
        [base + spot, 0.8 * base + spot, 0.5 * base]
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// Replicates of `samples` skewed samples each: most are small, and a few are large.
fn replicates(truth: &Rgb, seed: u32, samples: [u32; 4]) -> [Rgb; 4] {
    std::array::from_fn(|r| {
        let pixel = |(i, rgb): (usize, &[f32; 3])| {
            let mut rng = Sampler::new(seed, i as u64, r as u64);
            let mut sum = 0.0;
            for _ in 0..samples[r] {
                // An exponential distribution, and now and then one that is five times as wide: mean 1.
                let width = if rng.uniform() < 0.1 { 5.0 } else { 5.0 / 9.0 };
                sum += -width * (1.0 - rng.uniform()).ln();
            }
            let relative = (sum / f64::from(samples[r])) as f32;
            rgb.map(|c| c * relative)
        };
        truth.iter().enumerate().map(pixel).collect()
    })
}

fn window(picture: &Rgb, i: usize, reach: isize) -> Vec<[f32; 3]> {
    let (x, y) = ((i % WIDTH) as isize, (i / WIDTH) as isize);
    let near =
        |at: isize, length: usize| (at - reach).max(0)..(at + reach + 1).min(length as isize);
    near(y, HEIGHT)
        .flat_map(|v| near(x, WIDTH).map(move |u| (v, u)))
        .map(|(v, u)| picture[v as usize * WIDTH + u as usize])
        .collect()
}

fn blur(picture: &Rgb) -> Rgb {
    let pixel = |i: usize| {
        let near = window(picture, i, 2);
        [0, 1, 2].map(|c: usize| near.iter().map(|p| p[c]).sum::<f32>() / near.len() as f32)
    };
    (0..picture.len()).map(pixel).collect()
}

fn median(picture: &Rgb) -> Rgb {
    let pixel = |i: usize| {
        let near = window(picture, i, 1);
        [0, 1, 2].map(|c: usize| {
            let mut all: Vec<f32> = near.iter().map(|p| p[c]).collect();
            all.sort_by(f32::total_cmp);
            all[all.len() / 2]
        })
    };
    (0..picture.len()).map(pixel).collect()
}

type Denoiser = fn(&Rgb) -> Rgb;

const DENOISERS: [(&str, Denoiser); 4] = [
    ("identity", Rgb::clone),
    ("blur", blur),
    ("constant 0", |p| vec![[0.0; 3]; p.len()]),
    ("median", median),
];

fn folds(replicates: &[Rgb; 4], denoiser: impl Fn(&Rgb) -> Rgb) -> [Rgb; 6] {
    std::array::from_fn(|pair| denoiser(&half(replicates, pair)))
}

fn lights(picture: &Rgb) -> Vec<f64> {
    picture
        .iter()
        .map(|p| luminance(p.map(f64::from)))
        .collect()
}

fn squares(replicates: &[Rgb; 4], folds: &[Rgb; 6]) -> Squares {
    Squares::new(
        &replicates.each_ref().map(lights),
        &folds.each_ref().map(lights),
    )
}

/// The mean squared error of a picture's luminance.
fn true_square(picture: &Rgb, truth: &Rgb) -> f64 {
    let pairs = lights(picture).into_iter().zip(lights(truth));
    pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / truth.len() as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean and its distance from 0 in standard errors.
fn z(values: &[f64]) -> f64 {
    let m = mean(values);
    let n = values.len() as f64;
    let variance = values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (n - 1.0);
    m / (variance / n).sqrt()
}

#[test]
fn a_denoiser_that_does_nothing_has_the_standard_error_squared() {
    let replicates = replicates(&truth(), 1, [4; 4]);
    let found = squares(&replicates, &folds(&replicates, Rgb::clone));
    for i in 0..found.raw.len() {
        for other in [found.mean[i], found.covariance[i]] {
            // The halves are rounded to f32.
            assert!(
                (other - found.raw[i]).abs() <= 1e-5 * found.raw[i] + 1e-7,
                "{i}"
            );
        }
    }
    let judged = judge(&replicates, &folds(&replicates, Rgb::clone), WIDTH, None);
    let (a, b) = (judged.statement.raw.value(), judged.statement.mean.value());
    assert!((a.unwrap() / b.unwrap() - 1.0).abs() < 1e-5);
    assert!(judged.statement.light.abs() < 1e-6);
}

/// Estimated less true squared errors of the denoised mean, one for each seed.
fn surplus(samples: [u32; 4], denoise: impl Fn(&[Rgb; 4]) -> [Rgb; 6] + Sync) -> Vec<f64> {
    let truth = truth();
    let of_seed = |seed| {
        let replicates = replicates(&truth, seed, samples);
        let folds = denoise(&replicates);
        let estimate = mean(&squares(&replicates, &folds).mean);
        estimate - true_square(&mean_of(&folds), &truth)
    };
    (0..SEEDS).into_par_iter().map(of_seed).collect()
}

#[test]
fn the_estimate_is_the_true_squared_error_on_average() {
    // The second is a film that ended within a turn, or an adaptive one.
    for samples in [[4; 4], [9, 6, 5, 1]] {
        for (name, denoiser) in DENOISERS {
            let z = z(&surplus(samples, |r| folds(r, denoiser)));
            assert!(z.abs() < 2.0, "{name}, {samples:?}: {z:.2} standard errors");
        }
    }
}

#[test]
fn a_denoiser_that_saw_what_is_held_out_is_caught() {
    // Each half has a third of all four replicates in it.
    let leaks = |replicates: &[Rgb; 4]| -> [Rgb; 6] {
        let all = mean_of(replicates);
        folds(replicates, |half| {
            let pairs = half.iter().zip(&all);
            let leaky = |(h, a): (&[f32; 3], &[f32; 3])| {
                [0, 1, 2].map(|c: usize| (2.0 * h[c] + a[c]) / 3.0)
            };
            pairs.map(leaky).collect()
        })
    };
    let z = z(&surplus([4; 4], leaks));
    assert!(z < -4.0, "{z:.2} standard errors");
}

/// Calls `f` with the replicates of every seed, of as many samples each, and the mean luminance of all.
fn of_seeds<T: Send>(samples: u32, f: impl Fn(&[Rgb; 4], f64) -> T + Sync) -> Vec<T> {
    let truth = truth();
    let of_seed = |seed| {
        let replicates = replicates(&truth, seed, [samples; 4]);
        f(&replicates, mean(&lights(&mean_of(&replicates))))
    };
    (0..SEEDS).into_par_iter().map(of_seed).collect()
}

#[test]
fn the_mixture_is_estimated_right_and_is_no_worse_than_raw() {
    let truth = truth();
    for (name, denoiser) in DENOISERS {
        let all = of_seeds(16, |replicates, light| {
            let judged = judge(replicates, &folds(replicates, denoiser), WIDTH, None);
            let square = true_square(&judged.mixture, &truth);
            let stated = judged.statement.mixture.value().expect("known") * light;
            let gain = true_square(&mean_of(replicates), &truth) / square;
            (stated * stated / square - 1.0, gain)
        });
        let (surplus, gain): (Vec<f64>, Vec<f64>) = all.into_iter().unzip();
        // The weights are chosen by the same numbers, though not by the pixel's own.
        assert!(mean(&surplus).abs() < 0.05, "{name}: {:.3}", mean(&surplus));
        assert!(mean(&gain) > 0.999, "{name}: {:.3}", mean(&gain));
        if name == "blur" {
            assert!(mean(&gain) > 1.5, "{:.2}", mean(&gain));
        }
    }
}

#[test]
fn the_stated_interval_holds_the_truth_at_256_samples() {
    let truth = truth();
    let all = of_seeds(64, |replicates, light| {
        DENOISERS.map(|(_, denoiser)| {
            let judged = judge(replicates, &folds(replicates, denoiser), WIDTH, None);
            let Statement { mean, mixture, .. } = &judged.statement;
            [(mean, &judged.mean), (mixture, &judged.mixture)].map(|(rms, picture)| {
                let true_rms = true_square(picture, &truth).sqrt() / light;
                let held = |(v, e): (f64, f64)| (v - true_rms).abs() <= 2.0 * e;
                rms.value().zip(rms.error()).map(held)
            })
        })
    });
    for (k, (name, _)) in DENOISERS.iter().enumerate() {
        let stated: Vec<bool> = all.iter().flat_map(|seed| seed[k]).flatten().collect();
        let held = stated.iter().filter(|held| **held).count();
        assert!(stated.len() >= SEEDS as usize, "{name}: {}", stated.len());
        assert!(
            held * 10 >= stated.len() * 9,
            "{name}: {held} of {}",
            stated.len()
        );
    }
}

#[test]
fn the_order_of_the_replicates_changes_nothing() {
    let own = replicates(&truth(), 3, [4; 4]);
    let expected = judge(&own, &folds(&own, median), WIDTH, None);
    for order in [[1, 0, 2, 3], [3, 2, 1, 0], [2, 3, 1, 0]] {
        let other = order.map(|r| own[r].clone());
        let found = judge(&other, &folds(&other, median), WIDTH, None);
        let close = |a: &Rgb, b: &Rgb| {
            let values = a.as_flattened().iter().zip(b.as_flattened());
            values
                .into_iter()
                .all(|(a, b)| (a - b).abs() <= 1e-6 * a.abs())
        };
        assert!(close(&expected.mean, &found.mean) && close(&expected.mixture, &found.mixture));
        let (a, b) = (&expected.statement.mixture, &found.statement.mixture);
        let same = |a: Option<f64>, b: Option<f64>| (a.unwrap() / b.unwrap() - 1.0).abs() < 1e-9;
        assert!(same(a.value(), b.value()) && same(a.error(), b.error()));
    }
}

#[test]
fn what_is_not_known_is_not_stated() {
    let truth = truth();
    let own = replicates(&truth, 5, [4; 4]);
    let doubt = Some("no light found yet in 20 % of the picture".to_owned());
    let judged = judge(&own, &folds(&own, blur), WIDTH, doubt);
    let text = judged.statement.to_string();
    assert!(
        text.contains("its RMS error is not known, because the raw picture's error is in doubt: no light found yet in 20 % of the picture; total light "),
        "{text}"
    );

    // One pixel has nearly all of the error.
    let mut lit = own.clone();
    for (r, replicate) in lit.iter_mut().enumerate() {
        replicate[77] = [1e4 * r as f32; 3];
    }
    let judged = judge(&lit, &folds(&lit, Rgb::clone), WIDTH, None);
    assert!(matches!(
        judged.statement.raw,
        Rms::Unknown(Why::Noisy | Why::Few)
    ));

    let black = [(); 4].map(|()| vec![[0.0; 3]; truth.len()]);
    let judged = judge(&black, &folds(&black, blur), WIDTH, None);
    assert_eq!(judged.statement.raw, Rms::Unknown(Why::Black));

    // A denoiser that is nearly perfect: its error is lost in the noise of its estimate.
    let judged = judge(&own, &[(); 6].map(|()| truth.clone()), WIDTH, None);
    assert!(matches!(judged.statement.mean, Rms::Unknown(_)));
}

/// A thousandth of the pixels has nearly all of the error. They are in different blocks, so the spread of blocks alone would let it pass.
#[test]
fn an_error_that_a_thousandth_of_the_pixels_has_is_not_known() {
    let mut few = replicates(&truth(), 5, [4; 4]);
    for (r, replicate) in few.iter_mut().enumerate() {
        for (x, y) in [(4, 4), (30, 12), (50, 28), (20, 44)] {
            replicate[y * WIDTH + x] = [1e3 * r as f32; 3];
        }
    }
    for (name, denoiser) in DENOISERS {
        let statement = judge(&few, &folds(&few, denoiser), WIDTH, None).statement;
        assert_eq!(statement.raw, Rms::Unknown(Why::Few), "{name}");
        // A median loses these pixels altogether, and so has all of the error there.
        assert_eq!(statement.mean, Rms::Unknown(Why::Few), "{name}");
    }
}

/// Those with the largest estimates would seem to have most of the error of a good denoiser: their noise is much larger than it is.
#[test]
fn noise_alone_is_not_taken_for_a_few_bad_pixels() {
    let own = replicates(&truth(), 5, [4; 4]);
    // What is left is a thirtieth of the noise, everywhere alike.
    let truth = truth();
    let good = folds(&own, |half| {
        let near = half.iter().zip(&truth);
        near.map(|(h, t)| [0, 1, 2].map(|c: usize| t[c] + 0.15 * (h[c] - t[c])))
            .collect()
    });
    let found = squares(&own, &good);
    let mut largest = found.mean.clone();
    largest.sort_by(|a, b| b.total_cmp(a));
    let few = (FEW * largest.len() as f64).ceil() as usize;
    let sum = |of: &[f64]| of.iter().sum::<f64>();
    assert!(sum(&largest[..few]) > MUCH * sum(&largest));
    let stated = judge(&own, &good, WIDTH, None).statement.mean;
    assert!(matches!(stated, Rms::Known { .. }), "{stated}");
}

/// A median loses most of a highlight of four pixels. The surroundings, where it does well, do not see that.
#[test]
fn a_highlight_that_a_denoiser_loses_stays() {
    let mut bright = truth();
    let i = WIDTH * 8 + 8;
    for k in [i, i + 1, i + WIDTH, i + WIDTH + 1] {
        bright[k] = [40.0; 3];
    }
    let replicates = replicates(&bright, 3, [64; 4]);
    let judged = judge(&replicates, &folds(&replicates, median), WIDTH, None);
    assert!(luminance(judged.mean[i].map(f64::from)) < 10.0);
    assert_eq!(judged.weight[i], 0.0);
    assert_eq!(judged.mixture[i], mean_of(&replicates)[i]);
    assert!(judged.weight.iter().filter(|w| **w > 0.5).count() > 100);
}
