//! The program in a folder of its own, for tests that see it from outside.

#![allow(dead_code, reason = "every test binary uses its own part of it")]

use assert_cmd::Command;
use etendue::film::Film;
use etendue::output::store;
use etendue::output::{Picture, read_exr};
use predicates::prelude::*;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

/// A box with a mirror, a glass ball and a light: every flag has something to act on.
pub const SCENE: &str = r#"
title = "Test box"

[camera]
eye        = [0.0, 1.0, 3.0]
look_at    = [0.0, 0.9, 0.0]
vfov       = 45.0
resolution = [24, 16]

[material.white]
type        = "diffuse"
reflectance = [0.7, 0.6, 0.5]

[material.steel]
type = "mirror"

[material.glass]
type = "dielectric"

[[plane]]
point    = [0.0, 0.0, 0.0]
normal   = [0.0, 1.0, 0.0]
material = "white"

[[plane]]
point    = [0.0, 0.0, -1.5]
normal   = [0.0, 0.0, 1.0]
material = "white"

[[sphere]]
center   = [-0.5, 0.5, -0.5]
radius   = 0.45
material = "steel"

[[sphere]]
center   = [0.6, 0.5, 0.0]
radius   = 0.4
material = "glass"

[[light]]
center   = [0.0, 2.2, 0.0]
normal   = [0.0, -1.0, 0.0]
radius   = 0.5
radiance = [8.0, 8.0, 8.0]
"#;

/// Runs a command in a mount namespace of its own, for file systems that vanish with it.
pub const NAMESPACE: &[&str] = &["unshare", "--map-root-user", "--mount"];

/// A folder with `box.toml` in it, which is the working directory of every command.
pub struct Bench {
    pub dir: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        fs::write(dir.path().join("box.toml"), SCENE).expect("a scene file");
        Self { dir }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// `etendue ARGS`, words separated by blanks.
    pub fn run(&self, args: &str) -> assert_cmd::assert::Assert {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        command.current_dir(self.dir.path());
        command.args(args.split_whitespace());
        // What hangs is to fail.
        command.timeout(Duration::from_secs(300));
        command.assert()
    }

    /// `etendue render box.toml --backend cpu ARGS`, which must succeed.
    pub fn render(&self, args: &str) {
        self.run(&format!("render box.toml --backend cpu {args}"))
            .success();
    }

    /// Runs `etendue ARGS`, which must succeed. Returns the most memory that it ever held, in bytes.
    #[cfg(target_os = "linux")]
    pub fn peak(&self, args: &str) -> u64 {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.dir.path())
            .args(args.split_whitespace())
            .spawn()
            .expect("it starts");
        // The high-water mark of resident memory never falls: the last one seen is that of the whole run but for the
        // last milliseconds, in which files are synced to disk.
        let mut peak = 0;
        while child.try_wait().expect("its state").is_none() {
            let status =
                fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
            let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
            if let Some(kib) = line.and_then(|l| l.split_whitespace().next()) {
                peak = kib.parse::<u64>().expect("a number") * 1024;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(child.wait().expect("its end").success());
        peak
    }

    pub fn picture(&self, name: &str) -> Picture {
        read_exr(&self.path(name)).expect("a picture of ours")
    }

    pub fn film(&self, name: &str) -> Film {
        store::load(&self.path(name)).expect("a film of ours").0
    }

    /// Runs a shell script in the folder, in which `$0` is the program; returns its status. `wrapper` is a command that
    /// runs another.
    pub fn shell(&self, wrapper: &[&str], script: &str) -> i32 {
        let said = fs::File::create(self.path("said")).expect("a file");
        let sh = ["sh", "-c", script, env!("CARGO_BIN_EXE_etendue")];
        let all: Vec<&str> = wrapper.iter().copied().chain(sh).collect();
        let done = std::process::Command::new(all[0])
            .args(&all[1..])
            .current_dir(self.dir.path())
            .stderr(said)
            .status();
        done.expect("it starts").code().expect("not killed")
    }

    /// What the last script wrote to stderr.
    pub fn said(&self) -> String {
        fs::read_to_string(self.path("said")).expect("text")
    }

    /// Names in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.dir.path()).expect("our own folder");
        let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = entries.map(name).collect();
        names.sort();
        names
    }
}

pub fn says(text: &str) -> predicates::str::ContainsPredicate {
    predicate::str::contains(text)
}
