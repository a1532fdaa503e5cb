//! `etendue compare`: its verdicts, its errors, and its page in a real browser.

mod others;
#[path = "../output_support/mod.rs"]
mod output_support;
mod page;

use assert_cmd::Command;
use etendue::compare::flip::{PIXELS_PER_DEGREE, flip};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::output::store;
use etendue::output::{ExrChannels, read_exr, write_exr, write_png};
use output_support::{Random, described};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const SIZE: [u32; 2] = [40, 32];

fn etendue() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
}

/// A film of 64 samples per pixel: every replicate's mean is `light` of the pixel, give or take half of it.
fn noisy(size: [u32; 2], bounds: Rect, seed: u64, light: impl Fn(u32, u32) -> f64) -> Film {
    let mut random = Random(seed);
    let mut film = Film::new(size, bounds, 2);
    let pixels = (0..bounds.area() as u32).map(|i| {
        let (x, y) = (
            bounds.x0 + i % bounds.width(),
            bounds.y0 + i / bounds.width(),
        );
        [(); 4].map(|()| {
            [1.0, 0.7, 0.4, 1.0].map(|c| {
                let noise = 0.5 + random.below(1 << 20) as f64 / f64::from(1 << 20);
                16.0 * c * noise * light(x, y)
            })
        })
    });
    let pixels = pixels.collect();
    film.put_samples(bounds, 0..64, pixels);
    film
}

fn whole(seed: u64, light: impl Fn(u32, u32) -> f64) -> Film {
    noisy(SIZE, Rect::whole(SIZE), seed, light)
}

/// A folder with pictures to compare.
struct Pictures(TempDir);

impl Pictures {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, film: &Film) -> PathBuf {
        let path = self.path(name);
        let provenance = described(film);
        match path.extension().and_then(|e| e.to_str()) {
            Some("exr") => write_exr(&path, film, &provenance, ExrChannels::All),
            Some("png") => write_png(&path, film, &provenance, 0.0),
            _ => store::save(&path, film, &provenance),
        }
        .expect("written");
        path
    }
}

fn run(a: &Path, b: &Path, flags: &[&str]) -> assert_cmd::assert::Assert {
    etendue().arg("compare").arg(a).arg(b).args(flags).assert()
}

/// A block of 8 x 8 pixels that is a third brighter.
fn patch(x: u32, y: u32) -> f64 {
    if (16..24).contains(&x) && (8..16).contains(&y) {
        1.33
    } else {
        1.0
    }
}

#[test]
fn noise_is_equal_and_a_patch_is_different() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 1.0));
    let b = p.put("b.npz", &whole(2, |_, _| 1.0));
    let c = p.put("c.exr", &whole(3, patch));
    run(&a, &b, &[])
        .code(0)
        .stdout(contains(
            "equal up to noise (false-alarm rate 0.001); would have detected a change of the whole picture's brightness by",
        ))
        .stdout(
            contains("relative RMSE")
                .and(contains("mean FLIP"))
                .and(contains("PSNR")),
        );
    run(&a, &c, &[])
        .code(1)
        .stdout(contains("different in ").and(contains("pixels at (16, 8)")));
    // Limits don't override the verdict, and they also count if there is a verdict.
    run(&a, &c, &["--max-flip", "1"]).code(1);
    run(&a, &b, &["--max-relative-rmse", "0.1%"])
        .code(1)
        .stdout(contains("different by the given limits (relative RMSE is "))
        .stdout(contains("as a difference; without them: equal up to noise"));
    run(&a, &c, &["--max-relative-rmse", "0.1%"])
        .code(1)
        .stdout(contains("different in ").and(contains(
            "; also different by the given limits (relative RMSE is ",
        )));
    // Small rates are printed with few digits.
    run(&a, &b, &["--alpha", "1e-300"])
        .code(0)
        .stdout(contains("(false-alarm rate 1e-300)"));
    let copy = p.path("copy.exr");
    std::fs::copy(&a, &copy).expect("copied");
    run(&a, &copy, &[])
        .code(0)
        .stdout(contains("bit-identical").and(contains("both were rendered with seed")));
}

/// One render twice is no second measurement.
#[test]
fn a_film_and_its_own_picture_are_no_evidence() {
    let p = Pictures::new();
    let film = whole(1, |x, _| 0.1 + f64::from(x));
    let (a, b) = (p.put("a.exr", &film), p.put("a.npz", &film));
    let no_evidence = "the same samples, equal but for the rounding of files: no evidence";
    run(&a, &b, &[]).code(0).stdout(contains(no_evidence));
    // Another render of the same seed is another picture.
    let c = p.put("c.npz", &whole(2, |x, _| 0.1 + f64::from(x)));
    run(&a, &c, &[]).code(0).stdout(
        contains("equal up to noise")
            .and(contains("both were rendered with seed"))
            .and(contains(no_evidence).not()),
    );
}

