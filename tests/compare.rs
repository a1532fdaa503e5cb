//! `etendue compare`: its verdicts, its errors, and its page in a real browser.

mod output_support;

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

/// EXR files of another program, which states no noise: four renders of each side.
#[test]
fn renders_of_any_program_state_their_noise_by_their_spread() {
    let p = Pictures::new();
    let put = |name: &str, seed: u64, light: &dyn Fn(u32, u32) -> f64| {
        let path = p.path(name);
        let film = whole(seed, light);
        write_exr(&path, &film, &described(&film), ExrChannels::Rgb).expect("written");
        path
    };
    let side = |name: &str, seed: u64, light: &dyn Fn(u32, u32) -> f64| -> Vec<PathBuf> {
        (0..4)
            .map(|k| put(&format!("{name}{k}.exr"), seed + k, light))
            .collect()
    };
    let compare = |a: &[PathBuf], b: &[PathBuf], more: &[&str]| {
        let mut command = etendue();
        command.arg("compare").args(more);
        command.arg("--a").args(a).arg("--b").args(b).assert()
    };
    let (a, b, c) = (
        side("a", 10, &|_, _| 1.0),
        side("b", 20, &|_, _| 1.0),
        side("c", 30, &patch),
    );
    compare(&a, &b, &[])
        .code(0)
        .stdout(contains("equal up to noise"));
    compare(&a, &c, &[])
        .code(1)
        .stdout(contains("pixels at (16, 8)"));
    // A film of ours against renders of another program: what a sample is differs.
    let ours = p.put("ours.npz", &whole(1, |_, _| 1.0));
    let brighter = p.put("brighter.npz", &whole(1, patch));
    compare(std::slice::from_ref(&ours), &b, &[]).code(0);
    compare(&[brighter], &b, &[])
        .code(1)
        .stdout(contains("pixels at (16, 8)"));
    // The mean and its error, of one pixel by hand.
    let read = |path: &PathBuf| f64::from(read_exr(path).expect("a picture").rgb[5][0]);
    let values: Vec<f64> = a.iter().map(read).collect();
    let mean = values.iter().sum::<f64>() / 4.0;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let picture = etendue::compare::Picture::read_renders(&a, None).expect("a picture");
    let error = picture.noise.as_ref().expect("its noise").error[5][0];
    assert!(
        (picture.rgb[5][0] - mean).abs() < 1e-12 && (error - (squares / 12.0).sqrt()).abs() < 1e-12
    );
    // Renders that are not independent, or do not fit.
    compare(&a, &[b[0].clone(), a[2].clone()], &[])
        .code(2)
        .stderr(contains("a2.exr is a render of both sides"));
    std::fs::copy(&b[0], &b[1]).expect("copied");
    compare(&a, &b, &[])
        .code(2)
        .stderr(contains("b1.exr: every pixel is that of ").and(contains("must be independent")));
    let small = p.put(
        "small.exr",
        &noisy([4, 4], Rect::whole([4, 4]), 1, |_, _| 1.0),
    );
    compare(&a, &[b[0].clone(), small], &[])
        .code(2)
        .stderr(contains("small.exr: it has 4 x 4 pixels, but ").and(contains(" has 40 x 32")));
    // One render says nothing of its noise.
    compare(&a, &b[2..3], &[])
        .code(2)
        .stderr(contains("does not state its noise"));
    etendue()
        .arg("compare")
        .arg("--a")
        .args(&a)
        .assert()
        .code(2)
        .stderr(contains("--b"));
    etendue()
        .arg("compare")
        .arg(&a[0])
        .assert()
        .code(2)
        .stderr(contains("<B>"));
}

/// What another renderer writes of `spp` samples of each pixel, each of them `light` times a grey from 0.5 to 1.5: the sums of
/// samples and of their squares in each pixel.
fn sampled(spp: u32, seed: u64, light: impl Fn(u32, u32) -> f64) -> Vec<[f64; 2]> {
    let mut random = Random(seed);
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| {
        let mean = light(i % SIZE[0], i / SIZE[0]);
        let samples =
            (0..spp).map(|_| mean * (0.5 + random.below(1 << 20) as f64 / f64::from(1 << 20)));
        samples.fold([0.0, 0.0], |[s, q], v| [s + v, q + v * v])
    });
    pixels.collect()
}

/// An EXR file of these channels, with the header's entry `samplesPerPixel` if that is given.
fn write_foreign(path: &Path, channels: &[(&str, Vec<f32>)], spp: Option<i32>) {
    use exr::prelude::*;
    let list = channels
        .iter()
        .map(|(name, values)| AnyChannel::new(*name, FlatSamples::F32(values.clone())));
    let mut attributes = LayerAttributes::default();
    if let Some(spp) = spp {
        let entry = (Text::from("samplesPerPixel"), AttributeValue::I32(spp));
        attributes.other.extend([entry]);
    }
    let size = (SIZE[0] as usize, SIZE[1] as usize);
    let layer = Layer::new(
        size,
        attributes,
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(list.collect()),
    );
    Image::from_layer(layer)
        .write()
        .to_file(path)
        .expect("written");
}

