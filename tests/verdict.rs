//! What the verdict promises: false alarms no more often than stated, and differences seen.
//!
//! The full studies take hours on two cores and are ignored by default:
//! `cargo test --release --test verdict -- --ignored --nocapture`

mod common;

use common::{film, read, scene, settings};
use etendue::compare::{Limits, Side, compare};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Kernel, compose};
use etendue::provenance::Provenance;
use etendue::scene::Scene;
use etendue::settings::Settings;
use etendue::world::World;
use std::path::Path;

fn text(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("scenes").join(format!("{name}.toml"));
    read(&path);
    std::fs::read_to_string(path).expect("it has just been read")
}

/// Renders pictures of one scene, each with its own seed.
struct Camera {
    scene: Scene,
    settings: Settings,
    engine: GpuEngine,
}

impl Camera {
    fn new(scene: Scene, size: [u32; 2], edit: impl FnOnce(&mut Kernel)) -> Self {
        let settings = settings(&scene, size, 0);
        let world = World::new(&scene, size);
        let mut kernel = compose(&world, &settings, None);
        edit(&mut kernel);
        let gpu = Gpu::open(&Choice::default()).expect("an adapter; scripts/test installs one");
        // SAFETY: edits change what is added up, no index and no loop.
        let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
        Self {
            engine: engine.expect("a kernel that compiles"),
            scene,
            settings,
        }
    }

    fn shoot(&mut self, seed: u32, samples: u64) -> Side {
        self.settings.seed = seed;
        self.engine.reseed(seed);
        let film = film(&mut self.engine, &self.settings, samples);
        picture(&film, &Provenance::new(&self.scene, "", &self.settings))
    }
}

fn picture(film: &Film, provenance: &Provenance) -> Side {
    Side::from_film("film".into(), film, provenance).expect("it has samples")
}

/// The smallest false-alarm rate at which the two are different.
fn p(a: &Side, b: &Side) -> f64 {
    let comparison = compare(a, b, &Limits::default()).expect("comparable");
    comparison.verdict.expect("both state their noise").p
}

/// p-values of `pairs` pairs of pictures of a scene that differ in their seeds.
fn null_study(scene: Scene, size: [u32; 2], pairs: u32, samples: u64) -> Vec<f64> {
    let mut camera = Camera::new(scene, size, |_| {});
    (0..pairs)
        .map(|k| {
            let [a, b] = [2 * k, 2 * k + 1].map(|seed| camera.shoot(10_000 + seed, samples));
            p(&a, &b)
        })
        .collect()
}

const NULL_SCENES: [&str; 4] = ["caustic", "three_materials", "diffuse", "phong_gallery"];

/// The most alarms in `n` trials at rate `p` that chance alone exceeds with probability 10⁻³ at most.
fn most_alarms(n: usize, p: f64) -> usize {
    let n = n as f64;
    let (mut k, mut term) = (0usize, (1.0 - p).powf(n));
    let mut below = term;
    while 1.0 - below > 1e-3 {
        term *= (n - k as f64) / (k as f64 + 1.0) * p / (1.0 - p);
        k += 1;
        below += term;
    }
    k
}

fn check_false_alarms(pairs: u32, samples: u64) {
    let scenes = NULL_SCENES.map(|name| (name.to_owned(), scene(&text(name))));
    check_false_alarms_of(scenes.into(), [32, 24], pairs, samples);
}

fn check_false_alarms_of(scenes: Vec<(String, Scene)>, size: [u32; 2], pairs: u32, samples: u64) {
    let mut all = Vec::new();
    for (name, scene) in scenes {
        let ps = null_study(scene, size, pairs, samples);
        let count = |rate: f64| ps.iter().filter(|p| **p < rate).count();
        let least = ps.iter().copied().fold(1.0, f64::min);
        println!(
            "{name}: {} pairs at {samples} samples, false alarms at 0.001: {}, 0.01: {}, 0.05: {}, 0.2: {}; least p {least:.1e}",
            ps.len(),
            count(0.001),
            count(0.01),
            count(0.05),
            count(0.2)
        );
        all.extend(ps);
    }
    for rate in [0.001, 0.01, 0.05, 0.2] {
        let alarms = all.iter().filter(|p| **p < rate).count();
        let most = most_alarms(all.len(), rate);
        assert!(
            alarms <= most,
            "{alarms} false alarms in {} at rate {rate}; chance explains {most}",
            all.len()
        );
    }
}

#[test]
fn false_alarms_are_as_rare_as_stated() {
    check_false_alarms(12, 64);
}

/// A find of a bright sample is no change: its pixel's error is not that of its neighbours, which found none.
#[test]
fn rare_light_gives_no_false_alarms() {
    let names = ["bulb_edge", "bulb_tube", "bulb_small", "sparse_spot"];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stated_error");
    let named = |name: &str| {
        (
            name.to_owned(),
            read(&folder.join(name).with_extension("toml")),
        )
    };
    check_false_alarms_of(names.map(named).into(), [64, 48], 6, 256);
}

