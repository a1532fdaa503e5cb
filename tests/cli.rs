//! The program from outside: exit statuses, what is written where, and the promises about bits.
//!
//! Everything runs on the CPU reference, so that these tests need no adapter.

mod program;

use etendue::output::Picture;
use predicates::prelude::*;
use program::{Bench, SCENE, says};
use std::fs;
use std::time::{Duration, Instant};

// Exit statuses.

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
fn interrupted(bench: &Bench, signal: &str) -> Option<i32> {
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

// What is said.

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

#[test]
fn the_report_on_stdout_has_every_key() {
    let bench = Bench::new();
    let done = bench
        .run("render box.toml --backend cpu --spp 16 --seed 7 --region 1,2,5,6 -o a.png --report - --quiet")
        .success()
        .stderr("");
    let report: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    for key in "version scene scene_hash adapter resolution regions seed spp stop_reason seconds paths rays \
                paths_per_second rays_per_second relative_error heavy_tail mean_luminance truncated_paths nonfinite_samples"
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
fn a_reader_that_has_gone_is_no_failure() {
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

#[test]
fn lines_of_progress_never_say_all_is_done() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --spp 64 --progress plain -o a.png")
        .success()
        .stderr(says("100 %").not());
}

#[test]
fn a_picture_to_follow_is_left_as_the_last_one() {
    let bench = Bench::new();
    bench.render("--spp 4 -o a.png --watch w.png");
    let (a, w) = (fs::read(bench.path("a.png")), fs::read(bench.path("w.png")));
    assert_eq!(a.unwrap(), w.unwrap());
}

// When it stops.

#[test]
fn rays_are_for_every_stratum() {
    let bench = Bench::new();
    bench.render("--rays 2 --strata 3 -o a.exr");
    assert_eq!(bench.picture("a.exr").samples.unwrap()[0], 18);
}

#[test]
fn time_and_error_end_a_run() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --error 30% -o a.exr --report -")
        .success()
        .stdout(says("\"stop_reason\": \"error\""));
    bench
        .run("render box.toml --backend cpu --time 300ms -o a.exr --report -")
        .success()
        .stdout(says("\"stop_reason\": \"time\""));
    // The first one met ends it.
    bench
        .run("render box.toml --backend cpu --spp 2 --time 1h --error 0.0001% -o a.exr --report -")
        .success()
        .stdout(says("\"stop_reason\": \"spp\""));
}

// Bits.

/// The largest difference of any channel, as part of the larger value or of 1e-3, whichever is more.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let channels = a.iter().flatten().zip(b.iter().flatten());
    let relative = channels.map(|(a, b)| {
        let (a, b) = (f64::from(*a), f64::from(*b));
        (a - b).abs() / a.abs().max(b.abs()).max(1e-3)
    });
    relative.fold(0.0, f64::max)
}

#[test]
fn parts_of_the_light_add_up_to_the_whole() {
    let bench = Bench::new();
    let part = |light: &str| {
        bench.render(&format!("--spp 64 --light {light} -o {light}.exr"));
        bench.picture(&format!("{light}.exr")).rgb
    };
    let parts = [part("emitted"), part("direct"), part("indirect")];
    for p in &parts {
        assert!(p.iter().flatten().any(|&v| v > 0.0), "a part is black");
    }
    let sum: Vec<[f32; 3]> = (0..parts[0].len())
        .map(|i| [0, 1, 2].map(|c| parts[0][i][c] + parts[1][i][c] + parts[2][i][c]))
        .collect();
    bench.render("--spp 64 -o whole.exr");
    let off = difference(&sum, &bench.picture("whole.exr").rgb);
    assert!(off < 1e-5, "off by {off}");
    bench.render("--spp 64 --light direct,indirect -o two.exr");
    assert_ne!(bench.picture("two.exr").rgb, bench.picture("whole.exr").rgb);
}

