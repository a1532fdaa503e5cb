//! Direct light with closed forms, and light that must not be there.

use crate::build::*;
use etendue::film::coverage::Rect;
use etendue::reference::Estimator;
use etendue::settings::Settings;
use etendue::world::trace::Met;
use etendue::world::{Geometry, WorldPrimitive};
use glam::DVec3;

/// The disk's form factor for a receiver parallel to it and for one facing its axis.
fn form_factors(a: f64, h: f64, r: f64) -> [f64; 2] {
    let s = a * a + h * h - r * r;
    let q = (s * s + 4.0 * h * h * r * r).sqrt();
    let height = if s > 0.0 {
        2.0 * h * r * r / (q + s)
    } else {
        (q - s) / (2.0 * h)
    };
    let across = 2.0 * h * r * r * a / (q * (a * a + h * h + r * r + q));
    [h * height / q, across]
}

#[test]
fn a_floor_under_a_disk_light_has_the_closed_form_irradiance() {
    for (a, h, r) in [
        (0.5, 1.0, 1.0),
        (2.0, 1.0, 1.0),
        (1.0, 0.2, 1.0),
        (3.0, 0.5, 0.7),
    ] {
        // Nearly a single point of the floor, seen from the side.
        let scene = small(v(a, 0.1, 5.0), v(a, 0.0, 0.0), 1e-4)
            .add(plane(DVec3::ZERO, DVec3::Y), grey(0.6))
            .light(v(0.0, h, 0.0), -DVec3::Y, r, 2.0);
        let expected = 0.6 * 2.0 * form_factors(a, h, r)[0];
        for (estimator, samples) in BOTH.into_iter().zip([1000, 20_000]) {
            let m = scene.measure(estimator, samples);
            m.assert_is(&format!("({a}, {h}, {r}), {estimator:?}"), expected, 0.05);
        }
    }
}

#[test]
fn a_wall_beside_a_disk_light_has_the_closed_form_irradiance() {
    // The light's plane cuts the wall's hemisphere; while the whole disk is in front of the wall nothing is lost.
    for (a, h, r) in [(2.0, 1.0, 1.0), (3.0, 0.5, 0.7)] {
        let scene = small(v(0.5, -h, 5.0), v(a, -h, 0.0), 1e-4)
            .add(plane(v(a, 0.0, 0.0), -DVec3::X), grey(0.6))
            .light(DVec3::ZERO, -DVec3::Y, r, 2.0);
        let expected = 0.6 * 2.0 * form_factors(a, h, r)[1];
        let m = scene.measure(Estimator::LightSampling, 1000);
        m.assert_is(&format!("({a}, {h}, {r})"), expected, 0.01 * expected);
    }
}

#[test]
fn many_shadow_rays_and_many_lights_give_the_sum() {
    let mut scene =
        small(v(0.0, 0.1, 5.0), DVec3::ZERO, 1e-4).add(plane(DVec3::ZERO, DVec3::Y), grey(1.0));
    let mut expected = 0.0;
    for (x, h, r, le) in [
        (0.5, 1.0, 0.5, 1.0),
        (-2.0, 1.5, 0.2, 30.0),
        (1.0, 0.3, 0.1, 5.0),
    ] {
        scene = scene.light(v(x, h, 0.0), -DVec3::Y, r, le);
        expected += le * form_factors(x, h, r)[0];
    }
    for shadow_rays in [1, 2, 5, 16] {
        let settings = Settings {
            shadow_rays,
            ..scene.settings()
        };
        let (film, counters) = scene.render(&settings, Estimator::LightSampling, 1000);
        let m = measured(&film, Rect::whole(film.size), 1000);
        m.assert_is(&format!("{shadow_rays} shadow rays"), expected, 0.02);
        assert_eq!(counters.rays, counters.paths * (2 + u64::from(shadow_rays)));
    }
}

#[test]
fn a_light_is_seen_as_its_radiance_in_front_and_black_behind() {
    for (side, expected) in [(1.0, 7.0), (-1.0, 0.0)] {
        let scene = small(v(0.0, 0.0, 3.0 * side), DVec3::ZERO, 5.0)
            .light(DVec3::ZERO, DVec3::Z, 1.0, 7.0)
            // Something bright beyond the black back.
            .light(v(0.0, 0.0, 4.0), -DVec3::Z, 0.5, 100.0);
        for estimator in BOTH {
            let mean = scene.measure(estimator, 4).mean;
            assert!(
                (mean - expected).abs() < 1e-14 * expected + f64::MIN_POSITIVE,
                "{mean}"
            );
        }
    }
}

