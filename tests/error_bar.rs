//! The error that a picture states is the error that it has: over many seeds, the mean square of (picture - reference), less
//! the reference's own variance, against the mean of the stated squares.

mod common;

use common::{add, film, generated, gpu, named_scene, scene, settings};
use etendue::engine::EngineError;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::run::{CALL, Job, Run, tiles};
use etendue::scene::{Scene, generate};
use std::sync::atomic::AtomicBool;

const SEEDS: u32 = 64;
const SAMPLES: [u64; 3] = [16, 64, 256];
const REFERENCE_SAMPLES: u64 = 8192;

/// Mean and squared standard error of every pixel and channel.
fn pixels(film: &Film) -> Vec<(f64, f64)> {
    let mut out = vec![(0.0, 0.0); 3 * film.sums().len()];
    film.for_each(|x, y, e| {
        let at = 3 * film.index(x, y);
        (0..3).for_each(|c| out[at + c] = (e.mean[c], e.error[c].powi(2)));
    });
    out
}

/// Sums over a picture of true and of stated squared errors.
fn squares(picture: &[(f64, f64)], reference: &[(f64, f64)]) -> (f64, f64) {
    let pairs = picture.iter().zip(reference);
    pairs.fold((0.0, 0.0), |sum, ((m, s2), (r, v))| {
        (sum.0 + (m - r).powi(2) - v, sum.1 + s2)
    })
}

/// √(true mean square error / mean stated square) and its standard error over the seeds, which are independent, by the
/// jackknife.
fn ratio(squares: &[(f64, f64)]) -> (f64, f64) {
    let total = squares
        .iter()
        .fold((0.0, 0.0), |t, s| (t.0 + s.0, t.1 + s.1));
    let all = (total.0 / total.1).sqrt();
    let n = squares.len() as f64;
    let without = squares
        .iter()
        .map(|s| ((total.0 - s.0) / (total.1 - s.1)).sqrt());
    let spread: f64 = without.map(|r| (r - all).powi(2)).sum();
    (all, (spread * (n - 1.0) / n).sqrt())
}

fn check(name: &str, size: [u32; 2]) {
    check_scene(name, &named_scene(name), size);
}

fn check_scene(name: &str, s: &Scene, size: [u32; 2]) {
    let settings = settings(s, size, 0);
    let mut engine = gpu(s, &settings, None);
    let reference = pixels(&film(&mut engine, &settings, REFERENCE_SAMPLES));
    let mut of_seeds = [const { Vec::new() }; SAMPLES.len()];
    for seed in 1..=SEEDS {
        engine.reseed(seed);
        let mut film = Film::new(size, Rect::whole(size), settings.strata);
        let mut at = 0;
        for (spp, squares_of) in SAMPLES.into_iter().zip(&mut of_seeds) {
            add(&mut engine, &mut film, at..spp);
            at = spp;
            squares_of.push(squares(&pixels(&film), &reference));
        }
    }
    let mut wrong = String::new();
    for (spp, squares) in SAMPLES.into_iter().zip(&of_seeds) {
        let (ratio, error) = ratio(squares);
        let text = format!("{name}, {spp} samples: true / stated error = {ratio:.3} ± {error:.3}");
        println!("{text}");
        if !(0.9..=1.1).contains(&ratio) || error > 0.05 {
            wrong += &(text + "\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn diffuse() {
    check("diffuse", [24, 18]);
}

#[test]
fn glossy() {
    check("phong_gallery", [24, 18]);
}

#[test]
fn caustic() {
    check("caustic", [24, 18]);
}

#[test]
fn cylinders() {
    check("cylinders", [24, 18]);
}

#[test]
fn room_of_mirrors() {
    let room = scene(include_str!("scenes/mirror_balls.toml"));
    check_scene("mirror_balls", &room, [24, 18]);
}

#[test]
fn several_lights() {
    check("several_lights", [32, 24]);
}

/// A scene with a tree: places in the pixel are drawn together with points on the light.
#[test]
fn crowd() {
    let crowd = generated(&generate::cloud(200, 1, "rows.csv"));
    check_scene("a cloud of 200 spheres", &crowd, [24, 18]);
}

/// Samples that went where pilots had found the noise: the error is as true, and the mean of all pictures is the reference.
#[test]
fn adaptive() {
    let (s, size) = (named_scene("caustic"), [48, 36]);
    let settings = settings(&s, size, 0);
    let mut engine = gpu(&s, &settings, None);
    let reference = pixels(&film(&mut engine, &settings, REFERENCE_SAMPLES));
    let (mut squares_of, mut light, mut spread) = (Vec::new(), Vec::new(), 0);
    for seed in 1..=SEEDS {
        engine.reseed(seed);
        let job = Job {
            tiles: tiles(&[Rect::whole(size)], u64::MAX),
            samples: 0..128,
            round: settings.round(),
            time: None,
            error: None,
            black: false,
            call: CALL,
            adaptive: Some(seed),
        };
        let mut film = Film::new(size, Rect::whole(size), settings.strata);
        Run::new(&job, &mut engine, &mut film, &AtomicBool::new(false))
            .go(|_, _| Ok::<(), EngineError>(()))
            .expect("renders");
        let (least, most) = film.coverage.samples();
        spread += most - least;
        squares_of.push(squares(&pixels(&film), &reference));
        light.push(film.mean_luminance());
    }
    assert!(spread > 16 * u64::from(SEEDS), "nothing was steered");
    let (ratio, error) = ratio(&squares_of);
    println!("adaptive caustic: true / stated error = {ratio:.3} ± {error:.3}");
    assert!((0.9..=1.1).contains(&ratio) && error <= 0.05);

    engine.reseed(0);
    let truth = film(&mut engine, &settings, REFERENCE_SAMPLES).mean_luminance();
    let n = light.len() as f64;
    let mean = light.iter().sum::<f64>() / n;
    let variance = light.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // The reference has as many samples as all pictures together.
    let error = (2.0 * variance / n).sqrt();
    println!("mean light {mean:.5}, of the reference {truth:.5}, ± {error:.5}");
    assert!((mean - truth).abs() < 4.0 * error);
}
