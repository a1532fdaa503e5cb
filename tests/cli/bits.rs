//! Promises about bits.

use crate::program::{Bench, SCENE, says};
use crate::status::interrupted;
use etendue::output::Picture;
use predicates::prelude::*;
use std::fs;

/// The largest difference of any channel, as part of the larger value or of 1e-3, whichever is more.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let channels = a.iter().flatten().zip(b.iter().flatten());
    let relative = channels.map(|(a, b)| {
        let (a, b) = (f64::from(*a), f64::from(*b));
        (a - b).abs() / a.abs().max(b.abs()).max(1e-3)
    });
    relative.fold(0.0, f64::max)
}

#[test]
fn parts_of_the_light_add_up_to_the_whole() {
    let bench = Bench::new();
    let part = |light: &str| {
        bench.render(&format!("--spp 64 --light {light} -o {light}.exr"));
        bench.picture(&format!("{light}.exr")).rgb
    };
    let parts = [part("emitted"), part("direct"), part("indirect")];
    for p in &parts {
        assert!(p.iter().flatten().any(|&v| v > 0.0), "a part is black");
    }
    let sum: Vec<[f32; 3]> = (0..parts[0].len())
        .map(|i| [0, 1, 2].map(|c| parts[0][i][c] + parts[1][i][c] + parts[2][i][c]))
        .collect();
    bench.render("--spp 64 -o whole.exr");
    let off = difference(&sum, &bench.picture("whole.exr").rgb);
    assert!(off < 1e-5, "off by {off}");
    bench.render("--spp 64 --light direct,indirect -o two.exr");
    assert_ne!(bench.picture("two.exr").rgb, bench.picture("whole.exr").rgb);
}

#[test]
fn regions_have_the_bits_of_the_whole() {
    let bench = Bench::new();
    bench.render("--spp 20 -o whole.exr");
    bench.render("--spp 20 --region 3,2,9,9 --region 5,5,20,16 -o part.exr -o part.png");
    let (whole, part) = (bench.picture("whole.exr"), bench.picture("part.exr"));
    assert_eq!(part.size, [24, 16]);
    let mut inside = 0;
    for i in 0..whole.rgb.len() {
        let (x, y) = (i % 24, i / 24);
        let there = (3..9).contains(&x) && (2..9).contains(&y) || (5..20).contains(&x) && y >= 5;
        assert_eq!(
            part.alpha[i],
            f32::from(u8::from(there)),
            "alpha at {x}, {y}"
        );
        if there {
            inside += 1;
            let bits = |p: &Picture| p.rgb[i].map(f32::to_bits);
            assert_eq!(bits(&part), bits(&whole), "pixel {x}, {y}");
        }
    }
    assert_eq!(inside, 6 * 7 + 15 * 11 - 4 * 4);
}

#[test]
fn a_resumed_film_has_the_bits_of_one_run() {
    let bench = Bench::new();
    bench.render("--spp 50 --film cut.npz -o a.png --seed 3");
    // The seed comes from the film.
    bench.render("--spp 51 --film cut.npz -o a.png");
    bench.render("--spp 300 --film cut.npz -o cut.exr");
    bench.render("--spp 300 --film one.npz -o one.exr --seed 3");
    let (cut, one) = (bench.film("cut.npz"), bench.film("one.npz"));
    assert_eq!(cut.coverage.samples(), (300, 300));
    for y in 0..16 {
        for x in 0..24 {
            assert_eq!(cut.total(x, y), one.total(x, y), "pixel {x}, {y}");
        }
    }
    assert_eq!(bench.picture("cut.exr").rgb, bench.picture("one.exr").rgb);
}

#[cfg(unix)]
#[test]
fn an_interrupted_film_is_resumed_with_the_same_bits() {
    let bench = Bench::new();
    interrupted(&bench, "-INT");
    let held = bench.film("f.npz").coverage.samples().1;
    let spp = held + 10;
    bench.render(&format!("--spp {spp} --film f.npz -o a.exr"));
    bench.render(&format!("--spp {spp} -o b.exr"));
    assert_eq!(bench.picture("a.exr").rgb, bench.picture("b.exr").rgb);
}

#[test]
fn slices_merge_to_the_single_run_in_any_order() {
    let bench = Bench::new();
    bench.render("--spp 600 --film one.npz -o one.exr");
    for (name, range) in [("a", "0..256"), ("b", "256..512"), ("c", "512..600")] {
        bench.render(&format!(
            "--samples {range} --film {name}.npz -o {name}.exr"
        ));
    }
    bench.run("merge whole.npz c.npz a.npz b.npz").success();
    bench.run("develop whole.npz -o whole.exr").success();
    let (whole, one) = (bench.film("whole.npz"), bench.film("one.npz"));
    assert_eq!(whole.coverage, one.coverage);
    for y in 0..16 {
        for x in 0..24 {
            let (a, b) = (whole.total(x, y), one.total(x, y));
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                // The order of f64 additions differs.
                assert!((a - b).abs() <= 1e-12 * b.abs(), "pixel {x}, {y}: {a} {b}");
            }
        }
    }
    let off = difference(
        &bench.picture("whole.exr").rgb,
        &bench.picture("one.exr").rgb,
    );
    assert!(off < 1e-6, "off by {off}");
}