#[test]
fn a_film_and_its_picture_say_the_same() {
    let p = Pictures::new();
    let (film, other) = (whole(1, |_, _| 1.0), p.put("b.exr", &whole(3, patch)));
    let said = ["a.exr", "a.npz"].map(|name| {
        let output = run(&p.put(name, &film), &other, &[]).code(1);
        String::from_utf8(output.get_output().stdout.clone()).expect("text")
    });
    assert_eq!(said[0], said[1]);
}

#[test]
fn a_report_has_the_verdict_for_scripts() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 1.0));
    let c = p.put("c.exr", &whole(3, patch));
    let output = run(&a, &c, &["--report", "-"])
        .code(1)
        .stderr(contains("different in "));
    let json: serde_json::Value =
        serde_json::from_slice(&output.get_output().stdout).expect("JSON and nothing else");
    assert_eq!(
        (&json["same"], &json["identical"]),
        (&false.into(), &false.into())
    );
    assert!(
        json["sentence"]
            .as_str()
            .is_some_and(|s| s.starts_with("different in "))
    );
    let finding = &json["verdict"]["findings"][0];
    assert!(finding["rect"]["x0"].as_u64().is_some_and(|x| x >= 16) && finding["whole"] == false);
    let [before, after] = [0, 1].map(|k| finding["means"][k].as_f64().expect("a number"));
    assert!(after > before && finding["p"].as_f64() < json["verdict"]["alpha"].as_f64());
    assert!(json["metrics"]["relative_rmse"].as_f64() > Some(0.0) && json["notes"].is_array());
    // Without errors there is no verdict.
    let b = p.put("b.png", &whole(2, |_, _| 0.5));
    let file = p.path("report.json");
    let flags = [
        "--max-flip",
        "1",
        "--report",
        file.to_str().expect("a name"),
    ];
    run(&a, &b, &flags).code(0);
    let text = std::fs::read(&file).expect("a report");
    let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    assert!(json["verdict"].is_null() && json["same"] == true);
    run(&a, &b, &["--report", a.to_str().expect("a name")])
        .code(2)
        .stderr(contains("would overwrite"));
}

#[test]
fn pictures_of_other_programs_are_read() {
    let p = Pictures::new();
    let film = whole(1, |_, _| 0.5);
    let a = p.put("a.png", &film);
    let picture = image::open(&a).expect("a picture").to_rgb8();
    for (name, format) in [
        ("b.tif", image::ImageFormat::Tiff),
        ("b.webp", image::ImageFormat::WebP),
        ("tiff", image::ImageFormat::Tiff),
    ] {
        let b = p.path(name);
        picture.save_with_format(&b, format).expect("written");
        run(&a, &b, &["--max-relative-rmse", "0.01%"]).code(0);
        etendue()
            .arg("info")
            .arg(&b)
            .assert()
            .code(0)
            .stdout(contains("picture of another program, 40x32"));
    }
    let b = p.path("b.jpg");
    picture
        .save_with_format(&b, image::ImageFormat::Jpeg)
        .expect("written");
    run(&a, &b, &["--max-flip", "0.2"]).code(0);
    run(&a, &b, &["--max-flip", "0"]).code(1);
    std::fs::write(p.path("cut.jpg"), &std::fs::read(&b).expect("there")[..300]).expect("written");
    run(&a, &p.path("cut.jpg"), &["--max-flip", "1"])
        .code(2)
        .stderr(contains("cut.jpg: invalid picture: "));
    run(&a, &p.path("none.tif"), &["--max-flip", "1"])
        .code(4)
        .stderr(contains("none.tif"));
}

#[test]
fn pictures_without_noise_need_limits() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 0.5));
    let b = p.put("b.png", &whole(2, |_, _| 0.5));
    run(&a, &b, &[])
        .code(2)
        .stderr(contains("b.png does not state its noise").and(contains("--max-flip")));
    run(&a, &b, &["--max-flip", "0.9"])
        .code(0)
        .stdout(contains("within the limits"));
    run(
        &a,
        &b,
        &["--max-flip", "0.001", "--max-relative-rmse", "1%"],
    )
    .code(1)
    .stdout(contains("mean FLIP is").and(contains("relative RMSE is")));
    // One replicate is no error: four samples of 2 x 2 strata are one round.
    let mut film = Film::new(SIZE, Rect::whole(SIZE), 2);
    let pixels = vec![[[1.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]]; 40 * 32];
    film.put_samples(Rect::whole(SIZE), 0..4, pixels);
    run(&a, &p.put("one.exr", &film), &[])
        .code(2)
        .stderr(contains("one.exr does not state its noise"));
}

