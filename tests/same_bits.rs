//! On one adapter a pixel's bits depend on scene, seed and samples alone: not on how the work is cut.

mod common;

use common::{generated, gpu, read, scene_files};
use etendue::engine::{Counters, Engine};
use etendue::film::coverage::Rect;
use etendue::film::{BLOCK, Film};
use etendue::scene::{Scene, generate};
use etendue::settings::{LightParts, Overrides, Settings};
use std::ops::Range;
use std::sync::atomic::AtomicBool;

const SIZE: [u32; 2] = [40, 30];
const WHOLE: Rect = Rect {
    x0: 0,
    y0: 0,
    x1: 40,
    y1: 30,
};

fn three_materials() -> Scene {
    let file = scene_files()
        .into_iter()
        .find(|p| p.ends_with("three_materials.toml"))
        .expect("it is there");
    read(&file)
}

/// So many spheres that the kernel walks a tree, and draws places and points on the light together.
fn crowd() -> Scene {
    generated(&generate::cloud(100, 1, "rows.csv"))
}

fn settings(scene: &Scene, strata: u32) -> Settings {
    Settings::resolve(
        scene,
        &Overrides {
            size: Some(SIZE),
            strata: Some(strata),
            ..Overrides::default()
        },
    )
}

/// Renders `samples` over `rect` in calls that end at every one of `cuts`, and at the ends of blocks.
fn go(
    engine: &mut dyn Engine,
    film: &mut Film,
    rect: Rect,
    samples: Range<u64>,
    cuts: &[u64],
) -> Counters {
    let mut total = Counters::default();
    let mut at = samples.start;
    while at < samples.end {
        let block = (at / BLOCK + 1) * BLOCK;
        let end = cuts
            .iter()
            .copied()
            .chain([block, samples.end])
            .filter(|c| *c > at)
            .min()
            .expect("has an end");
        total += engine
            .render(film, rect, at..end, &AtomicBool::new(false))
            .expect("renders");
        at = end;
    }
    total
}

#[test]
fn cuts_tiles_and_regions_change_no_bit() {
    no_bit_is_changed_by_cuts(&three_materials(), &[1, 2, 3]);
}

#[test]
fn nor_in_crowds() {
    no_bit_is_changed_by_cuts(&crowd(), &[1, 2]);
}

fn no_bit_is_changed_by_cuts(scene: &Scene, strata: &[u32]) {
    for &strata in strata {
        let settings = settings(scene, strata);
        let mut engine = gpu(scene, &settings, None);
        let film = || Film::new(SIZE, WHOLE, strata);
        let mut once = film();
        let counted = go(&mut engine, &mut once, WHOLE, 0..300, &[]);

        let mut cut = film();
        let again = go(
            &mut engine,
            &mut cut,
            WHOLE,
            0..300,
            &[1, 2, 7, 64, 65, 255, 257, 299],
        );
        assert_eq!(once.sums(), cut.sums(), "strata {strata}");
        assert_eq!(once.partial(), cut.partial(), "strata {strata}");
        assert_eq!(counted, again, "strata {strata}");

        // A new engine resumes where another stopped.
        let mut resumed = film();
        go(&mut engine, &mut resumed, WHOLE, 0..100, &[33]);
        go(
            &mut gpu(scene, &settings, None),
            &mut resumed,
            WHOLE,
            100..300,
            &[],
        );
        assert_eq!(
            (once.sums(), once.partial()),
            (resumed.sums(), resumed.partial()),
            "strata {strata}"
        );

        let mut tiled = film();
        for (k, x0) in [0, 13, 20].into_iter().enumerate() {
            let x1 = [13, 20, 40][k];
            go(
                &mut engine,
                &mut tiled,
                Rect { x0, x1, ..WHOLE },
                0..300,
                &[50 * (k as u64 + 1)],
            );
        }
        assert_eq!(
            (once.sums(), once.partial()),
            (tiled.sums(), tiled.partial()),
            "strata {strata}"
        );
    }
}

/// An engine keeps the running sums of its last call: they must not find their way into another film.
#[test]
fn films_in_turns_on_one_engine_do_not_mix() {
    let scene = three_materials();
    let settings = settings(&scene, 2);
    let film = || Film::new(SIZE, WHOLE, 2);
    let fresh = || gpu(&scene, &settings, None);
    let (mut slice, mut whole) = (film(), film());
    go(&mut fresh(), &mut slice, WHOLE, 9..14, &[]);
    go(&mut fresh(), &mut whole, WHOLE, 0..30, &[]);
    let mut slice_alone = slice.clone();
    go(&mut fresh(), &mut slice_alone, WHOLE, 14..30, &[]);

    let mut engine = fresh();
    let mut turns = film();
    go(&mut engine, &mut turns, WHOLE, 0..14, &[]);
    go(&mut engine, &mut slice, WHOLE, 14..30, &[20]);
    go(&mut engine, &mut turns, WHOLE, 14..30, &[17]);
    assert_eq!(slice.partial(), slice_alone.partial());
    assert_eq!(turns.partial(), whole.partial());
}

#[test]
fn another_seed_gives_another_picture() {
    let scene = three_materials();
    let mut pictures = Vec::new();
    for seed in [0, 1] {
        let settings = Settings {
            seed,
            ..settings(&scene, 2)
        };
        let mut film = Film::new(SIZE, WHOLE, 2);
        go(
            &mut gpu(&scene, &settings, None),
            &mut film,
            WHOLE,
            0..4,
            &[],
        );
        pictures.push(film);
    }
    assert_ne!(pictures[0].partial(), pictures[1].partial());
}

#[test]
fn emitted_direct_and_indirect_add_up() {
    let scene = three_materials();
    let mean = |light: LightParts| {
        let settings = Settings {
            light,
            ..settings(&scene, 2)
        };
        let mut film = Film::new(SIZE, WHOLE, 2);
        go(
            &mut gpu(&scene, &settings, None),
            &mut film,
            WHOLE,
            0..16,
            &[],
        );
        let mut out = Vec::new();
        film.for_each(|_, _, e| out.push(e.mean));
        out
    };
    let none = LightParts {
        emitted: false,
        direct: false,
        indirect: false,
    };
    let whole = mean(LightParts::ALL);
    let parts = [
        mean(LightParts {
            emitted: true,
            ..none
        }),
        mean(LightParts {
            direct: true,
            ..none
        }),
        mean(LightParts {
            indirect: true,
            ..none
        }),
    ];
    assert!(
        parts.iter().all(|p| p.iter().any(|x| x[0] > 0.0)),
        "every part has some light"
    );
    for (i, w) in whole.iter().enumerate() {
        for c in 0..3 {
            let sum: f64 = parts.iter().map(|p| p[i][c]).sum();
            assert!(
                (sum - w[c]).abs() <= 1e-5 * w[c].max(1e-3),
                "pixel {i}: {sum} instead of {}",
                w[c]
            );
        }
    }
}
