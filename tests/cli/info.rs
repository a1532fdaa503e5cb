//! `etendue info`.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use serde_json::Value;
use std::fs;

fn json(bench: &Bench, file: &str) -> Value {
    let done = bench.run(&format!("info --json {file}")).success();
    serde_json::from_slice(&done.get_output().stdout).expect("JSON")
}

#[test]
fn films_and_pictures_say_the_same_of_themselves() {
    let bench = Bench::new();
    let written = "--film f.npz -o a.exr -o a.png --exposure -1.5";
    bench.render(&format!(
        "--samples 8..24 --region 0,0,12,8 --seed 7 {written}"
    ));
    bench
        .run("info f.npz")
        .success()
        .stderr("")
        .stdout(says("f.npz: film, 24x16\n"))
        .stdout(says("region                      0,0,12,8\n"))
        .stdout(says("sample numbers              8..24\n"))
        .stdout(says("seed                        7\n"))
        .stdout(says("scene                       Test box\n"))
        .stdout(says("relative_error_uncertainty  0."));
    bench
        .run("info a.exr")
        .success()
        .stdout(says("a.exr: EXR picture, 24x16\n"))
        .stdout(says("R (float)").and(says("samples (float)")));
    bench
        .run("info a.png")
        .success()
        .stdout(says("a.png: PNG picture, 24x16\n").and(says("RGBA (8 bits)")));
    let [film, exr, png] = ["f.npz", "a.exr", "a.png"].map(|file| json(&bench, file));
    assert_eq!(film["film"]["scene_text"], SCENE);
    assert_eq!(film["film"]["coverage"][0][1], "8..24");
    assert!(exr["film"].is_null());
    let [film, exr, png] = [film, exr, png].map(|told| told["entries"].clone());
    assert_eq!(png["exposure"], -1.5);
    assert!(film["exposure"].is_null() && exr["exposure"].is_null());
    for key in [
        "software",
        "scene",
        "scene_hash",
        "seed",
        "samples",
        "replicates",
        "adapter",
        "light",
    ] {
        let is_number = ["seed", "samples", "replicates"].contains(&key);
        assert_eq!(
            (film[key].is_number(), film[key].is_string()),
            (is_number, !is_number),
            "{key}"
        );
        assert_eq!(film[key], exr[key], "{key}");
        assert_eq!(film[key], png[key], "{key}");
    }
    assert_eq!(
        (&film["seed"], &film["samples"]),
        (&Value::from(7), &Value::from(16))
    );
}

#[test]
fn other_files_are_refused() {
    let bench = Bench::new();
    fs::write(bench.path("damaged.npz"), "PK").unwrap();
    fs::write(bench.path("damaged.exr"), "\x76").unwrap();
    fs::write(bench.path("damaged.png"), "\u{89}PNG").unwrap();
    for (file, status) in [
        ("box.toml", 2),
        ("damaged.npz", 2),
        ("damaged.exr", 2),
        ("damaged.png", 2),
        ("none.exr", 4),
        (".", 4),
    ] {
        let refused = bench.run(&format!("info {file}")).code(status);
        refused.stdout("").stderr(says(&format!("error: {file}: ")));
    }
}
