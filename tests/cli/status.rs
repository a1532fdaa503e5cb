//! Exit statuses.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use std::fs;
use std::time::{Duration, Instant};

#[test]
fn status_0_and_the_default_outputs() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 1")
        .success()
        .stdout("")
        .stderr(says("box: 24x16, 1 spp, on CPU reference ("))
        .stderr(says("wrote box.exr, box.png"));
    assert_eq!(bench.names(), ["box.exr", "box.png", "box.toml"]);
}

#[test]
fn status_2_for_a_bad_command_line() {
    let bench = Bench::new();
    for (flags, rule) in [
        ("--spp 0", "whole number from 1 to"),
        ("--spp many", "many"),
        ("--rays 4294967295", "4294967295"),
        ("--time 5x", "90s, 2m, 1h30m"),
        ("--time 0", "more than 0"),
        ("--error 0", "more than 0"),
        ("--error two", "0.02 or 2%"),
        ("--samples 5..5", "A must be less than B"),
        ("--samples 0..4 --spp 3", "cannot be used with"),
        ("--samples 0..4 --error 1%", "cannot be used with"),
        ("--size 0x4", "1 to 65536"),
        ("--region 1,1,1,2", "X0 must be less than X1"),
        ("--region 0,0,25,16", "24x16"),
        ("--light direct,dim", "\"dim\""),
        ("--max-depth 0", "a whole number from 1 to 4294967295"),
        ("--strata 0", "a whole number from 1 to 1024"),
        ("--shadow-rays 0", "a whole number from 1 to 1024"),
        ("--seed abc", "a whole number from 0 to 4294967295"),
        ("--adapter=", "part of an adapter's name"),
        ("--integrator radiosity", "whitted"),
        ("--adapter x", "--backend cpu"),
        ("--checkpoint 5s", "--film"),
        ("--exposure x", "stops"),
        ("--output a.tiff", "use .exr or .png"),
        ("--output a", ".exr or .png"),
        ("--watch a.exr", ".png"),
        ("--no-such-flag", "--no-such-flag"),
    ] {
        bench
            .run(&format!("render box.toml --backend cpu {flags}"))
            .code(2)
            .stdout("")
            .stderr(says("error: ").and(says(rule)));
    }
    bench
        .run("render box.toml --backend tpu")
        .code(2)
        .stderr(says("tpu"));
    bench.run("").code(2);
    bench.run("paint").code(2);
    bench.run("merge out.npz").code(2);
    bench.run("develop film.npz").code(2);
    assert_eq!(bench.names(), ["box.toml"]);
}

#[test]
fn status_2_for_a_bad_scene_names_line_and_column() {
    let bench = Bench::new();
    fs::write(
        bench.path("bad.toml"),
        SCENE.replace("\"steel\"", "\"stel\""),
    )
    .unwrap();
    for command in ["render", "check"] {
        bench.run(&format!("{command} bad.toml")).code(2).stderr(
            says("error: bad.toml:")
                .and(says("stel"))
                .and(says("steel")),
        );
    }
    fs::write(bench.path("empty.toml"), "").unwrap();
    bench.run("render empty.toml").code(2);
    assert_eq!(bench.names(), ["bad.toml", "box.toml", "empty.toml"]);
}

#[test]
fn status_3_without_the_adapter_asked_for() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend gpu --adapter no-such-adapter --spp 1")
        .code(3)
        .stdout("")
        .stderr(says("error: "));
    assert_eq!(bench.names(), ["box.toml"]);
}

#[test]
fn status_2_for_a_picture_larger_than_memory() {
    let bench = Bench::new();
    for backend in ["cpu", "auto"] {
        bench
            .run(&format!(
                "render box.toml --backend {backend} --size 65536x65536 --spp 1"
            ))
            .code(2)
            .stderr(says("4295.0 million pixels").and(says("GB")));
    }
}

