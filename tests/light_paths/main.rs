//! Light paths against chance alone: the f64 reference, which has none, and the kernel with `--light-paths off`. Welch's t on blocks of
//! the picture and on the whole, for each hard case of light that comes by way of mirrors and glass. Faults put in on purpose must be seen.
//!
//! Renders only light that was scattered at least twice. Lamps are large, so that chance finds their light well enough to judge.

mod cases;
#[path = "../common/mod.rs"]
mod common;
mod faults;

use cases::{BOX, CASES, FIRST_BULB, LAMP, case};
use common::{block_means, cpu, film, scene, settings, worst_t};
use etendue::engine::Engine;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::film::splats::Passes;
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Access, Kernel, compose};
use etendue::reference::Estimator;
use etendue::scene::Scene;
use etendue::settings::{LightParts, Settings};
use etendue::world::World;
use std::collections::HashMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock};

const FALSE_ALARM: f64 = 1e-4;
const SIZE: [u32; 2] = [32, 24];
const RUNS: u32 = 16;

/// Samples a run: with light paths, by chance on the GPU, and by chance in f64.
const SAMPLES: [u64; 3] = [256, 2048, 512];

type Runs = Vec<Vec<[f64; 3]>>;

fn indirect(room: &Scene, seed: u32, light_paths: bool) -> Settings {
    let mut settings = settings(room, SIZE, seed);
    settings.light_paths = light_paths;
    settings.light = LightParts {
        emitted: false,
        direct: false,
        indirect: true,
    };
    settings
}

fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    let open = || Gpu::open(&Choice::default()).expect("an adapter; scripts/test installs one");
    Arc::clone(GPU.get_or_init(|| Arc::new(open())))
}

/// Runs of the kernel after `edit`, which changes what is added up, and no index or loop.
fn kernel(room: &Scene, light_paths: bool, samples: u64, edit: impl FnOnce(&mut Kernel)) -> Runs {
    let mut settings = indirect(room, 0, light_paths);
    let world = World::new(room, SIZE);
    let mut kernel = compose(&world, &settings, None);
    edit(&mut kernel);
    // SAFETY: see above.
    let engine = unsafe { GpuEngine::with_kernel(gpu(), &world, &settings, kernel) };
    let mut engine = engine.expect("a kernel that compiles");
    let run = |k| {
        settings.seed = k + if light_paths { 0 } else { 500 };
        engine.reseed(settings.seed);
        block_means(&film(&mut engine, &settings, samples), 8)
    };
    (0..RUNS).map(run).collect()
}

/// What the kernel finds by chance alone, made once for each case.
fn by_chance(number: usize) -> Runs {
    static ALL: OnceLock<Mutex<HashMap<usize, Runs>>> = OnceLock::new();
    let all = ALL.get_or_init(Mutex::default);
    if let Some(runs) = all.lock().expect("no panic").get(&number) {
        return runs.clone();
    }
    let runs = kernel(&case(number).1, false, SAMPLES[1], |_| {});
    all.lock().expect("no panic").insert(number, runs.clone());
    runs
}

/// What the f64 reference finds by chance and by straight shadow rays, made once for each case.
fn by_reference(number: usize) -> Runs {
    static ALL: OnceLock<Mutex<HashMap<usize, Runs>>> = OnceLock::new();
    let all = ALL.get_or_init(Mutex::default);
    if let Some(runs) = all.lock().expect("no panic").get(&number) {
        return runs.clone();
    }
    let room = case(number).1;
    let run = |k| {
        let settings = indirect(&room, 1000 + k, true);
        let mut engine = cpu(&room, &settings, Estimator::LightSampling);
        block_means(&film(&mut engine, &settings, SAMPLES[2]), 8)
    };
    let runs: Runs = (0..RUNS).map(run).collect();
    all.lock().expect("no panic").insert(number, runs.clone());
    runs
}

/// How improbable the worst difference is, if there is none.
fn p(name: &str, a: &Runs, b: &Runs) -> f64 {
    let worst = worst_t(a, b);
    println!("{name}: {worst:?}");
    worst.p * worst.tests as f64
}

