//! Damaged films, and files that are not films, in every command that reads films. Each must give a clear error, exit status
//! 2 or 4, and leave the file unchanged. `film_store.rs` tests more kinds of damage.

use crate::output_support::{forge, negate_first_count};
use crate::program::{Bench, NAMESPACE, says};
use etendue::film::Film;
use etendue::output::store;
use predicates::prelude::*;
use std::fs;

/// Every command that reads `f.npz`.
const READERS: [&str; 3] = [
    "render box.toml --backend cpu --spp 8 --film f.npz -o b.png",
    "develop f.npz -o b.png",
    "merge b.npz a.npz f.npz",
];

/// A bench with two films that can be added, and the bytes of the second.
fn two_films() -> (Bench, Vec<u8>) {
    let bench = Bench::new();
    bench.render("--samples 4..8 --film a.npz -o a.png");
    bench.render("--samples 0..4 --film f.npz -o a.png");
    let bytes = fs::read(bench.path("f.npz")).expect("the film");
    (bench, bytes)
}

#[test]
fn damaged_films_are_refused_and_left_as_they_are() {
    let (bench, good) = two_films();
    let edited = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.clone();
        edit(&mut bytes);
        bytes
    };
    let png = fs::read(bench.path("a.png")).expect("a picture");
    let scene = fs::read(bench.path("box.toml")).expect("the scene");
    let cases = [
        (edited(&|b| b.truncate(b.len() / 2)), "truncated"),
        (edited(&|b| b.truncate(b.len() - 1)), "truncated"),
        (Vec::new(), "not a film (an empty file)"),
        (edited(&|b| b.push(0)), "extra bytes at the end"),
        (edited(&|b| b[20_000] ^= 4), "does not match its checksum"),
        (png, "not a film (a PNG picture)"),
        (scene, "not a film (text, such as a scene file)"),
        (with_a_nan(&bench), "\"sums\" holds NaN"),
        (
            edited(&|b| negate_first_count(b, 4)),
            "has a count of 18446744073709551615 samples",
        ),
        (
            edited(&|b| forge(b, "\"format_version\":1", "\"format_version\":2")),
            "its format version is 2; this program reads version 1",
        ),
        (
            edited(&|b| forge(b, "\"etendue film\"", "\"another film\"")),
            "its format is \"another film\"",
        ),
    ];
    for (bytes, what) in cases {
        fs::write(bench.path("f.npz"), &bytes).expect("written");
        for command in READERS {
            let refused = bench.run(command).code(2).stdout("");
            let text = says("error: f.npz: ").and(says(what));
            refused.stderr(text.and(predicate::str::contains("panicked").not()));
        }
        let after = fs::read(bench.path("f.npz")).expect("the film");
        assert!(after == bytes, "{what}: it was touched");
        assert_eq!(
            bench.names(),
            ["a.npz", "a.png", "box.toml", "f.npz"],
            "{what}"
        );
    }
    // The undamaged one passes: nothing else was wrong. The render comes last, for it makes the two overlap.
    fs::write(bench.path("f.npz"), good).expect("written");
    for command in READERS.iter().rev() {
        bench.run(command).success();
    }
}

/// The film with a NaN in it, and every checksum right.
fn with_a_nan(bench: &Bench) -> Vec<u8> {
    let (film, provenance) = store::load(&bench.path("f.npz")).expect("a film");
    let mut sums = film.sums().to_vec();
    sums[100][2][1] = f64::NAN;
    let bad = Film::from_parts(
        film.size,
        film.bounds,
        film.strata,
        film.coverage,
        sums,
        vec![],
    );
    let path = bench.path("nan.npz");
    store::save(&path, &bad, &provenance).expect("saved");
    let bytes = fs::read(&path).expect("the film");
    fs::remove_file(path).expect("removed");
    bytes
}

#[test]
fn inaccessible_films_are_named() {
    let (bench, _) = two_films();
    fs::remove_file(bench.path("f.npz")).expect("removed");
    for command in &READERS[1..] {
        bench
            .run(command)
            .code(4)
            .stderr(says("error: f.npz: cannot read: no such file or directory"));
    }
    fs::create_dir(bench.path("f.npz")).expect("a folder");
    for command in READERS {
        bench
            .run(command)
            .code(4)
            .stderr(says("error: f.npz: cannot ").and(says("is a directory")));
    }
    assert_eq!(bench.names(), ["a.npz", "a.png", "box.toml", "f.npz"]);
}

/// As root, who may write everywhere, the folder is a read-only mount.
#[cfg(target_os = "linux")]
#[test]
fn a_film_in_a_read_only_folder_is_read_but_not_resumed() {
    let (bench, before) = two_films();
    let mount = "mkdir -p ro && cp f.npz ro/ && chmod 555 ro && if touch ro/x 2>/dev/null; then rm ro/x; \
                 mount --bind ro ro && mount -o remount,bind,ro ro || exit 77; fi;";
    let user_may_write = bench.shell(&[], "mkdir t && chmod 555 t && touch t/x 2>/dev/null") == 0;
    let wrapper = if user_may_write { NAMESPACE } else { &[] };
    if bench.shell(wrapper, mount) != 0 {
        eprintln!(
            "SKIPPED, no read-only folder can be made here: {}",
            bench.said()
        );
        return;
    }
    let script = format!(
        "{mount} \"$0\" render box.toml --backend cpu --spp 8 --film ro/f.npz -o b.png; status=$?; \
         \"$0\" develop ro/f.npz -o c.png || exit 1; cmp f.npz ro/f.npz || exit 1; exit $status"
    );
    assert_eq!(bench.shell(wrapper, &script), 4);
    let said = bench.said();
    let first = said.lines().next().unwrap_or_default();
    assert!(
        first.starts_with("error: ro/f.npz: cannot write: "),
        "{said}"
    );
    assert_eq!(fs::read(bench.path("ro/f.npz")).expect("the film"), before);
    assert!(!bench.path("b.png").exists() && bench.path("c.png").exists());
}