/// The error for a value that begins with a hyphen states the rule, not that the flag is unknown.
#[test]
fn negative_values_get_the_rule() {
    let bench = Bench::new();
    for (command, flag, value, rule) in [
        (
            "render box.toml",
            "--seed",
            "-1",
            "a whole number from 0 to 4294967295",
        ),
        ("render box.toml", "--size", "-1x5", "1 to 65536"),
        ("render box.toml", "--time", "-1s", "90s, 2m, 1h30m"),
        (
            "render box.toml",
            "--region",
            "-1,0,4,4",
            "expected X0,Y0,X1,Y1 in pixels",
        ),
        ("render box.toml", "--exposure", "-inf", "from -100 to 100"),
        ("render box.toml", "--exposure", "-101", "from -100 to 100"),
        ("render box.toml", "--spp", "-1", "a whole number from 1 to"),
        ("render box.toml", "--error", "-1%", "more than 0"),
        (
            "render box.toml",
            "--samples",
            "-1..4",
            "not a whole number from 0",
        ),
        (
            "render box.toml",
            "--max-depth",
            "-1",
            "a whole number from 1",
        ),
        (
            "render box.toml",
            "--shadow-rays",
            "-2",
            "a whole number from 1 to 1024",
        ),
        (
            "render box.toml",
            "--threads",
            "-1",
            "a whole number from 1 to 4096",
        ),
        (
            "make-scene spheres",
            "--count",
            "-1",
            "a whole number from 1 to 5000000",
        ),
        (
            "make-scene spheres",
            "--seed",
            "-1",
            "a whole number from 0",
        ),
        ("compare a b", "--alpha", "-1", "a probability"),
        ("compare a b", "--max-flip", "-0.1", "from 0 to 1"),
        ("compare a b", "--max-flip", "2", "from 0 to 1"),
        ("regress a", "--jobs", "-1", "a whole number from 1 to 256"),
        (
            "regress a --bless",
            "--power",
            "-1%",
            "more than 0 and at most 1",
        ),
        ("regress a --bless", "--power", "0", "expected a change"),
        (
            "bench box.toml",
            "--seeds",
            "-1",
            "a whole number from 1 to 1024",
        ),
        (
            "bench --scaling",
            "--up-to",
            "-1",
            "a whole number from 1 to 5000000",
        ),
        (
            "bench box.toml",
            "--max-spp",
            "-1",
            "a whole number from 1 to",
        ),
    ] {
        let text = format!("error: invalid value '{value}' for '{flag} <");
        bench
            .run(&format!("{command} {flag} {value}"))
            .code(2)
            .stdout("")
            .stderr(says(&text).and(says(rule)).and(says("tip:").not()));
    }
    for (flags, said) in [
        ("-o a.exr --exposure 1", "--exposure is about PNG pictures"),
        ("-o a.png --exr rgb", "--exr is about EXR pictures"),
    ] {
        let said = format!("error: {said}, and none is written: name ");
        let render = format!("render box.toml --backend cpu --spp 1 {flags}");
        bench.run(&render).code(2).stderr(says(&said));
    }
    bench.render("--spp 1 -o a.exr --watch w.png --exposure 1");
    // Negative values are accepted where they are valid.
    bench.render("--spp 1 --exposure -2 -o a.png");
}

#[test]
fn status_4_for_inaccessible_files() {
    let bench = Bench::new();
    fs::create_dir(bench.path("folder")).unwrap();
    for (args, name) in [
        ("render none.toml", "none.toml"),
        ("render folder", "folder"),
        ("check none.toml", "none.toml"),
        ("develop none.npz -o a.png", "none.npz"),
        ("merge out.npz none.npz", "none.npz"),
        (
            "render box.toml --backend cpu --spp 1 -o none/a.exr",
            "none/a.exr",
        ),
        (
            "render box.toml --backend cpu --spp 1 --report none/r.json",
            "none/r.json",
        ),
        (
            "render box.toml --backend cpu --spp 1 --film none/f.npz",
            "none/f.npz",
        ),
        (
            "render box.toml --backend cpu --spp 1 --film folder",
            "folder",
        ),
        (
            "render box.toml --backend cpu --spp 1 --dump-wgsl folder",
            "folder",
        ),
        (
            "compare folder box.exr",
            "folder: cannot read: is a directory",
        ),
        (
            "compare none.exr box.exr",
            "none.exr: cannot read: no such file",
        ),
    ] {
        bench
            .run(args)
            .code(4)
            .stderr(says("error: ").and(says(name)));
    }
    assert_eq!(bench.names(), ["box.toml", "folder"]);
}