#[test]
fn merge_names_films_that_do_not_fit() {
    let bench = Bench::new();
    bench.render("--samples 0..8 --film a.npz -o a.png");
    bench.render("--samples 4..12 --film b.npz -o a.png");
    bench.render("--samples 20..24 --film c.npz -o a.png");
    bench.render("--samples 8..12 --film d.npz -o a.png --seed 1");
    bench
        .run("merge out.npz a.npz b.npz")
        .code(2)
        .stderr(says("b.npz"));
    bench
        .run("merge out.npz a.npz d.npz")
        .code(2)
        .stderr(says("seed"));
    assert!(!bench.path("out.npz").exists());
    bench
        .run("merge out.npz a.npz c.npz")
        .success()
        .stderr(says("warning: ").and(says("8..20")));
    bench
        .run("merge out.npz a.npz c.npz")
        .code(4)
        .stderr(says("merge never overwrites a film"));
}

#[test]
fn a_film_of_another_scene_is_refused_and_untouched() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let before = fs::read(bench.path("f.npz")).unwrap();
    for (flags, what) in [
        ("--size 12x8", "size"),
        ("--seed 9", "seed"),
        ("--strata 3", "strata"),
        ("--max-depth 3", "max_depth"),
        ("--light direct", "light"),
        ("--integrator whitted", "integrator"),
        ("--shadow-rays 2", "shadow_rays"),
    ] {
        bench
            .run(&format!(
                "render box.toml --backend cpu --spp 8 --film f.npz {flags}"
            ))
            .code(2)
            .stderr(says("f.npz").and(says(what)))
            .stderr(says(&format!(
                "leave out {}, or name another film",
                flags.split(' ').next().unwrap()
            )));
    }
    fs::write(bench.path("other.toml"), SCENE.replace("0.45", "0.46")).unwrap();
    bench
        .run("render other.toml --backend cpu --spp 8 --film f.npz")
        .code(2)
        .stderr(says("scene"));
    assert_eq!(fs::read(bench.path("f.npz")).unwrap(), before);

    // Comments and layout are not the scene.
    fs::write(bench.path("same.toml"), format!("# a comment\n{SCENE}")).unwrap();
    bench
        .run("render same.toml --backend cpu --spp 8 --film f.npz -o a.png")
        .success();
}

#[test]
fn a_film_of_a_region_refuses_other_regions() {
    let bench = Bench::new();
    bench.render("--spp 4 --region 0,0,8,8 --film f.npz -o a.png");
    bench
        .run("render box.toml --backend cpu --spp 8 --film f.npz --region 4,4,12,12")
        .code(2)
        .stderr(says("0,0,8,8"));
}

/// A film brings its settings along: nothing needs to be said twice.
#[test]
fn a_film_is_resumed_without_its_flags() {
    let bench = Bench::new();
    let flags =
        "--size 20x14 --seed 7 --strata 1 --max-depth 3 --light direct,indirect --shadow-rays 2";
    for more in [
        "",
        " --adaptive",
        " --region 2,3,9,8",
        " --region 2,3,9,8 --region 12,9,15,12",
        " --region 2,3,9,8 --adaptive",
    ] {
        bench.render(&format!("--spp 64 {flags}{more} --film whole.npz -o a.png"));
        bench.render(&format!("--spp 20 {flags}{more} --film f.npz -o a.png"));
        bench.render("--spp 64 --film f.npz -o a.png");
        let [whole, resumed] = ["whole.npz", "f.npz"].map(|f| bench.film(f));
        assert!(whole == resumed, "{more}");
        for film in ["whole.npz", "f.npz"] {
            fs::remove_file(bench.path(film)).unwrap();
        }
    }
}

/// What the scene file says since is not passed over.
#[test]
fn a_changed_scene_file_does_not_resume_another_film() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let changed = SCENE.replace("resolution = [24, 16]", "resolution = [12, 8]");
    assert_ne!(changed, SCENE);
    fs::write(bench.path("changed.toml"), changed).unwrap();
    bench
        .run("render changed.toml --backend cpu --spp 8 --film f.npz")
        .code(2)
        .stderr(says(
            "size is 24x16 and 12x8; add --size 24x16, or name another film",
        ));
    bench
        .run("render changed.toml --backend cpu --spp 8 --film f.npz --size 24x16")
        .success();
    // A flag that contradicts, and a value of the file.
    let changed = SCENE.replace("[camera]", "[render]\nseed = 3\n\n[camera]");
    fs::write(bench.path("changed.toml"), changed).unwrap();
    bench
        .run("render changed.toml --backend cpu --spp 9 --film f.npz --size 8x8")
        .code(2)
        .stderr(says(
            "leave out --size and add --seed 0, or name another film",
        ));
    bench
        .run("render changed.toml --backend cpu --spp 9 --film f.npz --seed 0")
        .success();
}