/// As Mitsuba's integrator `moment` writes it around one that is named `inside`.
fn write_moments(path: &Path, spp: u32, pixels: &[[f64; 2]]) {
    let plane =
        |f: &dyn Fn(&[f64; 2]) -> f64| -> Vec<f32> { pixels.iter().map(|p| f(p) as f32).collect() };
    let mean = plane(&|p| p[0] / f64::from(spp));
    let square = plane(&|p| p[1] / f64::from(spp));
    let channels =
        ["R", "G", "B", "inside.X", "inside.Y", "inside.Z"].map(|name| (name, mean.clone()));
    let squares = ["m2_inside.X", "m2_inside.Y", "m2_inside.Z"].map(|name| (name, square.clone()));
    write_foreign(path, &[&channels[..], &squares].concat(), None);
}

/// As pbrt's film `gbuffer` writes it.
fn write_variance(path: &Path, spp: u32, pixels: &[[f64; 2]]) {
    let n = f64::from(spp);
    let plane =
        |f: &dyn Fn(&[f64; 2]) -> f64| -> Vec<f32> { pixels.iter().map(|p| f(p) as f32).collect() };
    let mean = plane(&|p| p[0] / n);
    let variance = plane(&|p| (p[1] - p[0] * p[0] / n) / (n - 1.0));
    let channels = ["R", "G", "B"].map(|name| (name, mean.clone()));
    let variances = ["Variance.R", "Variance.G", "Variance.B"].map(|name| (name, variance.clone()));
    write_foreign(
        path,
        &[&channels[..], &variances].concat(),
        Some(spp as i32),
    );
}

#[test]
fn variances_of_other_renderers_are_noise() {
    let p = Pictures::new();
    let (a, same, other) = (p.path("a.exr"), p.path("same.exr"), p.path("other.exr"));
    write_moments(&a, 64, &sampled(64, 1, |_, _| 1.0));
    write_variance(&same, 32, &sampled(32, 2, |_, _| 1.0));
    write_moments(&other, 64, &sampled(64, 3, patch));
    // The error of a mean of 64 numbers that are even from 0.5 to 1.5, and of 32.
    for (path, spp, n) in [(&a, Some(64), 64.0f64), (&same, None, 32.0)] {
        let picture = etendue::compare::Picture::read_sampled(path, spp).expect("a picture");
        let noise = picture.noise.expect("its noise");
        let mean = noise.error.iter().map(|e| e[3] * e[3]).sum::<f64>() / noise.error.len() as f64;
        let right = 1.0 / (12.0 * n);
        assert!(
            (mean / right - 1.0).abs() < 0.02 && noise.luminance_alone,
            "{mean}, not {right}"
        );
        assert_eq!((noise.samples[0], noise.replicates), (n as u64, n as u32));
    }
    run(&a, &same, &["--spp-a", "64"])
        .code(0)
        .stdout(contains("equal up to noise").and(
            contains("note: ").and(contains("a.exr states the noise of its luminance alone")),
        ));
    run(&a, &other, &["--spp-a", "64", "--spp-b", "64"])
        .code(1)
        .stdout(contains("pixels at (16, 8)").and(contains(" Y ")));
    // A film states that too.
    let grey = |light: fn(u32, u32) -> f64| {
        let mut random = Random(9);
        let mut film = Film::new(SIZE, Rect::whole(SIZE), 2);
        let pixels = (0..SIZE[0] * SIZE[1]).map(|i| {
            let sum = || {
                16.0 * light(i % SIZE[0], i / SIZE[0])
                    * (0.9 + 0.2 * random.below(1 << 20) as f64 / f64::from(1 << 20))
            };
            [(); 4].map({
                let mut sum = sum;
                move |()| {
                    let s = sum();
                    [s, s, s, s * s]
                }
            })
        });
        let pixels = pixels.collect();
        film.put_samples(Rect::whole(SIZE), 0..64, pixels);
        film
    };
    let film = p.put("film.npz", &grey(|_, _| 1.0));
    run(&film, &same, &[])
        .code(0)
        .stdout(contains("equal up to noise"));
    run(&p.put("patch.npz", &grey(patch)), &same, &[])
        .code(1)
        .stdout(contains("pixels at (16, 8)"));
    // Without the number of samples nothing is known.
    run(&a, &same, &[])
        .code(2)
        .stderr(contains("a.exr does not state its noise").and(contains("--spp-a")));
    run(&a, &same, &["--spp-a", "1"])
        .code(2)
        .stderr(contains("does not state its noise"));
    run(&a, &same, &["--spp-a", "0"])
        .code(2)
        .stderr(contains("--spp-a"));
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

/// What Chromium makes of a page: its elements after the scripts have run, and a screenshot.
struct Browser(String);

impl Browser {
    /// Without a browser this fails, unless ETENDUE_SKIP_BROWSER=1 asks for the check to be left out.
    fn find() -> Option<Self> {
        if std::env::var_os("ETENDUE_SKIP_BROWSER").is_some_and(|v| v == "1") {
            eprintln!("ETENDUE_SKIP_BROWSER=1: not looked at in a browser");
            return None;
        }
        Some(Self(
            std::env::var("ETENDUE_BROWSER").unwrap_or("chromium".into()),
        ))
    }

    fn run(&self, flags: &[&str], url: &str) -> Vec<u8> {
        let profile = tempfile::tempdir().expect("a temporary folder");
        let output = std::process::Command::new(&self.0)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(flags)
            .arg(url)
            .output();
        let output = output.unwrap_or_else(|e| {
            panic!(
                "{}: {e}; set ETENDUE_BROWSER, or ETENDUE_SKIP_BROWSER=1",
                self.0
            )
        });
        assert!(output.status.success(), "{output:?}");
        output.stdout
    }

    fn elements(&self, url: &str) -> String {
        String::from_utf8(self.run(&["--dump-dom"], url)).expect("text")
    }

    fn screenshot(&self, url: &str, flags: &[&str]) -> image::RgbImage {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("shot.png");
        let shot = format!("--screenshot={}", path.display());
        self.run(&[&[shot.as_str()], flags].concat(), url);
        image::open(&path).expect("a screenshot").to_rgb8()
    }
}

/// The part of the page's text from `from` to the next `to`.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let start = text.find(from).unwrap_or_else(|| panic!("no {from}")) + from.len();
    let end = text[start..].find(to).unwrap_or_else(|| panic!("no {to}"));
    &text[start..start + end]
}

