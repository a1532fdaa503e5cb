//! `etendue regress` and the assertion, on the CPU reference.

mod accept;
mod layers;
mod refused;

use assert_cmd::Command;
use etendue::engine::Engine;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::output::store;
use etendue::output::{ExrChannels, read_exr, write_exr};
use etendue::provenance::Provenance;
use etendue::reference::{CpuEngine, Estimator};
use etendue::regress::assert_golden;
use etendue::scene::parse::parse_str;
use etendue::settings::{Overrides, Settings};
use etendue::world::World;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const BALL: &str = r#"
title = "Ball"
[camera]
eye = [0.0, 1.0, 4.0]
look_at = [0.0, 0.5, 0.0]
vfov = 40.0
resolution = [24, 18]
[material.white]
type = "diffuse"
reflectance = [0.8, 0.8, 0.8]
[[sphere]]
center = [0.0, 0.5, 0.0]
radius = 0.5
material = "white"
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
material = "white"
[[light]]
center = [0.0, 3.0, 1.0]
normal = [0.0, -1.0, 0.0]
radius = 0.5
radiance = [20.0, 20.0, 20.0]
"#;

/// A folder of scenes.
struct Folder(TempDir);

impl Folder {
    fn new(scenes: &[&str]) -> Self {
        let folder = Self(tempfile::tempdir().expect("a temporary folder"));
        for name in scenes {
            folder.put(name, BALL);
        }
        folder
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.path(&format!("{name}.toml")), text).expect("written");
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn golden(&self, name: &str) -> PathBuf {
        self.path("golden").join(name)
    }

    fn run(&self, flags: &[&str]) -> assert_cmd::assert::Assert {
        Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
            .arg("regress")
            .arg(self.0.path())
            .args(["--backend", "cpu"])
            .args(flags)
            .assert()
    }

    /// Replaces a golden by one of a brighter lamp that says it is of the scene: the renderer has changed since.
    fn spoil(&self, name: &str) {
        let path = self.golden(&format!("{name}.exr"));
        let samples = read_exr(&path).unwrap().samples.unwrap()[0];
        let brighter = BALL.replace("20.0, 20.0, 20.0", "24.0, 24.0, 24.0");
        let (film, _) = render(&brighter, 5, samples.into());
        let (_, provenance) = render(BALL, 5, samples.into());
        write_exr(&path, &film, &provenance, ExrChannels::All).expect("written");
    }

    fn bless(&self) {
        self.run(&["--bless", "--power", "5%"])
            .code(0)
            .stdout(contains("24x18").and(contains(
                "detects a change of the whole picture's brightness by",
            )));
    }
}

fn render(text: &str, seed: u32, samples: u64) -> (Film, Provenance) {
    let scene = parse_str(Path::new("ball.toml"), text).expect("legal");
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &overrides);
    let world = World::new(&scene, settings.size);
    let mut engine = CpuEngine::new(world, settings.clone(), Estimator::LightSampling);
    let rect = Rect::whole(settings.size);
    let mut film = Film::new(settings.size, rect, settings.strata);
    engine
        .render(&mut film, rect, 0..samples, &Default::default())
        .expect("rendered");
    let mut provenance = Provenance::new(&scene, text, &settings);
    provenance.describe(&film);
    (film, provenance)
}

#[test]
fn goldens_are_made_and_pass_with_another_seed() {
    let f = Folder::new(&["one", "two"]);
    f.run(&[]).code(1).stdout(
        contains("one.exr does not exist; create it: etendue regress ")
            .and(contains("2 scenes: 2 new")),
    );
    f.bless();
    let (junit, html) = (f.path("r.xml"), f.path("r.html"));
    let flags = [
        "--junit",
        junit.to_str().unwrap(),
        "--html",
        html.to_str().unwrap(),
        "--jobs",
        "2",
    ];
    f.run(&flags)
        .code(0)
        .stdout(contains("passed  one: equal up to noise").and(contains("2 scenes: 2 passed")));
    let xml = std::fs::read_to_string(junit).expect("written");
    assert!(
        xml.contains("tests=\"2\"") && xml.contains("failures=\"0\""),
        "{xml}"
    );
    let page = std::fs::read_to_string(html).expect("written");
    assert_eq!(page.matches("<img ").count(), 4);
    assert!(page.contains("2 scenes: 2 passed") && !page.contains("{{"));
    f.run(&["--filter", "wo"])
        .code(0)
        .stdout(contains("1 of 2 scenes (--filter wo): 1 passed").and(contains("one").not()));
    // Enough samples for --power, and not many more.
    let power = |flag: &str| {
        f.run(&["--bless", "--filter", "one", "--power", flag])
            .code(0);
        let picture = read_exr(&f.golden("one.exr")).expect("a golden");
        picture.samples.expect("counts")[0]
    };
    let (rough, fine) = (power("5%"), power("0.5%"));
    assert!(rough * 3 < fine, "{rough} and {fine} samples");
}

