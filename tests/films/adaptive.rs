//! `--adaptive` on the command line: films are resumed bit for bit, merged, and refused if they don't fit.

use crate::program::{Bench, says};

const RENDER: &str = "render box.toml --backend cpu --size 64x48 --adaptive -o a.exr";

#[test]
fn adaptive_films_are_resumed_bit_for_bit_and_their_counts_differ() {
    let bench = Bench::new();
    bench
        .run(&format!(
            "{RENDER} --spp 90 --film once.npz --report r.json"
        ))
        .success()
        .stderr(says("90.0 samples per pixel on average"));
    let report = std::fs::read_to_string(bench.path("r.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let spp = report["spp"].as_f64().expect("a number");
    assert!((spp - 90.0).abs() < 0.5, "{spp}");
    // The header says the same.
    let header = bench.picture("a.exr").attributes["samples"].parse();
    assert_eq!(header, Ok(spp));
    assert_eq!(spp, bench.film("once.npz").coverage.mean());
    for spp in [20, 45, 64, 71, 90] {
        bench
            .run(&format!("{RENDER} --spp {spp} --film f.npz"))
            .success();
    }
    let (once, film) = (bench.film("once.npz"), bench.film("f.npz"));
    assert!(once.sums() == film.sums(), "other bits");
    assert_eq!(once.pilot, film.pilot);
    assert!((film.coverage.mean() - 90.0).abs() < 0.5);
    let (least, most) = film.coverage.samples();
    assert!(least >= 32 && most > least + 16, "{least} to {most}");
    let samples = bench.picture("a.exr").samples.expect("a layer");
    let (fewest, most_there) = (samples.iter().min(), samples.iter().max());
    assert_eq!(
        (fewest, most_there),
        (Some(&(least as u32)), Some(&(most as u32)))
    );
    // More is there already: nothing to do.
    bench
        .run(&format!("{RENDER} --spp 50 --film f.npz"))
        .success();
    assert!(bench.film("f.npz") == film);
}

#[test]
fn conflicting_arguments_are_refused() {
    let bench = Bench::new();
    let plain = RENDER.replace(" --adaptive", "");
    bench
        .run(&format!("{RENDER} --spp 40 --film f.npz"))
        .success();
    bench
        .run(&format!("{plain} --spp 40 --film g.npz"))
        .success();
    for (command, text) in [
        (
            format!("{plain} --samples 0..9 --film f.npz"),
            "--samples can't be used with an adaptive film",
        ),
        (
            format!("{RENDER} --spp 80 --film g.npz"),
            "this film is not adaptive: resume it without --adaptive",
        ),
        (
            format!("{RENDER} --spp 80 --film f.npz --region 0,0,9,9"),
            "adaptive film has other regions",
        ),
        (format!("{RENDER} --samples 0..9"), "cannot be used with"),
    ] {
        bench.run(&command).code(2).stderr(says(text));
    }
}

#[test]
fn merged_regions_are_resumed_without_adaptive() {
    let bench = Bench::new();
    for (name, region) in [("a", "0,0,64,24"), ("b", "0,24,64,48")] {
        bench
            .run(&format!(
                "{RENDER} --spp 64 --region {region} --film {name}.npz"
            ))
            .success();
    }
    let merged = bench.run("merge sum.npz a.npz b.npz").success();
    let said = String::from_utf8_lossy(&merged.get_output().stderr).into_owned();
    assert!(!said.contains("warning"), "{said}");
    let most = bench.film("sum.npz").coverage.samples().1;
    let plain = RENDER.replace(" --adaptive", "");
    bench
        .run(&format!("{plain} --spp {most} --film sum.npz"))
        .success();
    assert_eq!(bench.film("sum.npz").coverage.samples(), (most, most));
}

#[test]
fn time_and_error_end_it() {
    let bench = Bench::new();
    for (flags, reason) in [
        ("--error 20%", "error"),
        ("--time 2s --spp 4000000", "time"),
    ] {
        bench
            .run(&format!("{RENDER} {flags} --report -"))
            .success()
            .stdout(says(format!("\"stop_reason\": \"{reason}\"").as_str()));
    }
}
