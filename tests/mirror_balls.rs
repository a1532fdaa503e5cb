//! Light reflected by mirror balls, to which the kernel sends paths, compared with the CPU reference, which does not: Welch's
//! t on blocks of the picture and on the whole. Also checks that this test detects light counted twice, and a wrong density.
//!
//! Renders only the indirect light of paths with three vertices, in a dark room, so that most of it comes from the balls.
//! agreement.rs compares all light together, where an error in this part is hidden by noise. probes/images.rs detects smaller
//! errors of the density.

mod common;

use common::{block_means, cpu, film, scene, settings, worst_t};
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Access, Kernel, compose};
use etendue::reference::Estimator;
use etendue::scene::Scene;
use etendue::settings::{LightParts, Settings};
use etendue::world::World;
use std::sync::OnceLock;

const FALSE_ALARM: f64 = 1e-4;
const SIZE: [u32; 2] = [32, 24];
const RUNS: u32 = 16;
/// Samples a run, on the GPU and of the reference.
const SAMPLES: [u64; 2] = [512, 1024];

type Runs = Vec<Vec<[f64; 3]>>;

/// Matt and dark but for two balls, of which one is cut by the floor, and two lights; one comes near the other ball. Nothing
/// else focuses light, so that sixteen runs tell their own noise.
const ROOM: &str = "
[camera]
eye = [0, 1.2, 3.4]
look_at = [0, 0.6, -0.4]
vfov = 50
resolution = [32, 24]
[material.dark]
type = 'diffuse'
reflectance = [0.05, 0.04, 0.06]
[material.silver]
type = 'mirror'
reflectance = [0.95, 0.95, 0.9]
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = 'dark'
[[plane]]
point = [0, 0, -1.5]
normal = [0, 0, 1]
material = 'dark'
[[plane]]
point = [-1.6, 0, 0]
normal = [1, 0, 0]
material = 'dark'
[[disk]]
center = [0.1, 0.9, -0.2]
normal = [0.3, 1, 0.2]
radius = 0.2
material = 'dark'
[[light]]
center = [0.3, 2.3, 0.2]
normal = [0.1, -1, 0]
radius = 0.3
radiance = [9, 8, 6]
[[light]]
center = [-0.05, 1.22, -0.28]
normal = [-0.45, -0.72, -0.72]
radius = 0.2
radiance = [6, 9, 12]
[[sphere]]
center = [-0.5, 0.5, -1]
radius = 0.5
material = 'silver'
[[sphere]]
center = [0.85, 0.2, -0.4]
radius = 0.45
material = 'silver'
";

fn by_mirrors(room: &Scene, seed: u32) -> Settings {
    let mut settings = settings(room, SIZE, seed);
    settings.max_depth = 3;
    settings.light = LightParts {
        emitted: false,
        direct: false,
        indirect: true,
    };
    settings
}

fn reference() -> &'static Runs {
    static RUN: OnceLock<Runs> = OnceLock::new();
    RUN.get_or_init(|| {
        let room = scene(ROOM);
        let run = |k| {
            let settings = by_mirrors(&room, 1000 + k);
            let mut engine = cpu(&room, &settings, Estimator::LightSampling);
            block_means(&film(&mut engine, &settings, SAMPLES[1]), 8)
        };
        (0..RUNS).map(run).collect()
    })
}

/// Runs of the kernel after `edit`, which changes what is added up, and no index or loop.
fn kernel(access: Access, edit: impl FnOnce(&mut Kernel)) -> Runs {
    let room = scene(ROOM);
    let mut settings = by_mirrors(&room, 0);
    let world = World::new(&room, SIZE);
    let mut kernel = compose(&world, &settings, Some(access));
    edit(&mut kernel);
    let gpu = Gpu::open(&Choice::default()).expect("an adapter; scripts/test installs one");
    // SAFETY: see above.
    let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
    let mut engine = engine.expect("a kernel that compiles");
    let run = |seed| {
        settings.seed = seed;
        engine.reseed(seed);
        block_means(&film(&mut engine, &settings, SAMPLES[0]), 8)
    };
    (0..RUNS).map(run).collect()
}

/// Puts other text in the place of one that is there once.
fn replace(kernel: &mut Kernel, old: &str, new: &str) {
    assert_eq!(kernel.wgsl.matches(old).count(), 1, "{old}");
    kernel.wgsl = kernel.wgsl.replace(old, new);
}

/// How improbable the worst difference to the reference is, if there is none.
fn p(runs: &Runs) -> f64 {
    let worst = worst_t(runs, reference());
    println!("{worst:?}");
    worst.p * worst.tests as f64
}

#[test]
fn the_room_is_as_bright_as_the_reference_says() {
    for access in [Access::Baked, Access::Buffers] {
        let p = p(&kernel(access, |_| {}));
        assert!(p > FALSE_ALARM, "{access:?}: p = {p}");
    }
}

#[test]
fn light_counted_twice_is_detected() {
    let p = p(&kernel(Access::Baked, |k| {
        replace(k, "memory < BY_MIRROR || !image", "true");
    }));
    assert!(p < FALSE_ALARM, "p = {p}");
}

#[test]
fn a_density_wrong_by_a_fifth_is_detected() {
    let p = p(&kernel(Access::Baked, |k| {
        replace(k, "PI * radius * radius", "3.77 * radius * radius");
    }));
    assert!(p < FALSE_ALARM, "p = {p}");
}