/// What comes first on a page is what needs to be looked at.
#[test]
fn the_page_has_failures_first_and_says_where_it_comes_from() {
    let f = Folder::new(&["one", "two"]);
    f.bless();
    let (film, _) = render(&BALL.replace("20.0, 20.0", "30.0, 30.0"), 5, 64);
    write_exr(
        &f.golden("two.exr"),
        &film,
        &render(BALL, 5, 64).1,
        ExrChannels::All,
    )
    .expect("written");
    f.run(&["--html", f.path("r.html").to_str().unwrap()])
        .code(1);
    let page = std::fs::read_to_string(f.path("r.html")).expect("written");
    let place = |text: &str| {
        page.find(text)
            .unwrap_or_else(|| panic!("no {text}: {page}"))
    };
    assert!(place("two: failed") < place("one: passed"));
    let caption = |label| page.matches(&format!("<figcaption>{label}<")).count();
    assert_eq!([caption("golden"), caption("now")], [2, 2]);
    assert!(place(">golden<") < place(">now<"));
    let version = env!("CARGO_PKG_VERSION");
    place(&format!("etendue {version} on CPU reference (f64), "));
    let made = &page[place(&format!("etendue {version} on"))..];
    let date = made.split_once("; ").expect("a date").1;
    assert_eq!(&date[16..20], " UTC", "{}", &date[..20]);
    let report = std::fs::read_to_string(f.golden("two.report.html")).expect("written");
    for told in [
        "golden left of the line, now right of it",
        "alt=\"Picture golden\"",
        "<th scope=\"col\">now</th>",
        "> Golden</label>",
        "mean of golden",
    ] {
        assert!(report.contains(told), "no {told}");
    }
    assert!(!report.contains("{{") && !report.contains("Picture A"));
}

/// Files that need not change do not, and a golden made anew is the same file.
#[test]
fn goldens_that_still_pass_are_left_alone() {
    let f = Folder::new(&["one", "two"]);
    f.bless();
    let golden = |name: &str| std::fs::read(f.golden(name)).expect("a golden");
    let (one, two) = (golden("one.exr"), golden("two.exr"));
    assert_eq!(one, two, "one scene, one picture, one file");

    // Another film of the scene, which passes, and one of another lamp, which does not.
    let (film, provenance) = render(BALL, 7, 256);
    write_exr(&f.golden("one.exr"), &film, &provenance, ExrChannels::All).expect("written");
    let kept = golden("one.exr");
    let (film, _) = render(&BALL.replace("20.0, 20.0", "30.0, 30.0"), 5, 64);
    write_exr(&f.golden("two.exr"), &film, &provenance, ExrChannels::All).expect("written");
    f.run(&["--bless", "--power", "5%"])
        .code(0)
        .stdout(contains(
            "kept  one: the golden still passes: equal up to noise",
        ))
        .stdout(contains("blessed  two: 24x18"))
        .stdout(contains("2 scenes: 1 blessed, 1 kept"));
    assert_eq!(golden("one.exr"), kept);
    assert_eq!(golden("two.exr"), two, "from scratch the same bytes");
    assert!(!f.golden("two.report.html").exists());
    f.run(&["--bless", "--filter", "two"])
        .code(0)
        .stdout(contains("1 of 2 scenes (--filter two): 1 kept"));

    // One that is not as wanted is made anew.
    for flags in [["--size", "12x9"], ["--max-spp", "16"]] {
        f.run(&["--bless", flags[0], flags[1]])
            .code(0)
            .stdout(contains("2 scenes: 2 blessed"));
    }
    std::fs::write(f.golden("one.exr"), "no picture").expect("written");
    f.run(&["--bless"])
        .code(0)
        .stdout(contains("blessed  one").and(contains("kept  two")));
}

