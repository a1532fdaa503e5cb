//! Smooth normals of isosurfaces: how near they are to those of what the volume shows, and pictures of them against the f64 reference,
//! which finds all light by chance. Faults put in on purpose must be seen.

use crate::common::{block_means, cpu, film, settings, worst_t};
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Kernel, compose};
use etendue::reference::Estimator;
use etendue::settings::{LightParts, Settings};
use etendue::world::World;
use etendue::world::trace::Ray;
use etendue::{Grid, Implicit, Numbers, Scene, SceneBuilder, Volume};
use glam::DVec3;
use std::sync::Arc;

const FALSE_ALARM: f64 = 1e-4;
const SIZE: [u32; 2] = [32, 24];
const RUNS: u32 = 12;

/// Samples a run on the GPU, and in f64.
const SAMPLES: [u64; 2] = [512, 512];

type Runs = Vec<Vec<[f64; 3]>>;

/// A ball of radius 0.5 around `center`, from its distance at `side` points a side. The points are farther apart along y.
fn ball(side: usize, center: DVec3, smooth: bool) -> Implicit {
    let spacing = DVec3::new(1.2, 1.5, 1.2) / (side - 1) as f64;
    let half = 0.5 * spacing * (side - 1) as f64;
    let numbers = (0..side.pow(3)).map(|i| {
        let at = [i % side, i / side % side, i / side / side].map(|n| n as f64);
        (0.5 - (DVec3::from_array(at) * spacing - half).length()) as f32
    });
    let volume = Volume::new([side; 3], Numbers::F32(numbers.collect()));
    let mut grid = Grid::new(volume.unwrap_or_else(|e| panic!("{e}")), spacing);
    grid.smooth = smooth;
    let mut implicit = Implicit::of_volume(grid, 0.0);
    implicit.center = center - half;
    implicit
}

/// The root mean square angle, in degrees, between the normals of a ball and those that light is scattered about.
fn off_normals(side: usize, smooth: bool) -> f64 {
    let scene = Scene::builder()
        .camera([0.0, 0.0, 9.0], [0.0; 3], 40.0, SIZE)
        .diffuse("white", [0.5; 3])
        .isosurface(&ball(side, DVec3::ZERO, smooth), "white")
        .build()
        .unwrap_or_else(|e| panic!("{e}"));
    let world = World::new(&scene, SIZE);
    let (mut squares, mut count) = (0.0, 0);
    for k in 0..4000 {
        let (height, turn) = (1.0 - (f64::from(k) + 0.5) / 2000.0, 2.4 * f64::from(k));
        let out = (1.0 - height * height).sqrt();
        let normal = DVec3::new(out * turn.cos(), height, out * turn.sin());
        let ray = Ray {
            origin: normal * 3.0,
            direction: -normal,
            medium: 0,
            face: 0,
        };
        let hit = world.intersect(&ray).expect("the ball");
        assert!(hit.shading.dot(hit.normal) > 0.0 && (hit.shading.length() - 1.0).abs() < 1e-12);
        squares += hit.shading.angle_between(normal).to_degrees().powi(2);
        count += 1;
    }
    (squares / f64::from(count)).sqrt()
}

#[test]
fn they_are_nearer_to_those_of_a_sphere_than_the_cells_are() {
    let off = |side| [off_normals(side, false), off_normals(side, true)];
    let (coarse, fine) = (off(13), off(25));
    println!("cells and smooth: {coarse:.2?}, {fine:.2?} degrees");
    assert!(coarse[1] < 0.5 * coarse[0] && fine[1] < 0.2 * fine[0]);
    // Differences are of second order.
    let order = (coarse[1] / fine[1]).log2();
    assert!((1.7..2.6).contains(&order), "{order}");
}

/// A corner of a room with a smooth ball of coarse cells in it, and a ball of glass.
fn room(material: &str, inside: bool) -> Scene {
    let eye = if inside {
        [0.05, 0.62, 0.2]
    } else {
        [0.0, 1.2, 2.6]
    };
    let room: SceneBuilder = Scene::builder()
        .camera(eye, [0.1, 0.5, -0.5], 55.0, SIZE)
        .diffuse("white", [0.6, 0.5, 0.4])
        .mirror("mirror", [0.95, 0.95, 0.9])
        .dielectric("glass", 1.5)
        .phong("phong", [0.2, 0.3, 0.3], [0.4, 0.3, 0.2], 20.0)
        .plane([0.0; 3], [0.0, 1.0, 0.0], "white")
        .plane([0.0, 0.0, -1.5], [0.0, 0.0, 1.0], "white")
        .isosurface(&ball(6, DVec3::new(0.0, 0.55, 0.0), true), material)
        .sphere([0.85, 0.45, 0.4], 0.4, "glass")
        .light([0.3, 2.3, 0.2], [0.1, -1.0, 0.0], 0.5, [9.0, 8.0, 6.0]);
    room.build().unwrap_or_else(|e| panic!("{e}"))
}

