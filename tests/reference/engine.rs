//! The CPU engine: the film does not depend on how the work is cut.

use crate::build::*;
use etendue::engine::{Counters, Engine, EngineError, Part};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::reference::{CpuEngine, Estimator};
use etendue::settings::Settings;
use glam::DVec3;
use std::sync::atomic::AtomicBool;

fn scene() -> Build {
    small(v(0.0, 1.0, 5.0), DVec3::ZERO, 40.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        .add(sphere(v(0.0, 0.5, 0.0), 0.5), GLASS)
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 1.0, 1.0)
}

fn engine() -> CpuEngine {
    let scene = scene();
    let settings = Settings {
        strata: 2,
        ..scene.settings()
    };
    CpuEngine::new(scene.world(), settings, Estimator::LightSampling)
}

fn empty_film() -> Film {
    Film::new([8, 6], Rect::whole([8, 6]), 2)
}

static GO_ON: AtomicBool = AtomicBool::new(false);

#[test]
fn regions_and_ranges_give_the_bits_of_the_whole() {
    let whole_rect = Rect::whole([8, 6]);
    let mut whole = empty_film();
    let counters = engine()
        .render(&mut whole, whole_rect, 0..30, &GO_ON)
        .unwrap();
    assert_eq!(counters.paths, 8 * 6 * 30);
    assert!(counters.rays > counters.paths);

    let mut cut = empty_film();
    let left = Rect {
        x1: 3,
        ..whole_rect
    };
    let right = Rect {
        x0: 3,
        ..whole_rect
    };
    let mut total = Counters::default();
    for (rect, samples) in [(right, 0..7), (left, 0..13), (right, 7..30), (left, 13..30)] {
        total += engine().render(&mut cut, rect, samples, &GO_ON).unwrap();
    }
    assert_eq!(whole.sums(), cut.sums());
    assert_eq!((counters.paths, counters.rays), (total.paths, total.rays));
    assert!(
        whole.sums().iter().any(|s| s[0] != s[1]),
        "replicates differ"
    );
}

#[test]
fn parts_have_samples_of_their_own() {
    let tile = Rect::whole([8, 6]);
    let left = Rect { x1: 3, ..tile };
    let below = Rect {
        x0: 3,
        y0: 4,
        ..tile
    };
    let parts = [(left, 0..9), (below, 0..14)].map(|(rect, samples)| Part { rect, samples });
    let (mut once, mut apart) = (empty_film(), empty_film());
    let counters = engine().render_parts(&mut once, tile, &parts, &GO_ON);
    let mut total = Counters::default();
    for Part { rect, samples } in parts {
        total += engine().render(&mut apart, rect, samples, &GO_ON).unwrap();
    }
    assert_eq!(once, apart);
    assert_eq!(counters, Ok(total));
    assert_eq!(total.paths, 18 * 9 + 10 * 14);
}

#[test]
fn every_replicate_gets_its_rounds() {
    // An eye in front of a light sees 1 in every sample, so the sums count samples.
    let scene = small(v(0.0, 0.0, 1.0), DVec3::ZERO, 20.0).light(DVec3::ZERO, DVec3::Z, 5.0, 1.0);
    let settings = Settings {
        strata: 2,
        ..scene.settings()
    };
    let mut engine = CpuEngine::new(scene.world(), settings, Estimator::LightSampling);
    let mut film = empty_film();
    engine
        .render(&mut film, Rect::whole([8, 6]), 0..22, &GO_ON)
        .unwrap();
    for sums in film.sums() {
        assert_eq!(sums.map(|s| s[0]), [8.0, 6.0, 4.0, 4.0]);
        assert!((sums[0][3] - 8.0).abs() < 1e-12);
    }
}

#[test]
fn a_stopped_call_leaves_the_film_alone() {
    let mut film = empty_film();
    let mut engine = engine();
    engine
        .render(&mut film, Rect::whole([8, 6]), 0..4, &GO_ON)
        .unwrap();
    let before = film.clone();
    let stop = AtomicBool::new(true);
    let result = engine.render(&mut film, Rect::whole([8, 6]), 4..8, &stop);
    assert_eq!(result, Err(EngineError::Stopped));
    assert_eq!(film, before);
}

#[test]
fn it_says_what_it_is() {
    let engine = engine();
    let device = engine.device();
    assert_eq!(device.name, "CPU reference (f64)");
    assert_eq!(device.backend, "cpu");
    assert!(device.software && device.driver.ends_with(" threads"));
}

#[test]
fn seeds_change_the_noise_and_nothing_else() {
    let scene = scene();
    let of = |seed: u32| {
        let settings = Settings {
            seed,
            ..scene.settings()
        };
        let film = scene.render(&settings, Estimator::LightSampling, 2000).0;
        measured(&film, Rect::whole(film.size), 2000)
    };
    let (a, b) = (of(0), of(1));
    assert_ne!(a.mean, b.mean);
    assert!(
        (a.mean - b.mean).abs() < 4.0 * a.error.hypot(b.error),
        "{a:?} {b:?}"
    );
}
