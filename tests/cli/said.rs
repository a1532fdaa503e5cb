//! Messages and help, on stdout and stderr.

use crate::program::{Bench, SCENE, says};
use predicates::prelude::*;
use std::fs;

#[test]
fn help_and_version_are_data() {
    let bench = Bench::new();
    bench
        .run("--version")
        .success()
        .stdout(says("etendue "))
        .stderr("");
    bench
        .run("--help")
        .success()
        .stdout(says("Examples:"))
        .stderr("");
    bench
        .run("render --help")
        .success()
        .stdout(says("Examples:").and(says("multiples of 256")))
        .stderr("");
}

/// Text that is wrapped by hand is wrapped again where the terminal is narrower, into long and short lines by turns.
#[test]
fn every_command_has_examples_and_even_lines() {
    let bench = Bench::new();
    for command in
        "render check develop merge selftest compare regress make-scene bench adapters schema completions man"
            .split(' ')
    {
        let done = bench.run(&format!("{command} --help")).success();
        let help = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
        assert!(help.contains("Example"), "{command}: {help}");
        let prose: Vec<&str> = help
            .lines()
            .filter(|l| l.starts_with(char::is_alphanumeric))
            .collect();
        for pair in prose.windows(2) {
            // A wrapped line must be full.
            let [line, next] = [pair[0], pair[1]];
            let word = next.split(' ').next().unwrap_or_default();
            let goes_on =
                next.starts_with(char::is_lowercase) && help.contains(&format!("{line}\n{next}"));
            assert!(
                !goes_on || line.chars().count() + 1 + word.chars().count() > 90,
                "{command}: {line}"
            );
        }
    }
    for command in [
        "render", "selftest", "bench", "regress", "compare", "merge", "develop",
    ] {
        bench.run(&format!("{command} --help")).success().stdout(
            says("--quiet")
                .and(says("--progress"))
                .and(says("--threads")),
        );
    }
}

#[test]
fn the_first_line_of_a_render_is_short() {
    let bench = Bench::new();
    let first = |flags: &str| {
        let done = bench.run(&format!(
            "render box.toml --backend cpu --threads 2 -o a.png {flags}"
        ));
        let said = String::from_utf8_lossy(&done.success().get_output().stderr).into_owned();
        let line = said.lines().find(|l| !l.starts_with("note: "));
        line.unwrap_or_default().to_owned()
    };
    let cpu = "on CPU reference (2 threads)";
    for (flags, line) in [
        ("--spp 4", format!("box: 24x16, 4 spp, {cpu}")),
        (
            "--error 50% --time 10m --size 12x8",
            format!("box: 12x8, until error 50 % or 10 min, {cpu}"),
        ),
        (
            "--spp 8 --region 0,0,4,4 --adaptive",
            format!("box: 24x16 (16 pixels), 8 spp, adaptive, {cpu}"),
        ),
        (
            "--samples 0..4 --film f.npz",
            format!("box: 24x16, samples 0..4, {cpu}"),
        ),
        (
            "--spp 9 --film f.npz",
            format!("box: 24x16, 9 spp, {cpu}; f.npz holds 4 spp"),
        ),
    ] {
        assert_eq!(first(flags), line);
    }
}

#[test]
fn quiet_is_quiet_everywhere() {
    let bench = Bench::new();
    bench.render("--spp 64 --film f.npz -o a.exr");
    fs::create_dir(bench.path("scenes")).unwrap();
    fs::copy(bench.path("box.toml"), bench.path("scenes/box.toml")).unwrap();
    fs::write(bench.path("scenes/OTHER.TOML"), SCENE).unwrap();
    for command in [
        "render box.toml --backend cpu --spp 2 -o b.exr",
        "render box.toml --spp 2 --size 4x4 -o b.exr",
        "render box.toml --backend cpu --spp 64 --film f.npz -o b.exr",
        "develop f.npz -o b.png",
        "merge g.npz f.npz",
        "compare a.exr a.exr --html c.html",
        "make-scene spheres --count 3",
        "selftest --backend cpu --filter incidence",
        "regress scenes --bless --backend cpu --power 100%",
        "regress scenes --backend cpu --junit -",
        "bench box.toml --engine cpu --seeds 1 --max-spp 2 --reference-spp 16 --size 4x4 --cache c --json -",
        "bench --report-table --engine cpu --size 4x3 --time 1ms",
    ] {
        for flag in ["-q", "--quiet"] {
            let done = bench.run(&format!("{command} {flag}"));
            let output = done.success().get_output().clone();
            let said = String::from_utf8_lossy(&output.stderr);
            let is_warning = |line: &str| line.starts_with("warning: ");
            assert!(said.lines().all(is_warning), "{command}: {said}");
            let _ = fs::remove_file(bench.path("g.npz"));
        }
    }
}