#[test]
fn bad_input_is_named() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 1.0));
    let small = noisy([8, 8], Rect::whole([8, 8]), 2, |_, _| 1.0);
    run(&a, &p.put("small.exr", &small), &[])
        .code(2)
        .stderr(contains("40 x 32 pixels").and(contains("8 x 8")));
    let part = Rect {
        x0: 3,
        y0: 2,
        ..Rect::whole(SIZE)
    };
    let region = noisy(SIZE, part, 2, |_, _| 1.0);
    run(&a, &p.put("region.exr", &region), &[])
        .code(2)
        .stderr(contains("pixel (0, 0) has samples in").and(contains("none in")));
    let empty = Film::new(SIZE, Rect::whole(SIZE), 2);
    run(&a, &p.put("empty.exr", &empty), &[])
        .code(2)
        .stderr(contains(
            "empty.exr: no pixel has samples, so there is nothing to compare",
        ));
    run(&p.put("empty.npz", &empty), &a, &[])
        .code(2)
        .stderr(contains(
            "empty.npz: no pixel has samples, so there is nothing to compare",
        ));

    let mut bytes = std::fs::read(&a).expect("there");
    bytes.truncate(bytes.len() / 2);
    std::fs::write(p.path("cut.exr"), &bytes).expect("written");
    run(&a, &p.path("cut.exr"), &[])
        .code(2)
        .stderr(contains("cut.exr"));
    std::fs::write(p.path("text.png"), "no picture").expect("written");
    run(&a, &p.path("text.png"), &["--max-flip", "1"])
        .code(2)
        .stderr(contains(
            "text.png: not a PNG picture (text, such as a scene file)",
        ));
    run(&a, &p.path("none.exr"), &[])
        .code(4)
        .stderr(contains("none.exr: cannot read: no such file"));
    std::fs::write(p.path("a.bmp"), "x").expect("written");
    run(&a, &p.path("a.bmp"), &[]).code(2).stderr(contains(
        "not a picture that etendue reads (.exr, .png, .hdr, .jpg, .tif, .webp, or .npz film)",
    ));
    std::fs::write(p.path("a.tiff"), "x").expect("written");
    run(&a, &p.path("a.tiff"), &[]).code(2).stderr(contains(
        "a.tiff: not a picture (by its first bytes no HDR, JPEG, TIFF or WebP file)",
    ));
    run(&a, &a, &["--alpha", "0"]).code(2);
    run(&a, &a, &["--html", "/nowhere/x.html"]).code(4);
}

#[test]
fn nan_is_named_for_every_kind_of_picture() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 1.0));
    let nan = whole(2, |x, y| if (x, y) == (7, 5) { f64::NAN } else { 1.0 });
    let path = p.path("nan.npz");
    store::save(&path, &nan, &described(&nan)).expect("written");
    let said = run(&a, &path, &[]).code(2);
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("nan.npz"), "{said}");
    // Our own EXR files never hold one; a foreign one is refused by the reader.
    assert!(read_exr(&p.put("nan.exr", &nan)).is_ok());
}

/// The values are those of the authors' own flip-evaluator 1.7 (LDR, default pixels per degree).
#[test]
fn flip_equals_the_authors_implementation() {
    let (w, h) = (24u32, 18u32);
    let mut a = Vec::new();
    let mut b = Vec::new();
    for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
        let p = [
            (f64::from(x) + 0.5) / f64::from(w),
            (f64::from(y) + 0.5) / f64::from(h),
            f64::from((3 * x + 5 * y) % 7) / 7.0,
        ];
        let mut q = p;
        if (4..9).contains(&y) && (5..12).contains(&x) {
            q = q.map(|v| 0.5 * v);
        }
        if (x + y) % 5 == 0 {
            q[2] = 0.9;
        }
        if (x, y) == (18, 12) {
            q = [1.0; 3];
        }
        a.push(p);
        b.push(q);
    }
    let map = flip([w, h], &a, &b, PIXELS_PER_DEGREE);
    let mean = map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64;
    assert!((mean - 0.303_573).abs() < 2e-4, "mean {mean}");
    for (x, y, expected) in [
        (0, 0, 0.582_542),
        (6, 6, 0.624_328),
        (18, 12, 0.332_570),
        (23, 17, 0.644_065),
        (14, 9, 0.285_660),
    ] {
        let found = map[(y * w + x) as usize];
        assert!(
            (found - expected).abs() < 1e-3,
            "({x}, {y}): {found}, not {expected}"
        );
    }
    assert!(
        flip([w, h], &a, &a, PIXELS_PER_DEGREE)
            .iter()
            .all(|v| *v == 0.0)
    );
}
