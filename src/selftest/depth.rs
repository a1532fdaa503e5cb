//! Long paths and long sums.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, grey, plane, v};
use super::measure::{Measure, Tolerance};
use crate::film::coverage::Rect;
use crate::film::{BLOCK, Film, REPLICATES, Sums};
use crate::scene::Bsdf;
use crate::settings::Settings;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "31",
        name: "facing_mirrors",
        what: "the 100th image between facing mirrors of reflectance 0.99: drift",
        run: facing_mirrors,
    },
    Case {
        row: "37",
        name: "constant_pixel",
        what: "a pixel of radiance 0.1 with 2²⁴ samples (an adapter renders every 1000th block, since all are equal): f32 sums",
        run: constant_pixel,
    },
    Case {
        row: "38",
        name: "loop_trips",
        what: "more than 65 535 loop iterations, over many samples and in one path: some drivers silently stop there",
        run: loop_trips,
    },
];

/// Facing mirrors at distance 1, and a light that a path reaches after `images` reflections. With each crossing of the gap
/// the path moves by `step`.
fn corridor(reflectance: f64, images: u32, step: f64) -> Build {
    let dull = Bsdf::Mirror {
        reflectance: DVec3::splat(reflectance),
    };
    let eye = v(0.5, 0.0, 0.0);
    // The view is so narrow that all of it shows the same image.
    let vfov = 0.01 * step / f64::from(images);
    Build::new(eye, eye + v(1.0, 0.0, step), vfov)
        .size(8, 8)
        .add(plane(DVec3::ZERO, DVec3::X), dull)
        .add(plane(DVec3::X, -DVec3::X), dull)
        .light(v(0.5, 0.0, step * f64::from(images)), -DVec3::Z, 2.0, 1.0)
}

fn facing_mirrors(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let build = corridor(0.99, 100, 0.1).size(48, 36);
    let expected = 0.366_032;
    // Roulette leaves a path in 1 / 0.366 of them, with weight 1.
    let picture = b.picture_to(&build, &build.settings(), 0.98e-3 * expected)?;
    Ok(vec![Measure::sampled(
        "image 100",
        picture.mean(),
        expected,
        Tolerance::Sigmas { comparisons: 1 },
    )])
}

fn constant_pixel(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    const SAMPLES: u64 = 1 << 24;
    let build = Build::new(v(0.0, 0.0, 1.0), DVec3::ZERO, 40.0)
        .size(1, 1)
        .add(plane(v(0.0, 0.0, -1.0), DVec3::Z), grey(0.5))
        .light(DVec3::ZERO, DVec3::Z, 9.0, 0.1);
    let film = if b.open_gpu().is_some() {
        many_blocks(b, &build, SAMPLES / BLOCK)?
    } else {
        // The reference has no blocks: it adds sample after sample in f64.
        let settings = build.settings();
        let rect = Rect::whole(settings.size);
        let mut film = Film::new(settings.size, rect, settings.strata);
        let mut engine = b.engine(&build, &settings)?;
        engine.render(&mut film, rect, 0..SAMPLES, &b.stop_flag())?;
        film
    };
    let total: f64 = film.total(0, 0).iter().map(|s| s[0]).sum();
    Ok(vec![Measure::new(
        "mean of 2²⁴ samples",
        total / SAMPLES as f64,
        0.1,
        Tolerance::Relative(1e-6),
    )])
}

/// The film of one pixel after many blocks of samples. Only every 1000th block and the last are rendered, since for an adapter
/// the overhead of such a small submission is 1000 times its work. The other blocks have the same sums.
fn many_blocks(b: &Backend, build: &Build, blocks: u64) -> Result<Film, Trouble> {
    let settings = build.settings();
    let rect = Rect::whole(settings.size);
    let empty = || Film::new(settings.size, rect, settings.strata);
    let mut engine = b.engine(build, &settings)?;
    let mut film = empty();
    let mut block: [Sums<f32>; REPLICATES] = Default::default();
    for k in 0..blocks {
        let range = k * BLOCK..(k + 1) * BLOCK;
        if k % 1000 == 0 || k + 1 == blocks {
            let mut one = empty();
            engine.render(&mut one, rect, range.clone(), &b.stop_flag())?;
            // Of f32 numbers, so nothing is lost.
            let made = one.sums()[0].map(|s| s.map(|x| x as f32));
            if k > 0 && made != block {
                let why = format!("block {k} of a constant picture differs from block 0");
                return Err(Trouble::Unable(why));
            }
            block = made;
        }
        film.put_block(rect, range, |_, _| block);
    }
    Ok(film)
}

fn loop_trips(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // The steps are powers of two, so that any number of additions of them is exact. A perfect mirror leaves roulette
    // nothing to do on a GPU; the reference's ends one path in a hundred at every vertex, so it gets a shorter corridor.
    let gpu = b.open_gpu().is_some();
    let (reflectance, images) = if gpu { (1.0, 1000) } else { (0.99, 100) };
    let build = corridor(reflectance, images, (-10f64).exp2());
    let settings = build.settings();
    let at_once = b.picture(&build, &settings, 256)?;
    let mut one_by_one = b.picture(&build, &settings, 1)?;
    let mut engine = b.engine(&build, &settings)?;
    for spp in 2..=256 {
        one_by_one.go_on(engine.as_mut(), spp, &b.stop_flag())?;
    }
    let pairs = at_once.film.sums().iter().zip(one_by_one.film.sums());
    let mut measures = vec![Measure::none(
        "256 samples at once: pixels that differ from one at a time",
        pairs.filter(|(a, b)| a != b).count(),
    )];
    if !gpu {
        return Ok(measures);
    }
    measures.push(Measure::new(
        "256 000 mirrors in all",
        at_once.mean().mean,
        1.0,
        Tolerance::Relative(1e-5),
    ));
    let images = 70_000;
    let build = corridor(1.0, images, (-13f64).exp2());
    let settings = Settings {
        max_depth: images + 100,
        ..build.settings()
    };
    match b.picture(&build, &settings, 4) {
        Ok(picture) => measures.push(Measure::new(
            "70 000 mirrors in one path",
            picture.mean().mean,
            1.0,
            Tolerance::Relative(1e-5),
        )),
        // A picture cut short would be the failure. A kernel that counts its trips finds out while it renders.
        Err(Trouble::Unable(why) | Trouble::Device(why)) => measures.push(Measure::none(
            "70 000 mirrors in one path: refused for another reason than its loop iterations",
            usize::from(!why.contains("loop iterations")),
        )),
        Err(e) => return Err(e),
    }
    Ok(measures)
}