#[test]
#[ignore = "2000 pairs: minutes to an hour"]
fn false_alarms_in_2000_pairs() {
    check_false_alarms(500, 64);
}

#[test]
#[ignore = "2000 pairs: minutes to an hour"]
fn false_alarms_in_2000_pairs_of_few_samples() {
    check_false_alarms(500, 16);
}

/// Scenes made for the stated error: light that is rarely found, clouds, glossy and random rooms.
#[test]
#[ignore = "4800 pairs of 36 scenes: half an hour"]
fn false_alarms_of_other_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stated_error");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("the folder is there")
        .map(|e| e.expect("an entry").path())
        .collect();
    files.sort();
    let named = |p: &std::path::PathBuf| (p.display().to_string(), read(p));
    check_false_alarms_of(files.iter().map(named).collect(), [64, 48], 134, 256);
}

/// Pictures of unequal samples: the sign test is no longer exact.
#[test]
#[ignore = "800 pairs: minutes to an hour"]
fn false_alarms_of_unequal_samples() {
    let mut all = Vec::new();
    for name in NULL_SCENES {
        let mut camera = Camera::new(scene(&text(name)), [32, 24], |_| {});
        let ps: Vec<f64> = (0..200)
            .map(|k| {
                let few = camera.shoot(20_000 + 2 * k, 16);
                p(&few, &camera.shoot(20_001 + 2 * k, 256))
            })
            .collect();
        println!(
            "{name}: least p {:.1e}",
            ps.iter().copied().fold(1.0, f64::min)
        );
        all.extend(ps);
    }
    let alarms = all.iter().filter(|p| **p < 0.001).count();
    assert!(
        alarms <= most_alarms(all.len(), 0.001),
        "{alarms} false alarms"
    );
}

#[test]
fn counts_that_chance_explains() {
    // Binomial(2000, 0.001): P(> 7) = 1.1e-3, P(> 8) = 2.4e-4.
    assert_eq!(most_alarms(2000, 0.001), 8);
    assert_eq!(most_alarms(1, 0.0001), 0);
}

