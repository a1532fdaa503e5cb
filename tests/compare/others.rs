//! Pictures of other renderers, which state their noise by several renders, or by variances.

use super::*;

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
    let mut with_one = etendue();
    with_one.arg("compare").arg(&ours).arg("--b").args(&b);
    with_one
        .assert()
        .code(0)
        .stdout(contains("equal up to noise"));
    // A PNG picture ends at white.
    let bright = |k: u32| p.put(&format!("w{k}.png"), &whole(40 + u64::from(k), |_, _| 2.0));
    let whites: Vec<PathBuf> = (0..4).map(bright).collect();
    let linear = side("l", 50, &|_, _| 2.0);
    compare(&linear, &whites, &[]).code(1).stdout(
        contains("w0.png and 3 more ends at white, as 8-bit pictures do: ")
            .and(contains("of 1280 pixels are white in it and brighter in ")),
    );
    let dim = side("d", 60, &|_, _| 0.1);
    compare(&dim, &whites, &[])
        .code(1)
        .stdout(contains("ends at white").not());
    // The mean and its error, of one pixel by hand.
    let read = |path: &PathBuf| f64::from(read_exr(path).expect("a picture").rgb[5][0]);
    let values: Vec<f64> = a.iter().map(read).collect();
    let mean = values.iter().sum::<f64>() / 4.0;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let picture = etendue::compare::Side::read_renders(&a, None).expect("a picture");
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
        let picture = etendue::compare::Side::read_sampled(path, spp).expect("a picture");
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