#[test]
fn regions_have_the_bits_of_the_whole() {
    let bench = Bench::new();
    bench.render("--spp 20 -o whole.exr");
    bench.render("--spp 20 --region 3,2,9,9 --region 5,5,20,16 -o part.exr -o part.png");
    let (whole, part) = (bench.picture("whole.exr"), bench.picture("part.exr"));
    assert_eq!(part.size, [24, 16]);
    let mut inside = 0;
    for i in 0..whole.rgb.len() {
        let (x, y) = (i % 24, i / 24);
        let there = (3..9).contains(&x) && (2..9).contains(&y) || (5..20).contains(&x) && y >= 5;
        assert_eq!(
            part.alpha[i],
            f32::from(u8::from(there)),
            "alpha at {x}, {y}"
        );
        if there {
            inside += 1;
            let bits = |p: &Picture| p.rgb[i].map(f32::to_bits);
            assert_eq!(bits(&part), bits(&whole), "pixel {x}, {y}");
        }
    }
    assert_eq!(inside, 6 * 7 + 15 * 11 - 4 * 4);
}

#[test]
fn a_film_gone_on_with_has_the_bits_of_one_run() {
    let bench = Bench::new();
    bench.render("--spp 50 --film cut.npz -o a.png --seed 3");
    // The seed comes from the film.
    bench.render("--spp 51 --film cut.npz -o a.png");
    bench.render("--spp 300 --film cut.npz -o cut.exr");
    bench.render("--spp 300 --film one.npz -o one.exr --seed 3");
    let (cut, one) = (bench.film("cut.npz"), bench.film("one.npz"));
    assert_eq!(cut.coverage.samples(), (300, 300));
    for y in 0..16 {
        for x in 0..24 {
            assert_eq!(cut.total(x, y), one.total(x, y), "pixel {x}, {y}");
        }
    }
    assert_eq!(bench.picture("cut.exr").rgb, bench.picture("one.exr").rgb);
}

#[cfg(unix)]
#[test]
fn an_interrupted_film_goes_on_with_the_same_bits() {
    let bench = Bench::new();
    interrupted(&bench, "-INT");
    let held = bench.film("f.npz").coverage.samples().1;
    let spp = held + 10;
    bench.render(&format!("--spp {spp} --film f.npz -o a.exr"));
    bench.render(&format!("--spp {spp} -o b.exr"));
    assert_eq!(bench.picture("a.exr").rgb, bench.picture("b.exr").rgb);
}

#[test]
fn slices_merge_to_the_single_run_in_any_order() {
    let bench = Bench::new();
    bench.render("--spp 600 --film one.npz -o one.exr");
    for (name, range) in [("a", "0..256"), ("b", "256..512"), ("c", "512..600")] {
        bench.render(&format!(
            "--samples {range} --film {name}.npz -o {name}.exr"
        ));
    }
    bench.run("merge whole.npz c.npz a.npz b.npz").success();
    bench.run("develop whole.npz -o whole.exr").success();
    let (whole, one) = (bench.film("whole.npz"), bench.film("one.npz"));
    assert_eq!(whole.coverage, one.coverage);
    for y in 0..16 {
        for x in 0..24 {
            let (a, b) = (whole.total(x, y), one.total(x, y));
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                // The order of f64 additions differs.
                assert!((a - b).abs() <= 1e-12 * b.abs(), "pixel {x}, {y}: {a} {b}");
            }
        }
    }
    let off = difference(
        &bench.picture("whole.exr").rgb,
        &bench.picture("one.exr").rgb,
    );
    assert!(off < 1e-6, "off by {off}");
}

#[test]
fn merge_names_what_does_not_fit() {
    let bench = Bench::new();
    bench.render("--samples 0..8 --film a.npz -o a.png");
    bench.render("--samples 4..12 --film b.npz -o a.png");
    bench.render("--samples 20..24 --film c.npz -o a.png");
    bench.render("--samples 8..12 --film d.npz -o a.png --seed 1");
    bench
        .run("merge out.npz a.npz b.npz")
        .code(2)
        .stderr(says("b.npz"));
    bench
        .run("merge out.npz a.npz d.npz")
        .code(2)
        .stderr(says("seed"));
    assert!(!bench.path("out.npz").exists());
    bench
        .run("merge out.npz a.npz c.npz")
        .success()
        .stderr(says("warning: ").and(says("8..20")));
    bench
        .run("merge out.npz a.npz c.npz")
        .code(4)
        .stderr(says("never replaced"));
}