#[test]
fn a_damaged_film_is_refused() {
    let bench = Bench::new();
    bench.render("--spp 4 --film f.npz -o a.png");
    let bytes = fs::read(bench.path("f.npz")).unwrap();
    fs::write(bench.path("f.npz"), &bytes[..bytes.len() / 2]).unwrap();
    for args in [
        "render box.toml --backend cpu --spp 8 --film f.npz",
        "develop f.npz -o b.png",
        "merge out.npz f.npz",
    ] {
        bench.run(args).code(2).stderr(says("f.npz"));
    }
    assert!(!bench.path("b.png").exists() && !bench.path("out.npz").exists());
}

#[test]
fn only_the_requested_files_are_written() {
    let bench = Bench::new();
    bench.render("--spp 1 -o only.png");
    assert_eq!(bench.names(), ["box.toml", "only.png"]);
}

/// A lamp over a floor with a glass ball.
const GLASS: &str = "
[camera]
eye = [0, 1, 3]
look_at = [0, 0.5, 0]
vfov = 45
resolution = [40, 30]
[material.white]
type = 'diffuse'
reflectance = [0.7, 0.7, 0.7]
[material.glass]
type = 'dielectric'
ior = 1.5
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = 'white'
[[sphere]]
center = [0, 0.6, 0]
radius = 0.5
material = 'glass'
[[light]]
center = [0.5, 2.5, 0]
normal = [0, -1, 0]
radius = 0.3
radiance = [20, 18, 15]
";

#[test]
fn light_paths_bring_the_same_however_a_film_is_cut() {
    let bench = Bench::new();
    fs::write(bench.path("glass.toml"), GLASS).expect("a scene file");
    let render =
        |args: &str| bench.run(&format!("render glass.toml --backend gpu -o a.exr {args}"));
    render("--spp 600 --film one.npz").success();
    render("--spp 50 --film cut.npz").success();
    render("--spp 600 --film cut.npz").success();
    render("--samples 0..256 --film a.npz").success();
    render("--samples 256..600 --film b.npz").success();
    bench.run("merge slices.npz b.npz a.npz").success();
    render("--spp 600 --region 0,0,40,11 --film upper.npz").success();
    render("--spp 600 --region 0,11,40,30 --film lower.npz").success();
    bench.run("merge regions.npz lower.npz upper.npz").success();
    let one = bench.film("one.npz");
    let of_one = one.splats().expect("light paths");
    assert!(of_one.sums().iter().flatten().flatten().any(|s| *s > 0));
    for name in ["cut", "slices", "regions"] {
        let film = bench.film(&format!("{name}.npz"));
        let splats = film.splats().expect("light paths");
        assert!(splats.sums() == of_one.sums(), "{name}");
        assert_eq!(splats.coverage.total(), of_one.coverage.total(), "{name}");
    }
    // Time and signals end a film at samples that another run can have too.
    render("--time 300ms --film timed.npz").success();
    let timed = bench.film("timed.npz");
    let (samples, most) = timed.coverage.samples();
    assert_eq!(samples, most, "tiles of one picture end together");
    render(&format!("--spp {samples} --film counted.npz")).success();
    assert!(bench.film("counted.npz").splats() == timed.splats());
    let rest = format!("--samples {samples}..{} --film rest.npz", samples + 8);
    render(&rest).success();
    bench.run("merge more.npz rest.npz timed.npz").success();

    // Adaptive runs have as many passes as samples on average, whatever led there.
    render("--adaptive --spp 100 --film once.npz").success();
    render("--adaptive --spp 40 --film twice.npz").success();
    render("--adaptive --spp 100 --film twice.npz").success();
    assert!(bench.film("once.npz").splats() == bench.film("twice.npz").splats());

    // What does not fit is refused, and says what to do.
    render("--spp 601 --film one.npz --light-paths off")
        .code(2)
        .stderr(says("leave out --light-paths"));
    bench
        .run("render glass.toml --backend cpu --spp 601 --film one.npz -o a.exr")
        .code(2)
        .stderr(says("light paths, which the CPU reference does not trace"));
    render("--spp 4 --light-paths off --film off.npz").success();
    bench
        .run("merge x.npz one.npz off.npz")
        .code(2)
        .stderr(says("light_paths is traced and off"));
    bench
        .run("info off.npz")
        .success()
        .stdout(says("light_paths                 off"));
}
