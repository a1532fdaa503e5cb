//! Goldens that a person accepts: out of a failed run's films, or one by one; and the results as Markdown.

use super::{BALL, Folder};
use etendue::output::read_exr;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::fs;

const DARKER: [&str; 2] = ["[20.0, 20.0, 20.0]", "[5.0, 5.0, 5.0]"];

#[test]
fn the_films_of_a_failed_run_become_goldens_without_rendering() {
    let f = Folder::new(&["one", "two"]);
    f.bless();
    f.spoil("one");
    f.run(&[]).code(1);
    // As a download of the results of another machine has them.
    let results = tempfile::tempdir().expect("a folder");
    let there = results.path().join("scenes/golden");
    fs::create_dir_all(&there).expect("made");
    fs::rename(f.golden("one.actual.npz"), there.join("one.actual.npz")).expect("moved");
    let folder = results.path().to_str().expect("a name");
    let two = fs::read(f.golden("two.exr")).expect("a golden");
    f.run(&["--accept", folder])
        .code(0)
        .stdout(contains("blessed  one: 24x18, ").and(contains("1 scene: 1 blessed")));
    assert_eq!(fs::read(f.golden("two.exr")).expect("a golden"), two);
    f.run(&[]).code(0);
    // A golden beside which the film passes stays as it is: now this one, and before that any other.
    let accepted = fs::read(f.golden("one.exr")).expect("a golden");
    fs::copy(there.join("one.actual.npz"), there.join("two.actual.npz")).expect("copied");
    f.run(&["--accept", folder]).code(0).stdout(
        contains("kept  one: the golden still passes: ")
            .and(contains(
                "kept  two: the golden still passes: equal up to noise",
            ))
            .and(contains("2 scenes: 2 kept")),
    );
    assert_eq!(fs::read(f.golden("one.exr")).expect("a golden"), accepted);
    assert_eq!(fs::read(f.golden("two.exr")).expect("a golden"), two);
    // The golden is the film, to the digits of a picture.
    let film = etendue::output::store::load(&there.join("one.actual.npz")).expect("a film");
    let golden = read_exr(&f.golden("one.exr")).expect("a golden");
    let samples = film.0.coverage.mean();
    assert!(
        golden
            .samples
            .is_some_and(|all| all.iter().all(|n| f64::from(*n) == samples))
    );
}

#[test]
fn films_that_do_not_fit_are_not_accepted() {
    let f = Folder::new(&["one"]);
    f.bless();
    f.run(&["--accept", f.path("none").to_str().expect("a name")])
        .code(4)
        .stderr(contains("none: cannot read"));
    let folder = f.path("golden");
    let folder = folder.to_str().expect("a name");
    f.run(&["--accept", folder])
        .code(2)
        .stderr(contains("no films of failed scenes (NAME.actual.npz)"));
    f.spoil("one");
    f.run(&[]).code(1);
    let before = fs::read(f.golden("one.exr")).expect("a golden");
    // The scene has changed since.
    for (text, told) in [
        (
            BALL.replace(DARKER[0], DARKER[1]),
            "is of another scene than",
        ),
        (
            BALL.replace("[camera]", "[render]\nmax_depth = 3\n[camera]"),
            "one.actual.npz has max_depth 64, but the scene has 3; it was rendered before the scene was changed",
        ),
        ("nonsense".into(), "one.toml:1:9"),
    ] {
        f.put("one", &text);
        f.run(&["--accept", folder])
            .code(2)
            .stdout(contains("unusable  one: ").and(contains(told)));
    }
    f.put("one", BALL);
    // Damage, and two films of one name.
    fs::create_dir(f.path("golden/more")).expect("made");
    fs::copy(
        f.golden("one.actual.npz"),
        f.path("golden/more/one.actual.npz"),
    )
    .expect("copied");
    f.run(&["--accept", folder])
        .code(2)
        .stderr(contains("another film of this name"));
    fs::write(f.golden("one.actual.npz"), b"PK\x03\x04").expect("written");
    f.run(&[
        "--accept",
        f.golden("one.actual.npz").to_str().expect("a name"),
    ])
    .code(2)
    .stdout(contains("unusable  one: "));
    assert_eq!(fs::read(f.golden("one.exr")).expect("a golden"), before);
    // A film of a scene that is elsewhere.
    fs::rename(
        f.golden("one.actual.npz"),
        f.path("golden/other.actual.npz"),
    )
    .expect("moved");
    fs::remove_dir_all(f.path("golden/more")).expect("removed");
    f.run(&["--accept", folder])
        .code(2)
        .stderr(contains("other.actual.npz is ignored").and(contains("no film of a scene in")));
    for other in ["--bless", "--review"] {
        f.run(&["--accept", folder, other])
            .code(2)
            .stderr(contains("cannot be used with"));
    }
}

/// `etendue regress --review` with these answers.
fn review(f: &Folder, answers: &str) -> assert_cmd::assert::Assert {
    assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
        .arg("regress")
        .arg(f.path(""))
        .args(["--backend", "cpu", "--review", "--power", "5%"])
        .write_stdin(answers)
        .assert()
}

