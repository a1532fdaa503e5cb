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

#[test]
fn progress_for_programs_is_json() {
    let bench = Bench::new();
    let output = bench
        .run("render box.toml --backend cpu --time 1s --progress json -o a.png")
        .success();
    let said = String::from_utf8(output.get_output().stderr.clone()).expect("text");
    let lines: Vec<serde_json::Value> = said
        .lines()
        .filter(|l| l.starts_with('{'))
        .map(|l| serde_json::from_str(l).expect("JSON"))
        .collect();
    assert!((2..=4).contains(&lines.len()), "{said}");
    let fractions: Vec<f64> = lines
        .iter()
        .filter_map(|l| l["fraction"].as_f64())
        .collect();
    assert!(fractions.len() > 1 && fractions.is_sorted(), "{said}");
    assert!(fractions.iter().all(|f| (0.0..1.0).contains(f)), "{said}");
    assert!(
        lines.iter().all(|l| l["samples"].as_f64() > Some(0.0)),
        "{said}"
    );
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