#[test]
fn failures_leave_a_film_and_a_report() {
    let f = Folder::new(&["one", "two"]);
    f.bless();
    // A golden of the same hash, but of a brighter lamp: the renderer has changed, not the scene.
    f.spoil("one");
    let junit = f.path("r.xml");
    f.run(&["--junit", junit.to_str().unwrap()])
        .code(1)
        .stdout(contains("FAILED  one: different in the whole picture"))
        .stdout(contains("one.report.html").and(contains("--bless --scene one")))
        .stdout(contains("2 scenes: 1 passed, 1 failed"));
    let xml = std::fs::read_to_string(junit).expect("written");
    assert!(
        xml.contains("failures=\"1\"")
            && xml.contains("in the whole picture")
            && xml.contains("--bless --scene one")
            && xml.contains("<property name=\"adapter\""),
        "{xml}"
    );
    store::load(&f.golden("one.actual.npz")).expect("the actual film");
    assert!(f.golden("one.report.html").exists() && !f.golden("two.report.html").exists());
    // Once it passes again, nothing of the failure is left.
    f.bless();
    f.run(&[]).code(0);
    assert!(!f.golden("one.report.html").exists() && !f.golden("one.actual.npz").exists());
}

#[test]
fn the_assertion_says_what_differs_and_how_to_bless() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let golden = folder.path().join("ball.exr");
    let fails = |film: &Film, provenance: &Provenance| {
        let call = std::panic::AssertUnwindSafe(|| assert_golden(&golden, film, provenance));
        let panic = std::panic::catch_unwind(call).expect_err("it must not pass");
        *panic.downcast::<String>().expect("a text")
    };
    let (film, provenance) = render(BALL, 1, 256);
    let text = fails(&film, &provenance);
    assert!(
        text.contains("no such file") && text.contains("ETENDUE_BLESS=1"),
        "{text}"
    );
    write_exr(&golden, &film, &provenance, ExrChannels::All).expect("written");
    let (again, its) = render(BALL, 2, 256);
    assert_golden(&golden, &again, &its);
    let brighter = BALL.replace("20.0, 20.0, 20.0", "24.0, 24.0, 24.0");
    let (wrong, other) = render(&brighter, 3, 256);
    let text = fails(&wrong, &other);
    assert!(text.contains("another scene"), "{text}");
    let text = fails(&wrong, &its);
    for told in [
        "different",
        "in the whole picture",
        "ball.report.html",
        "ETENDUE_BLESS=1",
        "%",
    ] {
        assert!(text.contains(told), "{told} is missing: {text}");
    }
}

/// The hash of a scene does not have it, but the light does.
#[test]
fn another_max_depth_is_another_picture() {
    let f = Folder::new(&["one"]);
    f.bless();
    f.put(
        "one",
        &BALL.replace("[camera]", "[render]\nmax_depth = 3\n[camera]"),
    );
    f.run(&[])
        .code(2)
        .stdout(contains("the golden has max_depth 64, but the scene has 3"))
        .stdout(contains(format!(
            "re-create the golden: etendue regress {} --bless --scene one\n",
            f.0.path().display()
        )));
    // Who has just re-created it needs no advice to do so.
    f.run(&["--bless"]).code(0).stdout(
        contains("the golden before it: the golden has max_depth 64, but the scene has 3\n")
            .and(contains("re-create").not()),
    );
    f.run(&["-q"]).code(0).stdout("");
}

#[test]
fn a_scene_is_chosen_by_its_whole_name() {
    let f = Folder::new(&["one", "one more"]);
    f.run(&["--bless", "--scene", "one", "--power", "5%"])
        .code(0)
        .stdout(contains("1 of 2 scenes (--scene one): 1 blessed"));
    assert!(f.golden("one.exr").exists() && !f.golden("one more.exr").exists());
    f.run(&["--scene", "on"])
        .code(2)
        .stderr(contains("no scene or golden has the name \"on\""));
    f.bless();
    f.spoil("one more");
    f.run(&["--quiet"])
        .code(1)
        .stdout(contains("--bless --scene 'one more'"))
        .stdout(contains("passed  one").not());
}

/// What is done is told, and the rest is not.
#[cfg(unix)]
#[test]
fn an_interrupted_run_tells_its_results_so_far() {
    let f = Folder::new(&["a", "b"]);
    f.bless();
    // It takes for ever.
    f.put(
        "b",
        &BALL.replace("resolution = [24, 18]", "resolution = [4000, 3000]"),
    );
    let junit = f.path("r.xml");
    let script = "\"$0\" regress \"$1\" --backend cpu --bless --size 4000x3000 --power 0.001% --scene b --junit \"$2\" & pid=$!; sleep 2; kill -TERM $pid; wait $pid";
    let done = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_etendue")])
        .args([f.0.path(), &junit])
        .output()
        .expect("a shell");
    assert_eq!(done.status.code(), Some(143));
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(
        said.contains("interrupted: 0 of 1 scenes were done"),
        "{said}"
    );
    assert!(
        std::fs::read_to_string(junit)
            .unwrap()
            .contains("tests=\"0\"")
    );
}
