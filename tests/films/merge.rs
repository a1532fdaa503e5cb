//! Sharing: films of slices and regions, by processes of their own, added by `merge`.

use crate::output_support::provenance;
use crate::program::{Bench, says};
use etendue::film::coverage::Rect;
use etendue::film::{Film, REPLICATES, Sums};
use etendue::output::store;
use predicates::prelude::*;
use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn any_order_gives_the_same_bytes() {
    let bench = Bench::new();
    for (name, flags) in [
        ("a", "--samples 0..100"),
        ("b", "--samples 100..256 --region 0,0,10,16"),
        ("c", "--samples 100..256 --region 10,0,24,16"),
        ("d", "--samples 256..300"),
    ] {
        bench.render(&format!("{flags} --film {name}.npz -o a.png"));
    }
    let orders = ["a b c d", "d c b a", "c a d b"];
    let merged = orders.map(|order| {
        let films = order.replace(' ', ".npz ") + ".npz";
        let _ = fs::remove_file(bench.path("sum.npz"));
        bench.run(&format!("merge sum.npz {films}")).success();
        fs::read(bench.path("sum.npz")).expect("the sum")
    });
    assert!(
        merged[0] == merged[1] && merged[0] == merged[2],
        "other bytes"
    );
    assert_eq!(bench.film("sum.npz").coverage.samples(), (300, 300));
}

#[test]
fn the_pair_that_overlaps_is_named_unless_one_is_damaged() {
    let bench = Bench::new();
    bench.render("--samples 0..8 --film a.npz -o a.png");
    bench.render("--samples 8..16 --film b.npz -o a.png");
    bench.render("--samples 12..20 --region 3,4,9,9 --film c.npz -o a.png");
    bench.run("merge out.npz a.npz b.npz c.npz").code(2).stderr(says(
        "error: c.npz: cannot be merged with b.npz: samples 12..16 of pixels 3,4,9,9 are in both films",
    ));
    bench
        .run("merge out.npz a.npz b.npz a.npz")
        .code(2)
        .stderr(says("a.npz: cannot be merged with a.npz"));
    // Damage is reported first, since the coverage of a damaged film may be wrong too.
    let bytes = fs::read(bench.path("b.npz")).expect("a film");
    fs::write(bench.path("b.npz"), &bytes[..bytes.len() / 2]).expect("written");
    bench
        .run("merge out.npz a.npz b.npz c.npz")
        .code(2)
        .stderr(says("error: b.npz: truncated").and(says("in both films").not()));
    assert!(!bench.path("out.npz").exists());
}

/// A slice that is resumed stays one, and fits the others.
#[test]
fn a_slice_is_resumed_within_its_range() {
    let bench = Bench::new();
    bench.render("--samples 0..8 --film a.npz -o a.png");
    bench
        .run("render box.toml --backend cpu --film a.npz -o a.png --time 1s")
        .success()
        .stderr(says("samples 0..8").and(says("nothing rendered")));
    assert_eq!(bench.film("a.npz").coverage.samples(), (8, 8));
    // Who asks for others gets them, and is told.
    for flag in ["--spp 12", "--rays 3"] {
        fs::copy(bench.path("a.npz"), bench.path("d.npz")).expect("copied");
        bench
            .run(&format!(
                "render box.toml --backend cpu --film d.npz -o a.png {flag}"
            ))
            .success()
            .stderr(says(
                "warning: this film is a slice, samples 0..8; --spp and --rays ask for others",
            ));
        assert_eq!(bench.film("d.npz").coverage.samples(), (12, 12));
    }
    // One that was interrupted goes on to its end, and a larger range can be asked for.
    bench.render("--samples 0..16 --film a.npz -o a.png");
    bench.render("--samples 16..24 --film b.npz -o a.png");
    bench.run("merge sum.npz a.npz b.npz").success();
    assert_eq!(bench.film("sum.npz").coverage.samples(), (24, 24));
    // The sum is none.
    bench.render("--spp 32 --film sum.npz -o a.png");
    assert_eq!(bench.film("sum.npz").coverage.samples(), (32, 32));
    // What was typed is named, not what surrounds it.
    bench.render("--region 0,0,4,4 --spp 4 --film c.npz -o a.png");
    bench
        .run("render box.toml --backend cpu --film c.npz -o a.png --region 0,0,4,4 --region 8,8,12,12")
        .code(2)
        .stderr(says("but the command line selects 0,0,4,4 and 8,8,12,12;"));
}

