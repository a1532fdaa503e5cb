//! The error that a picture states is the error that it has: over many seeds, the mean square of (picture - reference), less
//! the reference's own variance, against the mean of the stated squares.

mod common;

use common::{film, gpu, read, scene_files, settings};
use etendue::film::Film;
use etendue::scene::Scene;

const SIZE: [u32; 2] = [32, 24];
const SEEDS: u32 = 24;

fn scene(name: &str) -> Scene {
    read(
        &scene_files()
            .into_iter()
            .find(|p| p.file_stem().is_some_and(|s| s == name))
            .expect("it is there"),
    )
}

fn pixels(film: &Film) -> Vec<([f64; 3], [f64; 3])> {
    let mut out = Vec::new();
    film.for_each(|_, _, e| out.push((e.mean, [e.error[0], e.error[1], e.error[2]])));
    out
}

/// √(true mean square error / mean stated square) and its standard error over the seeds.
fn ratio(s: &Scene, spp: u64, reference: &[([f64; 3], [f64; 3])]) -> (f64, f64) {
    let mut pairs = Vec::new();
    for seed in 1..=SEEDS {
        let settings = settings(s, SIZE, seed);
        let picture = pixels(&film(&mut gpu(s, &settings, None), &settings, spp));
        let (mut actual, mut stated) = (0.0, 0.0);
        for ((m, e), (r, v)) in picture.iter().zip(reference) {
            for c in 0..3 {
                actual += (m[c] - r[c]).powi(2) - v[c].powi(2);
                stated += e[c].powi(2);
            }
        }
        pairs.push((actual, stated));
    }
    let of = |skip: usize| {
        let (a, b) = pairs
            .iter()
            .enumerate()
            .filter(|(k, _)| *k != skip)
            .fold((0.0, 0.0), |t, (_, p)| (t.0 + p.0, t.1 + p.1));
        (a / b).sqrt()
    };
    // Jackknife: the seeds are independent.
    let all = of(usize::MAX);
    let n = pairs.len() as f64;
    let spread: f64 = (0..pairs.len()).map(|k| (of(k) - all).powi(2)).sum();
    (all, (spread * (n - 1.0) / n).sqrt())
}

fn check(name: &str) {
    let s = scene(name);
    let settings = settings(&s, SIZE, 0);
    let reference = pixels(&film(&mut gpu(&s, &settings, None), &settings, 8192));
    for spp in [16, 64, 256] {
        let (ratio, error) = ratio(&s, spp, &reference);
        println!("{name}, {spp} samples: true / stated error = {ratio:.3} ± {error:.3}");
        assert!(
            (0.9 - 2.0 * error..=1.1 + 2.0 * error).contains(&ratio) && error < 0.1,
            "{name}, {spp} samples: true / stated error = {ratio:.3} ± {error:.3}"
        );
    }
}

#[test]
fn diffuse() {
    check("diffuse");
}

#[test]
fn glossy() {
    check("phong_gallery");
}

#[test]
fn several_lights() {
    check("several_lights");
}
