//! The GPU kernel against the CPU reference, and the reference's two estimators against each other: Welch's t on blocks of
//! pixels and on the whole picture, for every scene of `scenes/` and some that are harder.
//!
//! Each comparison of a scene may reject with probability 10⁻⁴ although both are right (Bonferroni over
//! its blocks and channels): about one false alarm in a thousand runs of this file.

mod common;

use common::{block_means, cpu, film, gpu, read, scene, scene_files, settings, worst_t};
use etendue::kernel::Access;
use etendue::reference::Estimator;
use etendue::scene::Scene;
use libtest_mimic::{Arguments, Failed, Trial};

const FALSE_ALARM: f64 = 1e-4;
const RUNS: u32 = 8;
const SIZE: [u32; 2] = [48, 36];

fn compare(name: &str, a: &[Vec<[f64; 3]>], b: &[Vec<[f64; 3]>]) -> Result<(), Failed> {
    let worst = worst_t(a, b);
    if worst.tests == 0 {
        return Err("nothing was compared".into());
    }
    if worst.p * (worst.tests as f64) < FALSE_ALARM {
        return Err(format!("{name}: {worst:?}").into());
    }
    Ok(())
}

fn gpu_runs(s: &Scene, spp: u64, access: Option<Access>, first_seed: u32) -> Vec<Vec<[f64; 3]>> {
    let runs = (0..RUNS).map(|k| {
        let settings = settings(s, SIZE, first_seed + k);
        block_means(&film(&mut gpu(s, &settings, access), &settings, spp), 6)
    });
    runs.collect()
}

fn cpu_runs(s: &Scene, spp: u64, estimator: Estimator) -> Vec<Vec<[f64; 3]>> {
    let runs = (0..RUNS).map(|seed| {
        let settings = settings(s, SIZE, 1000 + seed);
        block_means(&film(&mut cpu(s, &settings, estimator), &settings, spp), 6)
    });
    runs.collect()
}

fn agree(s: &Scene) -> Result<(), Failed> {
    let reference = cpu_runs(s, 64, Estimator::LightSampling);
    compare(
        "GPU against reference",
        &gpu_runs(s, 192, None, 0),
        &reference,
    )?;
    compare(
        "reference with and without light sampling",
        &reference,
        &cpu_runs(s, 96, Estimator::NoLightSampling),
    )
}

/// Baked values and buffers are two texts of one estimator.
fn access_agrees(s: &Scene) -> Result<(), Failed> {
    let baked = gpu_runs(s, 64, Some(Access::Baked), 0);
    compare(
        "baked against buffers",
        &baked,
        &gpu_runs(s, 64, Some(Access::Buffers), 100),
    )
}

fn main() {
    let args = Arguments::from_args();
    let adapters = etendue::gpu::adapters();
    for a in &adapters {
        println!("adapter: {} ({})", a.device.name, a.device.driver);
    }
    let mut trials = Vec::new();
    for path in scene_files() {
        let name = path
            .file_stem()
            .expect("has a name")
            .to_string_lossy()
            .into_owned();
        let file = path.clone();
        trials.push(Trial::test(format!("{name}::agrees"), move || {
            agree(&read(&path))
        }));
        trials.push(Trial::test(format!("{name}::access"), move || {
            access_agrees(&read(&file))
        }));
    }
    for (name, text) in HARD {
        trials.push(Trial::test(format!("{name}::agrees"), move || {
            agree(&scene(text))
        }));
    }
    libtest_mimic::run(&args, trials).exit();
}

/// Scenes with what the figures lack: nested and planar glass, an eye in glass, lights in glass and half in it, lights flush and near,
/// stacked and on ends of cylinders, coplanar things, a room of huge spheres, a scene far from the origin.
const HARD: [(&str, &str); 11] = [
    ("nested_glass", include_str!("scenes/nested_glass.toml")),
    ("water", include_str!("scenes/water.toml")),
    ("eye_in_glass", include_str!("scenes/eye_in_glass.toml")),
    ("light_in_glass", include_str!("scenes/light_in_glass.toml")),
    (
        "light_through_glass",
        include_str!("scenes/light_through_glass.toml"),
    ),
    ("near_light", include_str!("scenes/near_light.toml")),
    ("contact", include_str!("scenes/contact.toml")),
    (
        "lamps_on_things",
        include_str!("scenes/lamps_on_things.toml"),
    ),
    ("stacked_lights", include_str!("scenes/stacked_lights.toml")),
    ("huge_walls", include_str!("scenes/huge_walls.toml")),
    ("far_away", include_str!("scenes/far_away.toml")),
];