#[test]
fn a_foreign_scene_is_named() {
    let bench = Bench::new();
    let scene = fs::read_to_string(bench.path("box.toml")).expect("the scene");
    fs::write(
        bench.path("other.toml"),
        scene.replace("vfov       = 45.0", "vfov = 44.0"),
    )
    .expect("a scene");
    bench.render("--samples 0..8 --film a.npz -o a.png");
    bench
        .run("render other.toml --backend cpu --samples 8..16 --film b.npz -o a.png")
        .success();
    bench.run("merge out.npz a.npz b.npz").code(2).stderr(
        says("b.npz: cannot be merged with a.npz: scene is \"Test box\" (").and(says(") and ")),
    );
}

#[test]
fn quadrants_by_four_processes_become_the_film_of_one() {
    let bench = Bench::new();
    let regions = ["0,0,12,8", "12,0,24,8", "0,8,12,16", "12,8,24,16"];
    let mut at_once = Vec::new();
    for (i, region) in regions.iter().enumerate() {
        let child = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(bench.dir.path())
            .args([
                "render",
                "box.toml",
                "--backend",
                "cpu",
                "--spp",
                "300",
                "--quiet",
            ])
            .args(["--region", region, "--film", &format!("q{i}.npz"), "-o"])
            .arg(format!("q{i}.png"))
            .spawn();
        at_once.push(child.expect("it starts"));
    }
    for child in &mut at_once {
        assert!(child.wait().expect("its end").success());
    }
    bench
        .run("merge whole.npz q3.npz q1.npz q0.npz q2.npz")
        .success()
        .stderr(says("warning").not());
    bench.render("--spp 300 --film one.npz -o one.exr");
    let (whole, one) = (bench.film("whole.npz"), bench.film("one.npz"));
    assert_eq!(whole.coverage.samples(), (300, 300));
    assert!(whole.sums() == one.sums(), "other bits");
    // Three of them leave a hole, which is warned of.
    bench
        .run("merge part.npz q3.npz q1.npz q0.npz")
        .success()
        .stderr(says("warning: pixels 0,8,12,16 have no samples"));
}

/// Saves a film of samples `slice`·256 to the next slice's, all of it light.
fn slice(path: &Path, size: [u32; 2], slice: u64) {
    let whole = Rect::whole(size);
    let mut film = Film::new(size, whole, 2);
    let sums: [Sums<f64>; REPLICATES] = [[slice as f64; 4]; REPLICATES];
    let pixels = vec![sums; whole.area() as usize];
    film.put_samples(whole, slice * 256..(slice + 1) * 256, pixels);
    let mut its = provenance(size);
    its.describe(&film);
    store::save(path, &film, &its).expect("saved");
}

/// The most memory that `etendue merge` of `films` slices ever held, over the size of one of the files.
#[cfg(target_os = "linux")]
fn peak_in_films(bench: &Bench, size: [u32; 2], films: u64) -> f64 {
    let names: Vec<String> = (0..films).map(|k| format!("{k}.npz")).collect();
    for (k, name) in names.iter().enumerate() {
        slice(&bench.path(name), size, k as u64);
    }
    let one = fs::metadata(bench.path("0.npz")).expect("a film").len();
    let peak = bench.peak(&format!("merge sum.npz --quiet {}", names.join(" ")));
    let sum = store::load(&bench.path("sum.npz")).expect("a film").0;
    assert_eq!(sum.coverage.samples().0, films * 256);
    let all = (films * (films - 1) / 2) as f64;
    assert_eq!(sum.total(size[0] / 2, size[1] / 2), [[all; 4]; REPLICATES]);
    println!(
        "{films} films of {:.1} MB: {:.1} MB of memory, {:.2} films",
        one as f64 / 1e6,
        peak as f64 / 1e6,
        peak as f64 / one as f64
    );
    peak as f64 / one as f64
}

#[cfg(target_os = "linux")]
#[test]
fn merging_holds_fewer_than_three_films() {
    let films = peak_in_films(&Bench::new(), [640, 360], 8);
    // At least the sum itself: less would be a peak that was missed.
    assert!((1.0..3.0).contains(&films), "{films} films");
}

#[cfg(target_os = "linux")]
#[test]
fn merging_more_films_takes_no_more_memory() {
    let [few, many] = [3, 16].map(|n| peak_in_films(&Bench::new(), [480, 270], n));
    assert!(few > 1.0 && many < few + 0.5, "{few} and {many} films");
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "18 GB of films: cargo test --release --test films -- --ignored --nocapture full_hd"]
fn merging_64_full_hd_films_holds_fewer_than_three() {
    let films = peak_in_films(&Bench::new(), [1920, 1080], 64);
    assert!((1.0..3.0).contains(&films), "{films} films");
}
