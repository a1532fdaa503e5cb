//! Completions and man pages name every command and flag, and the programs that read them find no fault.

use crate::program::{Bench, says};
use predicates::prelude::*;
use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

/// Every command, with the flags in its help.
fn commands(bench: &Bench) -> Vec<(String, BTreeSet<String>)> {
    let help = |command: &str| {
        let done = bench.run(&format!("{command} --help")).success();
        String::from_utf8_lossy(&done.get_output().stdout).into_owned()
    };
    let all = help("");
    let list = all.split("Commands:").nth(1).expect("a list");
    let list = list.split("\n\n").next().expect("its end");
    let names = list
        .lines()
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "));
    let names = names.filter_map(|l| l.split_whitespace().next());
    let flags = |name: &str| {
        let text = help(name);
        let words = text.lines().filter(|l| l.trim_start().starts_with('-'));
        let words = words.flat_map(|l| l.split([' ', ',']));
        words
            .filter(|w| w.starts_with("--"))
            .map(|w| w.trim_end_matches([']', '=']).to_owned())
            .collect()
    };
    let named = names.filter(|n| *n != "help");
    named.map(|n| (n.to_owned(), flags(n))).collect()
}

/// Runs a program that reads `file`, if it is installed; it must succeed and print nothing.
fn accepts(program: &str, flags: &[&str], file: &std::path::Path) {
    match Command::new(program).args(flags).arg(file).output() {
        Ok(done) => {
            let said = String::from_utf8_lossy(&done.stderr).into_owned();
            assert!(
                done.status.success() && said.is_empty(),
                "{program}: {said}"
            );
        }
        Err(e) => assert_eq!(e.kind(), std::io::ErrorKind::NotFound, "{program}: {e}"),
    }
}

#[test]
fn completions_know_every_command_and_flag() {
    let bench = Bench::new();
    let commands = commands(&bench);
    assert!(
        commands.len() > 10
            && commands
                .iter()
                .any(|(c, f)| c == "render" && f.contains("--spp"))
    );
    for (shell, check) in [
        ("bash", Some("bash")),
        ("zsh", Some("zsh")),
        ("fish", Some("fish")),
        ("elvish", None),
        ("powershell", None),
    ] {
        let done = bench
            .run(&format!("completions {shell}"))
            .success()
            .stderr("");
        let script = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
        for (command, flags) in &commands {
            assert!(script.contains(command.as_str()), "{shell}: no {command}");
            for flag in flags {
                // fish leaves out the dashes.
                let told = script.contains(flag.as_str())
                    || script.contains(&format!("-l {} ", &flag[2..]))
                    || script.contains(&format!("-l {}\n", &flag[2..]));
                assert!(told, "{shell}: no {flag} of {command}");
            }
        }
        let path = bench.path(shell);
        fs::write(&path, script).unwrap();
        if let Some(program) = check {
            accepts(program, &["-n"], &path);
        }
    }
    bench.run("completions tcsh").code(2).stderr(says("zsh"));
    bench.run("completions").code(2);
}

/// What bash offers after the words.
#[cfg(target_os = "linux")]
#[test]
fn bash_completes_commands_and_flags() {
    let bench = Bench::new();
    let script = r#"
        bash -c '
            eval "$("$0" completions bash)"
            COMP_WORDS=(etendue render --ada); COMP_CWORD=2; COMPREPLY=()
            _etendue etendue --ada render; echo "${COMPREPLY[@]}"
            COMP_WORDS=(etendue sel); COMP_CWORD=1; COMPREPLY=()
            _etendue etendue sel etendue; echo "${COMPREPLY[@]}"
        ' "$0" > offered
    "#;
    assert_eq!(bench.shell(&[], script), 0, "{}", bench.said());
    let offered = fs::read_to_string(bench.path("offered")).unwrap();
    assert_eq!(offered, "--adaptive --adapter\nselftest\n");
}

#[test]
fn man_pages_know_every_command_and_flag() {
    let bench = Bench::new();
    bench
        .run("man pages/man1")
        .success()
        .stdout("")
        .stderr(says("pages to pages/man1"));
    let page = |name: &str| {
        let path = bench.path(&format!("pages/man1/{name}.1"));
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        accepts("mandoc", &["-T", "lint", "-W", "error"], &path);
        accepts("groff", &["-man", "-z", "-ww"], &path);
        // Hyphens are escaped.
        text.replace("\\-", "-")
    };
    let program = page("etendue");
    let commands = commands(&bench);
    for (command, flags) in &commands {
        assert!(
            program.contains(&format!("etendue-{command}(1)")),
            "{command}"
        );
        let text = page(&format!("etendue-{command}"));
        for flag in flags {
            assert!(text.contains(flag.as_str()), "no {flag} of {command}");
        }
    }
    let pages = fs::read_dir(bench.path("pages/man1")).unwrap().count();
    assert_eq!(pages, commands.len() + 1);
    let done = bench.run("man").success().stderr("");
    let printed = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert_eq!(printed.replace("\\-", "-"), program);
    bench
        .run("man box.toml")
        .code(4)
        .stderr(says("box.toml").and(says("cannot create")));
    bench.run("man box.toml/man1").code(4).stderr(says(
        "error: box.toml/man1: no such folder, and it can't be made: ",
    ));
}