#[test]
fn a_scene_in_place_of_a_command_suggests_render() {
    let bench = Bench::new();
    for scene in ["box.toml", "none.TOML"] {
        bench
            .run(&format!("{scene} --spp 4"))
            .code(2)
            .stdout("")
            .stderr(says(&format!("to render a scene: etendue render {scene}")))
            .stderr(says("similar").not());
    }
    bench
        .run("rendr")
        .code(2)
        .stderr(says("'render'").and(says("a scene:").not()));
}

#[test]
fn help_says_that_the_first_stop_condition_ends_a_run() {
    let bench = Bench::new();
    bench
        .run("render --help")
        .success()
        .stdout(says("When to stop (the first condition met ends the run):"));
}

#[test]
fn the_report_on_stdout_has_every_key() {
    let bench = Bench::new();
    let done = bench
        .run("render box.toml --backend cpu --spp 16 --seed 7 --region 1,2,5,6 -o a.png --report - --quiet")
        .success()
        .stderr(says("note").not());
    let report: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    for key in "version scene scene_hash adapter resolution regions seed spp stop_reason seconds paths rays \
                paths_per_second rays_per_second relative_error relative_error_uncertainty relative_error_doubt mean_luminance truncated_paths nonfinite_samples"
        .split_whitespace()
    {
        assert!(report.get(key).is_some(), "no {key} in {report}");
    }
    assert_eq!(report["seed"], 7);
    assert_eq!(report["spp"], 16);
    assert_eq!(report["paths"], 16 * 16);
    assert_eq!(report["stop_reason"], "spp");
    assert_eq!(report["resolution"], serde_json::json!([24, 16]));
    assert_eq!(report["regions"], serde_json::json!([[1, 2, 5, 6]]));
    assert_eq!(report["nonfinite_samples"], 0);
    assert!(report["relative_error"].as_f64().unwrap() > 0.0);
    for key in ["compile", "render", "total"] {
        assert!(report["seconds"][key].is_number(), "seconds.{key}");
    }
    for key in ["name", "driver", "backend"] {
        assert!(report["adapter"][key].is_string(), "adapter.{key}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_not_an_error() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .arg("schema")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success(), "{:?}", done.status);
    assert!(done.stderr.is_empty());
}

#[test]
fn check_schema_and_adapters_print_data() {
    let bench = Bench::new();
    bench
        .run("check box.toml")
        .success()
        .stdout(says("box.toml: ").and(says("primitives 4, lights 1, materials 3")));
    let done = bench.run("schema").success().stderr("");
    let schema: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    assert!(schema["properties"]["camera"].is_object());
    bench
        .run("adapters")
        .success()
        .stdout(says("CPU reference"));
}

#[test]
fn the_kernel_can_be_seen_without_an_adapter() {
    let bench = Bench::new();
    bench.render("--spp 1 --dump-wgsl kernel.wgsl -o a.png");
    let wgsl = fs::read_to_string(bench.path("kernel.wgsl")).unwrap();
    assert!(wgsl.contains("@compute"));
}

/// The error is stated from two samples on, however few replicates there are, and alike in report and header.
#[test]
fn every_picture_of_two_samples_states_its_error() {
    let bench = Bench::new();
    for (spp, strata, known) in [
        (1, 2, false),
        (2, 2, true),
        (4, 2, true),
        (5, 2, true),
        (2, 1, true),
    ] {
        bench.render(&format!(
            "--spp {spp} --strata {strata} -o a.exr --report r.json"
        ));
        let report = fs::read_to_string(bench.path("r.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let header = bench.picture("a.exr").attributes;
        let error = header
            .get("relative_error")
            .map(|e| e.parse::<f32>().unwrap());
        // Pictures have floats.
        let in_report = report["relative_error"].as_f64().map(|e| e as f32);
        assert_eq!(in_report, error);
        assert_eq!(error.is_some_and(|e| e > 0.0), known, "{spp} samples");
    }
}

/// Of pixels with different samples, header and report say the mean.
#[test]
fn samples_are_means() {
    let bench = Bench::new();
    bench.render("--spp 3 --region 0,0,24,4 --film f.npz -o a.png");
    bench.render("--spp 5 --region 0,0,12,4 --film f.npz -o a.exr --report r.json");
    let report = fs::read_to_string(bench.path("r.json")).unwrap();
    assert!(report.contains("\"spp\": 4,"), "{report}");
    assert_eq!(bench.picture("a.exr").attributes["samples"], "4");
}

#[test]
fn progress_lines_never_say_100_percent() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 64 --progress plain -o a.png")
        .success()
        .stderr(says("100 %").not());
}

#[test]
fn the_watch_picture_is_the_final_one_at_the_end() {
    let bench = Bench::new();
    bench.render("--spp 4 -o a.png --watch w.png");
    let (a, w) = (fs::read(bench.path("a.png")), fs::read(bench.path("w.png")));
    assert_eq!(a.unwrap(), w.unwrap());
}

/// On a terminal, long stages are shown until they end. They are not shown elsewhere, or without a progress bar.
#[cfg(target_os = "linux")]
#[test]
fn long_stages_are_shown_only_on_a_terminal() {
    let bench = Bench::new();
    // A scene that is slow to read on every machine.
    let script = r#"
        export TERM=xterm
        render() {
            mkfifo "$1.toml" && { sleep 1; cat box.toml; } > "$1.toml" &
            while [ ! -p "$1.toml" ]; do sleep 0.01; done
            command="'$0' render $1.toml --backend cpu --spp 1 -o $1.png $3"
            if [ "$2" = terminal ]; then script -qec "$command" "$1" > /dev/null; else sh -c "$command" 2> "$1"; fi
        }
        render bar terminal &&
            render quiet terminal --quiet &&
            render none terminal "--progress none" &&
            render plain terminal "--progress plain" &&
            render file file
    "#;
    assert_eq!(bench.shell(&[], script), 0, "{}", bench.said());
    let said = |name| String::from_utf8_lossy(&fs::read(bench.path(name)).unwrap()).into_owned();
    let bar = said("bar");
    let (stage, after) = bar.rsplit_once("reading bar.toml, ").expect(&bar);
    assert!(stage.contains("reading bar.toml, 0."), "{bar:?}");
    // Cleared before anything else is printed.
    let (rest, said_next) = after.split_once("bar: 24x16").expect(&bar);
    assert!(
        rest.contains("\x1b[2K") && said_next.contains("wrote"),
        "{bar:?}"
    );
    for name in ["quiet", "none", "plain", "file"] {
        assert!(!said(name).contains("reading"), "{:?}", said(name));
    }
}

/// A resumed film's report tells the work of this run from that of all.
#[test]
fn a_report_tells_this_run_from_the_film() {
    let bench = Bench::new();
    bench.render("--spp 8 --film f.npz -o a.png");
    bench.render("--spp 32 --film f.npz -o a.png --report r.json");
    let report = fs::read_to_string(bench.path("r.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(
        (&report["spp"], &report["paths"]),
        (&32.into(), &(24 * 24 * 16).into())
    );
    let work = |key: &str| {
        (
            report[key]["spp"].as_u64().unwrap(),
            report[key]["paths"].as_u64().unwrap(),
        )
    };
    assert_eq!(work("run"), (24, 24 * 24 * 16));
    assert_eq!(work("film"), (32, 32 * 24 * 16));
    let seconds = |key: &str| report[key]["seconds"].as_f64().unwrap();
    assert!(seconds("film") > seconds("run") && seconds("run") > 0.0);
}

/// As many threads as the process may use, not as many as the machine has.
#[cfg(target_os = "linux")]
#[test]
fn affinity_sets_the_number_of_threads() {
    let bench = Bench::new();
    let pinned = "taskset -c 0 \"$0\" render box.toml --backend cpu --spp 1 -o a.png";
    assert_eq!(bench.shell(&[], pinned), 0, "{}", bench.said());
    assert!(
        bench.said().contains("CPU reference (1 thread)"),
        "{}",
        bench.said()
    );
}
