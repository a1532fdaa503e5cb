//! Dielectrics with closed-form transmission.

use crate::build::*;
use etendue::reference::Estimator;
use etendue::scene::{Bsdf, Shape};
use etendue::world::trace::Met;
use etendue::world::{AIR, Geometry};
use glam::DVec3;

const AIR_IN_GLASS: Bsdf = Bsdf::Dielectric {
    ior: 1.0 / 1.52,
    transmittance: DVec3::ONE,
};

/// Looks down on a light far below, at almost normal incidence.
fn through(things: &[(Shape, Bsdf)]) -> Build {
    let scene = small(v(0.0, 5.0, 0.0), DVec3::ZERO, 0.1);
    things
        .iter()
        .fold(scene, |scene, (shape, bsdf)| {
            scene.add(shape.clone(), *bsdf)
        })
        .light(v(0.0, -5.0, 0.0), DVec3::Y, 3.0, 1.0)
}

#[test]
fn a_slab_transmits_the_fresnel_series() {
    let below = |y: f64, bsdf: Bsdf| (plane(v(0.0, y, 0.0), DVec3::Y), bsdf);
    let plate = cylinder(v(0.0, -0.1, 0.0), v(0.0, 0.1, 0.0), 50.0);
    let slabs = [
        // Glass below y = 1 in which there is air below y = 0, in either order in the file.
        vec![below(1.0, GLASS), below(0.0, AIR_IN_GLASS)],
        vec![below(0.0, AIR_IN_GLASS), below(1.0, GLASS)],
        vec![(plate, GLASS)],
    ];
    for slab in slabs {
        let m = through(&slab).measure(Estimator::LightSampling, 10_000);
        m.assert_is(&format!("{slab:?}"), 0.918318, 2e-3);
    }
}

#[test]
fn a_thin_shell_transmits_through_four_interfaces() {
    let shell = [
        (sphere(DVec3::ZERO, 1.0), GLASS),
        (sphere(DVec3::ZERO, 1.0 - 1e-4), AIR_IN_GLASS),
    ];
    let m = through(&shell).measure(Estimator::LightSampling, 10_000);
    m.assert_is("shell", 0.84897, 3e-3);
}

#[test]
fn tint_counts_once_per_refraction() {
    let tinted = Bsdf::Dielectric {
        ior: 1.0,
        transmittance: v(0.5, 1.0, 0.0),
    };
    let scene = through(&[(sphere(DVec3::ZERO, 1.0), tinted)]);
    let (film, _) = scene.render(&scene.settings(), Estimator::LightSampling, 16);
    let total = film.total(3, 3);
    let mean = [0, 1, 2].map(|c| total.iter().map(|s| s[c]).sum::<f64>() / 16.0);
    assert_eq!(mean, [0.25, 1.0, 0.0]);
}

#[test]
fn a_light_in_glass_is_seen_at_one_over_n_squared() {
    let scene = small(v(0.0, 3.0, 0.0), DVec3::ZERO, 0.1)
        .add(sphere(DVec3::ZERO, 1.0), GLASS)
        .light(DVec3::ZERO, DVec3::Y, 0.5, 1.0);
    // Inside, what is reflected at normal incidence comes back to the light, which reflects nothing.
    let expected = (1.0 - 0.0425800) / 2.3104;
    for estimator in BOTH {
        let m = scene.measure(estimator, 10_000);
        m.assert_is(&format!("{estimator:?}"), expected, 1.5e-3);
    }
    let seen = scene.world().lights[0].radiance.x;
    assert!(
        (seen - 1.0 / 2.3104).abs() < 1e-12,
        "the world's own factor: {seen}"
    );
}

