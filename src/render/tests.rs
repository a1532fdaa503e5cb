use super::*;
use crate::film::coverage::Rect;
use crate::run::StopReason;
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
    assert_eq!(picture.ended(), Some(StopReason::Samples));
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
    assert_eq!(picture.ended(), Some(StopReason::Error));
    assert!(picture.provenance().samples < 10_000.0);
    let by_time = Options {
        spp: None,
        time: Some(Duration::from_millis(50)),
        ..cpu()
    };
    assert_eq!(
        render(&scene(), &by_time).unwrap().ended(),
        Some(StopReason::Time)
    );

    let mut heard = 0;
    let broken = render_with(&scene(), &Options { spp: None, ..cpu() }, |progress| {
        heard += 1;
        assert!(progress.samples() >= 1.0 && progress.fraction().is_some());
        ControlFlow::Break(())
    });
    let broken = broken.unwrap();
    assert_eq!((heard, broken.ended()), (1, Some(StopReason::Interrupted)));
    assert!(broken.samples()[0] >= 1);

    let stopped = cpu();
    stopped.stop.store(true, Ordering::Relaxed);
    assert!(matches!(render(&scene(), &stopped), Err(Error::Stopped)));
}

/// The reference takes four samples of a pixel at once here, and is asked at once whether to go on.
#[test]
fn those_who_watch_hear_of_each_change_once_and_of_the_end() {
    let mut heard = Vec::new();
    let options = Options {
        spp: Some(4096),
        ..cpu()
    };
    let begun = std::time::Instant::now();
    let picture = render_with(&scene(), &options, |progress| {
        heard.push(progress.samples());
        ControlFlow::Continue(())
    });
    assert!(picture.is_ok());
    assert!(heard.windows(2).all(|two| two[0] < two[1]), "{heard:?}");
    assert_eq!(heard.last(), Some(&4096.0), "{heard:?}");
    let seconds = begun.elapsed().as_secs_f64();
    assert!(heard.len() as f64 <= 3.0 + 2.0 * seconds, "{heard:?}");
}

#[test]
fn a_renderer_refuses_options_of_another_device() {
    let renderer = Renderer::open(&cpu()).unwrap();
    let with = |backend, adapter: Option<&str>| Options {
        backend,
        adapter: adapter.map(str::to_owned),
        ..cpu()
    };
    renderer
        .render(&scene(), &with(Backend::Auto, None))
        .unwrap();
    for (options, named) in [
        (with(Backend::Gpu, None), "backend gpu"),
        (with(Backend::Auto, Some("llvm")), "adapter \"llvm\""),
    ] {
        match renderer.render(&scene(), &options) {
            Err(Error::Input(why)) => assert_eq!(
                why,
                format!(
                    "the options name {named}, but the renderer was opened on the CPU reference; open another, or leave backend and \
                     adapter as they are by default"
                )
            ),
            other => panic!("{other:?}"),
        }
    }
    let gpu = Renderer::open(&with(Backend::Gpu, None)).unwrap();
    let refused = gpu.render(&scene(), &cpu()).unwrap_err().to_string();
    assert!(refused.starts_with("the options name backend cpu, but"));
    let other = with(Backend::Auto, Some("no such"));
    let refused = gpu.render(&scene(), &other).unwrap_err().to_string();
    assert!(refused.starts_with("the options name adapter \"no such\", but"));
}