/// Mean luminance of the whole picture over all runs, and its standard error.
fn mean(runs: &Runs) -> (f64, f64) {
    let all: Vec<f64> = (runs.iter().filter_map(|r| r.last()))
        .map(|c| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2])
        .collect();
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn every_hard_case_is_as_bright_as_chance_says() {
    let mut wrong = Vec::new();
    for number in 0..FIRST_BULB {
        let (name, room) = case(number);
        let with = kernel(&room, true, SAMPLES[0], |k| {
            assert!(k.light.is_some(), "{name}: no light paths");
        });
        let without = by_chance(number);
        let ((a, ea), (b, eb)) = (mean(&with), mean(&without));
        println!(
            "{name}: {:+.2} % ± {:.2} % of {b:.4}; noise {:.2} of chance's",
            100.0 * (a / b - 1.0),
            100.0 * ea.hypot(eb) / b,
            ea / (eb * (SAMPLES[1] as f64 / SAMPLES[0] as f64).sqrt()),
        );
        if p(name, &with, &without) < FALSE_ALARM {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn the_reference_agrees() {
    let mut wrong = Vec::new();
    for number in 0..CASES.len() {
        let (name, room) = case(number);
        let with = kernel(&room, true, SAMPLES[0], |_| {});
        let reference = by_reference(number);
        if p(name, &with, &reference) < FALSE_ALARM {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn bulbs_are_as_bright_in_every_access() {
    // One with another lamp, which is sampled beside the bulb.
    let number = FIRST_BULB + 5;
    let (name, room) = case(number);
    for access in [Access::Buffers, Access::Tree] {
        let with = kernel(&room, true, SAMPLES[0], |k| {
            let world = World::new(&room, SIZE);
            *k = compose(&world, &indirect(&room, 0, true), Some(access));
        });
        let p = p(name, &with, &by_reference(number));
        assert!(p > FALSE_ALARM, "{access:?}");
    }
}

/// Films must not depend on how the passes are cut, on regions, or on how many light paths an invocation has.
#[test]
fn the_same_bits_however_the_passes_are_cut() {
    let (_, room) = case(0);
    let settings = indirect(&room, 3, true);
    let whole = Rect::whole(SIZE);
    let stop = AtomicBool::new(false);
    let mut engine =
        GpuEngine::on(gpu(), &World::new(&room, SIZE), &settings, None).expect("an engine");
    let setup = engine.light_paths().expect("light paths");
    let mut film = |cuts: &[(Rect, u64, u64)]| {
        let mut film = Film::new(SIZE, whole, settings.strata);
        film.begin_splats(setup);
        for &(rect, from, to) in cuts {
            let (splats, counters) = engine.trace_light(from..to, &stop).expect("passes");
            assert!(counters.light_paths > 0);
            film.put_passes(rect, &Passes::new(from..to, SIZE[0], splats));
        }
        film
    };
    let once = film(&[(whole, 0, 300)]);
    let upper = Rect { y1: 7, ..whole };
    let lower = Rect { y0: 7, ..whole };
    let cut = film(&[
        (lower, 100, 300),
        (upper, 0, 1),
        (lower, 0, 100),
        (upper, 1, 300),
    ]);
    let sums = |film: &Film| film.splats().expect("splats").sums().to_vec();
    assert!(sums(&once).iter().flatten().flatten().any(|s| *s > 0));
    assert_eq!(sums(&once), sums(&cut));
}

#[test]
fn only_scenes_that_gain_by_it_have_light_paths() {
    let has = |text: &str, change: fn(&mut Settings)| {
        let room = scene(text);
        let mut settings = settings(&room, SIZE, 0);
        change(&mut settings);
        let world = World::new(&room, SIZE);
        [Access::Baked, Access::Buffers, Access::Tree]
            .map(|access| compose(&world, &settings, Some(access)).light.is_some())
    };
    let matt = format!("{BOX}{LAMP}");
    let glass = format!("{matt}[[sphere]]\ncenter = [0, 1, 0]\nradius = 0.5\nmaterial = 'glass'\n");
    assert_eq!(has(&matt, |_| {}), [false; 3]);
    assert_eq!(has(&glass, |_| {}), [true; 3]);
    assert_eq!(has(&glass, |s| s.light_paths = false), [false; 3]);
    assert_eq!(has(&glass, |s| s.max_depth = 2), [false; 3]);
    assert_eq!(has(&glass, |s| s.light.indirect = false), [false; 3]);
    let whitted = |s: &mut Settings| s.integrator = etendue::settings::Integrator::Whitted;
    assert_eq!(has(&glass, whitted), [false; 3]);
}
