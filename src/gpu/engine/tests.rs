use super::*;
use crate::scene::parse;
use crate::settings::Overrides;

fn engine() -> (GpuEngine, Film, Rect) {
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
    let engine = GpuEngine::new(&Choice::default(), &world, &settings, None);
    let rect = Rect {
        x0: 0,
        y0: 0,
        x1: 8,
        y1: 8,
    };
    (
        engine.expect("an adapter"),
        Film::new([8, 8], rect, 2),
        rect,
    )
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
fn strides_visit_every_group() {
    for groups in [1, 2, 3, 7, 64, 3072, 16384] {
        let stride = coprime_stride(groups);
        let mut seen = vec![false; groups as usize];
        for g in 0..groups {
            seen[(u64::from(g) * u64::from(stride) % u64::from(groups)) as usize] = true;
        }
        assert!(seen.iter().all(|s| *s), "{groups} groups, stride {stride}");
    }
}
