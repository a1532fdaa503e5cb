//! Smooth normals of isosurfaces: how near they are to those of what the volume shows, and pictures of them against the f64 reference,
//! which finds all light by chance. Faults put in on purpose must be seen.

use crate::common::{block_means, cpu, film, settings, worst_t};
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Access, Kernel, compose};
use etendue::reference::Estimator;
use etendue::settings::{LightParts, Settings};
use etendue::world::World;
use etendue::world::trace::Ray;
use etendue::{Grid, Implicit, Numbers, Scene, SceneBuilder, Volume};
use glam::DVec3;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

const FALSE_ALARM: f64 = 1e-4;
const SIZE: [u32; 2] = [16, 12];
const RUNS: u32 = 12;

/// Blocks are as small as what a cell shows: over many cells the effects of normals cancel.
const BLOCK: u32 = 2;

/// Samples a run: with light paths, by chance on the GPU, and by chance in f64.
const SAMPLES: [u64; 3] = [1024, 6144, 768];

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
        .light([0.0, 9.0, 0.0], [0.0, -1.0, 0.0], 1.0, [1.0; 3])
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

/// Where the eye is, and where the lamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Place {
    /// The lamp is in the open.
    Open,
    /// The same, and the smooth ball is hollow: a surface with two sides.
    Sheet,
    /// The lamp is in a ball of glass, so that light paths bring all of its light.
    LampInGlass,
    /// The lamp is in the smooth ball.
    LampInside,
    /// The eye is.
    EyeInside,
}