#[test]
fn no_light_behind_a_light_and_none_in_its_plane() {
    let scene = small(v(0.0, 0.5, 5.0), DVec3::ZERO, 10.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
        .light(v(0.0, 1.0, 0.0), DVec3::Y, 1.0, 100.0)
        .light(v(3.0, 0.0, 0.0), DVec3::Y, 1.0, 100.0);
    for estimator in BOTH {
        assert_eq!(scene.measure(estimator, 100).mean, 0.0);
    }
}

#[test]
fn closed_walls_do_not_leak() {
    let eye = v(0.3, 0.2, 0.9);
    let mut room = small(eye, DVec3::ZERO, 100.0);
    for n in [DVec3::X, DVec3::Y, DVec3::Z] {
        for n in [n, -n] {
            room = room.add(plane(-n, n), grey(0.9));
        }
    }
    let rod = cylinder(v(-0.2, -0.3, 0.0), v(0.3, 0.4, 0.1), 0.3);
    let scenes = [
        room.clone()
            .light(v(0.0, 1.0 + 1e-3, 0.0), -DVec3::Y, 0.5, 1e6),
        room.clone().light(v(0.0, 1.0, 0.0), DVec3::Y, 0.5, 1e6),
        room.add(rod, grey(0.9))
            .light(v(0.0, 0.0, 0.1), -DVec3::Y, 0.1, 1e6),
    ];
    for scene in scenes {
        for estimator in BOTH {
            assert_eq!(scene.measure(estimator, 200).mean, 0.0);
        }
    }
}

#[test]
fn a_flush_light_is_wholly_visible_and_lights_the_room() {
    let scene = small(v(0.0, 0.5, 0.0), DVec3::Y, 90.0)
        .add(plane(DVec3::Y, -DVec3::Y), grey(0.5))
        .add(disk(v(0.1, 1.0, 0.0), DVec3::Y, 0.7), grey(0.2))
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        // Flush on the ceiling and on the disk.
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 0.3, 3.0);
    let world = scene.world();
    let ceiling =
        |p: &WorldPrimitive| matches!(p.geometry, Geometry::Plane { normal, .. } if normal.y < 0.0);
    let ceiling = world.primitives.iter().position(ceiling).unwrap();
    let aim = |x: f64, z: f64| ray(v(0.0, 0.4, 0.0), v(x, 0.6, z));
    for k in 0..10_000 {
        let (s, c) = f64::from(k).sin_cos();
        let r = (f64::from(k) + 0.5) / 10_000.0;
        let hit = world.intersect(&aim(r * c, r * s)).unwrap();
        let expected = if r < 0.3 {
            Met::Light {
                index: 0,
                front: true,
            }
        } else if (r * c - 0.1).hypot(r * s) < 0.7 {
            Met::Primitive(0)
        } else {
            Met::Primitive(ceiling)
        };
        assert_eq!(hit.met, expected, "{k}");
        assert_eq!(world.occluded(&aim(r * c, r * s), 0), r >= 0.3);
    }
}

#[test]
fn where_coplanar_lights_overlap_the_first_is_seen_by_both_estimators() {
    let scene = small(v(0.0, 0.4, 5.0), DVec3::ZERO, 1e-3)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 0.5, 1.0)
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 1.0, 3.0)
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 0.7, 50.0);
    let f = |r: f64| form_factors(0.0, 1.0, r)[0];
    let expected = f(0.5) + 3.0 * (f(1.0) - f(0.5));
    for (estimator, samples) in BOTH.into_iter().zip([2000, 10_000]) {
        let m = scene.measure(estimator, samples);
        m.assert_is(&format!("{estimator:?}"), expected, 0.02);
    }
}

#[test]
fn the_umbra_is_black_and_outside_the_shadow_nothing_is_lost() {
    // A ball of radius 0.5 at height 1 between the floor and a light of radius 0.2 at height 3.
    let floor_at = |x: f64| {
        small(v(x, 0.1, 5.0), v(x, 0.0, 0.0), 1e-4)
            .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
            .add(sphere(v(0.0, 1.0, 0.0), 0.5), grey(0.0))
            .light(v(0.0, 3.0, 0.0), -DVec3::Y, 0.2, 10.0)
    };
    for x in [0.0, 0.3] {
        assert_eq!(floor_at(x).measure(Estimator::LightSampling, 200).mean, 0.0);
    }
    for x in [1.3, 2.0] {
        let m = floor_at(x).measure(Estimator::LightSampling, 2000);
        m.assert_is(&format!("{x}"), 10.0 * form_factors(x, 3.0, 0.2)[0], 1e-3);
    }
}
