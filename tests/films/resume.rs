//! Resuming a film: which films are refused or accepted, and what NumPy reads from them.

use crate::output_support::seen_from_python;
use crate::program::{Bench, SCENE, says};
use etendue::output::store;
use etendue::provenance::{Provenance, SAMPLER_VERSION};
use predicates::prelude::*;
use serde_json::{Value, json};
use std::fs;

const GO_ON: &str = "render box.toml --backend cpu --spp 8 --film f.npz -o a.png";

/// A film of 4 samples, made as if `edit` had been so.
fn film_with(bench: &Bench, edit: impl Fn(&mut Provenance)) -> Vec<u8> {
    let path = bench.path("f.npz");
    let _ = fs::remove_file(&path);
    bench.render("--spp 4 --film f.npz -o a.png");
    let (film, mut provenance) = store::load(&path).expect("a film");
    edit(&mut provenance);
    store::save(&path, &film, &provenance).expect("saved");
    fs::read(path).expect("the film")
}

#[test]
fn a_version_that_samples_differently_is_refused_and_another_version_is_not() {
    let bench = Bench::new();
    let before = film_with(&bench, |p| {
        p.sampler_version = 0;
        p.version = "0.0.1".into();
    });
    bench
        .run(GO_ON)
        .code(2)
        .stderr(says("f.npz").and(says(&format!(
            "sampler is 0 (of version 0.0.1) and {SAMPLER_VERSION} (of version "
        ))));
    assert_eq!(fs::read(bench.path("f.npz")).expect("the film"), before);

    film_with(&bench, |p| p.version = "0.0.1".into());
    bench.run(GO_ON).success();
}

#[test]
fn everything_that_differs_is_named() {
    let bench = Bench::new();
    let before = film_with(&bench, |_| {});
    let other = SCENE
        .replace("0.45", "0.46")
        .replace("Test box", "Other box");
    fs::write(bench.path("other.toml"), other).expect("a scene");
    let go_on = |scene: &str, flags: &str| {
        bench
            .run(&format!(
                "render {scene} --backend cpu --spp 8 --film f.npz {flags}"
            ))
            .code(2)
    };
    go_on("box.toml", "--shadow-rays 2 --strata 3 --seed 9").stderr(
        says("strata is 2 and 3")
            .and(says("shadow_rays is 1 and 2"))
            .and(says("seed is 0 and 9")),
    );
    go_on("other.toml", "")
        .stderr(says("scene is \"Test box\" (").and(says("and \"Other box\" (")));
    assert_eq!(fs::read(bench.path("f.npz")).expect("the film"), before);
}

#[test]
fn resuming_on_another_adapter_prints_a_note() {
    let bench = Bench::new();
    film_with(&bench, |p| {
        p.devices[0].device.name = "Another adapter".into();
    });
    let text = "note: f.npz holds samples from Another adapter";
    bench.run(GO_ON).success().stderr(says(text));
    let (film, provenance) = store::load(&bench.path("f.npz")).expect("a film");
    assert_eq!(film.coverage.samples(), (8, 8));
    let used: Vec<_> = provenance
        .devices
        .iter()
        .map(|d| (d.device.name.as_str(), d.samples))
        .collect();
    assert_eq!(
        used,
        [
            ("Another adapter", 4 * 24 * 16),
            ("CPU reference (f64)", 4 * 24 * 16)
        ]
    );
    // Another number of threads is not another adapter.
    film_with(&bench, |_| {});
    bench
        .run(&format!("{GO_ON} --threads 3"))
        .success()
        .stderr(says("note: f.npz").not());
}

#[test]
fn numpy_reads_the_documented_arrays() {
    let bench = Bench::new();
    bench.render("--size 12x8 --spp 300 --seed 5 --film f.npz -o a.exr");
    let Some(seen) = seen_from_python(&bench.path("f.npz")) else {
        return;
    };
    let arrays = &seen["arrays"];
    let types = |name: &str| (arrays[name]["dtype"].clone(), arrays[name]["shape"].clone());
    assert_eq!(types("sums"), (json!("<f8"), json!([8, 12, 4, 4])));
    assert_eq!(types("counts"), (json!("<u8"), json!([8, 12])));

    // The formula that the documentation gives, against the picture.
    let number = |v: &Value| v.as_f64().expect("a number");
    let picture = bench.picture("a.exr");
    for y in 0..8 {
        for x in 0..12 {
            let count = number(&arrays["counts"]["values"][y][x]);
            assert_eq!(count, 300.0);
            for c in 0..3 {
                let replicate = |r: usize| number(&arrays["sums"]["values"][y][x][r][c]);
                let mean = (0..4).map(replicate).sum::<f64>() / count;
                let pixel = f64::from(picture.rgb[y * 12 + x][c]);
                assert!(
                    (mean - pixel).abs() <= 1e-6 * pixel,
                    "{x}, {y}: {mean} {pixel}"
                );
            }
        }
    }

    let told = &seen["provenance"]["provenance"];
    assert_eq!(told["scene_text"], SCENE);
    assert_eq!(told["scene_hash"].as_str().map(str::len), Some(64));
    assert_eq!(told["settings"]["seed"], 5);
    assert_eq!(told["samples"], 300);
    assert_eq!(told["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(told["devices"][0]["device"]["name"], "CPU reference (f64)");
    assert_eq!(told["devices"][0]["samples"], 300 * 96);
    for seconds in [&told["seconds"], &told["devices"][0]["seconds"]] {
        assert!(number(seconds) > 0.0);
    }
}

/// `earlier.npz` has 10 samples a pixel of the box, and lacks the arrays that films have got since. Its samples have other values than
/// those of this version.
#[test]
fn what_has_changed_in_a_scene_is_told() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let scene = SCENE.replace("radius   = 0.45", "radius   = 0.4");
    fs::write(bench.path("box.toml"), format!("# mine\n{scene}")).unwrap();
    bench
        .run("render box.toml --backend cpu --spp 8 --film f.npz -o a.png")
        .code(2)
        .stderr(says(
            "; the film's scene has `radius = 0.45` at line 32, and the file has `radius = 0.4` at line 33; give the scene of the film",
        ));
}

#[test]
fn a_film_of_an_earlier_version_is_read_and_not_resumed() {
    let bench = Bench::new();
    fs::copy("tests/films/earlier.npz", bench.path("f.npz")).unwrap();
    bench.run("develop f.npz -o a.exr").success();
    assert_eq!(bench.picture("a.exr").samples.unwrap()[0], 10);
    let info = bench.run("info f.npz").success();
    info.stdout(says("sample numbers              0..10\n"));
    let refused = bench.run("render box.toml --backend cpu --spp 24 --film f.npz -o a.png");
    refused
        .code(2)
        .stderr(says("f.npz: this film can't be resumed").and(says("version")));
}
