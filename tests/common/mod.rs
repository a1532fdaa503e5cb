//! What several tests share: scenes by name, the one GPU engine, and block statistics.

#![allow(dead_code, reason = "every test binary uses its own part of it")]

use etendue::engine::{Engine, EngineError};
use etendue::film::coverage::Rect;
use etendue::film::{BLOCK, Film};
use etendue::gpu::{Choice, GpuEngine};
use etendue::kernel::Access;
use etendue::reference::{CpuEngine, Estimator};
use etendue::scene::generate::Generated;
use etendue::scene::{Diagnostic, Scene, parse};
use etendue::settings::{Overrides, Settings};
use etendue::world::World;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Every scene file of `scenes/`, sorted.
pub fn scene_files() -> Vec<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<PathBuf> = std::fs::read_dir(&dir)
        .expect("scenes/ is there")
        .map(|f| f.expect("readable").path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    assert!(!files.is_empty(), "no scenes in {}", dir.display());
    files
}

/// The scene `scenes/NAME.toml`.
pub fn named_scene(name: &str) -> Scene {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    read(&dir.join(name).with_extension("toml"))
}

/// Reads a scene, or says what is wrong with it.
pub fn read(path: &Path) -> Scene {
    parse::read(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Parses a scene given as text.
pub fn scene(text: &str) -> Scene {
    or_panic(parse::parse_str(Path::new("test.toml"), text))
}

/// Parses a generated scene.
pub fn generated(scene: &Generated) -> Scene {
    or_panic(scene.parse(Path::new("test.toml")))
}

fn or_panic(read: Result<Scene, Vec<Diagnostic>>) -> Scene {
    let lines = |all: Vec<Diagnostic>| all.iter().map(|d| format!("{d}\n")).collect::<String>();
    read.unwrap_or_else(|all| panic!("{}", lines(all)))
}

/// Settings for a picture of `size` with a seed.
pub fn settings(scene: &Scene, size: [u32; 2], seed: u32) -> Settings {
    Settings::resolve(
        scene,
        &Overrides {
            size: Some(size),
            seed: Some(seed),
            ..Overrides::default()
        },
    )
}

/// The GPU engine; the test fails without an adapter.
pub fn gpu(scene: &Scene, settings: &Settings, access: Option<Access>) -> GpuEngine {
    let world = World::new(scene, settings.size);
    GpuEngine::new(&Choice::default(), &world, settings, access).unwrap_or_else(|e| {
        panic!("no GPU engine: {e}\ninstall a Vulkan driver (scripts/test does)")
    })
}

/// The CPU reference.
pub fn cpu(scene: &Scene, settings: &Settings, estimator: Estimator) -> CpuEngine {
    CpuEngine::new(
        World::new(scene, settings.size),
        settings.clone(),
        estimator,
    )
}

/// A film with samples 0..spp of the whole picture.
pub fn film(engine: &mut dyn Engine, settings: &Settings, spp: u64) -> Film {
    let rect = Rect::whole(settings.size);
    let mut film = Film::new(settings.size, rect, settings.strata);
    add(engine, &mut film, 0..spp);
    film
}

/// Adds samples to a film of the whole picture.
pub fn add(engine: &mut dyn Engine, film: &mut Film, samples: Range<u64>) {
    let mut at = samples.start;
    while at < samples.end {
        let end = ((at / BLOCK + 1) * BLOCK).min(samples.end);
        match engine.render(film, film.bounds, at..end, &AtomicBool::new(false)) {
            Ok(counters) => assert_eq!(
                counters.nonfinite, 0,
                "non-finite samples, first {:?}",
                counters.first_nonfinite
            ),
            Err(EngineError::Stopped) => unreachable!("nobody stops it"),
            Err(e) => panic!("{e}"),
        }
        at = end;
    }
}

/// [`block_means`] of pictures of `count` seeds, from that of `settings` on. A kernel is compiled once for all.
pub fn block_means_of_seeds(
    engine: &mut dyn Engine,
    settings: &Settings,
    count: u32,
    spp: u64,
    block: u32,
) -> Vec<Vec<[f64; 3]>> {
    let seeds = settings.seed..settings.seed + count;
    let means = seeds.map(|seed| {
        engine.reseed(seed);
        block_means(&film(engine, settings, spp), block)
    });
    means.collect()
}

/// Means of square blocks of pixels, all channels, then the mean of the whole picture.
pub fn block_means(film: &Film, block: u32) -> Vec<[f64; 3]> {
    let [w, h] = film.size;
    let (bw, bh) = (w.div_ceil(block), h.div_ceil(block));
    let mut sums = vec![[0.0; 4]; (bw * bh) as usize + 1];
    film.for_each(|x, y, e| {
        for k in [(y / block * bw + x / block) as usize, (bw * bh) as usize] {
            for (s, x) in sums[k].iter_mut().zip(e.mean.into_iter().chain([1.0])) {
                *s += x;
            }
        }
    });
    sums.iter()
        .map(|s| [s[0] / s[3], s[1] / s[3], s[2] / s[3]])
        .collect()
}

/// Two sets of runs, each giving the same list of means: Welch's t for every mean and channel, as
/// the largest two-sided p-value's complement. Returns (largest |t|, its degrees of freedom, which mean).
pub fn worst_t(a: &[Vec<[f64; 3]>], b: &[Vec<[f64; 3]>]) -> Worst {
    let moments = |runs: &[Vec<[f64; 3]>], k: usize, c: usize| {
        let n = runs.len() as f64;
        let mean = runs.iter().map(|r| r[k][c]).sum::<f64>() / n;
        let var = runs.iter().map(|r| (r[k][c] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, var / n, n - 1.0)
    };
    let mut worst = Worst {
        p: 1.0,
        t: 0.0,
        place: 0,
        channel: 0,
        means: (0.0, 0.0),
        tests: 0,
    };
    for k in 0..a[0].len() {
        for c in 0..3 {
            let ((ma, va, na), (mb, vb, nb)) = (moments(a, k, c), moments(b, k, c));
            worst.tests += 1;
            // Rounding of f32 samples: equal constants must pass.
            let v = va + vb + (1e-6 * ma.abs().max(mb.abs())).powi(2);
            if v == 0.0 && ma == mb {
                continue;
            }
            let t = (ma - mb) / v.sqrt();
            let dof = (v * v / (va * va / na + vb * vb / nb)).min(1e6);
            let p = two_sided(t, dof);
            if p < worst.p {
                worst = Worst {
                    p,
                    t,
                    place: k,
                    channel: c,
                    means: (ma, mb),
                    tests: worst.tests,
                };
            }
        }
    }
    let tests = worst.tests;
    Worst { tests, ..worst }
}

/// The most suspicious of many comparisons.
#[derive(Debug)]
pub struct Worst {
    /// Two-sided p-value.
    pub p: f64,
    pub t: f64,
    pub place: usize,
    pub channel: usize,
    pub means: (f64, f64),
    /// How many comparisons there were.
    pub tests: usize,
}

/// Two-sided p-value of Student's t.
pub fn two_sided(t: f64, dof: f64) -> f64 {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    let dist = StudentsT::new(0.0, 1.0, dof).expect("positive degrees of freedom");
    2.0 * dist.cdf(-t.abs())
}
