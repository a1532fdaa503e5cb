//! What the host does around the kernel, timed: reading a scene, composing its kernel, folding what comes back, writing.
//!
//! `cargo bench --bench host`. Nothing here is held against a limit: clocks on shared machines say little.

use divan::{Bencher, black_box};
use etendue::engine::DeviceInfo;
use etendue::film::coverage::Rect;
use etendue::film::{BLOCK, Film, REPLICATES, Sums};
use etendue::gpu::pack::pack;
use etendue::kernel::{Access, compose};
use etendue::output::store;
use etendue::output::{ExrChannels, write_exr, write_png};
use etendue::provenance::Provenance;
use etendue::scene::{Scene, parse};
use etendue::settings::{Overrides, Settings};
use etendue::world::World;
use std::path::{Path, PathBuf};

const SCENES: [&str; 3] = ["diffuse", "several_lights", "three_materials"];
const SIZE: [u32; 2] = [512, 384];

fn main() {
    divan::main();
}

fn path(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    dir.join(name).with_extension("toml")
}

fn scene(name: &str) -> (Scene, Settings, World) {
    let scene = parse::read(&path(name)).expect("a scene of ours");
    let settings = Settings::resolve(&scene, &Overrides::default());
    let world = World::new(&scene, settings.size);
    (scene, settings, world)
}

/// A whole picture of `samples` that end a block or not, and its provenance.
fn film(samples: u64) -> (Film, Provenance) {
    let (scene, settings, _) = scene("three_materials");
    let mut film = Film::new(SIZE, Rect::whole(SIZE), settings.strata);
    film.put_block(film.bounds, 0..samples, running);
    let mut provenance = Provenance::new(&scene, "", &settings);
    let device = DeviceInfo {
        name: "nothing".into(),
        driver: "none".into(),
        backend: "cpu".into(),
        software: true,
    };
    provenance.add_work(&device, Default::default(), 1.0);
    provenance.describe(&film);
    (film, provenance)
}

/// Sums that look like a picture's: no two pixels and replicates alike.
fn running(x: u32, y: u32) -> [Sums<f32>; REPLICATES] {
    let replicate = |r: usize| {
        let v = 20.0 + (x as f32 * 0.37).sin() + (y as f32 * 0.11).cos() + r as f32 * 0.1;
        [v, 0.9 * v, 0.8 * v, v * v]
    };
    std::array::from_fn(replicate)
}

#[divan::bench(args = SCENES)]
fn parse_scene(bencher: Bencher, name: &str) {
    let path = path(name);
    let text = parse::read_text(&path).expect("a scene of ours");
    bencher.bench(|| parse::parse_str(&path, black_box(&text)));
}

#[divan::bench(args = SCENES)]
fn make_world(bencher: Bencher, name: &str) {
    let (scene, settings, _) = scene(name);
    bencher.bench(|| World::new(black_box(&scene), settings.size));
}

#[divan::bench(args = SCENES)]
fn compose_baked(bencher: Bencher, name: &str) {
    let (_, settings, world) = scene(name);
    bencher.bench(|| compose(black_box(&world), &settings, Some(Access::Baked)));
}

#[divan::bench(args = SCENES)]
fn compose_buffers(bencher: Bencher, name: &str) {
    let (_, settings, world) = scene(name);
    bencher.bench(|| compose(black_box(&world), &settings, Some(Access::Buffers)));
}

#[divan::bench(args = SCENES)]
fn pack_buffers(bencher: Bencher, name: &str) {
    let (.., world) = scene(name);
    bencher.bench(|| pack(black_box(&world), Access::choose(&world), None));
}

/// A block of 512 x 384 pixels, in two parts: what is unfinished, and what is folded into f64.
#[divan::bench(args = [BLOCK / 2, BLOCK])]
fn fold_block(bencher: Bencher, samples: u64) {
    bencher
        .with_inputs(|| Film::new(SIZE, Rect::whole(SIZE), 2))
        .bench_values(|mut film| {
            film.put_block(film.bounds, 0..samples, running);
            film
        });
}

#[divan::bench]
fn relative_error(bencher: Bencher) {
    let (film, _) = film(BLOCK);
    bencher.bench(|| black_box(&film).relative_error());
}

#[divan::bench]
fn exr_file(bencher: Bencher) {
    let (film, provenance) = film(BLOCK);
    let dir = tempfile::tempdir().expect("a temporary folder");
    bencher.bench(|| {
        write_exr(
            &dir.path().join("x.exr"),
            &film,
            &provenance,
            ExrChannels::All,
        )
    });
}

#[divan::bench]
fn png_file(bencher: Bencher) {
    let (film, provenance) = film(BLOCK);
    let dir = tempfile::tempdir().expect("a temporary folder");
    bencher.bench(|| write_png(&dir.path().join("x.png"), &film, &provenance, 0.0));
}

#[divan::bench]
fn film_file(bencher: Bencher) {
    let (film, provenance) = film(BLOCK / 2);
    let dir = tempfile::tempdir().expect("a temporary folder");
    bencher.bench(|| store::save(&dir.path().join("x.npz"), &film, &provenance));
}
