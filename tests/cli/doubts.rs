//! What is said of scenes that are suspect, and of errors in doubt.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use std::fs;

/// A ball under a lamp of this radiance that faces away from it.
fn turned_away(radiance: f64) -> String {
    format!(
        "camera = {{ eye = [0, 1, 4], look_at = [0, 0.5, 0], vfov = 40, resolution = [24, 16] }}\n\
         sphere = [{{ center = [0, 0.5, 0], radius = 0.5, material = \"white\" }}]\n\
         [material.white]\ntype = \"diffuse\"\nreflectance = [0.7, 0.7, 0.7]\n\
         [[light]]\ncenter = [0, 3, 0]\nnormal = [0, 1, 0]\nradius = 0.2\nradiance = [{radiance:?}, 0, 0]\n"
    )
}

/// The same with a chip close before the lamp, whose light goes nowhere else.
fn shaded(radiance: f64) -> String {
    turned_away(radiance)
        + "[[disk]]\ncenter = [0, 3.05, 0]\nnormal = [0, 1, 0]\nradius = 0.05\nmaterial = \"white\"\n"
}

#[test]
fn check_names_lights_that_have_lit_nothing() {
    let bench = Bench::new();
    let other =
        "[[light]]\ncenter = [0, 3, 1]\nnormal = [0, -1, 0]\nradius = 0.2\nradiance = [5, 5, 5]\n";
    fs::write(bench.path("idle.toml"), shaded(5.0) + other).unwrap();
    bench.run("check idle.toml").success().stderr(
        says("idle.toml:6:1: the light at line 6 has lit nothing").and(says("line 16").not()),
    );
}

/// What changes the picture is told in full, however quiet the run; the rest is counted.
#[test]
fn render_repeats_warnings_that_change_the_picture() {
    let bench = Bench::new();
    fs::write(bench.path("dark.toml"), turned_away(5.0)).unwrap();
    let run = |flags: &str| {
        let done = bench
            .run(&format!(
                "render dark.toml --backend cpu --spp 4 -o a.png {flags}"
            ))
            .success();
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let warning = "warning: dark.toml:6:1: the light at line 6 faces away from everything";
    let said = run("");
    assert!(said.contains(warning), "{said}");
    let note = "note: 1 remark about this scene; see: etendue check dark.toml";
    assert!(said.contains(note), "{said}");
    let quiet = run("--quiet");
    assert!(
        quiet.starts_with(warning) && quiet.lines().all(|line| line.starts_with("warning: ")),
        "{quiet}"
    );
    bench.run("check dark.toml").success().stderr(
        says(warning)
            .and(says("warning: dark.toml: the scene is open"))
            .and(says("lit nothing").not()),
    );
}

/// A pixel of so narrow a view is narrower than the rays of a GPU are apart. The reference has no such limit.
#[test]
fn views_that_are_too_narrow_for_a_gpu() {
    let bench = Bench::new();
    let narrow = SCENE.replace("45.0", "1e-6");
    fs::write(bench.path("narrow.toml"), narrow).unwrap();
    let told = says("1.1e-9 of its distance wide");
    bench
        .run("check narrow.toml")
        .success()
        .stderr(told.clone());
    bench
        .run("render narrow.toml --backend cpu --spp 1 -o a.png --quiet")
        .success()
        .stderr(told.not());
}

/// Nothing found is nothing known, unless no lamp shines.
#[test]
fn a_black_picture_of_a_lit_scene_states_no_error() {
    let bench = Bench::new();
    for (radiance, error, stop_reason) in [(5.0, None, "spp"), (0.0, Some(0.0), "error")] {
        fs::write(bench.path("dark.toml"), turned_away(radiance)).unwrap();
        let done = bench
            .run("render dark.toml --backend cpu --spp 64 --error 5% -o a.exr --report r.json")
            .success();
        let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert_eq!(
            said.contains("no light found yet"),
            error.is_none(),
            "{said}"
        );
        let report = fs::read_to_string(bench.path("r.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["relative_error"].as_f64(), error);
        assert_eq!(report["stop_reason"], stop_reason);
        let doubt = error.map_or("no light found yet".into(), |_| serde_json::Value::Null);
        assert_eq!(report["relative_error_doubt"], doubt);
        let header = bench.picture("a.exr").attributes;
        assert_eq!(header.contains_key("relative_error"), error.is_some());
    }
}

#[test]
fn an_error_that_was_not_reached_is_said() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 8 --error 1% -o a.png")
        .success()
        .stderr(says("; not yet 1.00 % with certainty"));
    bench
        .run("render box.toml --backend cpu --spp 8 -o a.png")
        .success()
        .stderr(says("with certainty").not());
}

#[test]
fn a_white_or_black_png_comes_with_an_exposure() {
    let bench = Bench::new();
    for (radiance, said) in [
        ("60000.0", "are white in the PNG; try --exposure -1"),
        ("0.0001", "are black in the PNG; try --exposure +1"),
    ] {
        let scene = SCENE.replace("8.0, 8.0, 8.0", &[radiance; 3].join(", "));
        fs::write(bench.path("lit.toml"), scene).unwrap();
        bench
            .run("render lit.toml --backend cpu --spp 8 -o a.png")
            .success()
            .stderr(says(said));
    }
    bench
        .run("render box.toml --backend cpu --spp 8 -o a.png")
        .success()
        .stderr(says("--exposure").not());
}

#[test]
fn lights_that_are_all_off_are_said() {
    let bench = Bench::new();
    fs::write(
        bench.path("off.toml"),
        SCENE.replace("8.0, 8.0, 8.0", "0, 0, 0"),
    )
    .unwrap();
    bench
        .run("render off.toml --backend cpu --spp 2 -q -o a.png")
        .success()
        .stderr(says("warning: ").and(says("has radiance 0, so it is a black disk")));
}

/// A lamp of 0.1 mm in a ball of glass is found by no path of a small trial, and the other lamp hides that.
#[test]
fn lights_that_were_not_found_are_named_at_the_end() {
    let bench = Bench::new();
    let lamp = "[[light]]\ncenter = [0.6, 0.5, 0.0]\nnormal = [0.0, -1.0, 0.0]\nradius = 0.0001\nradiance = [1e7, 1e7, 1e7]\n";
    fs::write(bench.path("two.toml"), format!("{SCENE}\n{lamp}")).unwrap();
    let line = SCENE.lines().count() + 2;
    let said = bench
        .run("render two.toml --backend cpu --error 50% --spp 64 -q -o a.png")
        .success();
    said.stderr(says(&format!(
        "warning: the light at line {line} has lit nothing in a trial"
    )));
    bench
        .run("render box.toml --backend cpu --error 50% --spp 64 -q -o a.png")
        .success()
        .stderr(says("has lit nothing").not());
}

/// More samples would show nothing new there.
#[test]
fn mirrors_that_show_nothing_are_not_in_doubt() {
    let bench = Bench::new();
    let disk = "[[disk]]\ncenter = [0.0, 1.4, -1.4]\nnormal = [0.0, 0.3, 1.0]\nradius = 0.6\nmaterial = \"steel\"\n";
    fs::write(bench.path("dark.toml"), format!("{SCENE}\n{disk}")).unwrap();
    bench
        .run("render dark.toml --backend cpu --error 60% --spp 4096 -o a.png --report r.json")
        .success();
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert_eq!(report["stop_reason"], "error");
}
