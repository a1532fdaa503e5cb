//! Light paths against chance alone: the f64 reference, which has none, and the kernel with `--light-paths off`. Welch's t on blocks of
//! the picture and on the whole, for each hard case of light that comes by way of mirrors and glass. Faults put in on purpose must be seen.
//!
//! Renders only light that was scattered at least twice. Lamps are large, so that chance finds their light well enough to judge.

mod common;

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

/// A box with the eye in it, and materials.
const BOX: &str = "
[camera]
eye = [0, 1.2, 2.6]
look_at = [0, 0.7, 0]
vfov = 55
resolution = [32, 24]
[render]
max_depth = 9
[material.white]
type = 'diffuse'
reflectance = [0.6, 0.5, 0.4]
[material.dark]
type = 'diffuse'
reflectance = [0.1, 0.1, 0.1]
[material.silver]
type = 'mirror'
reflectance = [0.95, 0.95, 0.9]
[material.glass]
type = 'dielectric'
ior = 1.5
[material.tinted]
type = 'dielectric'
ior = 1.4
transmittance = [0.9, 0.7, 0.5]
[material.air]
type = 'dielectric'
ior = 1.0
[material.dense]
type = 'dielectric'
ior = 3
transmittance = [0.9, 0.8, 0.7]
[material.cavity]
type = 'dielectric'
ior = 0.33333334
[material.bubble]
type = 'dielectric'
ior = 0.7142857
[material.gloss]
type = 'phong'
diffuse = [0.2, 0.3, 0.3]
specular = [0.4, 0.3, 0.2]
exponent = 20
[material.sharp]
type = 'phong'
diffuse = [0.0, 0.0, 0.0]
specular = [0.8, 0.8, 0.8]
exponent = 200
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = 'white'
[[plane]]
point = [0, 0, -1.5]
normal = [0, 0, 1]
material = 'dark'
";

const LAMP: &str = "
[[light]]
center = [0.3, 2.3, 0.2]
normal = [0.1, -1, 0]
radius = 0.5
radiance = [9, 8, 6]
";

/// A case: its name, what is in the box, and what is replaced in the text of the box.
type Case = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

