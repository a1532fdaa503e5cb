//! JSON lines on stderr, logs, and their plot.

use crate::program::{Bench, says};
use serde_json::Value;
use std::fs;

fn lines(text: &str) -> Vec<Value> {
    let each = text
        .lines()
        .map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{l}: {e}")));
    each.collect()
}

fn of<'a>(lines: &'a [Value], event: &'a str) -> impl Iterator<Item = &'a Value> {
    lines.iter().filter(move |l| l["event"] == event)
}

#[test]
fn every_line_is_json_and_the_last_has_the_numbers_of_the_report() {
    let bench = Bench::new();
    let run = bench
        .run("render box.toml --backend cpu --size 96x64 --spp 256 --progress json -o a.exr --report a.json --film a.npz")
        .success();
    let said = lines(std::str::from_utf8(&run.get_output().stderr).unwrap());
    assert_eq!(said[0]["event"], "start");
    assert_eq!(said[0]["title"], "Test box");
    assert_eq!(said[0]["resolution"], serde_json::json!([96, 64]));
    assert_eq!(said[0]["target"]["samples"], 256);
    assert!(of(&said, "progress").count() >= 2);
    assert!(of(&said, "message").any(|m| m["text"] == "wrote a.npz, a.exr"));
    let ends: Vec<_> = of(&said, "end").collect();
    let report: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("a.json")).unwrap()).unwrap();
    let [end] = ends[..] else { panic!("{ends:?}") };
    for (key, reported) in [
        ("stop_reason", &report["stop_reason"]),
        ("samples", &report["spp"]),
        ("seconds", &report["seconds"]["render"]),
        ("paths", &report["paths"]),
        ("paths_per_second", &report["paths_per_second"]),
        ("relative_error", &report["relative_error"]),
        (
            "relative_error_uncertainty",
            &report["relative_error_uncertainty"],
        ),
    ] {
        assert_eq!(
            (end[key].as_f64(), end[key].as_str()),
            (reported.as_f64(), reported.as_str()),
            "{key}"
        );
    }
    // Errors and warnings alone.
    let quiet = bench
        .run("render none.toml --backend cpu --progress json --quiet")
        .code(4);
    let said = lines(std::str::from_utf8(&quiet.get_output().stderr).unwrap());
    assert_eq!(said.len(), 1);
    assert_eq!(
        (&said[0]["event"], &said[0]["level"]),
        (&"message".into(), &"error".into())
    );
}

#[test]
fn a_log_goes_on_with_its_film_and_is_drawn() {
    let bench = Bench::new();
    bench.render("--spp 64 --log a.jsonl --film a.npz -o a.png");
    bench.render("--spp 128 --log a.jsonl --film a.npz -o a.png");
    bench.render("--spp 64 --seed 7 --error 0.001% --log b.jsonl -o a.png");
    let log = lines(&fs::read_to_string(bench.path("a.jsonl")).unwrap());
    let starts: Vec<_> = of(&log, "start").collect();
    assert_eq!((starts.len(), of(&log, "end").count()), (2, 2));
    assert_eq!(starts[1]["held"]["samples"], 64.0);
    // A film that is begun anew begins a new log.
    fs::remove_file(bench.path("a.npz")).unwrap();
    bench.render("--spp 64 --log a.jsonl --film a.npz -o a.png");
    let log = lines(&fs::read_to_string(bench.path("a.jsonl")).unwrap());
    assert_eq!(of(&log, "start").count(), 1);

    bench
        .run("plot a.jsonl b.jsonl -o curve.svg -o curve.png")
        .success()
        .stdout("")
        .stderr(says("wrote curve.svg, curve.png"));
    let svg = fs::read_to_string(bench.path("curve.svg")).unwrap();
    for word in ["Test box", ">\na\n<", ">\nb\n<", "slope -1/2"] {
        assert!(svg.contains(word), "no {word:?}");
    }
}

#[test]
fn what_is_no_log_is_refused() {
    let bench = Bench::new();
    fs::write(bench.path("empty.jsonl"), "").unwrap();
    for (args, status, rule) in [
        ("plot none.jsonl -o a.svg", 4, "no such file"),
        (
            "plot box.toml -o a.svg",
            2,
            "box.toml: not a log (text, such as a scene file)",
        ),
        (
            "plot empty.jsonl -o a.svg",
            2,
            "no log has a relative error",
        ),
        ("plot empty.jsonl -o a.pdf", 2, ".svg"),
        ("plot empty.jsonl -o empty.jsonl", 2, "svg"),
        ("plot empty.jsonl", 2, "--output"),
        (
            "render box.toml --backend cpu --spp 1 --log no/a.jsonl",
            4,
            "no such folder",
        ),
        (
            "render box.toml --backend cpu --spp 1 --log box.toml",
            2,
            "would overwrite the scene",
        ),
    ] {
        bench.run(args).code(status).stderr(says(rule));
    }
    assert_eq!(bench.names(), ["box.toml", "empty.jsonl"]);
}

/// A full disk ends the log, and not the render.
#[cfg(target_os = "linux")]
#[test]
fn a_log_that_cannot_be_written_ends_alone() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 4 --log /dev/full -o a.png")
        .success()
        .stderr(says("warning: /dev/full: cannot write"));
    assert!(bench.path("a.png").exists());
}
