//! When a run ends.

use crate::program::{Bench, says};

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