#[test]
fn the_page_is_self_contained_and_works_in_a_browser() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 0.4));
    let b = p.put("b<i>.exr", &whole(3, |x, y| 0.4 * patch(x, y)));
    let page = p.path("report.html");
    let name = page.to_str().expect("UTF-8");
    run(&a, &b, &["--html", name]).code(1);
    let text = std::fs::read_to_string(&page).expect("written");
    for outside in ["http:", "https:", "<link", "@import", "url("] {
        assert!(!text.contains(outside), "{outside} in the page");
    }
    assert!(!text.contains("b<i>") && !text.contains("{{"));
    for told in [
        "pixels at (16, 8)",
        "scene_hash",
        "llvmpipe",
        "mean FLIP",
        "<rect x=\"16\" y=\"8\"",
    ] {
        assert!(text.contains(told), "no {told} in the page");
    }

    let Some(browser) = Browser::find() else {
        return;
    };
    let url = format!("file://{name}");
    // The script shows what the fragment names, under its own legend.
    for (view, shown) in [
        ("slide", "Picture A"),
        ("b", "Picture B"),
        ("difference", "Difference B - A"),
        ("score", "Difference over its noise"),
        ("flip", "FLIP map"),
    ] {
        let elements = browser.elements(&format!("{url}#{view}"));
        let under = between(&elements, "<img id=\"under\"", ">");
        assert!(
            under.contains(&format!("alt=\"{shown}\"")),
            "{view} shows {under}"
        );
        let legend = between(&elements, &format!("<div data-for=\"{view}\""), ">");
        assert!(!legend.contains("hidden"), "the legend of {view} is hidden");
    }
    // Light paper, dark paper; and on a phone nothing hangs over the right edge: its last column is paper.
    let phone = "--window-size=500,900";
    let dark = "--blink-settings=preferredColorScheme=0";
    let light = browser.screenshot(&url, &[phone]);
    let night = browser.screenshot(&url, &[phone, dark]);
    let brightness = |i: &image::RgbImage| i.get_pixel(2, 2).0.map(u32::from).iter().sum::<u32>();
    assert!(brightness(&light) > 700, "{}", brightness(&light));
    assert!(brightness(&night) < 120, "{}", brightness(&night));
    for shot in [&light, &night] {
        let paper = shot.get_pixel(2, 2);
        let last = shot.width() - 1;
        assert!((0..shot.height()).all(|y| shot.get_pixel(last, y) == paper));
        let colours: std::collections::BTreeSet<_> = shot.pixels().map(|p| p.0).collect();
        assert!(colours.len() > 200, "a blank page");
    }
}
