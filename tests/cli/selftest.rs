//! The self-test as a command.

use crate::program::{Bench, says};
use predicates::prelude::*;

#[test]
fn selftest_prints_measurements_and_verdict() {
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
fn selftest_refuses_invalid_arguments() {
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