/// The scene is all right, but for files that it names.
#[test]
fn status_4_for_inaccessible_csv_files() {
    let bench = Bench::new();
    fs::create_dir(bench.path("folder")).unwrap();
    let with = |file: &str| {
        let text = format!("{SCENE}\n[[spheres]]\nfile = \"{file}\"\nmaterial = \"white\"\n");
        fs::write(bench.path("rows.toml"), text).unwrap();
    };
    let line = SCENE.lines().count() + 3;
    for (file, why) in [
        ("none.csv", "no such file or directory"),
        ("folder", "is a directory"),
    ] {
        with(file);
        for command in ["check", "render --backend cpu"] {
            bench
                .run(&format!("{command} rows.toml"))
                .code(4)
                .stderr(format!(
                    "error: rows.toml:{line}:8: cannot read {file}: {why}\n"
                ));
        }
    }
    // With anything else wrong it is the content.
    fs::write(bench.path("bad.csv"), "x,y,z\n").unwrap();
    with("bad.csv");
    // Every file has a line of its own.
    bench
        .run("check box.toml rows.toml")
        .code(2)
        .stdout(says("box.toml: 1 warning; ").and(says("\nrows.toml: 1 error\n")))
        .stderr(says("error: bad.csv:1: no column "));
}

/// Sends `signal` to a render that would take for ever, once its film is there; its exit status.
#[cfg(unix)]
pub fn interrupted(bench: &Bench, signal: &str) -> Option<i32> {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(bench.dir.path())
        .args(
            "render box.toml --backend cpu --spp 4000000 --film f.npz --checkpoint 100ms"
                .split(' '),
        )
        .args(["-o", "a.exr", "--report", "r.json", "--quiet"])
        .stdin(Stdio::null())
        .spawn()
        .expect("the program starts");
    let begun = Instant::now();
    while !bench.path("f.npz").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no checkpoint");
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status()
        .expect("kill");
    assert!(killed.success());
    child.wait().expect("its end").code()
}

#[cfg(unix)]
#[test]
fn status_130_143_and_129_after_saving_the_results_so_far() {
    let mut signals = vec![("-INT", 130), ("-TERM", 143)];
    // SIGHUP is handled unless the process ignores it, as under nohup. Then the child ignores it too.
    let ignored = fs::read_to_string("/proc/self/status").ok().and_then(|s| {
        let mask = s.lines().find_map(|l| l.strip_prefix("SigIgn:"))?.trim();
        Some(u64::from_str_radix(mask, 16).ok()? & 1 == 1)
    });
    signals.extend((ignored == Some(false)).then_some(("-HUP", 129)));
    for (signal, status) in signals {
        let bench = Bench::new();
        assert_eq!(interrupted(&bench, signal), Some(status));
        let held = bench.film("f.npz").coverage.samples();
        assert!(held.0 > 0);
        let samples = bench.picture("a.exr").samples.expect("a samples layer");
        assert_eq!(u64::from(samples[0]), held.1);
        let report = fs::read_to_string(bench.path("r.json")).unwrap();
        assert!(
            report.contains("\"stop_reason\": \"interrupted\""),
            "{report}"
        );
        assert_eq!(bench.names(), ["a.exr", "box.toml", "f.npz", "r.json"]);
    }
}
