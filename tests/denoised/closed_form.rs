//! A floor under a lamp, whose radiance is known, rendered with many seeds.

use crate::oidn;
use etendue::film::Film;
use etendue::stats::denoised::{PAIRS, Rgb, Rms, half, judge};
use etendue::stats::luminance;
use etendue::{Backend, LightParts, Options, Scene, render};
use std::collections::BTreeSet;
use std::f64::consts::PI;

const SIZE: [u32; 2] = [32, 24];
const EYE: [f64; 3] = [0.0, 2.0, 4.0];
const VFOV: f64 = 40.0;
const HEIGHT: f64 = 3.0;
const RADIUS: f64 = 2.0;
const RADIANCE: f64 = 5.0;
const REFLECTANCE: f64 = 0.6;

fn scene() -> Scene {
    Scene::builder()
        .camera(EYE, [0.0, 0.0, 0.0], VFOV, SIZE)
        .diffuse("floor", [REFLECTANCE; 3])
        .plane([0.0; 3], [0.0, 1.0, 0.0], "floor")
        .light([0.0, HEIGHT, 0.0], [0.0, -1.0, 0.0], RADIUS, [RADIANCE; 3])
        .build()
        .expect("a scene")
}

/// The radiance of the floor at a distance `a` from the point below the lamp's centre: the irradiance by a disk that is parallel to it.
fn radiance(a: f64) -> f64 {
    let (h, r) = (HEIGHT, RADIUS);
    let sum = h * h + a * a + r * r;
    let root = (sum * sum - 4.0 * r * r * a * a).sqrt();
    let irradiance = PI * RADIANCE / 2.0 * (1.0 - (h * h + a * a - r * r) / root);
    REFLECTANCE / PI * irradiance
}

/// The mean over each pixel, by 8 x 8 points.
fn truth() -> Vec<f64> {
    const SIDE: u32 = 8;
    let [x, y, z] = EYE;
    let length = (y * y + z * z).sqrt();
    let (forward, up) = (
        [0.0, -y / length, -z / length],
        [0.0, z / length, -y / length],
    );
    let step = 2.0 * (VFOV / 2.0).to_radians().tan() / f64::from(SIZE[1]);
    let at = |u: f64, v: f64| {
        let right = (u - f64::from(SIZE[0]) / 2.0) * step;
        let rise = (f64::from(SIZE[1]) / 2.0 - v) * step;
        let d = [right, forward[1] + rise * up[1], forward[2] + rise * up[2]];
        let t = -y / d[1];
        assert!(t > 0.0, "all of the picture is floor");
        radiance((x + t * d[0]).hypot(z + t * d[2]))
    };
    let mut all = Vec::new();
    for j in 0..SIZE[1] {
        for i in 0..SIZE[0] {
            let part =
                |pixel: u32, k: u32| f64::from(pixel) + (f64::from(k) + 0.5) / f64::from(SIDE);
            let points = (0..SIDE * SIDE).map(|k| at(part(i, k % SIDE), part(j, k / SIDE)));
            all.push(points.sum::<f64>() / f64::from(SIDE * SIDE));
        }
    }
    all
}

/// How far from 0, in standard errors, the mean of any of the denoisers may be. Five are tried at once, and so one of them is beyond this as
/// rarely as one alone is beyond two standard errors: 1 - (1 - 0.0455)^(1/5) = 0.0093 of a normal distribution lies outside of 2.6.
const MOST: f64 = 2.6;

/// A film of `samples` samples a pixel, on average if it is `adaptive`.
fn film(scene: &Scene, seed: u32, samples: u64, adaptive: bool) -> Film {
    let options = Options {
        adaptive,
        spp: Some(samples),
        seed: Some(seed),
        strata: Some(1),
        backend: Backend::Cpu,
        light: Some(LightParts {
            emitted: false,
            direct: true,
            indirect: false,
        }),
        ..Options::default()
    };
    let picture = render(scene, &options).expect("a picture");
    picture.film().clone()
}

fn apart(film: &Film) -> [Rgb; 4] {
    film.replicates_apart().expect("four of them").means
}

fn replicates(scene: &Scene, seed: u32, samples: u64) -> [Rgb; 4] {
    apart(&film(scene, seed, samples, false))
}

fn near(i: usize, reach: usize) -> impl Iterator<Item = usize> {
    let [width, height] = SIZE.map(|n| n as usize);
    let (x, y) = (i % width, i / width);
    let columns = x.saturating_sub(reach)..width.min(x + reach + 1);
    let rows = y.saturating_sub(reach)..height.min(y + reach + 1);
    rows.flat_map(move |v| columns.clone().map(move |u| v * width + u))
}

