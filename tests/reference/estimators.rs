//! Compares the estimator with light sampling with the one without, and the modes with each other.

use crate::build::*;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::reference::Estimator;
use etendue::scene::Bsdf;
use etendue::settings::{Integrator, LightParts, Settings};
use glam::DVec3;

/// Bound on |z| of each comparison: two-sided false-alarm rate 1.5·10⁻⁵, so 4·10⁻⁴ for the 26 of a picture.
const LIMIT: f64 = 4.33;

/// A box with every material and shape; the lights are large, so that paths find them by chance.
fn cornell() -> Build {
    let gloss = Bsdf::Phong {
        diffuse: v(0.3, 0.1, 0.1),
        specular: DVec3::splat(0.5),
        exponent: 20.0,
    };
    let tinted = Bsdf::Dielectric {
        ior: 1.52,
        transmittance: v(0.9, 1.0, 0.9),
    };
    let red = Bsdf::Diffuse {
        reflectance: v(0.7, 0.1, 0.1),
    };
    let mut scene = small(v(0.0, 1.0, 2.9), v(0.0, 0.9, 0.0), 50.0)
        .add(plane(DVec3::ZERO, DVec3::Y), gloss)
        .add(plane(v(0.0, 2.0, 0.0), -DVec3::Y), grey(0.7))
        .add(plane(v(-1.0, 0.0, 0.0), DVec3::X), red)
        .add(plane(v(1.0, 0.0, 0.0), DVec3::X), grey(0.6))
        .add(plane(v(0.0, 0.0, -1.0), DVec3::Z), grey(0.7))
        .add(plane(v(0.0, 0.0, 3.0), DVec3::Z), grey(0.5))
        .add(sphere(v(-0.5, 0.4, -0.3), 0.4), MIRROR)
        .add(sphere(v(0.5, 0.35, 0.2), 0.35), tinted)
        .add(cylinder(v(0.5, 0.0, -0.6), v(0.4, 1.0, -0.5), 0.25), gloss)
        .add(cylinder(v(-0.4, 0.0, 0.6), v(-0.4, 0.3, 0.6), 0.2), GLASS)
        .add(
            disk(v(-0.9, 1.2, -0.2), v(1.0, 0.2, 0.0).normalize(), 0.3),
            grey(0.8),
        )
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 0.6, 4.0)
        .light(v(0.99, 1.2, 0.5), -DVec3::X, 0.4, 2.0);
    scene.0.lights[1].radiance = v(1.0, 2.0, 4.0);
    scene.0.camera.resolution = [20, 20];
    scene
}

fn settings(scene: &Build) -> Settings {
    Settings {
        max_depth: 64,
        ..scene.settings()
    }
}

/// z-tests of 5 x 5 blocks and of the whole picture.
fn assert_agree(what: &str, a: &(Film, u64), b: &(Film, u64)) {
    let whole = Rect::whole(a.0.size);
    let mut rects = vec![whole];
    for k in 0..25 {
        let (x0, y0) = (k % 5 * 4, k / 5 * 4);
        rects.push(Rect {
            x0,
            y0,
            x1: x0 + 4,
            y1: y0 + 4,
        });
    }
    for rect in rects {
        let (m, n) = (measured(&a.0, rect, a.1), measured(&b.0, rect, b.1));
        let error = m.error.hypot(n.error);
        assert!(
            (m.mean - n.mean).abs() <= LIMIT * error,
            "{what}, {rect:?}: {m:?} against {n:?}"
        );
        assert!(
            error < 0.2 * m.mean.max(n.mean) + 1e-9,
            "{what}, {rect:?}: {m:?} against {n:?} shows nothing"
        );
    }
}

fn picture(scene: &Build, s: &Settings, estimator: Estimator, samples: u64) -> (Film, u64) {
    (scene.render(s, estimator, samples).0, samples)
}

#[test]
fn both_estimators_agree_on_a_box_with_everything_in_it() {
    let scene = cornell();
    let base = settings(&scene);
    let by_chance = picture(&scene, &base, Estimator::NoLightSampling, 3000);
    for shadow_rays in [1, 4] {
        let s = Settings {
            shadow_rays,
            ..base.clone()
        };
        let sampled = picture(&scene, &s, Estimator::LightSampling, 600);
        assert_agree(&format!("{shadow_rays} shadow rays"), &sampled, &by_chance);
    }
}

#[test]
fn both_estimators_agree_in_every_mode() {
    let scene = cornell();
    let base = settings(&scene);
    let only = |emitted, direct, indirect| LightParts {
        emitted,
        direct,
        indirect,
    };
    let modes = [
        (Integrator::Path, only(false, true, false), 64),
        (Integrator::Path, only(false, false, true), 64),
        (Integrator::Path, LightParts::ALL, 3),
        (Integrator::Whitted, LightParts::ALL, 64),
        (Integrator::Whitted, only(true, true, false), 64),
    ];
    for (integrator, light, max_depth) in modes {
        let s = Settings {
            integrator,
            light,
            max_depth,
            ..base.clone()
        };
        let sampled = picture(&scene, &s, Estimator::LightSampling, 400);
        let by_chance = picture(&scene, &s, Estimator::NoLightSampling, 2000);
        let what = format!("{integrator:?} {light:?} {max_depth}");
        assert_agree(&what, &sampled, &by_chance);
    }
}