#[test]
fn glass_resting_on_the_floor_has_a_gap_of_no_width() {
    let scene = small(v(0.0, 3.0, 5.0), DVec3::ZERO, 40.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        .add(cylinder(DVec3::ZERO, DVec3::Y, 0.5), GLASS)
        .light(v(0.0, 4.0, 0.0), -DVec3::Y, 1.0, 1.0);
    let world = scene.world();
    let rod = &world.primitives[0];
    assert!(matches!(rod.geometry, Geometry::Cylinder { .. }));

    let top = world.intersect(&ray(v(0.1, 3.0, 0.2), -DVec3::Y)).unwrap();
    assert_eq!((top.met, top.t), (Met::Primitive(0), 2.0));
    let cap = world
        .intersect(&from_hit(&top, -DVec3::Y, rod.solid))
        .unwrap();
    assert_eq!(
        (cap.met, cap.t, cap.normal),
        (Met::Primitive(0), 1.0, DVec3::Y)
    );
    let floor = world
        .intersect(&from_hit(&cap, v(0.3, -1.0, 0.0), AIR))
        .unwrap();
    assert_eq!((floor.met, floor.t), (Met::Primitive(1), 0.0));
    let back = world
        .intersect(&from_hit(&floor, v(0.1, 1.0, 0.0), AIR))
        .unwrap();
    assert_eq!((back.met, back.t), (Met::Primitive(0), 0.0));
    let out = world
        .intersect(&from_hit(&back, v(0.1, 1.0, 0.0), rod.solid))
        .unwrap();
    assert_eq!(out.met, Met::Primitive(0));
    assert!((out.t - 1.01f64.sqrt()).abs() < 1e-15);
    // Total reflection at the bottom cap stays inside.
    let inside = world
        .intersect(&from_hit(&cap, v(0.0, 1.0, 0.1), rod.solid))
        .unwrap();
    assert_eq!(inside.met, Met::Primitive(0));
    assert!(inside.t > 0.9);
}

#[test]
fn stacked_rods_are_crossed_one_after_the_other() {
    let scene = through(&[
        (cylinder(DVec3::ZERO, DVec3::Y, 0.5), GLASS),
        (cylinder(-DVec3::Y, DVec3::ZERO, 0.5), GLASS),
    ]);
    // Four interfaces, as the gap between the rods counts though it has no width.
    let m = scene.measure(Estimator::LightSampling, 10_000);
    m.assert_is("stack", 0.84897, 3e-3);
}

#[test]
fn total_reflection_keeps_light_in_a_rod() {
    // Light that comes in through the end at right angles across a gap leaves no ray for an eye beside the rod:
    // for n² >= 2 whatever enters through the end is totally reflected by the side.
    let scene = small(v(0.0, 0.0, 4.0), DVec3::ZERO, 10.0)
        .add(cylinder(v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0), 0.5), GLASS)
        .light(v(-1.2, 0.0, 0.0), DVec3::X, 0.3, 100.0);
    for estimator in BOTH {
        assert_eq!(scene.measure(estimator, 1000).mean, 0.0);
    }
}

#[test]
fn nested_solids_know_their_parents_in_any_order() {
    let glass = sphere(DVec3::ZERO, 1.0);
    let bubble = sphere(v(0.1, 0.0, 0.0), 0.5);
    let pearl = sphere(v(0.1, 0.1, 0.0), 0.2);
    let water = plane(v(0.0, 3.0, 0.0), DVec3::Y);
    let deep = plane(v(0.0, 2.0, 0.0), DVec3::Y);
    let all = [glass, bubble, pearl, water, deep];
    for order in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 4, 0, 3, 1]] {
        let world = order
            .iter()
            .fold(small(v(0.0, 9.0, 0.0), DVec3::ZERO, 40.0), |b, &i| {
                b.add(all[i].clone(), GLASS)
            })
            .light(v(0.0, 8.0, 0.0), -DVec3::Y, 1.0, 1.0)
            .world();
        // The world has an order of its own: each shape is found by its size or place.
        let by_shape = |shape: usize| {
            let is_it = |g: &Geometry| match *g {
                Geometry::Sphere { radius, .. } => [1.0, 0.5, 0.2].get(shape) == Some(&radius),
                Geometry::Plane { offset, .. } => offset == [0.0, 0.0, 0.0, 3.0, 2.0][shape],
                _ => false,
            };
            world
                .primitives
                .iter()
                .find(|p| is_it(&p.geometry))
                .unwrap()
        };
        assert_eq!(by_shape(3).parent, AIR, "{order:?}");
        for (inner, outer) in [(4, 3), (0, 4), (1, 0), (2, 1)] {
            assert_eq!(
                by_shape(inner).parent,
                by_shape(outer).solid,
                "{inner} in {order:?}"
            );
        }
        let n = world.indices[by_shape(2).solid as usize];
        assert!((n - 1.52f64.powi(5)).abs() < 1e-12, "{n}");
    }
}
