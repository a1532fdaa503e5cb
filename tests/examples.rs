//! The programs of `examples/` do what they say, and print nothing that they were not asked for.

use assert_cmd::Command;
use std::path::PathBuf;

/// An example that `cargo test` has built: `cargo test --test examples` alone builds none.
fn example(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("this test's own path");
    let profile = test.ancestors().nth(2).expect("target/PROFILE/deps/TEST");
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let path = profile.join("examples").join(name);
    assert!(
        path.exists(),
        "{} is not there: cargo build --examples makes it",
        path.display()
    );
    path
}

/// What it prints to stdout. Nothing helps it to be silent: neither a folder for sockets of screens nor Mesa's own switch.
fn run(name: &str) -> String {
    let mut command = Command::new(example(name));
    command
        .env_remove("XDG_RUNTIME_DIR")
        .env_remove("NODEVICE_SELECT");
    let folder = tempfile::tempdir().expect("a folder");
    let done = command.env("TMPDIR", folder.path()).assert().success();
    let output = done.get_output();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{name}");
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

#[test]
fn first_picture() {
    let said = run("first_picture");
    assert!(
        said.contains("first_picture.png on ") && said.contains("relative error "),
        "{said}"
    );
}

#[test]
fn stop_at_error() {
    let said = run("stop_at_error");
    assert!(
        said.contains(" samples a pixel\n") && said.contains("reached the error\n"),
        "{said}"
    );
}

#[test]
fn same_picture() {
    let said = run("same_picture");
    assert!(said.contains("mean of B"), "{said}");
}
