//! A sphere closed by a disk light: every wall point has the same closed-form radiance, and with white walls
//! whatever loses no energy vanishes in it.

use crate::build::*;
use etendue::film::coverage::Rect;
use etendue::reference::Estimator;
use etendue::scene::{Bsdf, Shape};
use etendue::settings::Settings;
use glam::DVec3;

/// Light sampling pays a fixed amount at each of a random number of vertices, chance the whole once: in a white
/// dome chance has next to no variance.
const PRECISION: [f64; 2] = [0.012, 2e-3];

/// White upper half of a sphere of radius 1 over a light of radiance 1, the eye within.
fn dome(eye: DVec3, look_at: DVec3) -> Build {
    small(eye, look_at, 70.0)
        .add(sphere(DVec3::ZERO, 1.0), grey(1.0))
        .light(DVec3::ZERO, DVec3::Y, 1.0, 1.0)
}

fn dome_with(things: &[(Shape, Bsdf)]) -> Build {
    let mut scene = dome(v(0.0, 0.5, 0.8), v(0.0, 0.4, 0.0));
    for (shape, bsdf) in things {
        scene = scene.add(shape.clone(), *bsdf);
    }
    scene
}

#[test]
fn objects_without_loss_are_invisible_in_the_white_dome() {
    let ball = || sphere(v(0.1, 0.4, 0.0), 0.25);
    let rod = || cylinder(v(-0.3, 0.2, -0.2), v(0.3, 0.5, 0.0), 0.15);
    let small = |x: f64| sphere(v(x, 0.4, 0.0), 0.2);
    let bubble = Bsdf::Dielectric {
        ior: 1.0 / 1.52,
        transmittance: DVec3::ONE,
    };
    let scenes: [(&str, Vec<(Shape, Bsdf)>); 10] = [
        ("empty", vec![]),
        ("white sphere", vec![(ball(), grey(1.0))]),
        ("mirror sphere", vec![(ball(), MIRROR)]),
        ("glass sphere", vec![(ball(), GLASS)]),
        ("white cylinder", vec![(rod(), grey(1.0))]),
        ("glass cylinder", vec![(rod(), GLASS)]),
        (
            "touching glass",
            vec![(small(-0.2), GLASS), (small(0.2), GLASS)],
        ),
        (
            "touching mirrors",
            vec![(small(-0.2), MIRROR), (small(0.2), MIRROR)],
        ),
        (
            "glass shell",
            vec![(ball(), GLASS), (sphere(v(0.1, 0.4, 0.0), 0.2499), bubble)],
        ),
        (
            "glass cylinder on a mirror disk",
            vec![
                (cylinder(v(0.0, 0.2, 0.0), v(0.0, 0.6, 0.0), 0.2), GLASS),
                (disk(v(0.1, 0.2, 0.0), DVec3::Y, 0.3), MIRROR),
            ],
        ),
    ];
    for (name, things) in scenes {
        let scene = dome_with(&things);
        for (estimator, precision) in BOTH.into_iter().zip(PRECISION) {
            let what = format!("{name}, {estimator:?}");
            scene
                .measure(estimator, 1000)
                .assert_is(&what, 1.0, precision);
        }
    }
}

#[test]
fn light_sampling_finds_the_dome_s_radiance_to_a_thousandth_and_a_half() {
    let scene = dome(v(0.0, 0.5, 0.8), v(0.0, 0.4, 0.0));
    let m = scene.measure(Estimator::LightSampling, 50_000);
    m.assert_is("empty", 1.0, 1.5e-3);
}

#[test]
fn the_white_dome_is_uniform() {
    let scene = dome_with(&[
        (sphere(v(-0.2, 0.4, 0.0), 0.2), GLASS),
        (sphere(v(0.2, 0.4, 0.0), 0.2), MIRROR),
    ]);
    let samples = 2000;
    for estimator in BOTH {
        let (film, counters) = scene.render(&scene.settings(), estimator, samples);
        assert_eq!(counters.truncated, 0);
        for (x, y) in (0..8).flat_map(|x| (0..6).map(move |y| (x, y))) {
            let pixel = Rect {
                x0: x,
                y0: y,
                x1: x + 1,
                y1: y + 1,
            };
            let m = measured(&film, pixel, samples);
            let what = format!("pixel {x} {y}, {estimator:?}");
            if estimator == Estimator::LightSampling {
                m.assert_is(&what, 1.0, 0.07);
            } else {
                // Nearly all samples are 1: too skewed for a z-test of one pixel.
                assert!((m.mean - 1.0).abs() < 0.01, "{what}: {m:?}");
            }
        }
    }
}

#[test]
fn a_chord_at_six_tenths_gives_one_sixth() {
    let scene = small(v(0.0, 0.0, 0.2), v(0.0, 0.1, -1.0), 60.0)
        .add(sphere(DVec3::ZERO, 1.0), grey(0.5))
        .light(v(0.0, 0.0, 0.6), -DVec3::Z, 0.8, 1.0);
    for estimator in BOTH {
        let m = scene.measure(estimator, 8000);
        m.assert_is(&format!("{estimator:?}"), 1.0 / 6.0, 3e-3);
    }
}

#[test]
fn a_nearly_white_sphere_with_a_small_light_needs_hundreds_of_vertices() {
    // F = 0.01: L = 0.999 · 0.01/(1 - 0.999 · 0.99).
    let f = 0.01;
    let height = 2.0 * f;
    let radius = (1.0f64 - (1.0 - height) * (1.0 - height)).sqrt();
    let scene = small(v(0.3, 0.0, 0.2), v(0.0, 0.1, -1.0), 60.0)
        .add(sphere(DVec3::ZERO, 1.0), grey(0.999))
        .light(v(0.0, 0.0, 1.0 - height), -DVec3::Z, radius, 1.0);
    let expected = 0.999 * f / (1.0 - 0.999 * (1.0 - f));
    assert!((expected - 0.90901).abs() < 1e-5);
    let settings = Settings {
        max_depth: 2000,
        ..scene.settings()
    };
    for (estimator, samples) in BOTH.into_iter().zip([1000, 2000]) {
        let (film, counters) = scene.render(&settings, estimator, samples);
        assert_eq!(counters.truncated, 0);
        measured(&film, Rect::whole(film.size), samples).assert_is(
            &format!("{estimator:?}"),
            expected,
            0.04,
        );
    }
}

#[test]
fn an_eye_in_glass_sees_n_squared_times_the_dome() {
    // Nearer the centre than R/n no ray is totally reflected.
    let center = v(0.0, 0.5, 0.0);
    for offset in [DVec3::ZERO, v(0.05, -0.1, 0.1)] {
        let eye = center + offset;
        let scene = dome(eye, eye + DVec3::X).add(sphere(center, 0.3), GLASS);
        for (estimator, precision) in BOTH.into_iter().zip(PRECISION) {
            let m = scene.measure(estimator, 1000);
            let what = format!("{offset}, {estimator:?}");
            m.assert_is(&what, 2.3104, 2.3104 * precision);
        }
        let seen = scene.world().lights[0].radiance.x;
        assert!(
            (seen - 2.3104).abs() < 1e-12,
            "the world's own factor: {seen}"
        );
    }
}
