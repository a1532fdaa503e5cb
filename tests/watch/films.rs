//! `etendue watch`: films that other processes write, replace, damage and remove.

use crate::client::Running;
use crate::program::{Bench, says};
use serde_json::Value;
use std::fs;

#[test]
fn a_film_is_followed_through_all_that_happens_to_it() {
    let bench = Bench::new();
    let running = Running::serve(&bench, "watch f.npz --error 0.01%");
    let mut events = running.events();
    let problem = |u: &Value| u["problem"].as_str().unwrap_or("").to_owned();
    events.next(|u| problem(u) == "there is no such file yet");

    bench.render("--spp 16 --film f.npz -o a.png");
    let update = events.next(|u| u["picture"] == 1);
    assert_eq!(update["problem"], Value::Null);
    let first = events_or(&update, &mut events, |u| {
        u["about"].is_object() && u["now"]["samples"] == 16.0
    });
    assert_eq!(first["about"]["title"], "Test box");
    assert_eq!(first["about"]["file"], "f.npz");
    assert_eq!(first["about"]["target"]["relative_error"], 0.0001);
    assert_eq!(first["curve"].as_array().unwrap().len(), 1);
    let (_, before) = running.layer("samples");
    assert_eq!(before[..4], 16f32.to_le_bytes());

    // It grows.
    bench.render("--spp 64 --film f.npz -o a.png");
    let grown = events.next(|u| u["now"]["samples"] == 64.0);
    assert_eq!(grown["curve"].as_array().unwrap().len(), 2);
    let (version, samples) = running.layer("samples");
    assert_eq!((version, &samples[..4]), (2, &64f32.to_le_bytes()[..]));

    // Another film takes its name, of another size.
    bench.render("--spp 4 --size 12x8 --film other.npz -o a.png");
    fs::rename(bench.path("other.npz"), bench.path("f.npz")).unwrap();
    let other = events.next(|u| u["now"]["samples"] == 4.0);
    assert_eq!(other["about"]["size"], serde_json::json!([12, 8]));
    assert_eq!(other["curve"].as_array().unwrap().len(), 1);
    assert_eq!(running.layer("samples").1.len(), 12 * 8 * 4);

    // The beginning is damaged: the last numbers stay.
    fs::write(bench.path("f.npz"), "damaged").unwrap();
    let damaged = events.next(|u| !problem(u).is_empty());
    assert!(problem(&damaged).contains("not a film"), "{damaged}");
    assert_eq!(damaged["now"]["samples"], 4.0);
    assert_eq!(running.get("").status, 200);

    // The numbers are damaged, which shows when they are looked at.
    bench.render("--spp 32 --film new.npz -o a.png");
    let mut bytes = fs::read(bench.path("new.npz")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 64].fill(0x55);
    fs::write(bench.path("new.npz"), &bytes).unwrap();
    fs::rename(bench.path("new.npz"), bench.path("f.npz")).unwrap();
    events.next(|u| u["now"]["samples"] == 32.0);
    assert_eq!(running.get("runs/0/layers/picture").status, 204);
    let damaged = events.next(|u| !problem(u).is_empty());
    assert!(problem(&damaged).contains("invalid film"), "{damaged}");
    assert!(
        !damaged
            .to_string()
            .contains(bench.dir.path().to_str().unwrap())
    );

    fs::remove_file(bench.path("f.npz")).unwrap();
    events.next(|u| problem(u) == "the file is gone");
    running.interrupt();
    assert_eq!(running.end().0, Some(130));
}

/// `update` if it fits, else the next that does.
fn events_or(
    update: &Value,
    events: &mut crate::client::Events,
    fits: impl Fn(&Value) -> bool,
) -> Value {
    if fits(update) {
        return update.clone();
    }
    events.next(fits)
}

#[test]
fn a_folder_shows_its_films_and_those_that_come() {
    let bench = Bench::new();
    fs::create_dir(bench.path("night")).unwrap();
    bench.render("--spp 16 --film night/b.npz --log night/b.jsonl --error 0.5% -o a.png");
    bench.render("--spp 8 --seed 1 --film night/a.npz -o a.png");
    fs::write(bench.path("night/notes.txt"), "no film").unwrap();
    let running = Running::serve(&bench, "watch night");
    let mut events = running.events();
    let a = events.next(|u| u["id"] == 0);
    assert_eq!(
        (&a["about"]["file"], &a["now"]["samples"]),
        (&"a.npz".into(), &8.0.into())
    );
    // The log tells what the film does not: the target, and how it ended.
    let b = events.next(|u| u["id"] == 1);
    assert_eq!(b["about"]["target"]["relative_error"], 0.005);
    assert_eq!(b["ended"], "spp");
    bench.render("--spp 4 --seed 2 --film night/c.npz -o a.png");
    let c = events.next(|u| u["id"] == 2 && u["now"].is_object());
    assert_eq!(c["now"]["samples"], 4.0);
    for id in 0..3 {
        assert_eq!(
            running.get(&format!("runs/{id}/layers/picture?k=4")).status,
            200
        );
    }
    assert_eq!(running.get("runs/3/layers/picture").status, 404);
}

#[test]
fn what_is_no_film_is_refused() {
    let bench = Bench::new();
    bench.run("watch").code(2).stderr(says("FILM|DIR"));
    bench
        .run("watch box.toml")
        .code(2)
        .stderr(says("box.toml: not a film"));
    // For ever nothing would come there.
    for path in ["none/f.npz", "none/", "none/films"] {
        bench
            .run(&format!("watch {path}"))
            .code(4)
            .stderr(says(&format!("error: {path}: cannot read: ")));
    }
    bench
        .run("watch . --error 0")
        .code(2)
        .stderr(says("more than 0"));
    bench
        .run("watch . --listen x")
        .code(2)
        .stderr(says("expected an address and a port"));
}