fn of_room(room: &Scene, indirect: bool, seed: u32) -> Settings {
    let mut settings = settings(room, SIZE, seed);
    settings.max_depth = 9;
    if indirect {
        settings.light = LightParts {
            emitted: false,
            direct: false,
            indirect: true,
        };
    }
    settings
}

/// Runs of the kernel after `edit`, which changes what is added up, and no index or loop.
fn kernel(room: &Scene, indirect: bool, edit: impl FnOnce(&mut Kernel)) -> Runs {
    let mut settings = of_room(room, indirect, 0);
    let world = World::new(room, SIZE);
    let mut kernel = compose(&world, &settings, None);
    assert!(kernel.light.is_some(), "light paths");
    edit(&mut kernel);
    let gpu = Arc::new(Gpu::open(&Choice::default()).expect("an adapter"));
    // SAFETY: see above.
    let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
    let mut engine = engine.expect("a kernel that compiles");
    let run = |k| {
        settings.seed = k;
        engine.reseed(k);
        block_means(&film(&mut engine, &settings, SAMPLES[0]), 6)
    };
    (0..RUNS).map(run).collect()
}

fn reference(room: &Scene, indirect: bool) -> Runs {
    let run = |k| {
        let settings = of_room(room, indirect, 1000 + k);
        let mut engine = cpu(room, &settings, Estimator::LightSampling);
        block_means(&film(&mut engine, &settings, SAMPLES[1]), 6)
    };
    (0..RUNS).map(run).collect()
}

/// How improbable the worst difference is, if there is none.
fn p(name: &str, a: &Runs, b: &Runs) -> f64 {
    let worst = worst_t(a, b);
    println!("{name}: {worst:?}");
    assert!(worst.tests > 0, "{name}");
    worst.p * worst.tests as f64
}

#[test]
fn every_material_is_as_bright_as_the_reference_says() {
    let mut wrong = Vec::new();
    for (material, inside) in [
        ("white", false),
        ("mirror", false),
        ("glass", false),
        ("glass", true),
        ("phong", false),
    ] {
        for indirect in [false, true] {
            let room = room(material, inside);
            let name = format!("{material}, inside {inside}, indirect {indirect}");
            let found = kernel(&room, indirect, |_| {});
            if p(&name, &found, &reference(&room, indirect)) < FALSE_ALARM {
                wrong.push(name);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// A material, a name, whether the fault is in the kernel of light paths, and in that of the paths from the eye, and the fault.
const FAULTS: [(&str, &str, bool, bool, &str, &str); 4] = [
    (
        "white",
        "light paths that count by the wrong cosine where they end",
        true,
        false,
        "adjoint(x, d) * turns",
        "turns",
    ),
    (
        "glass",
        "and where they are refracted",
        true,
        false,
        "(scattered.weight * adjoint(&x, scattered.wi))",
        "scattered.weight",
    ),
    (
        "white",
        "a weight by another cosine than that of light paths",
        false,
        true,
        "fmax(dot(x.geometric, x.wo), TINY)",
        "fmax(x.cos_o, TINY)",
    ),
    (
        "glass",
        "light scattered to the wrong side",
        true,
        true,
        "select(vec3f(0.0), scattered.weight, right)",
        "scattered.weight",
    ),
];

#[test]
fn faults_are_seen() {
    let mut unseen = Vec::new();
    for (material, name, in_light, in_path, old, new) in FAULTS {
        let room = room(material, false);
        let replace = |text: &mut String| {
            assert_eq!(text.matches(old).count(), 1, "{old}");
            *text = text.replace(old, new);
        };
        let faulty = kernel(&room, true, |k| {
            if in_light {
                replace(&mut k.light.as_mut().expect("light paths").wgsl);
            }
            if in_path {
                replace(&mut k.wgsl);
            }
        });
        if p(name, &faulty, &reference(&room, true)) > FALSE_ALARM {
            unseen.push(name);
        }
    }
    assert!(unseen.is_empty(), "{unseen:?}");
}
