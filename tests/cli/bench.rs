//! Speed against error, as a command.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

/// A few small pictures in a second or so, their references in `cache`.
const SMALL: &str = "bench box.toml --engine cpu,cpu-brute --seeds 2 --max-spp 16 --reference-spp 64 --size 12x8 \
                     --cache cache --progress none";

fn json_lines(stdout: &[u8]) -> Vec<Value> {
    let text = String::from_utf8(stdout.to_vec()).expect("UTF-8");
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}")))
        .collect()
}

fn of_type<'a>(lines: &'a [Value], name: &str) -> Vec<&'a Value> {
    lines.iter().filter(|l| l["type"] == name).collect()
}

fn keys(value: &Value) -> BTreeSet<&str> {
    let object = value.as_object().expect("an object");
    object.keys().map(String::as_str).collect()
}

#[test]
fn bench_refuses_invalid_arguments() {
    let bench = Bench::new();
    bench.run("bench").code(2).stderr(says("SCENE"));
    for (args, rule) in [
        (
            "box.toml --engine tpu",
            "gpu-baked, gpu-buffers, gpu-tree, cpu, cpu-brute",
        ),
        ("box.toml --seeds 0", "a whole number from 1 to 1024"),
        ("box.toml --time soon", "90s, 2m, 1h30m"),
        ("box.toml --plot a.pdf", ".svg or .png"),
        ("box.toml --engine cpu --adapter x", "--adapter"),
        (
            "box.toml box.toml --engine cpu --reference a.exr",
            "needs a single scene, found 2",
        ),
        (
            "box.toml --reference a.exr --reference-spp 4",
            "cannot be used with",
        ),
        ("box.toml --report-table", "cannot be used with"),
        ("--report-table --plot a.svg", "cannot be used with"),
        ("box.toml --scaling", "cannot be used with"),
        ("--scaling --reference a.exr", "cannot be used with"),
        ("--scaling --up-to 0", "a whole number from 1 to 5000000"),
        ("box.toml --up-to 8", "cannot be used with"),
    ] {
        bench
            .run(&format!("bench {args}"))
            .code(2)
            .stdout("")
            .stderr(says("error: ").and(says(rule)));
    }
    fs::write(
        bench.path("bad.toml"),
        SCENE.replace("\"steel\"", "\"stel\""),
    )
    .unwrap();
    bench
        .run("bench box.toml bad.toml --engine cpu")
        .code(2)
        .stdout("")
        .stderr(says("error: bad.toml:").and(says("stel")));
    bench
        .run("bench box.toml --engine gpu-baked --adapter no-such-adapter")
        .code(3)
        .stdout("");
    for (args, name) in [
        ("none.toml", "none.toml"),
        ("box.toml --reference none.exr", "none.exr"),
        ("box.toml --json none/a.jsonl", "none/a.jsonl"),
        ("box.toml --plot none/a.svg", "none/a.svg"),
    ] {
        bench
            .run(&format!("bench {args} --engine cpu"))
            .code(4)
            .stdout("")
            .stderr(says("error: ").and(says(name)));
    }
    assert_eq!(bench.names(), ["bad.toml", "box.toml"]);
}

#[test]
fn a_reference_of_another_scene_is_refused() {
    let bench = Bench::new();
    bench.render("--spp 16 --size 12x8 -o small.exr -o small.png");
    bench.render("--spp 16 -o box.exr");
    bench.render("--spp 16 --light direct -o direct.exr");
    bench.render("--spp 16 --region 0,0,4,4 -o part.exr");
    for (name, rule) in [
        ("small.exr", "12 x 8 pixels, but the picture has 24 x 16"),
        ("small.png", ".exr or a film"),
        ("direct.exr", "another scene or has other settings"),
        ("part.exr", "whole picture"),
        ("box.toml", "box.toml"),
    ] {
        bench
            .run(&format!("bench box.toml --engine cpu --reference {name}"))
            .code(2)
            .stdout("")
            .stderr(says("error: ").and(says(rule)));
    }
    bench
        .run("bench box.toml --engine cpu --reference box.exr --max-spp 1 --seeds 1 --time 1ms --progress none")
        .success()
        .stdout(says("reference: box.exr, 16 samples per pixel").and(says("cpu")))
        .stderr("");
}

