//! The GPU kernel against the CPU reference, and the reference's two estimators against each other: Welch's t on blocks of
//! pixels and on the whole picture, for every scene of `scenes/` and some that are harder.
//!
//! Each comparison of a scene may reject with probability 10⁻⁴ although both are right (Bonferroni over
//! its blocks and channels): about one false alarm in a thousand runs of this file.

mod common;

use common::{block_means_of_seeds, cpu, gpu, read, scene, scene_files, settings, worst_t};
use etendue::engine::Engine;
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Access, compose};
use etendue::reference::Estimator;
use etendue::scene::Scene;
use etendue::settings::{LightParts, Settings};
use etendue::world::World;
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

/// Without light paths, as the reference: both have the same rare bright samples, which Welch's t would take for a difference to what is
/// free of them.
fn gpu_runs(s: &Scene, spp: u64, access: Option<Access>, first_seed: u32) -> Vec<Vec<[f64; 3]>> {
    runs_with(s, spp, access, first_seed, false)
}

fn runs_with(
    s: &Scene,
    spp: u64,
    access: Option<Access>,
    first_seed: u32,
    light_paths: bool,
) -> Vec<Vec<[f64; 3]>> {
    let mut settings = settings(s, SIZE, first_seed);
    settings.light_paths = light_paths;
    seeds_of(&mut gpu(s, &settings, access), &settings, spp)
}

fn cpu_runs(s: &Scene, spp: u64, estimator: Estimator) -> Vec<Vec<[f64; 3]>> {
    let settings = settings(s, SIZE, 1000);
    seeds_of(&mut cpu(s, &settings, estimator), &settings, spp)
}

fn seeds_of(engine: &mut dyn Engine, settings: &Settings, spp: u64) -> Vec<Vec<[f64; 3]>> {
    block_means_of_seeds(engine, settings, RUNS, spp, 6)
}

fn agree(s: &Scene) -> Result<(), Failed> {
    let reference = cpu_runs(s, 64, Estimator::LightSampling);
    compare(
        "GPU against reference",
        &gpu_runs(s, 192, None, 0),
        &reference,
    )?;
    if compose(&World::new(s, SIZE), &settings(s, SIZE, 0), None)
        .light
        .is_some()
    {
        // By chance with many samples.
        compare(
            "light paths against chance",
            &runs_with(s, 192, None, 0, true),
            &runs_with(s, 1024, None, 100, false),
        )?;
    }
    compare(
        "reference with and without light sampling",
        &reference,
        &cpu_runs(s, 96, Estimator::NoLightSampling),
    )
}

