//! Two processes and one film.

use crate::program::{Bench, says};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn a_second_process_is_refused_but_not_after_a_kill() {
    let bench = Bench::new();
    let args = "render box.toml --backend cpu --quiet -o a.png --checkpoint 100ms --film";
    let mut first = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(bench.dir.path())
        .args(args.split_whitespace())
        .args(["f.npz", "--spp", "4000000"])
        .stdin(Stdio::null())
        .spawn()
        .expect("it starts");
    let begun = Instant::now();
    while !bench.path("f.npz").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no save");
        sleep(Duration::from_millis(20));
    }
    bench
        .run(&format!("{args} f.npz --spp 4000000"))
        .code(4)
        .stderr(says(
            "error: f.npz: another process is rendering into this film",
        ));
    // Reading it is no harm, and other films are other films.
    bench.run("develop f.npz -o b.png").success();
    bench.run(&format!("{args} g.npz --spp 4")).success();
    assert_eq!(first.try_wait().expect("its state"), None);
    first.kill().expect("it can be killed");
    first.wait().expect("its end");
    assert!(bench.path(".f.npz.lock").exists());
    let held = bench.film("f.npz").coverage.samples().0;
    let spp = held + 1;
    bench.run(&format!("{args} f.npz --spp {spp}")).success();
    assert_eq!(
        bench.names(),
        ["a.png", "b.png", "box.toml", "f.npz", "g.npz"]
    );
}