#[test]
fn a_review_asks_about_what_changed_and_nothing_else() {
    let f = Folder::new(&["changed", "failed", "same"]);
    f.bless();
    f.spoil("failed");
    f.put("changed", &BALL.replace(DARKER[0], DARKER[1]));
    f.put("new", BALL);
    f.put("wrong", "nonsense");
    let goldens = || {
        ["changed", "failed", "same", "new"].map(|n| fs::read(f.golden(&format!("{n}.exr"))).ok())
    };
    let before = goldens();
    // The end of stdin is no consent.
    review(&f, "").code(2).stderr(
        contains("changed.report.html")
            .and(contains("accept it as the golden, skip it, or quit?"))
            .and(contains("4 of 5 scenes were not looked at")),
    );
    review(&f, "s\nskip\ns\n")
        .code(2)
        .stdout(contains("unusable  changed").and(contains("FAILED  failed")));
    assert_eq!(goldens(), before);
    let page = fs::read_to_string(f.golden("new.report.html")).expect("a page");
    assert!(page.contains("alt=\"new, now\"") && !page.contains("alt=\"new, golden\""));
    // An answer that is none is asked for again; the scene with errors is told, and not asked about.
    review(&f, "what?\na\nA\naccept\n")
        .code(2)
        .stdout(contains("blessed  changed").and(contains("blessed  failed")))
        .stdout(contains("passed  same").and(contains("blessed  new")))
        .stdout(contains("unusable  wrong").and(contains("nonsense").or(contains("wrong.toml:1"))));
    let after = goldens();
    assert!(after[2] == before[2] && [0, 1, 3].iter().all(|&k| after[k] != before[k]));
    assert!(!f.golden("changed.report.html").exists());
    fs::remove_file(f.path("wrong.toml")).expect("removed");
    f.run(&[]).code(0);
    review(&f, "").code(0).stderr(contains("accept it").not());
}

#[test]
fn the_summary_is_markdown_with_failures_first() {
    let f = Folder::new(&["a_b|c", "two"]);
    f.bless();
    f.spoil("two");
    let path = f.path("summary.md");
    f.run(&["--summary", path.to_str().expect("a name")])
        .code(1);
    let text = fs::read_to_string(&path).expect("a summary");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "### 2 scenes: 1 passed, 1 failed", "{text}");
    assert!(
        lines[4].starts_with("| **failed** | two | different in the whole picture"),
        "{text}"
    );
    assert!(
        lines[5].starts_with(r"| passed | a\_b\|c | equal up to noise"),
        "{text}"
    );
    let table = text
        .lines()
        .position(|l| l.starts_with("    where "))
        .expect("a table");
    assert!(
        lines[table + 1].starts_with("    in the whole picture "),
        "{text}"
    );
    assert!(
        text.contains("two.report.html") && text.contains("--bless --scene two"),
        "{text}"
    );
    assert!(text.ends_with("UTC</sub>\n"), "{text}");
    f.run(&["--summary", f.golden("two.exr").to_str().expect("a name")])
        .code(2)
        .stderr(contains("would overwrite"));
}

/// What a person wants to see before another golden is accepted: pictures, numbers, and the lines that were changed.
#[test]
fn a_review_says_what_differs_in_a_changed_scene() {
    let f = Folder::new(&["one"]);
    f.run(&["--bless", "--power", "5%", "--size", "20x15"])
        .code(0);
    f.put("one", &BALL.replace(DARKER[0], DARKER[1]));
    let review = |flags: &[&str]| {
        let done = f.run(&[&["--review", "--power", "5%"], flags].concat());
        let done = done.code(2).get_output().clone();
        String::from_utf8(done.stderr).expect("text")
    };
    let said = review(&[]);
    for told in [
        "is of another scene than",
        "different in the whole picture",
        "in the whole picture           red ",
        "relative RMSE",
        "the text of the scene differs from line 23 on:",
        "- radiance = [20.0, 20.0, 20.0]",
        "+ radiance = [5.0, 5.0, 5.0]",
    ] {
        assert!(said.contains(told), "no {told}: {said}");
    }
    // No noise is shared, so that it is evidence.
    assert!(!said.contains("seed"), "{said}");
    let page = fs::read_to_string(f.golden("one.report.html")).expect("a page");
    for told in [
        "alt=\"Picture golden\"",
        "alt=\"Picture now\"",
        "Difference over its noise",
        "+ radiance = [5.0, 5.0, 5.0]",
        "<th scope=\"row\">relative RMSE</th>",
    ] {
        assert!(page.contains(told), "no {told}");
    }
    assert!(!page.contains("scene_text"));
    // Pictures of other sizes can't be compared, but texts can.
    let said = review(&["--size", "12x9"]);
    assert!(
        said.contains("has 20 x 15 pixels, but") && said.contains("+ radiance = [5.0, 5.0, 5.0]"),
        "{said}"
    );
    let page = fs::read_to_string(f.golden("one.report.html")).expect("a page");
    assert!(page.contains("alt=\"one, golden\"") && page.contains("alt=\"one, now\""));
}

/// Goldens whose stated error is in doubt are made, and say so.
#[test]
fn a_golden_in_doubt_says_so() {
    let f = Folder::new(&["one"]);
    let summary = f.path("summary.md");
    let flags = ["--summary", summary.to_str().expect("a name")];
    f.run(&[&["--bless", "--max-spp", "8"][..], &flags].concat())
        .code(0)
        .stdout(contains("its stated error is in doubt: it rests on too few samples"))
        .stderr(contains(
            "warning: one: the stated error of this golden is in doubt: it rests on too few samples",
        ));
    let text = fs::read_to_string(summary).expect("a summary");
    assert!(text.contains("its stated error is in doubt"), "{text}");
}