#[test]
fn emitted_direct_and_indirect_add_up_sample_by_sample() {
    let scene = cornell();
    for estimator in BOTH {
        for integrator in [Integrator::Path, Integrator::Whitted] {
            let part = |light| {
                let s = Settings {
                    light,
                    integrator,
                    ..settings(&scene)
                };
                scene.render(&s, estimator, 20).0
            };
            let whole = part(LightParts::ALL);
            let none = LightParts {
                emitted: false,
                direct: false,
                indirect: false,
            };
            let parts = [
                part(LightParts {
                    emitted: true,
                    ..none
                }),
                part(LightParts {
                    direct: true,
                    ..none
                }),
                part(LightParts {
                    indirect: true,
                    ..none
                }),
            ];
            for p in &parts {
                assert!(
                    p.sums().iter().any(|s| s[0][0] > 0.0),
                    "an empty part shows nothing"
                );
            }
            for (x, y) in (0..20).flat_map(|x| (0..20).map(move |y| (x, y))) {
                for c in 0..3 {
                    let of = |f: &Film| f.total(x, y).iter().map(|s| s[c]).sum::<f64>();
                    let sum: f64 = parts.iter().map(of).sum();
                    assert!((sum - of(&whole)).abs() <= 1e-12 * of(&whole), "{x} {y}");
                }
            }
        }
    }
}

#[test]
fn depth_counts_the_vertex_on_the_light() {
    // A mirror shows the light at the second vertex; the floor it lights is seen there at the third.
    let floor = small(v(0.0, 1.0, 5.0), DVec3::ZERO, 5.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 1.0, 1.0);
    let light = small(v(0.0, 1.0, 0.0), v(0.0, 2.0, 0.0), 5.0)
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 1.0, 1.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5));
    let mirrored = small(v(0.0, 1.0, 0.0), DVec3::ZERO, 5.0)
        .add(plane(DVec3::ZERO, DVec3::Y), MIRROR)
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 1.0, 1.0);
    for estimator in BOTH {
        for (scene, name, needs) in [
            (&light, "light", 1),
            (&floor, "floor", 2),
            (&mirrored, "mirror", 2),
        ] {
            for max_depth in 1..=3 {
                let s = Settings {
                    max_depth,
                    ..scene.settings()
                };
                let (film, counters) = scene.render(&s, estimator, 50);
                let seen = measured(&film, Rect::whole(film.size), 50).mean > 0.0;
                assert_eq!(
                    seen,
                    max_depth >= needs,
                    "{name}, {max_depth}, {estimator:?}"
                );
                let cut = counters.truncated == counters.paths;
                assert_eq!(cut, max_depth < needs, "{name}, {max_depth}: {counters:?}");
            }
        }
    }
}

#[test]
fn parts_that_need_no_further_vertex_do_not_count_as_cut() {
    let scene = cornell();
    let cut = |integrator, light, max_depth| {
        let s = Settings {
            integrator,
            light,
            max_depth,
            ..settings(&scene)
        };
        scene.render(&s, Estimator::LightSampling, 2).1.truncated
    };
    let emitted = LightParts {
        emitted: true,
        direct: false,
        indirect: false,
    };
    let direct = LightParts {
        direct: true,
        ..emitted
    };
    assert_eq!(cut(Integrator::Path, emitted, 1), 0);
    assert!(cut(Integrator::Path, direct, 1) > 0);
    assert_eq!(cut(Integrator::Path, direct, 2), 0);
    assert!(cut(Integrator::Path, LightParts::ALL, 2) > 0);
    assert_eq!(cut(Integrator::Whitted, LightParts::ALL, 64), 0);
}

#[test]
fn facing_mirrors_lose_a_hundredth_at_each_reflection() {
    let dull = Bsdf::Mirror {
        reflectance: DVec3::splat(0.99),
    };
    // Each crossing of the gap of width 1 goes 0.1 along; the light at 10.05 is met after 100 reflections.
    let scene = small(v(0.5, 0.0, 0.0), v(1.5, 0.0, 0.1), 1e-3)
        .add(plane(DVec3::ZERO, DVec3::X), dull)
        .add(plane(DVec3::X, -DVec3::X), dull)
        .light(v(0.5, 0.0, 10.0), -DVec3::Z, 2.0, 1.0);
    for estimator in BOTH {
        let m = scene.measure(estimator, 1000);
        m.assert_is("image 100", 0.99f64.powi(100), 0.02);
    }
}
