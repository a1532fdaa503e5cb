use super::*;
use crate::scene::parse;
use crate::settings::Overrides;

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
    let add = "let l = path.radiance;";
    // One in every replicate's first round but the last's: samples 1, 5 and 9, and the same 256 later.
    let faulty = "var l = path.radiance; if s % 4u == 1u && s % 256u < 12u { l.y = bitcast<f32>(0x7f800000u | (s >> 31u)); }";
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
    let scene = parse::parse_str("hall.toml".as_ref(), &text).expect("a scene");
    let flags = Overrides {
        size: Some([16, 12]),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let world = World::new(&scene, settings.size);
    let mut gpu = Gpu::open(&Choice::default()).expect("an adapter");
    gpu.trip_limit = trips;
    let mut engine = GpuEngine::on(gpu, &world, &settings, None).expect("an engine");
    assert_eq!(engine.kernel().access, Access::Tree);
    let rect = Rect::whole([16, 12]);
    let mut film = Film::new([16, 12], rect, settings.strata);
    let stop = AtomicBool::new(false);
    let counters = engine.render(&mut film, rect, samples, &stop)?;
    Ok((film, counters))
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
fn a_path_that_cannot_be_cut_is_refused_and_named() {
    let refused = hall(300, 0..40).expect_err("too few for a path");
    assert!(
        refused
            .to_string()
            .contains("takes more than 300 loop trips"),
        "{refused}"
    );
}
