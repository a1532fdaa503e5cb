use super::*;
use std::sync::atomic::Ordering;

fn scene() -> Scene {
    Scene::builder()
        .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [16, 12])
        .diffuse("white", [0.8, 0.5, 0.2])
        .plane([0.0; 3], [0.0, 1.0, 0.0], "white")
        .sphere([0.0, 0.5, 0.0], 0.5, "white")
        .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
        .build()
        .unwrap()
}

fn cpu() -> Options {
    Options {
        backend: Backend::Cpu,
        spp: Some(16),
        ..Options::default()
    }
}

fn refusal(options: Options) -> String {
    match render(&scene(), &options) {
        Err(Error::Input(why)) => why,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_picture_says_what_it_shows_and_how_it_came_about() {
    let picture = render(&scene(), &cpu()).unwrap();
    assert_eq!((picture.size(), picture.pixels().len()), ([16, 12], 192));
    assert_eq!(picture.samples(), [16; 192]);
    assert_eq!(picture.ended(), StopReason::Samples);
    let provenance = picture.provenance();
    assert_eq!(
        (provenance.samples, provenance.counters.paths),
        (16.0, 16 * 192)
    );
    assert_eq!(provenance.devices[0].device.backend, "cpu");
    assert!(
        picture
            .relative_error()
            .value
            .is_some_and(|e| e > 0.0 && e < 1.0)
    );
    // The plane in front is lit and not exactly known.
    let (pixel, error) = (picture.pixels()[16 * 11 + 8], picture.errors()[16 * 11 + 8]);
    assert!(pixel[0] > pixel[1] && pixel[1] > pixel[2] && pixel[2] > 0.0);
    assert!(error.iter().zip(pixel).all(|(e, p)| *e > 0.0 && *e < p));
    // Its provenance holds a scene file that gives the same picture.
    let again = render(&Scene::parse(&provenance.scene_text).unwrap(), &cpu()).unwrap();
    assert_eq!(again.pixels(), picture.pixels());
    assert_eq!(again.provenance().scene_hash, provenance.scene_hash);
}

#[test]
fn each_stop_condition_ends_it() {
    let by_error = Options {
        spp: None,
        error: Some(0.2),
        ..cpu()
    };
    let picture = render(&scene(), &by_error).unwrap();
    assert_eq!(picture.ended(), StopReason::Error);
    assert!(picture.provenance().samples < 10_000.0);
    let by_time = Options {
        spp: None,
        time: Some(Duration::from_millis(50)),
        ..cpu()
    };
    assert_eq!(
        render(&scene(), &by_time).unwrap().ended(),
        StopReason::Time
    );

    let mut heard = 0;
    let broken = render_with(&scene(), &Options { spp: None, ..cpu() }, |progress| {
        heard += 1;
        assert!(progress.samples() >= 1.0 && progress.fraction().is_some());
        ControlFlow::Break(())
    });
    let broken = broken.unwrap();
    assert_eq!((heard, broken.ended()), (1, StopReason::Interrupted));
    assert!(broken.samples()[0] >= 1);

    let stopped = cpu();
    stopped.stop.store(true, Ordering::Relaxed);
    assert!(matches!(render(&scene(), &stopped), Err(Error::Stopped)));
}

#[test]
fn regions_are_the_same_pixels_and_adaptive_pictures_are_complete() {
    let whole = render(&scene(), &cpu()).unwrap();
    let rect = Rect {
        x0: 3,
        y0: 4,
        x1: 9,
        y1: 11,
    };
    let part = Options {
        regions: vec![rect],
        ..cpu()
    };
    let part = render(&scene(), &part).unwrap();
    for (i, (a, b)) in whole.pixels().iter().zip(part.pixels()).enumerate() {
        let inside = rect.contains(i as u32 % 16, i as u32 / 16);
        assert_eq!(part.samples()[i], if inside { 16 } else { 0 });
        assert_eq!(*b, if inside { *a } else { [0.0; 3] });
    }
    let adaptive = Options {
        adaptive: true,
        spp: Some(64),
        ..cpu()
    };
    let adaptive = render(&scene(), &adaptive).unwrap();
    assert!(adaptive.samples().iter().all(|&n| n > 0));
}

#[test]
fn seeds_are_told_apart_and_scenes_too() {
    let with = |seed, scene: &Scene| {
        let options = Options {
            seed: Some(seed),
            spp: Some(64),
            ..cpu()
        };
        render(scene, &options).unwrap()
    };
    let (a, b) = (with(1, &scene()), with(2, &scene()));
    let same = a.compare(&b).unwrap();
    assert!(same.same() && !same.identical);
    let mut darker = scene();
    darker.lights[0].radiance *= 0.8;
    assert!(!a.compare(&with(3, &darker)).unwrap().same());
}

#[test]
fn options_that_cannot_be_are_refused() {
    for (options, expected) in [
        (
            Options {
                spp: Some(0),
                ..cpu()
            },
            "spp is 0",
        ),
        (
            Options {
                size: Some([0, 4]),
                ..cpu()
            },
            "a side of size is 0",
        ),
        (
            Options {
                strata: Some(0),
                ..cpu()
            },
            "strata is 0",
        ),
        (
            Options {
                strata: Some(2000),
                ..cpu()
            },
            "strata is 2000",
        ),
        (
            Options {
                max_depth: Some(0),
                ..cpu()
            },
            "max_depth is 0",
        ),
        (
            Options {
                shadow_rays: Some(0),
                ..cpu()
            },
            "shadow_rays is 0",
        ),
        (
            Options {
                error: Some(f64::NAN),
                ..cpu()
            },
            "error is NaN",
        ),
        (
            Options {
                error: Some(0.0),
                ..cpu()
            },
            "error is 0",
        ),
        (
            Options {
                adapter: Some("x".into()),
                ..cpu()
            },
            "adapter names a GPU",
        ),
        (
            Options {
                regions: vec![Rect::whole([17, 1])],
                ..cpu()
            },
            "region 0,0,17,1",
        ),
        (
            Options {
                regions: vec![Rect::whole([0, 1])],
                ..cpu()
            },
            "region 0,0,0,1",
        ),
    ] {
        let why = refusal(options);
        assert!(why.starts_with(expected), "{expected}: {why}");
    }
    let mut wrong = scene();
    wrong.camera.vfov = 0.0;
    assert!(matches!(render(&wrong, &cpu()), Err(Error::Scene(_))));
}

#[test]
fn pictures_are_saved_by_the_ending_of_their_name() {
    let picture = render(&scene(), &cpu()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.exr", "a.png", "a.npz"] {
        let path = folder.path().join(name);
        picture.save(&path).unwrap();
        let read = crate::compare::Picture::read(&path).unwrap();
        assert_eq!(read.size, [16, 12], "{name}");
    }
    picture.save_png(folder.path().join("b.png"), 1.0).unwrap();
    for (name, stops) in [("b.exr", 1.0), ("c.png", f64::NAN)] {
        let refused = picture.save_png(folder.path().join(name), stops);
        assert!(matches!(refused, Err(Error::Input(_))), "{refused:?}");
    }
    let refused = picture.save(folder.path().join("a.jpg")).unwrap_err();
    assert!(
        refused.to_string().ends_with("or .npz for a film"),
        "{refused}"
    );
    assert!(matches!(picture.save("x.tiff"), Err(Error::Input(_))));
    let nowhere = folder.path().join("none").join("a.exr");
    assert!(matches!(picture.save(nowhere), Err(Error::File(_))));
}