const CASES: [Case; 24] = [
    (
        "glass and mirror balls",
        "[[sphere]]\ncenter = [-0.6, 0.5, 0]\nradius = 0.5\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.7, 0.45, -0.3]\nradius = 0.45\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a glass cylinder and a mirror disk",
        "[[cylinder]]\nbase = [-0.7, 0.3, 0.2]\ntop = [0.1, 0.4, 0.4]\nradius = 0.25\nmaterial = 'glass'\n\
         [[disk]]\ncenter = [0.8, 0.8, 0]\nnormal = [-1, 0.2, 0.3]\nradius = 0.5\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a mirror wall",
        "[[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.4\nmaterial = 'white'\n",
        &[],
    ),
    (
        "facing mirror walls",
        "[[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n\
         [[plane]]\npoint = [1.2, 0, 0]\nnormal = [-1, 0.1, 0]\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a floor of water",
        "[[plane]]\npoint = [0, 0.3, 0]\nnormal = [0, 1, 0]\nmaterial = 'glass'\n",
        &[],
    ),
    (
        "the eye in glass",
        "[[sphere]]\ncenter = [0, 1.2, 2.5]\nradius = 0.3\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [-0.4, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[],
    ),
    (
        "the eye in a glass room with things in it",
        "[[sphere]]\ncenter = [0, 1.2, 1.2]\nradius = 2.2\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.2, 0.8, 0.4]\nradius = 0.4\nmaterial = 'white'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 4.5, 0.2]")],
    ),
    (
        "a light in a glass ball",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'glass'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.6, 0.2]")],
    ),
    (
        "a light in a hollow bulb",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.62\nmaterial = 'air'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.6, 0.2]")],
    ),
    (
        "a light that cuts a glass ball, beside another",
        "[[sphere]]\ncenter = [0.3, 1.8, 0.2]\nradius = 0.6\nmaterial = 'glass'\n\
         [[light]]\ncenter = [-1, 1.6, 0.5]\nnormal = [1, -0.4, 0]\nradius = 0.4\nradiance = [3, 4, 6]\n",
        &[],
    ),
    (
        "nested and touching glass",
        "[[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.25\nmaterial = 'white'\n\
         [[sphere]]\ncenter = [0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.3\nmaterial = 'air'\n",
        &[],
    ),
    (
        "gloss under glass",
        "[[sphere]]\ncenter = [-0.5, 0.6, 0.2]\nradius = 0.4\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.7, 0.45, -0.3]\nradius = 0.45\nmaterial = 'silver'\n",
        &[("material = 'white'", "material = 'gloss'")],
    ),
    (
        "a sharp lobe under glass",
        "[[sphere]]\ncenter = [-0.5, 0.6, 0.2]\nradius = 0.4\nmaterial = 'glass'\n\
         [[disk]]\ncenter = [0.6, 0.3, 0]\nnormal = [-0.4, 1, 0]\nradius = 0.5\nmaterial = 'sharp'\n",
        &[],
    ),
    (
        "the eye just above the floor",
        "[[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[
            ("eye = [0, 1.2, 2.6]", "eye = [0, 0.03, 1.6]"),
            ("look_at = [0, 0.7, 0]", "look_at = [0, 0.0, 0.3]"),
        ],
    ),
    (
        "lights that overlap, and one that pokes through the floor",
        "[[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n\
         [[light]]\ncenter = [0.3, 2.3, 0.2]\nnormal = [0.1, -1, 0]\nradius = 0.3\nradiance = [2, 8, 2]\n\
         [[light]]\ncenter = [0.9, 0.1, 0.2]\nnormal = [-1, 0, 0.1]\nradius = 0.4\nradiance = [2, 3, 5]\n",
        &[],
    ),
    (
        "a huge mirror ball",
        "[[sphere]]\ncenter = [-10000001.2, 0, 0]\nradius = 10000000\nmaterial = 'silver'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.4\nmaterial = 'white'\n",
        &[],
    ),
    ("sixty glass balls", "@crowd", &[]),
    (
        "the eye just above a glossy floor",
        "[[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[
            ("eye = [0, 1.2, 2.6]", "eye = [0, 0.03, 1.6]"),
            ("look_at = [0, 0.7, 0]", "look_at = [0, 0.0, 0.3]"),
            ("material = 'white'", "material = 'gloss'"),
            ("material = 'dark'", "material = 'gloss'"),
        ],
    ),
    // Lights whose light is sampled through glass, straight alone or reflected once as well.
    (
        "a light that fills much of a glass ball",
        "[[sphere]]\ncenter = [0.3, 1.6, 0.2]\nradius = 0.9\nmaterial = 'glass'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.62, 0.2]")],
    ),
    (
        "a small light in a dense ball beside a mirror",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 1.2\nmaterial = 'dense'\n\
         [[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 1, -0.3]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.44, 1.5, 0.2]"),
            ("radius = 0.5", "radius = 0.13"),
        ],
    ),
    (
        "a light in a hollow tinted ball over a glossy floor",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.6\nmaterial = 'bubble'\n",
        &[
            ("center = [0.3, 2.3, 0.2]", "center = [0.32, 1.6, 0.2]"),
            ("radius = 0.5", "radius = 0.3"),
            ("material = 'white'", "material = 'gloss'"),
        ],
    ),
    (
        "a small light in a hollow ball, seen in another ball",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 1.1\nmaterial = 'dense'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.9\nmaterial = 'cavity'\n\
         [[sphere]]\ncenter = [-0.9, 0.4, 0.6]\nradius = 0.3\nmaterial = 'glass'\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 0.3, -1]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.34, 1.5, 0.2]"),
            ("radius = 0.5", "radius = 0.14"),
        ],
    ),
    (
        "the eye in a glass room with a lamp in a bubble, and two more lamps",
        "[[sphere]]\ncenter = [0, 1.2, 1.2]\nradius = 2.6\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.5\nmaterial = 'bubble'\n\
         [[sphere]]\ncenter = [-0.7, 0.9, 0.2]\nradius = 0.4\nmaterial = 'tinted'\n\
         [[light]]\ncenter = [-0.7, 0.9, 0.2]\nnormal = [1, -1, 0]\nradius = 0.12\nradiance = [9, 20, 30]\n\
         [[light]]\ncenter = [-0.7, 0.91, 0.21]\nnormal = [-1, 1, 0]\nradius = 0.1\nradiance = [30, 20, 9]\n",
        &[
            ("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.5, 0.21]"),
            ("radius = 0.5", "radius = 0.2"),
        ],
    ),
    (
        "a bulb that touches the floor, and another lamp",
        "[[sphere]]\ncenter = [0.3, 1.0, 0.2]\nradius = 1.0\nmaterial = 'dense'\n\
         [[light]]\ncenter = [-1, 1.6, 0.5]\nnormal = [1, -0.4, 0]\nradius = 0.4\nradiance = [0.3, 0.4, 0.6]\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 1, -0.3]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.01, 0.2]"),
            ("radius = 0.5", "radius = 0.2"),
        ],
    ),
];