/// Something that a renderer could do wrong.
struct Fault {
    name: String,
    scene: &'static str,
    /// What of the scene's text is replaced, and by what.
    text: Option<(&'static str, String)>,
    /// What of the kernel.
    kernel: Option<(&'static str, String)>,
}

/// Faults that must be detected at 128 x 96 pixels for `size` 1. For other values they are larger by this factor.
///
/// Half a pixel at the blue sphere's distance of 5.9 is 2 · 5.9 · tan(20.5°) / 96 / 2 = 0.023. A pixel's width at the
/// middle of the diffuse box, 5 away, is 2 · 5 · tan(18°) / 96 = 0.034.
fn faults(size: f64) -> Vec<Fault> {
    let lamp = [20.0, 16.8, 12.6].map(|x| x * (1.0 + 0.01 * size));
    let kept = 1.0 - 0.02 * size;
    let (aside, out) = (0.023 * size, 0.034 * size);
    vec![
        Fault {
            name: format!("shadow rays that start {out} off their surface"),
            scene: "diffuse",
            text: None,
            kernel: Some((
                "Ray(x.p, wi.d, x.face",
                format!("Ray(x.p + {out} * x.n, wi.d, x.face"),
            )),
        },
        Fault {
            name: format!("{size} % more light from the brighter lamp"),
            scene: "three_materials",
            text: Some(("[20.0, 16.8, 12.6]", format!("{lamp:?}"))),
            kernel: None,
        },
        Fault {
            name: format!("a sphere {aside} aside"),
            scene: "three_materials",
            text: Some((
                "[-1.55, 1.55, -1.2]",
                format!("[{}, 1.55, -1.2]", -1.55 + aside),
            )),
            kernel: None,
        },
        Fault {
            name: format!("glass that transmits {kept} of what it should"),
            scene: "three_materials",
            text: Some((
                "ior  = 1.52",
                format!("ior = 1.52\ntransmittance = [{kept}, {kept}, {kept}]"),
            )),
            kernel: None,
        },
    ]
}

/// The glossy metal ball of exponent 10 with another one. That redistributes the ball's light and leaves its sum: no block
/// that holds the ball sees it, only those as small as the highlight.
fn exponent(to: f64) -> Fault {
    Fault {
        name: format!("an exponent of {to}, not 10"),
        scene: "phong_gallery",
        text: Some((
            "specular = [0.86, 0.62, 0.24]\nexponent = 10.0\n",
            format!("specular = [0.86, 0.62, 0.24]\nexponent = {to:?}\n"),
        )),
        kernel: None,
    }
}

fn replace_once(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "one {from:?}");
    text.replace(from, to)
}

/// Of `trials` pairs of pictures, one without and one with the fault, the number told apart.
fn seen(fault: &Fault, size: [u32; 2], samples: u64, trials: u32) -> u32 {
    let good = text(fault.scene);
    let bad = match &fault.text {
        Some((from, to)) => replace_once(&good, from, to),
        None => good.clone(),
    };
    let mut before = Camera::new(scene(&good), size, |_| {});
    let mut after = Camera::new(scene(&bad), size, |kernel| {
        if let Some((from, to)) = &fault.kernel {
            kernel.wgsl = replace_once(&kernel.wgsl, from, to);
        }
    });
    let mut seen = 0;
    let mut least_certain: f64 = 0.0;
    for k in 0..trials {
        let p = p(
            &before.shoot(1 + 2 * k, samples),
            &after.shoot(2 + 2 * k, samples),
        );
        seen += u32::from(p < Limits::default().alpha);
        least_certain = least_certain.max(p);
    }
    println!(
        "{}: seen in {seen} of {trials} trials, largest p {least_certain:.1e}",
        fault.name
    );
    seen
}

/// The change that a comparison says it would have detected is one of what surfaces reflect, not of the lamp that the eye sees without
/// noise.
#[test]
fn the_change_that_is_stated_is_seen() {
    let size = [64, 48];
    let mut camera = Camera::new(scene(&text("diffuse")), size, |_| {});
    let [a, b] = [901, 902].map(|seed| camera.shoot(seed, 64));
    let comparison = compare(&a, &b, &Limits::default()).expect("comparable");
    let change = comparison
        .verdict
        .expect("both state their noise")
        .sensitivity[0]
        .change;
    assert!((1e-4..0.1).contains(&change), "{change}");
    let kept = 1.0 - change;
    let fault = Fault {
        name: format!("{kept} of the light that surfaces scatter"),
        scene: "diffuse",
        text: None,
        kernel: Some((
            "let gathered = path.beta",
            format!("let gathered = {kept} * path.beta"),
        )),
    };
    assert!(seen(&fault, size, 64, 5) >= 3, "{change}");
}

/// A quarter of the pixels doubles the noise of the whole, so the faults are twice as large. Were one seen in less than 22 %
/// of all trials, this would fail with more than 95 % probability: it tells a broken test, the study below the power.
#[test]
fn faults_are_seen() {
    for fault in faults(2.0) {
        assert_eq!(seen(&fault, [64, 48], 1024, 2), 2, "{}", fault.name);
    }
}

/// How the power grows with the samples for the hardest fault, an exponent a tenth larger.
#[test]
#[ignore = "four hundred pictures of up to 25 million paths: an hour or two"]
fn power_curve_of_an_exponent() {
    for samples in [1024, 1536, 2048] {
        let seen = seen(&exponent(11.0), [128, 96], samples, 100);
        println!("exponent 10 -> 11, {samples} samples: {seen} of 100");
    }
}

#[test]
#[ignore = "eight hundred pictures of 12 million paths: an hour"]
fn faults_are_seen_in_99_of_100_trials() {
    let mut missed = Vec::new();
    for fault in faults(1.0) {
        if seen(&fault, [128, 96], 1024, 100) < 99 {
            missed.push(fault.name);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// Three trials of each: the quickest look at all five at their stated size. A fault seen in less than 37 % of trials
/// passes with less than 5 % probability.
#[test]
#[ignore = "thirty pictures of 12 million paths: minutes"]
fn faults_are_seen_in_three_trials() {
    for fault in faults(1.0).iter().chain(&[exponent(11.0)]) {
        assert_eq!(seen(fault, [128, 96], 1024, 3), 3, "{}", fault.name);
    }
}

/// A region is compared like a picture, and the rest is not.
#[test]
fn pixels_without_samples_are_left_out() {
    let s = scene(&text("diffuse"));
    let settings = settings(&s, [32, 24], 1);
    let rect = Rect {
        x0: 4,
        y0: 4,
        x1: 20,
        y1: 20,
    };
    let mut shots = [1, 2].map(|seed| {
        let mut engine = common::gpu(&s, &settings, None);
        engine.reseed(seed);
        let mut film = Film::new(settings.size, rect, settings.strata);
        use etendue::engine::Engine as _;
        engine
            .render(&mut film, rect, 0..64, &Default::default())
            .expect("rendered");
        picture(&film, &Provenance::new(&s, "", &settings))
    });
    assert!(p(&shots[0], &shots[1]) > 0.001);
    let inside = 10 * 32 + 10;
    shots[1].rgb[inside] = [50.0; 3];
    assert!(p(&shots[0], &shots[1]) < 0.001, "a wrong pixel is seen");
}
