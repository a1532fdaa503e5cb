//! When a run ends.

use crate::program::{Bench, says};

#[test]
fn rays_count_per_stratum() {
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

/// An error that no run reaches leaves the other conditions as they are.
#[test]
fn time_ends_a_run_for_every_error() {
    let bench = Bench::new();
    for error in ["1e-8", "1e-20", "1e-100", "1e-320"] {
        bench
            .run(&format!(
                "render box.toml --backend cpu --error {error} --time 300ms -o a.exr --report -"
            ))
            .success()
            .stdout(says("\"stop_reason\": \"time\""));
    }
}

/// What `nohup` starts outlives its terminal.
#[cfg(target_os = "linux")]
#[test]
fn hanging_up_stays_ignored() {
    use std::process::Command;
    use std::thread::sleep;
    use std::time::{Duration, Instant};
    let bench = Bench::new();
    let mut child = Command::new("sh")
        .args([
            "-c",
            "trap '' HUP; exec \"$0\" \"$@\"",
            env!("CARGO_BIN_EXE_etendue"),
        ])
        .args("render box.toml --backend cpu --quiet --spp 4000000 --checkpoint 100ms".split(' '))
        .args(["--film", "f.npz", "-o", "a.png"])
        .current_dir(bench.dir.path())
        .spawn()
        .expect("it starts");
    let begun = Instant::now();
    while !bench.path("f.npz").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no checkpoint");
        sleep(Duration::from_millis(20));
    }
    let send = |signal: &str| {
        let sent = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status();
        assert!(sent.expect("kill").success());
    };
    send("-HUP");
    sleep(Duration::from_millis(500));
    // It takes the next signal for the first.
    send("-TERM");
    assert_eq!(child.wait().expect("its end").code(), Some(143));
    assert!(bench.path("a.png").exists(), "nothing was saved");
}

/// The first signal's work can last: here on a report to a pipe that is full and that nobody reads. A second signal ends it.
#[cfg(unix)]
#[test]
fn a_second_signal_ends_the_process_at_once() {
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};
    let bench = Bench::new();
    let sh = |script: &str| {
        let done = Command::new("sh")
            .args(["-c", script])
            .current_dir(bench.dir.path())
            .status();
        assert!(done.expect("a shell").success(), "{script}");
    };
    for [first, second] in [["INT", "TERM"], ["TERM", "INT"]] {
        sh("rm -f a.png f.npz");
        // The shell fills the pipe with the 64 KiB that it holds, and becomes the program.
        let script = format!(
            "head -c 65536 /dev/zero; exec {} render box.toml --backend cpu --quiet --spp 4000000 -o a.png --film f.npz --report -",
            env!("CARGO_BIN_EXE_etendue")
        );
        let mut child = Command::new("sh")
            .current_dir(bench.dir.path())
            .args(["-c", &script])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let pid = child.id();
        let begun = Instant::now();
        // It locks the film after it has installed its handlers of signals.
        while !bench.path(".f.npz.lock").exists() {
            assert!(begun.elapsed() < Duration::from_secs(60), "not begun");
            sleep(Duration::from_millis(20));
        }
        sleep(Duration::from_millis(500));
        sh(&format!("kill -{first} {pid}"));
        while !bench.path("a.png").exists() {
            assert!(begun.elapsed() < Duration::from_secs(60), "nothing saved");
            sleep(Duration::from_millis(20));
        }
        sleep(Duration::from_millis(500));
        assert_eq!(child.try_wait().expect("its state"), None, "it has ended");
        sh(&format!("kill -{second} {pid}"));
        let status = loop {
            if let Some(status) = child.try_wait().expect("its state") {
                break status;
            }
            if begun.elapsed() > Duration::from_secs(60) {
                child.kill().expect("it can be killed");
                panic!("the second signal did not end it");
            }
            sleep(Duration::from_millis(20));
        };
        let expected = if second == "INT" { 130 } else { 143 };
        assert_eq!(status.code(), Some(expected), "{first}, then {second}");
    }
}

/// 256 samples of a picture of ordinary size take minutes on the CPU reference.
#[test]
fn the_cpu_reference_ends_after_half_a_minute_unless_told_otherwise() {
    let bench = Bench::new();
    bench
        .run("render box.toml --backend cpu --size 1024x768 -o a.png --report r.json")
        .success()
        .stderr(says("until 256 spp or 30 s"))
        .stderr(says(
            "note: without a stop condition the CPU reference ends after 30 s",
        ));
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert_eq!(report["stop_reason"], "time");
    let seconds = report["seconds"]["render"].as_f64().unwrap();
    assert!((29.0..60.0).contains(&seconds), "{seconds}");
}