/// The first of the cases whose lights are sampled through glass, with light paths or without: the reference alone is their judge.
const FIRST_BULB: usize = 18;

/// Scene number `case`.
fn case(case: usize) -> (&'static str, Scene) {
    let (name, things, changes) = CASES[case];
    let crowd: String = (0..60)
        .map(|k| {
            let (x, z) = (
                f64::from(k % 10) * 0.3 - 1.35,
                f64::from(k / 10) * 0.3 - 1.0,
            );
            format!(
                "[[sphere]]\ncenter = [{x:.2}, 0.2, {z:.2}]\nradius = 0.13\nmaterial = 'glass'\n"
            )
        })
        .collect();
    let mut text = format!("{BOX}{LAMP}{}", things.replace("@crowd", &crowd));
    for (old, new) in changes {
        assert!(text.contains(old), "{name}: {old}");
        text = text.replacen(old, new, 1);
    }
    (name, scene(&text))
}

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

/// Puts other text in the place of one that is there once.
fn replace(text: &mut String, old: &str, new: &str) {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    *text = text.replace(old, new);
}

/// A case, a fault that it must show, and whether it is in the kernel of light paths, in the other one, or in both.
type Fault = (&'static str, usize, [bool; 2], &'static str, &'static str);

/// A fault in the densities of lobes is not among them: it moves weight between two ways that both find the light, by less than the noise
/// of these runs.
const FAULTS: [Fault; 12] = [
    (
        "light counted twice",
        0,
        [false, true],
        "return 1.0 / (1.0 + select(0.0, path.trail.ratio * density, weighs));",
        "return 1.0;",
    ),
    (
        "the cosine at the light is forgotten",
        0,
        [true, true],
        "fmax(2.0 * PI * cone.height * cos, TINY)",
        "fmax(2.0 * PI * cone.height, TINY)",
    ),
    (
        "a factor of n squared",
        7,
        [true, true],
        "return photons * select(in_cone",
        "return 2.25 * photons * select(in_cone",
    ),
    (
        "a density wrong by a tenth",
        1,
        [true, true],
        "return photons * select(in_cone",
        "return 1.1 * photons * select(in_cone",
    ),
    (
        "what is carried past a second surface is dropped",
        0,
        [false, true],
        "let later = path.trail.ratio * turned(x, scattered.wi, scattered.pdf);",
        "let later = 0.0;",
    ),
    (
        "sixteen passes for fifteen",
        0,
        [true, false],
        "(turns / fmax(ratio + cos, TINY))",
        "(16.0 / 15.0 * turns / fmax(ratio + cos, TINY))",
    ),
    (
        "a pixel's cosine is forgotten",
        0,
        [true, true],
        "return PIXEL_AREA * (cos * along) * along;",
        "return PIXEL_AREA * along * along;",
    ),
    (
        "light of bulbs counted twice",
        20,
        [false, true],
        "return select(share, weight, sampled);",
        "return share;",
    ),
    (
        "light that a bulb reflects counted twice",
        19,
        [false, true],
        "((trail.reflections == 0u) | once)",
        "(trail.reflections == 0u)",
    ),
    (
        "light paths counted beside what is sampled of a bulb",
        18,
        [true, false],
        "return straight | once;",
        "return false;",
    ),
    (
        "a bulb that reflects all light",
        21,
        [false, true],
        "again * again * (1.0 - outer)",
        "again * again",
    ),
    (
        "a bulb's own light lets light through",
        23,
        [false, true],
        "& keeps(last) & !hidden",
        "& keeps(last)",
    ),
];

#[test]
fn faults_are_seen() {
    let mut unseen = Vec::new();
    for (name, number, [in_light, in_path], old, new) in FAULTS {
        let faulty = kernel(&case(number).1, true, SAMPLES[0], |k| {
            let light = k.light.as_mut().expect("light paths");
            if in_light {
                replace(&mut light.wgsl, old, new);
            }
            if in_path {
                replace(&mut k.wgsl, old, new);
            }
        });
        let right = if number < FIRST_BULB {
            by_chance(number)
        } else {
            by_reference(number)
        };
        if p(name, &faulty, &right) > FALSE_ALARM {
            unseen.push(name);
        }
    }
    assert!(unseen.is_empty(), "{unseen:?}");
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
