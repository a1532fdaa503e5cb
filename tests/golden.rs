//! Pictures as they should look: of every scene up to its noise, and as PNG for what statistics do not see: orientation,
//! tone curve, colour order.
//! `ETENDUE_BLESS=1 cargo test --release --test golden` re-creates them.

mod common;

use common::{film, gpu, read, scene_files, settings};
use etendue::compare::{Limits, Side, compare};
use etendue::kernel::Access;
use etendue::output::write_png;
use etendue::provenance::Provenance;
use etendue::regress::{BLESS, assert_golden};
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [64, 48];
const SPP: u64 = 64;

/// The most that the mean FLIP between two adapters may be: row 43 of the hard cases. FLIP is about a picture's look, so
/// noise that differs everywhere would exceed it; the same seed gives both adapters the same.
const LARGEST_FLIP: f64 = 0.01;

/// The scenes of the repository; without those with implicit surfaces where `ETENDUE_NO_FORMULAS` is set, for a driver whose compiler takes
/// many minutes over one.
fn scenes() -> Vec<PathBuf> {
    let mut scenes = scene_files();
    if std::env::var_os("ETENDUE_NO_FORMULAS").is_some() {
        scenes.retain(|path| {
            let text = std::fs::read_to_string(path).expect("a scene");
            !text.contains("[[implicit]]") && !text.contains("[[isosurface]]")
        });
        assert!(scenes.len() >= 7);
    }
    scenes
}

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
    // The samples are the same on every adapter but for paths that rounding sends elsewhere: nobody sees a difference.
    let read = |p: &Path| Side::read(p).unwrap_or_else(|e| panic!("{e}; ETENDUE_BLESS=1 makes it"));
    let limits = Limits {
        max_flip: Some(LARGEST_FLIP),
        ..Limits::default()
    };
    let found = compare(&read(&golden), &read(&actual), &limits).expect("pictures of one size");
    println!("{name}: mean FLIP {:.5}", found.metrics.flip);
    assert!(
        found.same(),
        "{name}: {:?}; if this is intended, ETENDUE_BLESS=1 re-creates {}",
        found.exceeded,
        golden.display()
    );
}

/// Small enough for 50 KB a golden, with samples enough to see a change of all light by 1.5 % (diffuse) to 6 % (caustic).
#[test]
fn every_scene_is_its_golden_up_to_noise() {
    let blessing = std::env::var_os(BLESS).is_some();
    for path in scenes() {
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
fn every_scene_looks_as_its_golden() {
    for path in scenes() {
        check(&path.file_stem().expect("it has a name").to_string_lossy());
    }
}