#[test]
fn json_lines_contain_all_measurements() {
    let bench = Bench::new();
    let done = bench.run(&format!("{SMALL} --json -")).success();
    let output = done.get_output();
    let table = String::from_utf8_lossy(&output.stderr).into_owned();
    for word in [
        "mean path length",
        "slope",
        "million paths/s",
        "efficiency",
        "cpu-brute",
    ] {
        assert!(table.contains(word), "no {word} in {table}");
    }
    assert!(table.lines().all(|l| l.chars().count() <= 100));
    assert!(!table.contains("FLIP  "), "{table}");
    let wide = bench.run(&format!("{SMALL} --wide")).success();
    wide.stdout(says("claimed MSE").and(says("FLIP  ")));
    let lines = json_lines(&output.stdout);
    let [reference] = of_type(&lines, "reference")[..] else {
        panic!("one reference: {lines:?}");
    };
    assert_eq!(reference["samples"], 64);
    assert_eq!(reference["cached"], false);
    assert!(reference["relative_error"].as_f64().unwrap() > 0.0);

    let engines = of_type(&lines, "engine");
    assert_eq!(engines.len(), 2);
    for e in &engines {
        assert!(e["seconds"]["warm_up"].as_f64().unwrap() > 0.0);
        assert!(e["slope"]["mean"].is_number(), "{e}");
        assert!(e["mean_path_length"].as_f64().unwrap() > 1.0);
    }
    // 1, 2, 4, 8 and 16 samples of two engines with two seeds.
    let pictures = of_type(&lines, "picture");
    assert_eq!(pictures.len(), 20);
    let points = of_type(&lines, "point");
    assert_eq!(points.len(), 10);
    let expected = [
        "type",
        "scene",
        "scene_hash",
        "engine",
        "samples",
        "seeds",
        "seconds",
        "paths_per_second",
        "rays_per_second",
        "rays_per_path",
        "mean_path_length",
        "mse",
        "claimed_mse",
        "relative_mse",
        "trimmed_relative_mse",
        "flip",
        "true_relative_error",
        "claimed_relative_error",
        "claimed_uncertainty",
        "efficiency",
        "ratio",
    ];
    for p in &points {
        assert_eq!(keys(p), BTreeSet::from(expected));
        assert_eq!(p["seeds"], 2);
        assert!(p["seconds"]["render"]["mean"].as_f64().unwrap() > 0.0);
        assert!(p["mse"]["sd"].as_f64().unwrap() >= 0.0);
        // One sample says nothing of its error.
        let claims = p["samples"].as_u64().unwrap() > 1;
        assert_eq!(p["claimed_relative_error"].is_null(), !claims, "{p}");
    }
    let paths = |p: &Value| p["paths"].as_u64().unwrap();
    for p in &pictures {
        assert_eq!(paths(p), p["samples"].as_u64().unwrap() * 12 * 8);
    }
    // The same engine at the same samples, for the first; the other has a ratio to it.
    assert_eq!(points[0]["ratio"]["mean"], 1.0);
    assert!(points[9]["ratio"]["mean"].as_f64().unwrap() > 0.0);
}

#[test]
fn the_reference_is_cached_and_resumed() {
    let bench = Bench::new();
    let reference = |args: &str| {
        let done = bench.run(&format!("{SMALL} --json - {args}")).success();
        of_type(&json_lines(&done.get_output().stdout), "reference")[0].clone()
    };
    let first = reference("");
    let file = bench.path(first["file"].as_str().unwrap());
    let bytes = fs::read(&file).unwrap();
    let film = || bench.film(first["file"].as_str().unwrap());
    let made = film();
    let again = reference("");
    assert_eq!(
        (&again["cached"], &again["file"]),
        (&true.into(), &first["file"])
    );
    assert_eq!(fs::read(&file).unwrap(), bytes, "it was not touched");

    // A shorter reference is in the cache already. A longer one resumes it. Other settings have their own.
    let shorter = bench
        .run(&SMALL.replace("--reference-spp 64", "--reference-spp 32"))
        .success();
    shorter.stdout(says("64 samples per pixel").and(says("cached in cache")));
    bench
        .run(&SMALL.replace("--reference-spp 64", "--reference-spp 128"))
        .success()
        .stdout(says("128 samples per pixel"));
    assert_eq!(film().coverage.samples(), (128, 128));
    assert_ne!(reference("--light direct")["file"], first["file"]);
    assert_ne!(reference("--strata 3")["file"], first["file"]);

    // A damaged reference is rendered again, with a warning.
    fs::write(&file, "no film").unwrap();
    bench
        .run(SMALL)
        .success()
        .stderr(says("warning: ").and(says("the reference is rendered again")));
    assert_eq!(film(), made, "the same samples again");
}

