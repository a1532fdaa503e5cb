//! Pictures as they should look: of every scene up to its noise, and a few as PNG for what statistics do not see:
//! orientation, tone curve, colour order.
//! `ETENDUE_BLESS=1 cargo test --release --test golden` makes them anew.

mod common;

use common::{film, gpu, read, scene_files, settings};
use etendue::kernel::Access;
use etendue::output::write_png;
use etendue::provenance::Provenance;
use etendue::regress::{BLESS, assert_golden};
use image::RgbImage;
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [64, 48];
const SPP: u64 = 64;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/golden")
        .join(format!("{name}.png"))
}

fn check(name: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = read(&root.join("scenes").join(format!("{name}.toml")));
    let settings = settings(&scene, SIZE, 1);
    // The kernel that every adapter compiles: baked ones choose among lights with other random numbers.
    let mut engine = gpu(&scene, &settings, Some(Access::Buffers));
    let film = film(&mut engine, &settings, SPP);
    let mut provenance = Provenance::new(&scene, "", &settings);
    provenance.describe(&film);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let actual = folder.path().join("actual.png");
    write_png(&actual, &film, &provenance, 0.0).expect("written");
    let golden = golden(name);
    if std::env::var_os(BLESS).is_some() {
        std::fs::copy(&actual, &golden).expect("golden written");
        return;
    }
    let open = |p: &Path| -> RgbImage {
        image::open(p)
            .unwrap_or_else(|e| panic!("{}: {e}; ETENDUE_BLESS=1 makes it", p.display()))
            .to_rgb8()
    };
    let (a, b) = (open(&actual), open(&golden));
    assert_eq!(a.dimensions(), b.dimensions());
    // The samples are the same on every adapter but for paths that rounding sends elsewhere: few pixels may
    // differ by more than rounding, and the picture as a whole by next to nothing.
    let steps: Vec<u32> = a
        .as_raw()
        .iter()
        .zip(b.as_raw())
        .map(|(x, y)| u32::from(x.abs_diff(*y)))
        .collect();
    let mean = f64::from(steps.iter().sum::<u32>()) / steps.len() as f64;
    let moved = steps.iter().filter(|s| **s > 8).count() as f64 / steps.len() as f64;
    assert!(
        mean < 0.5 && moved < 0.01,
        "{name}: mean step {mean:.3}, {:.2} % of values moved by more than 8; if that is meant, ETENDUE_BLESS=1 \
         makes {} anew",
        100.0 * moved,
        golden.display()
    );
}

/// Small enough for 50 KB a golden, with samples enough to see a change of all light by 1.5 % (diffuse) to 6 % (caustic).
#[test]
fn every_scene_is_its_golden_up_to_noise() {
    let blessing = std::env::var_os(BLESS).is_some();
    for path in scene_files() {
        let scene = read(&path);
        // Noise that is shared with the golden is no evidence.
        let settings = settings(&scene, [48, 36], if blessing { 1 } else { 2 });
        let film = film(&mut gpu(&scene, &settings, None), &settings, 256);
        let name = path.file_stem().expect("it has a name").to_string_lossy();
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.exr"));
        assert_golden(&golden, &film, &Provenance::new(&scene, "", &settings));
    }
}

#[test]
fn diffuse() {
    check("diffuse");
}

#[test]
fn three_materials() {
    check("three_materials");
}

#[test]
fn phong_gallery() {
    check("phong_gallery");
}