fn blur(picture: &Rgb) -> Rgb {
    let pixel = |i: usize| {
        let n = near(i, 2).count() as f32;
        [0, 1, 2].map(|c: usize| near(i, 2).map(|k| picture[k][c]).sum::<f32>() / n)
    };
    (0..picture.len()).map(pixel).collect()
}

fn median(picture: &Rgb) -> Rgb {
    let pixel = |i: usize| {
        [0, 1, 2].map(|c: usize| {
            let mut all: Vec<f32> = near(i, 1).map(|k| picture[k][c]).collect();
            all.sort_by(f32::total_cmp);
            all[all.len() / 2]
        })
    };
    (0..picture.len()).map(pixel).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

type Denoiser<'a> = &'a dyn Fn(&Rgb) -> Rgb;

/// What a denoiser's estimates were over many seeds, beside the truth.
struct Trial {
    /// Estimated less true squared errors, over the true ones' mean; and their distance from 0 in standard errors.
    surplus: f64,
    z: f64,
    /// Statements whose interval of two standard errors held the truth, and all of them.
    held: [usize; 2],
}

fn trial(all: &[[Rgb; 4]], truth: &[f64], denoiser: &dyn Fn(&Rgb) -> Rgb) -> Trial {
    let (mut surplus, mut squares, mut held) = (Vec::new(), Vec::new(), [0, 0]);
    for replicates in all {
        let folds: [Rgb; PAIRS.len()] =
            std::array::from_fn(|pair| denoiser(&half(replicates, pair)));
        let light = |p: &[f32; 3]| luminance(p.map(f64::from));
        let of = |picture: &Rgb| -> Vec<f64> { picture.iter().map(light).collect() };
        let found = etendue::stats::denoised::Squares::new(
            &replicates.each_ref().map(of),
            &folds.each_ref().map(of),
        );
        let judged = judge(replicates, &folds, SIZE[0] as usize, None);
        let pairs = judged.mean.iter().zip(truth);
        let square = pairs.map(|(p, t)| (light(p) - t).powi(2)).sum::<f64>() / truth.len() as f64;
        surplus.push(mean(&found.mean) - square);
        squares.push(square);
        if let Rms::Known { value, error } = judged.statement.mean {
            let raw: Vec<f64> = replicates.iter().flat_map(of).collect();
            held[0] += usize::from((value - square.sqrt() / mean(&raw)).abs() <= 2.0 * error);
            held[1] += 1;
        }
    }
    let m = mean(&surplus);
    let n = surplus.len() as f64;
    let variance = surplus.iter().map(|s| (s - m).powi(2)).sum::<f64>() / (n - 1.0);
    Trial {
        surplus: m / mean(&squares),
        z: m / (variance / n).sqrt(),
        held,
    }
}

/// What each denoiser's estimates were.
fn trials(all: &[[Rgb; 4]], truth: &[f64]) -> Vec<(&'static str, Trial)> {
    // First of all: the closed form is that of the scene.
    let light = |p: &[f32; 3]| luminance(p.map(f64::from));
    let rendered: Vec<f64> = all.iter().flatten().flatten().map(light).collect();
    let ratio = mean(&rendered) / mean(truth);
    assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");

    let oidn = oidn();
    let features = vec![[REFLECTANCE as f32; 3]; truth.len()];
    let normals = vec![[0.0, 1.0, 0.0]; truth.len()];
    let by_oidn = |picture: &Rgb| {
        let oidn = oidn.as_ref().expect("only called if it is there");
        oidn.denoise(picture, &features, &normals, SIZE)
            .expect("denoised")
    };
    let zero = |p: &Rgb| vec![[0.0; 3]; p.len()];
    let mut denoisers: Vec<(&'static str, Denoiser)> = vec![
        ("identity", &Rgb::clone),
        ("blur", &blur),
        ("constant 0", &zero),
        ("median", &median),
    ];
    if oidn.is_some() {
        denoisers.push(("Open Image Denoise", &by_oidn));
    }
    let of = |(name, denoiser): (&'static str, Denoiser)| (name, trial(all, truth, denoiser));
    denoisers.into_iter().map(of).collect()
}

/// Fails unless the estimate of every denoiser is the true squared error on average.
fn hold(all: &[[Rgb; 4]], truth: &[f64]) {
    for (name, t) in trials(all, truth) {
        println!(
            "{name}: {:+.4}, {:.2} standard errors, {:?} held",
            t.surplus, t.z, t.held
        );
        assert!(
            t.z.abs() < MOST,
            "{name}: {:+.3}, {:.2} standard errors",
            t.surplus,
            t.z
        );
    }
}

#[test]
fn the_estimate_is_the_true_squared_error_on_average() {
    let scene = scene();
    let all: Vec<[Rgb; 4]> = (40_000..40_640)
        .map(|seed| replicates(&scene, seed, 16))
        .collect();
    hold(&all, &truth());
}

/// Its tiles have different numbers of samples, and the replicates of a pixel too. Pilots decide how many, never the samples themselves.
#[test]
fn the_estimate_of_an_adaptive_film_is_right_too() {
    let scene = scene();
    let of_seed = |seed| {
        let film = film(&scene, seed, 206, true);
        let lengths = film.coverage.cells().map(|(_, ranges)| {
            let samples = ranges.iter().map(|r| r.end - r.start);
            samples.sum::<u64>()
        });
        let lengths: BTreeSet<u64> = lengths.collect();
        (apart(&film), lengths)
    };
    let (all, lengths): (Vec<_>, Vec<_>) = (30_000..30_096).map(of_seed).unzip();
    let unequal = |all: &&BTreeSet<u64>| all.len() > 1 && all.iter().any(|n| n % 4 != 0);
    let n = lengths.iter().filter(unequal).count();
    assert!(2 * n > all.len(), "{n}: {:?}", lengths[0]);
    hold(&all, &truth());
}

#[test]
fn the_stated_interval_holds_the_truth_at_256_samples() {
    let (scene, truth) = (scene(), truth());
    let all: Vec<[Rgb; 4]> = (100..140)
        .map(|seed| replicates(&scene, seed, 256))
        .collect();
    for (name, t) in trials(&all, &truth) {
        let [held, stated] = t.held;
        println!("{name}: {held} of {stated}");
        assert!(
            stated >= 20 && held * 10 >= stated * 9,
            "{name}: {held} of {stated}"
        );
    }
}

/// A number of [0, 1) for each place, by Steele, Lea and Flood's mixer.
fn uniform(seed: u64, place: u64) -> f64 {
    let mut z = ((seed << 32) | place).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Highlights of one pixel each, which a median loses, have most of the error.
#[test]
fn the_mixture_keeps_highlights_and_its_error_is_right() {
    const LIGHT: f64 = 10.0;
    let (scene, mut bright) = (scene(), truth());
    let highlights: Vec<usize> = (40..bright.len()).step_by(43).collect();
    for i in &highlights {
        bright[*i] += LIGHT;
    }
    let light = |p: &[f32; 3]| luminance(p.map(f64::from));
    let wrong = |picture: &Rgb| {
        let pairs = picture.iter().zip(&bright);
        mean(
            &pairs
                .map(|(p, t)| (light(p) - t).powi(2))
                .collect::<Vec<_>>(),
        )
    };
    let (mut surplus, mut squares) = (Vec::new(), [0.0; 3]);
    for seed in 50_000..50_128 {
        let mut own = replicates(&scene, seed, 16);
        for (r, replicate) in own.iter_mut().enumerate() {
            for i in &highlights {
                // Between nothing and twice as much.
                let relative = 2.0 * uniform(seed.into(), (4 * i + r) as u64);
                replicate[*i] = replicate[*i].map(|c| c + (LIGHT * relative) as f32);
            }
        }
        let mean_of = |pictures: &[Rgb]| -> Rgb {
            let share = 1.0 / pictures.len() as f32;
            let pixel =
                |i: usize| [0, 1, 2].map(|c| pictures.iter().map(|p| p[i][c]).sum::<f32>() * share);
            (0..bright.len()).map(pixel).collect()
        };
        let folds: [Rgb; PAIRS.len()] = std::array::from_fn(|pair| median(&half(&own, pair)));
        let judged = judge(&own, &folds, SIZE[0] as usize, None);
        let raw = mean_of(&own);
        let whole = mean(&raw.iter().map(light).collect::<Vec<_>>());
        let stated = judged.statement.mixture.value().expect("known") * whole;
        let now = [&judged.mixture, &judged.mean, &raw].map(wrong);
        surplus.push(stated * stated - now[0]);
        squares = std::array::from_fn(|k| squares[k] + now[k]);
    }
    let [mixture, denoised, raw] = squares;
    let (m, n) = (mean(&surplus), surplus.len() as f64);
    let variance = surplus.iter().map(|s| (s - m).powi(2)).sum::<f64>() / (n - 1.0);
    let z = m / (variance / n).sqrt();
    let (of_mixture, of_denoised) = (raw / mixture, raw / denoised);
    println!(
        "raw / mixture {of_mixture:.3}, raw / denoised {of_denoised:.3}, {z:.2} standard errors"
    );
    // A highlight that a replicate happens to miss is lost in three of the six halves. Here that costs 8 % of the raw picture's squared error.
    assert!(of_denoised < 0.5 && of_mixture > 0.9);
    assert!(z.abs() < MOST, "{z:.2}");
}
