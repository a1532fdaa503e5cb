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
        .stderr(says("24x16").and(says("until 1 sample a pixel")))
        .stderr(says("wrote box.exr, box.png"));
    assert_eq!(bench.names(), ["box.exr", "box.png", "box.toml"]);
}

#[test]
fn status_2_for_a_bad_command_line() {
    let bench = Bench::new();
    for (flags, rule) in [
        ("--spp 0", "whole number, 1 to"),
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
        ("--region 1,1,1,2", "half-open"),
        ("--region 0,0,25,16", "24x16"),
        ("--light direct,dim", "\"dim\""),
        ("--max-depth 0", "0 is not in"),
        ("--strata 0", "0 is not in"),
        ("--shadow-rays 0", "0 is not in"),
        ("--seed -1", "-1"),
        ("--integrator radiosity", "whitted"),
        ("--adapter x", "--backend cpu"),
        ("--checkpoint 5s", "--film"),
        ("--exposure x", "stops"),
        ("--output a.tiff", ".exr and .png"),
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
fn status_3_for_a_picture_larger_than_memory() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --size 65536x65536 --spp 1")
        .code(3)
        .stderr(says("4295.0 million pixels").and(says("GB")));
}

#[test]
fn status_4_for_files_that_cannot_be_had() {
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
    ] {
        bench
            .run(args)
            .code(4)
            .stderr(says("error: ").and(says(name)));
    }
    assert_eq!(bench.names(), ["box.toml", "folder"]);
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
fn status_130_and_143_after_saving_what_there_is() {
    for (signal, status) in [("-INT", 130), ("-TERM", 143)] {
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