#[test]
fn plots_and_json_are_files() {
    let bench = Bench::new();
    bench
        .run(&format!("{SMALL} --plot a.svg --plot a.png --json a.jsonl"))
        .success()
        .stdout(says("box.toml: 12x8"));
    let svg = fs::read_to_string(bench.path("a.svg")).unwrap();
    assert!(svg.contains("cpu-brute") && svg.contains("slope -1/2"));
    assert!(
        fs::read(bench.path("a.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
    assert!(!json_lines(&fs::read(bench.path("a.jsonl")).unwrap()).is_empty());
}

#[test]
fn the_report_table_leaves_blank_what_takes_too_long() {
    let bench = Bench::new();
    bench
        .run("bench --report-table --engine cpu --size 8x6 --time 1ms --json a.jsonl --progress none")
        .success()
        .stdout(says("indirect light only").and(says("three materials")))
        .stderr(says("blank"));
    let lines = json_lines(&fs::read(bench.path("a.jsonl")).unwrap());
    let cells = of_type(&lines, "report_table");
    assert_eq!(cells.len(), 16);
    for cell in cells {
        let rays = cell["rays"].as_u64().unwrap();
        assert_eq!(cell["samples"], 4 * rays);
        // The first count is always rendered; 256 rays never fit into a millisecond.
        assert!(rays != 1 || cell["seconds"].as_f64().unwrap() > 0.0);
        assert!(rays != 256 || cell["seconds"].is_null());
    }
}

#[test]
fn scaling_shows_the_cost_of_a_path_by_number() {
    let bench = Bench::new();
    let args =
        "bench --scaling --engine cpu,cpu-brute --up-to 5 --size 8x6 --time 400ms --progress none";
    bench
        .run(&format!("{args} --json a.jsonl --plot a.svg --plot a.png"))
        .success()
        .stdout(
            says("spheres: 8x6, 3 other surfaces")
                .and(says("cloud: 8x6, 2 other surfaces"))
                .and(says("lights: 8x6, 24 other surfaces"))
                .and(says("ns per path")),
        );
    let lines = json_lines(&fs::read(bench.path("a.jsonl")).unwrap());
    let expected = [
        "type",
        "series",
        "count",
        "surfaces",
        "engine",
        "adapter",
        "driver",
        "resolution",
        "samples",
        "seconds",
        "paths",
        "rays",
        "seconds_per_path",
        "paths_per_second",
    ];
    let points = of_type(&lines, "scaling");
    assert_eq!(
        lines.len(),
        points.len(),
        "no line crosses that of gpu-tree"
    );
    for (series, others) in [("spheres", 3), ("cloud", 2), ("lights", 24)] {
        for engine in ["cpu", "cpu-brute"] {
            let mine = points
                .iter()
                .filter(|p| p["series"] == series && p["engine"] == engine);
            let counts: Vec<u64> = mine.map(|p| p["count"].as_u64().unwrap()).collect();
            // On a machine that does much else a line may end early.
            assert!(!counts.is_empty(), "{series}, {engine}");
            assert!([1, 2, 4, 5].starts_with(&counts), "{counts:?}");
        }
        for p in points.iter().filter(|p| p["series"] == series) {
            assert_eq!(keys(p), BTreeSet::from(expected));
            assert_eq!(
                p["surfaces"].as_u64(),
                p["count"].as_u64().map(|n| n + others)
            );
            assert!(p["seconds"]["warm_up"].as_f64().unwrap() > 0.0);
            assert_eq!(p["seconds"]["compile"], 0.0);
            assert!(p["seconds_per_path"].as_f64().unwrap() > 0.0);
            assert!(p["paths"].as_u64().unwrap() >= 8 * 6);
        }
    }
    let svg = fs::read_to_string(bench.path("a.svg")).unwrap();
    assert!(svg.contains("cpu-brute") && svg.contains("nanoseconds per path"));
    let png = fs::read(bench.path("a.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
}

#[test]
fn an_interrupted_scaling_prints_its_results_so_far() {
    let bench = Bench::new();
    let script = "timeout --foreground --preserve-status -s INT 3 \"$0\" bench --scaling --engine cpu --size 8x6 \
                  --time 10s --up-to 300 --json a.jsonl --progress none > table";
    assert_eq!(bench.shell(&[], script), 130);
    let table = fs::read_to_string(bench.path("table")).unwrap();
    assert!(table.contains("spheres: 8x6"), "{table}");
    let lines = json_lines(&fs::read(bench.path("a.jsonl")).unwrap());
    // A tenth of the time is that of one sphere.
    assert!(!lines.is_empty(), "{table}");
}

#[test]
fn an_interrupted_bench_prints_its_results_so_far() {
    let bench = Bench::new();
    let script = "timeout --foreground --preserve-status -s INT 4 \"$0\" bench box.toml --engine cpu --seeds 2 --size 12x8 \
                  --time 1h --reference-spp 64 --cache cache --json a.jsonl --progress none > table";
    assert_eq!(bench.shell(&[], script), 130);
    let table = fs::read_to_string(bench.path("table")).unwrap();
    assert!(
        table.contains("efficiency") && table.contains("million paths/s"),
        "{table}"
    );
    let lines = json_lines(&fs::read(bench.path("a.jsonl")).unwrap());
    assert!(!of_type(&lines, "point").is_empty());
}