/// A corner of a room with a smooth ball of coarse cells in it.
fn room(material: &str, place: Place) -> Scene {
    let middle = DVec3::new(0.0, 0.55, 0.0);
    let eye = match place {
        Place::EyeInside => middle + DVec3::new(0.05, 0.07, 0.2),
        _ => DVec3::new(0.0, 1.0, 1.7),
    };
    let aim = if matches!(place, Place::Open | Place::Sheet) {
        [1.0, -0.9, -0.9]
    } else {
        [-0.6, -1.0, -0.5]
    };
    let (lamp, radius) = match place {
        Place::Open | Place::Sheet => (DVec3::new(-1.0, 1.4, 0.9), 0.5),
        Place::LampInside => (middle + DVec3::Y * 0.1, 0.25),
        _ => (DVec3::new(0.6, 1.6, 0.3), 0.25),
    };
    let mut smooth = ball(5, middle, true);
    smooth.closed = place != Place::Sheet;
    let room: SceneBuilder = Scene::builder()
        .camera(eye, [0.1, 0.5, -0.5], 55.0, SIZE)
        .diffuse("white", [0.6, 0.5, 0.4])
        .mirror("mirror", [0.95, 0.95, 0.9])
        .dielectric("glass", 1.5)
        .phong("phong", [0.2, 0.3, 0.3], [0.4, 0.3, 0.2], 20.0)
        .plane([0.0; 3], [0.0, 1.0, 0.0], "white")
        .plane([0.0, 0.0, -1.5], [0.0, 0.0, 1.0], "white")
        .isosurface(&smooth, material)
        .sphere([0.6, 1.6, 0.3], 0.4, "glass")
        .light(lamp, aim, radius, [9.0, 8.0, 6.0]);
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
fn kernel(room: &Scene, mut settings: Settings, edit: impl FnOnce(&mut Kernel)) -> Runs {
    let world = World::new(room, SIZE);
    let mut kernel = compose(&world, &settings, None);
    assert_eq!(kernel.light.is_some(), settings.light_paths);
    edit(&mut kernel);
    let gpu = Arc::new(Gpu::open(&Choice::default()).expect("an adapter"));
    // SAFETY: see above.
    let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
    let mut engine = engine.expect("a kernel that compiles");
    let (first, samples) = if settings.light_paths {
        (0, SAMPLES[0])
    } else {
        (500, SAMPLES[1])
    };
    let run = |k| {
        settings.seed = first + k;
        engine.reseed(settings.seed);
        block_means(&film(&mut engine, &settings, samples), BLOCK)
    };
    (0..RUNS).map(run).collect()
}

/// Runs of the reference, made once for each room.
fn reference(material: &'static str, place: Place, indirect: bool) -> Runs {
    type Key = (&'static str, Place, bool);
    static ALL: OnceLock<Mutex<HashMap<Key, Runs>>> = OnceLock::new();
    let mut all = ALL.get_or_init(Mutex::default).lock().expect("no panic");
    let run = |k| {
        let room = room(material, place);
        let settings = of_room(&room, indirect, 1000 + k);
        let mut engine = cpu(&room, &settings, Estimator::LightSampling);
        block_means(&film(&mut engine, &settings, SAMPLES[2]), BLOCK)
    };
    let runs = all.entry((material, place, indirect));
    runs.or_insert_with(|| (0..RUNS).map(run).collect()).clone()
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
    for (material, place, indirect) in [
        ("white", Place::Sheet, false),
        ("white", Place::LampInGlass, true),
        ("mirror", Place::Open, true),
        ("glass", Place::LampInGlass, true),
        ("glass", Place::LampInside, true),
        ("glass", Place::EyeInside, true),
        ("phong", Place::Open, false),
    ] {
        let name = format!("{material}, {place:?}, indirect {indirect}");
        let room = room(material, place);
        let found = kernel(&room, of_room(&room, indirect, 0), |_| {});
        if p(&name, &found, &reference(material, place, indirect)) < FALSE_ALARM {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// A room, a name, whether the fault is in the kernel of light paths, and in that of the paths from the eye, and the fault.
type Fault = (
    (&'static str, Place, bool),
    &'static str,
    [bool; 2],
    &'static str,
    &'static str,
);

const FAULTS: [Fault; 2] = [
    (
        ("white", Place::LampInGlass, true),
        "light paths that count by the wrong cosine where they end",
        [true, false],
        "adjoint(x, d) * turns",
        "turns",
    ),
    (
        ("mirror", Place::Open, true),
        "and where they are reflected",
        [true, false],
        "(scattered.weight * adjoint(&x, scattered.wi))",
        "scattered.weight",
    ),
];

#[test]
fn faults_are_seen() {
    let mut unseen = Vec::new();
    for ((material, place, indirect), name, [in_light, in_path], old, new) in FAULTS {
        let room = room(material, place);
        let replace = |text: &mut String| {
            assert_eq!(text.matches(old).count(), 1, "{old}");
            *text = text.replace(old, new);
        };
        let settings = of_room(&room, indirect, 0);
        let faulty = kernel(&room, settings.clone(), |k| {
            if in_light {
                replace(&mut k.light.as_mut().expect("light paths").wgsl);
            }
            if in_path {
                replace(&mut k.wgsl);
            }
        });
        let chance = Settings {
            light_paths: false,
            ..settings
        };
        if p(name, &faulty, &kernel(&room, chance, |_| {})) > FALSE_ALARM {
            unseen.push(name);
        }
    }
    assert!(unseen.is_empty(), "{unseen:?}");
}

/// Every way to reach a surface has a kernel with smooth normals that is valid, and other scenes have nothing of it.
#[test]
fn kernels_have_smooth_normals_where_a_surface_has() {
    for access in [Access::Baked, Access::Buffers, Access::Tree] {
        for smooth in [false, true] {
            let room = Scene::builder()
                .camera([0.0, 0.0, 9.0], [0.0; 3], 40.0, SIZE)
                .diffuse("white", [0.5; 3])
                .phong("phong", [0.2, 0.3, 0.3], [0.4, 0.3, 0.2], 20.0)
                .dielectric("glass", 1.5)
                .isosurface(&ball(4, DVec3::ZERO, smooth), "white")
                .isosurface(&ball(4, DVec3::X * 3.0, false), "glass")
                .sphere([0.0, 3.0, 0.0], 0.5, "phong")
                .light([0.0, 9.0, 0.0], [0.0, -1.0, 0.0], 1.0, [1.0; 3])
                .build()
                .unwrap_or_else(|e| panic!("{e}"));
            let kernel = compose(
                &World::new(&room, SIZE),
                &of_room(&room, false, 0),
                Some(access),
            );
            let light = kernel.light.expect("light paths").wgsl;
            for text in [kernel.wgsl, light] {
                let module = naga::front::wgsl::parse_str(&text)
                    .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
                Validator::new(ValidationFlags::all(), Capabilities::default())
                    .validate(&module)
                    .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
                assert_eq!(text.contains("geometric"), smooth, "{access:?}");
                assert_eq!(text.matches("_smooth(p, n)").count(), usize::from(smooth));
            }
        }
    }
}