/// Many spheres under many lights: tests the trees of both, also where a path ends on a light.
///
/// A small number of lights must be large, or paths without light sampling hit them too rarely for the second comparison.
fn many(spheres: usize, lights: usize, size: f64) -> Scene {
    let mut text = String::from(
        "[camera]\neye = [0, 1.6, 4.2]\nlook_at = [0, 0.3, 0]\nvfov = 40\nresolution = [48, 36]\n\
         [material.red]\ntype = 'diffuse'\nreflectance = [0.8, 0.3, 0.2]\n\
         [material.glass]\ntype = 'dielectric'\n\
         [material.gloss]\ntype = 'phong'\ndiffuse = [0.2, 0.3, 0.4]\nspecular = [0.5, 0.5, 0.5]\nexponent = 15\n\
         [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = 'red'\n\
         [[plane]]\npoint = [0, 3, 0]\nnormal = [0, 1, 0]\nmaterial = 'red'\n",
    );
    // Evenly, by additive recurrence.
    let spread = |i: usize, k: f64| (i as f64 * k).fract() * 4.0 - 2.0;
    for i in 0..spheres {
        let (x, z) = (spread(i, 0.754_877_67), spread(i, 0.569_840_29));
        let radius = 0.03 + 0.02 * (i as f64).sin();
        let material = ["red", "gloss", "red", "gloss", "glass"][i % 5];
        text += &format!(
            "[[sphere]]\ncenter = [{x}, {radius}, {z}]\nradius = {radius}\nmaterial = '{material}'\n"
        );
    }
    for i in 0..lights {
        let (x, z) = (spread(i, 0.569_840_29), spread(i, 0.754_877_67));
        let (y, a) = (1.8 + 0.6 * (i as f64).sin(), i as f64);
        // Every way but up, of all strengths.
        let (nx, nz) = ((3.0 * a).sin(), (5.0 * a).cos());
        let strength = 0.4 / (lights as f64 * size * size) * (2.0 * a).sin().exp();
        text += &format!(
            "[[light]]\ncenter = [{x}, {y}, {z}]\nnormal = [{nx}, -1, {nz}]\nradius = {size}\n\
             radiance = [{strength}, {}, {strength}]\n",
            strength * 0.7
        );
    }
    scene(&text)
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

/// Of the parts of the light each alone: extra camera rays keep what the path would have kept.
fn part_agrees(s: &Scene, light: LightParts) -> Result<(), Failed> {
    let settings = |seed: u32| Settings {
        light,
        ..settings(s, SIZE, seed)
    };
    let of_reference = settings(1000);
    let mut reference = cpu(s, &of_reference, Estimator::LightSampling);
    let reference = seeds_of(&mut reference, &of_reference, 64);
    let settings = settings(0);
    let found = seeds_of(&mut gpu(s, &settings, None), &settings, 256);
    compare("GPU against reference", &found, &reference)
}

/// Kernels that look at lamps wrongly are found out: what the comparisons of this file are worth there.
fn faults_are_seen(s: &Scene) -> Result<(), Failed> {
    let reference = cpu_runs(s, 64, Estimator::LightSampling);
    for (right, wrong) in [
        // The path sees again what extra camera rays have seen in a mirror.
        (
            "!path.all_specular | (path.depth > sight.depth)",
            "path.depth > min(sight.depth, 1u)",
        ),
        // What glass reflects and what it lets through, as if each were half of the light.
        (
            "material.color, crosses) * share;",
            "material.color, crosses);",
        ),
    ] {
        let settings = settings(s, SIZE, 0);
        let world = World::new(s, settings.size);
        let mut kernel = compose(&world, &settings, None);
        assert!(kernel.wgsl.contains(right), "{right}");
        kernel.wgsl = kernel.wgsl.replace(right, wrong);
        let gpu = Gpu::open(&Choice::default()).expect("an adapter");
        // SAFETY: it is what `compose` made but for numbers that are no indices and end no loop.
        let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
        let runs = seeds_of(&mut engine.expect("an engine"), &settings, 256);
        if compare("", &runs, &reference).is_ok() {
            return Err(format!("\"{wrong}\" in the place of \"{right}\" is not seen").into());
        }
    }
    Ok(())
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
    let none = LightParts {
        emitted: false,
        direct: false,
        indirect: false,
    };
    let emitted = LightParts {
        emitted: true,
        ..none
    };
    let direct = LightParts {
        direct: true,
        ..none
    };
    let indirect = LightParts {
        indirect: true,
        ..none
    };
    trials.push(Trial::test("lamps_in_mirrors::faults_are_seen", || {
        faults_are_seen(&scene(include_str!("scenes/lamps_in_mirrors.toml")))
    }));
    for (name, light) in [
        ("emitted", emitted),
        ("direct", direct),
        ("indirect", indirect),
    ] {
        trials.push(Trial::test(
            format!("lamps_in_mirrors::{name}_agrees"),
            move || {
                let text = include_str!("scenes/lamps_in_mirrors.toml");
                part_agrees(&scene(text), light)
            },
        ));
    }
    trials.push(Trial::test("many_spheres::agrees", || {
        agree(&many(300, 3, 0.8))
    }));
    trials.push(Trial::test("many_lights::agrees", || {
        agree(&many(20, 200, 0.1))
    }));
    libtest_mimic::run(&args, trials).exit();
}

/// Scenes with what the figures lack: nested and planar glass, an eye in glass, lights in glass and half in it, lights flush and near,
/// stacked and on ends of cylinders, coplanar things, a room of huge spheres, a scene far from the origin.
const HARD: [(&str, &str); 13] = [
    ("mirror_balls", include_str!("scenes/mirror_balls.toml")),
    (
        "lamps_in_mirrors",
        include_str!("scenes/lamps_in_mirrors.toml"),
    ),
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