#[test]
fn every_failure_is_an_error_of_this_crate_and_debug_is_short() {
    fn all() -> Result<(), Error> {
        let _ = crate::Implicit::new("x^2 + y^2 - 1", &[])?;
        let picture = render(&Scene::builder().build()?, &cpu())?;
        picture.save("never.exr")
    }
    assert!(matches!(all(), Err(Error::Scene(_))));
    assert!(matches!(Scene::read("/no/such.toml"), Err(Error::File(_))));
    assert!(matches!(Scene::parse("x"), Err(Error::Scene(_))));
    let wrong = crate::Implicit::new("x +", &[]).map_err(Error::from);
    assert!(matches!(wrong, Err(Error::Input(_))));

    let picture = render(&scene(), &cpu()).unwrap();
    let text = format!("{picture:?}");
    assert!(text.starts_with("Picture { ") && text.contains("samples: (16, 16)"));
    assert!(text.len() < 400, "{text}");
    let side = crate::compare::Side::from_film("a".into(), picture.film(), picture.provenance());
    assert!(format!("{side:?}").len() < 400);
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
                error: Some(5.0),
                ..cpu()
            },
            "error is 5",
        ),
        (
            Options {
                time: Some(Duration::ZERO),
                ..cpu()
            },
            "time is 0ns",
        ),
        (
            Options {
                time: Some(Duration::MAX),
                ..cpu()
            },
            "time is 18446744073709551615.999999999s",
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
        let read = crate::compare::Side::read(&path).unwrap();
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

#[test]
fn a_picture_that_is_brought_on_has_the_bits_of_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let seed = Some(7);
    let whole = render(
        &scene(),
        &Options {
            spp: Some(600),
            seed,
            ..cpu()
        },
    )
    .unwrap();
    let begun = render(
        &scene(),
        &Options {
            spp: Some(100),
            seed,
            ..cpu()
        },
    )
    .unwrap();
    begun.save(&path).unwrap();
    let renderer = Renderer::open(&cpu()).unwrap();
    // The seed is the picture's own.
    let more = Options {
        spp: Some(600),
        ..cpu()
    };
    let read = Picture::open(&path).unwrap();
    assert_eq!((read.ended(), read.pixels()), (None, begun.pixels()));
    let done = renderer.resume(read, &scene(), &more).unwrap();
    assert_eq!(done.film(), whole.film());
    assert_eq!(done.provenance().counters.paths, 600 * 192);
    // It has all of them already.
    let same = renderer.resume(done.clone(), &scene(), &more).unwrap();
    assert_eq!(same.film(), whole.film());
    assert_eq!(same.ended(), Some(StopReason::Samples));
    let refused =
        |options: Options, scene: &Scene| match renderer.resume(done.clone(), scene, &options) {
            Err(Error::Input(why)) => why,
            other => panic!("{other:?}"),
        };
    let why = refused(
        Options {
            seed: Some(8),
            ..more.clone()
        },
        &scene(),
    );
    assert!(
        why.ends_with("picture and options: seed is 7 and 8"),
        "{why}"
    );
    let why = refused(
        Options {
            adaptive: true,
            ..more.clone()
        },
        &scene(),
    );
    assert!(why.contains("is not adaptive"), "{why}");
    let mut other = scene();
    other.lights[0].radius = 0.25;
    let why = refused(more.clone(), &other);
    assert!(why.contains("scene is \"untitled\""), "{why}");
}

#[test]
fn parts_of_a_picture_are_brought_on_and_merged() {
    let half = |x0: u32, spp: u64| {
        let regions = vec![Rect {
            x0,
            y0: 0,
            x1: x0 + 8,
            y1: 12,
        }];
        render(
            &scene(),
            &Options {
                regions,
                spp: Some(spp),
                ..cpu()
            },
        )
        .unwrap()
    };
    let (left, right) = (half(0, 512), half(8, 256));
    let renderer = Renderer::open(&cpu()).unwrap();
    let right = renderer
        .resume(
            right,
            &scene(),
            &Options {
                spp: Some(512),
                ..cpu()
            },
        )
        .unwrap();
    assert_eq!(
        right.film().bounds,
        Rect {
            x0: 8,
            y0: 0,
            x1: 16,
            y1: 12
        }
    );
    let both = merge(vec![right, left.clone()]).unwrap();
    let whole = render(
        &scene(),
        &Options {
            spp: Some(512),
            ..cpu()
        },
    )
    .unwrap();
    assert_eq!(both.pixels(), whole.pixels());
    let why = merge(vec![both, left]).unwrap_err().to_string();
    assert!(
        why.contains("samples 0..512 of pixels 0,0,8,12 are in both films"),
        "{why}"
    );
    assert!(merge(Vec::new()).is_err());

    let numbers = |numbers| Options {
        numbers: Some(numbers),
        spp: None,
        ..cpu()
    };
    let part = |from: u64| render(&scene(), &numbers(from..from + 256)).unwrap();
    let both = merge(vec![part(256), part(0)]).unwrap();
    assert_eq!(both.pixels(), whole.pixels());
    assert!(refusal(numbers(5..5)).contains("must end after they start"));
    let twice = Options {
        time: Some(Duration::from_secs(1)),
        ..numbers(0..4)
    };
    assert!(refusal(twice).contains("can't be given with them"));
}