#[test]
fn a_film_of_something_else_is_refused_and_untouched() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let before = fs::read(bench.path("f.npz")).unwrap();
    for (flags, what) in [
        ("--size 12x8", "size"),
        ("--seed 9", "seed"),
        ("--strata 3", "strata"),
        ("--max-depth 3", "max_depth"),
        ("--light direct", "light"),
        ("--integrator whitted", "integrator"),
        ("--shadow-rays 2", "shadow_rays"),
    ] {
        bench
            .run(&format!(
                "render box.toml --backend cpu --spp 8 --film f.npz {flags}"
            ))
            .code(2)
            .stderr(says("f.npz").and(says(what)));
    }
    fs::write(bench.path("other.toml"), SCENE.replace("0.45", "0.46")).unwrap();
    bench
        .run("render other.toml --backend cpu --spp 8 --film f.npz")
        .code(2)
        .stderr(says("scene"));
    assert_eq!(fs::read(bench.path("f.npz")).unwrap(), before);

    // Comments and layout are not the scene.
    fs::write(bench.path("same.toml"), format!("# a comment\n{SCENE}")).unwrap();
    bench
        .run("render same.toml --backend cpu --spp 8 --film f.npz -o a.png")
        .success();
}

#[test]
fn a_film_of_a_part_takes_no_other_part() {
    let bench = Bench::new();
    bench.render("--spp 4 --region 0,0,8,8 --film f.npz -o a.png");
    bench
        .run("render box.toml --backend cpu --spp 8 --film f.npz")
        .code(2)
        .stderr(says("0,0,8,8"));
}

#[test]
fn a_damaged_film_is_refused() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let bytes = fs::read(bench.path("f.npz")).unwrap();
    fs::write(bench.path("f.npz"), &bytes[..bytes.len() / 2]).unwrap();
    for args in [
        "render box.toml --backend cpu --spp 8 --film f.npz",
        "develop f.npz -o b.png",
        "merge out.npz f.npz",
    ] {
        bench.run(args).code(2).stderr(says("f.npz"));
    }
    assert!(!bench.path("b.png").exists() && !bench.path("out.npz").exists());
}

#[test]
fn nothing_is_written_beside_what_was_asked_for() {
    let bench = Bench::new();
    bench.render("--spp 1 -o only.png");
    assert_eq!(bench.names(), ["box.toml", "only.png"]);
}

// Self-test.

#[test]
fn selftest_prints_what_it_measured_and_its_verdict() {
    let bench = Bench::new();
    bench
        .run("selftest --backend cpu --filter incidence --quiet")
        .success()
        .stdout(says("CPU reference"))
        .stdout(says("14  normal_incidence"))
        .stdout(says("15  grazing_incidence"))
        .stdout(says("passed"))
        .stdout(says("2 cases, 3 quantities: all passed"))
        .stderr("");
    bench
        .run("selftest --backend cpu --filter normal_inc --markdown --progress none")
        .success()
        .stdout(says(
            "| row | case | quantity | measured | expected | tolerance | verdict |",
        ))
        .stdout(says(
            "| 14 | normal_incidence: Fresnel at normal incidence | F from outside |",
        ));
}

#[test]
fn selftest_refuses_what_it_cannot_do() {
    let bench = Bench::new();
    bench
        .run("selftest --backend cpu --filter nonsense")
        .code(2)
        .stderr(says("no case contains \"nonsense\"").and(says("08_glass_sphere_in_dome")));
    bench
        .run("selftest --backend cpu --adapter any")
        .code(2)
        .stderr(says("--adapter"));
    bench
        .run("selftest --adapter no-such-adapter")
        .code(3)
        .stdout("");
}
