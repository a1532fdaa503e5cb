use super::*;
use crate::kernel::compose_with;
use crate::scene::parse;
use crate::settings::{Integrator, Overrides};

fn engine() -> (GpuEngine, Film, Rect) {
    engine_with(str::to_owned)
}

/// An engine for 8 x 8 pixels whose kernel has gone through `change`.
fn engine_with(change: impl Fn(&str) -> String) -> (GpuEngine, Film, Rect) {
    let scene = parse::parse_str(
        "diffuse.toml".as_ref(),
        include_str!("../../../scenes/diffuse.toml"),
    )
    .expect("a scene");
    let flags = Overrides {
        size: Some([8, 8]),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let world = World::new(&scene, settings.size);
    let gpu = Gpu::open(&Choice::default()).expect("an adapter");
    let mut kernel = compose(&world, &settings, None);
    kernel.wgsl = change(&kernel.wgsl);
    // SAFETY: the changes of these tests touch neither loops nor indices.
    let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
    let rect = Rect {
        x0: 0,
        y0: 0,
        x1: 8,
        y1: 8,
    };
    (engine.expect("an engine"), Film::new([8, 8], rect, 2), rect)
}

#[test]
fn a_device_lost_between_two_calls_is_an_error_and_leaves_the_film() {
    let (mut engine, mut film, rect) = engine();
    let stop = AtomicBool::new(false);
    engine
        .render(&mut film, rect, 0..4, &stop)
        .expect("a live device");
    let before = film.clone();
    engine.gpu.device.destroy();
    let lost = engine.render(&mut film, rect, 4..8, &stop);
    assert!(matches!(lost, Err(EngineError::Device(_))), "{lost:?}");
    assert_eq!(film, before);
}

#[test]
fn a_tile_that_no_texture_holds_is_an_error() {
    let (mut engine, ..) = engine();
    let wide = Rect {
        x0: 0,
        y0: 0,
        x1: 1 << 20,
        y1: 1,
    };
    let problem = engine.prepare_tile(wide).expect_err("wider than a texture");
    assert!(problem.contains("1048576 x 1"), "{problem}");
    assert!(engine.prepare_tile(Rect { x1: 8, ..wide }).is_ok());
}

#[test]
fn samples_that_are_not_finite_are_left_out_and_counted_by_replicate() {
    let add = "add_sample(film, path.radiance, is_sample);";
    // One in every replicate's first round but the last's: samples 1, 5 and 9, and the same 256 later.
    let faulty = "var l = path.radiance;
        if film.s % 4u == 1u && film.s % 256u < 12u { l.y = bitcast<f32>(0x7f800000u | (film.s >> 31u)); }
        add_sample(film, l, is_sample);";
    let (mut engine, mut film, rect) = engine_with(|wgsl| {
        assert!(wgsl.contains(add));
        wgsl.replace(add, faulty)
    });
    let stop = AtomicBool::new(false);
    for (samples, lost, first) in [(0..7, 2, 1), (7..256, 1, 9), (256..300, 3, 257)] {
        let counters = engine
            .render(&mut film, rect, samples, &stop)
            .expect("samples");
        assert_eq!(counters.nonfinite, lost * 64);
        assert_eq!(counters.first_nonfinite, Some((0, 0, first)));
    }
    for pixel in film.left_out().iter() {
        assert_eq!(pixel.2, [2, 2, 2, 0]);
    }
    assert_eq!(film.left_out().iter().count(), 64);
    // What is left is the mean of the others: the same as if those had never been drawn.
    film.for_each(|x, y, e| {
        assert_eq!(e.samples, 294);
        let sum: f64 = film.total(x, y).iter().map(|s| s[0]).sum();
        assert_eq!(e.mean[0], sum / 294.0);
    });
}

/// A film of `samples` of a hall of a hundred lamps, on a driver that grants `trips` loop trips.
fn hall(trips: u64, samples: Range<u64>) -> Result<(Film, Counters), EngineError> {
    let text = crate::scene::generate::lights(100, 0, "").scene;
    counted(&text, trips, samples)
}

/// A film of `samples` of a scene whose kernel counts its loop trips.
fn counted(text: &str, trips: u64, samples: Range<u64>) -> Result<(Film, Counters), EngineError> {
    let scene = parse::parse_str("counted.toml".as_ref(), text).expect("a scene");
    let flags = Overrides {
        size: Some([16, 12]),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let world = World::new(&scene, settings.size);
    let mut gpu = Gpu::open(&Choice::default()).expect("an adapter");
    gpu.trip_limit = trips;
    let mut engine = GpuEngine::on(gpu, &world, &settings, None).expect("an engine");
    assert_eq!(engine.kernel().trips_per_sample, 0);
    let rect = Rect::whole([16, 12]);
    let mut film = Film::new([16, 12], rect, settings.strata);
    let stop = AtomicBool::new(false);
    let counters = engine.render(&mut film, rect, samples, &stop)?;
    Ok((film, counters))
}

/// Scenes whose rays wait in a queue: spheres at random, matt or of three materials; with rows of glass ones, which are kept apart from each
/// other; and with a light that the eye sees; disks; and a
/// crowd among large things.
fn queued_scenes() -> Vec<String> {
    let cloud = crate::scene::generate::cloud(200, 3, "").scene;
    let materials = "[material.gloss]
type = \"phong\"
exponent = 40.0
diffuse = [0.3, 0.3, 0.3]
specular = [0.5, 0.5, 0.5]
[material.glass]
type = \"dielectric\"
ior = 1.5
[material.mirror]
type = \"mirror\"
reflectance = [0.9, 0.9, 0.9]
";
    let of = ["matt", "gloss", "mirror"];
    let mixed = (cloud.split("[[sphere]]").enumerate())
        .map(|(i, part)| part.replace("\"matt\"", &format!("\"{}\"", of[i % 3])));
    let mixed = mixed.collect::<Vec<_>>().join("[[sphere]]");
    let mixed = mixed.replacen("[[plane]]", &format!("{materials}\n[[plane]]"), 1);
    let mut glass = cloud.replacen("[[plane]]", &format!("{materials}\n[[plane]]"), 1);
    for i in 0..120 {
        let (x, z) = (
            0.21 * f64::from(i % 11) - 1.05,
            0.3 * f64::from(i / 11) - 4.0,
        );
        let sphere =
            format!("\n[[sphere]]\ncenter = [{x}, 0.1, {z}]\nradius = 0.1\nmaterial = \"glass\"\n");
        glass.push_str(&sphere);
    }
    let seen = cloud.replace("[0.0, 4.0, 1.0]", "[0.0, 1.9, 0.0]");
    // Its tree holds lights too, some of which can block no other.
    let mut disks = cloud.split("[[sphere]]").next().expect("a head").to_owned();
    for i in 0..160 {
        let at = |k: u32| 0.02 * f64::from((i * k) % 101) - 1.0;
        let (kind, rest) = if i % 3 > 0 {
            ("disk", "material = \"matt\"")
        } else {
            ("light", "radiance = [3.0, 3.0, 3.0]")
        };
        let center = format!("[{}, {}, {}]", at(37), 1.0 + at(53), at(71));
        let disk = format!(
            "\n[[{kind}]]\ncenter = {center}\nnormal = [{}, -1.0, 0.3]\nradius = 0.08\n{rest}\n",
            at(7)
        );
        disks.push_str(&disk);
    }
    // The crowd in the middle has a tree of its own.
    let mut wide = cloud.clone();
    for i in 0..300 {
        let at = |k: u32| 20.0 * f64::from((i * k) % 307) - 3000.0;
        let center = format!(
            "[{}, {}, {}]",
            at(37),
            1010.0 + 0.3 * at(53),
            at(71) - 3300.0
        );
        wide.push_str(&format!(
            "\n[[sphere]]\ncenter = {center}\nradius = 60\nmaterial = \"matt\"\n"
        ));
    }
    vec![cloud, mixed, glass, seen, disks, wide]
}

/// 120 samples of 16 x 12 pixels in the open, whose rays wait in a queue or do not.
fn in_the_open(text: &str, flags: Overrides, queues: bool, trips: u64) -> (Film, Counters) {
    let scene = parse::parse_str("open.toml".as_ref(), text).expect("a scene");
    let flags = Overrides {
        size: Some([16, 12]),
        ..flags
    };
    let settings = Settings::resolve(&scene, &flags);
    let world = World::new(&scene, settings.size);
    let kernel = compose_with(&world, &settings, None, queues);
    assert_eq!(kernel.wgsl.contains("fn trace(queue"), queues);
    let mut gpu = Gpu::open(&Choice::default()).expect("an adapter");
    gpu.trip_limit = trips;
    // SAFETY: it is what `compose_with` made.
    let engine = unsafe { GpuEngine::with_kernel(gpu, &world, &settings, kernel) };
    let mut engine = engine.expect("an engine");
    let rect = Rect::whole([16, 12]);
    let mut film = Film::new([16, 12], rect, settings.strata);
    let stop = AtomicBool::new(false);
    let mut counters = Counters::default();
    for samples in [0..7, 7..8, 8..120] {
        let more = engine.render(&mut film, rect, samples, &stop);
        counters += more.expect("samples");
    }
    (film, counters)
}

#[test]
fn rays_in_a_queue_give_the_bits_of_rays_one_by_one() {
    for text in queued_scenes() {
        for flags in [
            Overrides::default(),
            Overrides {
                max_depth: Some(2),
                strata: Some(1),
                ..Overrides::default()
            },
            Overrides {
                max_depth: Some(3),
                strata: Some(3),
                ..Overrides::default()
            },
            Overrides {
                integrator: Some(Integrator::Whitted),
                ..Overrides::default()
            },
        ] {
            let alone = in_the_open(&text, flags, false, 60_000);
            // A few paths use up the loop trips, or none does.
            for trips in [60_000, 1_000] {
                let queued = in_the_open(&text, flags, true, trips);
                assert_eq!(queued.0, alone.0);
                assert_eq!(queued.1, alone.1);
            }
        }
    }
}

#[test]
fn want_of_loop_trips_changes_no_bit() {
    let plenty = hall(60_000, 0..40).expect("samples");
    let scant = hall(4_000, 0..40).expect("samples, a few at a time");
    assert_eq!(plenty.0, scant.0);
    assert_eq!(plenty.1, scant.1);
    assert_eq!(plenty.1.paths, 40 * 192);
}

#[test]
fn want_of_loop_trips_changes_no_bit_of_a_formula() {
    let text = include_str!("../../../scenes/torus.toml");
    let plenty = counted(text, 60_000, 0..40).expect("samples");
    let scant = counted(text, 4_000, 0..40).expect("samples, a few at a time");
    assert_eq!(plenty.0, scant.0);
    assert_eq!(plenty.1.paths, scant.1.paths);
}

#[test]
fn a_path_that_cannot_be_cut_is_refused_and_named() {
    let refused = hall(300, 0..40).expect_err("too few for a path");
    assert!(
        refused
            .to_string()
            .contains("takes more than 300 loop iterations"),
        "{refused}"
    );
}

const TILE: Rect = Rect {
    x0: 0,
    y0: 0,
    x1: 16,
    y1: 12,
};

/// Engines for 16 x 12 pixels of one scene with each way to reach its values. A few samples, or one path in trees, use up the
/// loop trips if they are `scant`.
fn engines(scant: bool) -> Vec<GpuEngine> {
    let text = include_str!("../../../scenes/three_materials.toml");
    let scene = parse::parse_str("three.toml".as_ref(), text).expect("a scene");
    let flags = Overrides {
        size: Some([TILE.x1, TILE.y1]),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let world = World::new(&scene, settings.size);
    let engine = |access| {
        let mut gpu = Gpu::open(&Choice::default()).expect("an adapter");
        if scant {
            gpu.trip_limit = match compose(&world, &settings, Some(access)).trips_per_sample {
                0 => 4_000,
                trips => 7 * trips + 1,
            };
        }
        GpuEngine::on(gpu, &world, &settings, Some(access)).expect("an engine")
    };
    [Access::Baked, Access::Buffers, Access::Tree]
        .map(engine)
        .into()
}

/// Parts of [`TILE`], as (which of three rectangles that are all of it, samples).
fn parts(of: &[(usize, Range<u64>)]) -> Vec<Part> {
    let rects = [
        Rect { x1: 7, ..TILE },
        Rect {
            x0: 7,
            y1: 5,
            ..TILE
        },
        Rect {
            x0: 7,
            y0: 5,
            ..TILE
        },
    ];
    let part = |(k, samples): &(usize, Range<u64>)| Part {
        rect: rects[*k],
        samples: samples.clone(),
    };
    of.iter().map(part).collect()
}

#[test]
fn a_call_with_several_parts_gives_the_bits_of_separate_calls() {
    let calls = [
        parts(&[(0, 0..40), (1, 0..256)]),
        parts(&[(0, 40..47), (1, 256..300), (2, 0..3)]),
        parts(&[(0, 47..256)]),
        parts(&[(2, 3..256), (1, 300..310)]),
    ];
    let alone = parts(&[(0, 0..256), (1, 0..256), (1, 256..310), (2, 0..256)]);
    let stop = AtomicBool::new(false);
    let mut scant = engines(true);
    for (mut engine, scant) in engines(false).into_iter().zip(&mut scant) {
        let access = engine.kernel().access;
        let mut wanted = Film::new([16, 12], TILE, 2);
        let mut counted = Counters::default();
        for part in &alone {
            let one =
                engine.render_parts(&mut wanted, part.rect, std::slice::from_ref(part), &stop);
            counted += one.expect("samples");
        }
        // What is in the textures serves the next call; or it has gone, and comes from the film.
        for forget in [false, true] {
            for engine in [&mut engine, &mut *scant] {
                let mut film = Film::new([16, 12], TILE, 2);
                let mut total = Counters::default();
                for parts in &calls {
                    if forget {
                        engine.held = None;
                    }
                    let some = engine.render_parts(&mut film, TILE, parts, &stop);
                    total += some.expect("samples");
                }
                assert!(film.sums() == wanted.sums(), "{access:?}");
                assert!(film.partial() == wanted.partial(), "{access:?}");
                assert_eq!(film.coverage.total(), wanted.coverage.total());
                assert_eq!(total, counted, "{access:?}");
            }
        }
    }
}

#[test]
fn a_call_that_is_stopped_on_its_way_leaves_the_film_and_the_next_one_its_bits() {
    for mut engine in engines(false) {
        let stop = AtomicBool::new(false);
        let first = parts(&[(0, 0..100), (1, 0..30)]);
        let then = parts(&[(0, 100..256), (1, 30..256), (2, 0..256)]);
        let mut wanted = Film::new([16, 12], TILE, 2);
        for parts in [&first, &then] {
            let some = engine.render_parts(&mut wanted, TILE, parts, &stop);
            some.expect("samples");
        }
        let mut film = Film::new([16, 12], TILE, 2);
        engine
            .render_parts(&mut film, TILE, &first, &stop)
            .expect("samples");
        let before = film.clone();
        // What a call has done that is stopped after its first submission.
        let work = Work::new(TILE, &then);
        let tile = engine.tile.as_ref().expect("a tile");
        tile.upload_ranges(&engine.gpu, &work.ranges());
        engine
            .submit(TILE, work.longest, 0..1, 1)
            .expect("a submission");
        stop.store(true, Ordering::Relaxed);
        let stopped = engine.render_parts(&mut film, TILE, &then, &stop);
        assert_eq!(stopped, Err(EngineError::Stopped));
        assert_eq!(film, before);
        stop.store(false, Ordering::Relaxed);
        engine
            .render_parts(&mut film, TILE, &then, &stop)
            .expect("samples");
        assert_eq!(film, wanted);
    }
}
