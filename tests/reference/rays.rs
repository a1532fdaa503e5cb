//! What single rays meet: sides, ties, and what a path stands on.

use crate::build::*;
use etendue::scene::{Bsdf, Shape};
use etendue::world::trace::{Hit, Met, Ray};
use etendue::world::{AIR, Geometry};
use glam::DVec3;

fn scene_of(eye: DVec3, things: &[(Shape, Bsdf)]) -> Build {
    let scene = small(eye, eye + v(0.3, 0.1, 1.0), 60.0);
    things
        .iter()
        .fold(scene, |scene, (shape, bsdf)| {
            scene.add(shape.clone(), *bsdf)
        })
        .light(v(50.0, 50.0, 50.0), DVec3::Y, 1.0, 1.0)
}

/// Directions spread over the sphere (a Fibonacci spiral).
fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (s, c) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        v(r * c, r * s, z)
    })
}

#[test]
fn from_inside_a_box_every_ray_meets_the_nearest_wall_from_every_wall() {
    let walls = [
        DVec3::X,
        -DVec3::X,
        DVec3::Y,
        -DVec3::Y,
        DVec3::Z,
        -DVec3::Z,
    ]
    // Half of the normals point outwards in the file.
    .map(|n| (plane(-n, n * n.element_sum()), grey(0.5)));
    let eye = v(0.2, -0.4, 0.7);
    let world = scene_of(eye, &walls).world();
    let nearest = |o: DVec3, d: DVec3| {
        let per_axis = (d.signum() - o) / d;
        per_axis.min_element()
    };
    for d in directions(2000) {
        let mut from = ray(eye, d);
        // Ten diffuse-like bounces, standing on each wall in turn.
        for next in directions(10) {
            let hit = world.intersect(&from).expect("a wall");
            assert!((hit.t - nearest(from.origin, from.direction)).abs() < 1e-12);
            assert!(hit.normal.dot(from.direction) < 0.0);
            assert!(hit.point.abs().max_element() < 1.0 + 1e-15);
            let up = (next + hit.normal * 1.001).normalize();
            from = from_hit(&hit, up, AIR);
        }
    }
}

#[test]
fn an_eye_in_an_opaque_cylinder_sees_all_of_it_and_nothing_else() {
    let tube = (cylinder(-DVec3::Y, DVec3::Y, 0.5), MIRROR);
    let beyond = (plane(v(0.0, -2.0, 0.0), DVec3::Y), grey(0.5));
    let world = scene_of(v(0.1, 0.2, 0.0), &[tube, beyond]).world();
    let mut faces = std::collections::HashSet::new();
    for d in directions(2000) {
        let mut from = ray(v(0.1, 0.2, 0.0), d);
        for _ in 0..20 {
            let hit = world.intersect(&from).expect("the tube");
            assert_eq!(hit.met, Met::Primitive(0));
            let p = hit.point;
            let on_side = (p.x.hypot(p.z) - 0.5).abs() < 1e-14 && p.y.abs() <= 1.0 + 1e-14;
            let on_cap = (p.y.abs() - 1.0).abs() < 1e-14 && p.x.hypot(p.z) <= 0.5 + 1e-14;
            assert!(on_side || on_cap, "{p}");
            assert!(hit.t > 0.0 && hit.normal.dot(from.direction) < 0.0);
            faces.insert(hit.face);
            let d = from.direction - hit.normal * (2.0 * hit.normal.dot(from.direction));
            from = from_hit(&hit, d, AIR);
        }
    }
    assert_eq!(faces.len(), 3);
}

#[test]
fn convex_things_left_from_outside_are_not_met_again() {
    let things = [
        (sphere(v(100.0, 100.0, 100.0), 1.0), grey(0.5)),
        (
            cylinder(v(97.0, 99.0, 100.0), v(97.5, 101.0, 100.5), 0.8),
            grey(0.5),
        ),
    ];
    let eye = v(98.5, 100.0, 90.0);
    let world = scene_of(eye, &things).world();
    let mut hits = 0;
    for d in directions(4000) {
        // Towards the two things.
        let Some(hit) = world.intersect(&ray(eye, d + v(0.0, 0.0, 3.0))) else {
            continue;
        };
        hits += 1;
        for out in directions(20) {
            let out = (out + hit.normal).normalize();
            if let Some(again) = world.intersect(&from_hit(&hit, out, AIR)) {
                assert_ne!(again.met, hit.met);
            }
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn coincident_faces_are_met_as_light_disk_cap_plane() {
    // One place on the plane y = 0 each for the plane alone, then one more face on top of the others.
    let scene = small(v(0.0, 3.0, 0.0), v(0.0, 0.0, 0.1), 60.0)
        .add(sphere(v(0.0, -5.0, 0.0), 5.0), grey(0.5))
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        .add(disk(v(0.0, 1e-12, 0.0), -DVec3::Y, 2.0), grey(0.5))
        .add(cylinder(-DVec3::Y, DVec3::ZERO, 3.0), grey(0.5))
        .light(v(0.0, -1e-12, 0.0), DVec3::Y, 1.0, 1.0);
    let world = scene.world();
    let kind = |x: f64| {
        let hit = world
            .intersect(&ray(v(x, 2.0, 0.7), v(0.1, -1.0, -0.35)))
            .unwrap();
        assert!(
            (hit.t - 2.0 * 1.1325f64.sqrt()).abs() < 1e-11,
            "{x}: {hit:?}"
        );
        match hit.met {
            Met::Light { .. } => "light",
            Met::Primitive(i) => match world.primitives[i].geometry {
                Geometry::Disk { .. } => "disk",
                Geometry::Cylinder { .. } => "cap",
                Geometry::Plane { .. } => "plane",
                _ => "sphere",
            },
        }
    };
    assert_eq!(
        [0.0, 1.5, 2.5, 3.5].map(kind),
        ["light", "disk", "cap", "plane"]
    );
}

#[test]
fn disks_are_two_sided_and_glass_needs_the_right_medium() {
    let things = [
        (disk(DVec3::ZERO, DVec3::Y, 1.0), grey(0.5)),
        (sphere(v(5.0, 0.0, 0.0), 1.0), GLASS),
    ];
    let world = scene_of(v(0.0, 9.0, 0.0), &things).world();
    for y in [-2.0, 2.0] {
        let hit = world
            .intersect(&ray(v(0.5, y, 0.0), v(0.0, -y, 0.0)))
            .unwrap();
        assert_eq!((hit.t, hit.normal), (2.0, v(0.0, y.signum(), 0.0)));
        for up in [v(0.3, 1.0, 0.0), v(0.0, 1e-9, 1.0)] {
            let away = from_hit(&hit, up * y.signum(), AIR);
            assert_eq!(world.intersect(&away), None);
        }
    }
    let glass = &world.primitives[1];
    let near = |hit: Option<Hit>| hit.map(|h| (h.t * 1e9).round() / 1e9);
    let mut r = ray(v(5.0, 0.0, 4.0), -DVec3::Z);
    assert_eq!(near(world.intersect(&r)), Some(3.0), "enters");
    r.medium = glass.solid;
    assert_eq!(
        near(world.intersect(&r)),
        Some(5.0),
        "already inside, so it leaves"
    );
    r.medium = 77;
    assert_eq!(
        near(world.intersect(&r)),
        None,
        "in a solid that knows nothing of it"
    );
}

#[test]
fn rooms_of_huge_spheres_and_of_planes_are_the_same() {
    let eye = v(0.2, 0.1, 0.7);
    let normals = [
        DVec3::X,
        -DVec3::X,
        DVec3::Y,
        -DVec3::Y,
        DVec3::Z,
        -DVec3::Z,
    ];
    let planes = normals.map(|n| (plane(-n, n), grey(0.5)));
    for radius in [1e5, 1e7] {
        let spheres = normals.map(|n| (sphere(-n * (1.0 + radius), radius), grey(0.5)));
        let flat = scene_of(eye, &planes).world();
        let mut build = scene_of(eye, &spheres);
        // A light as near as the walls, or the spheres would not be huge beside it.
        build.0.lights[0].center = v(0.0, 0.5, 0.0);
        let round = build.world();
        let huge = |g: &Geometry| matches!(g, Geometry::HugeSphere { .. });
        assert!(round.primitives.iter().all(|p| huge(&p.geometry)));
        for d in directions(2000) {
            let (a, b) = (flat.intersect(&ray(eye, d)), round.intersect(&ray(eye, d)));
            let (a, b) = (a.unwrap(), b.unwrap());
            if matches!(b.met, Met::Light { .. }) || a.met != b.met {
                // The light, or within the walls' curvature of an edge: 2/R.
                continue;
            }
            // A wall falls back by x²/2R <= 1/R, and a glancing ray meets it that much later over cos θ.
            let cosine = -a.normal.dot(d);
            assert!(
                (a.t - b.t).abs() <= 2.0 / (radius * cosine),
                "{d}: {} {}",
                a.t,
                b.t
            );
        }
    }
}

#[test]
fn zero_and_negative_zero_directions_and_starts_on_rims_are_finite() {
    let things = [
        (sphere(DVec3::ZERO, 1.0), GLASS),
        (cylinder(v(3.0, 0.0, 0.0), v(3.0, 1.0, 0.0), 1.0), GLASS),
        (disk(v(-3.0, 0.0, 0.0), DVec3::Y, 1.0), grey(0.5)),
    ];
    let world = scene_of(v(0.0, 5.0, 9.0), &things).world();
    let origins = [
        DVec3::ZERO,
        v(3.0, 0.0, 0.0),
        v(4.0, 1.0, 0.0),
        v(-2.0, 0.0, 0.0),
        v(1.0, 0.0, 0.0),
    ];
    for origin in origins {
        for zero in [0.0, -0.0] {
            for one in [1.0, -1.0] {
                for d in [v(one, zero, zero), v(zero, one, zero), v(zero, zero, one)] {
                    for medium in 0..=2 {
                        let r = Ray {
                            medium,
                            ..ray(origin, d)
                        };
                        if let Some(hit) = world.intersect(&r) {
                            assert!(hit.t.is_finite() && hit.t >= 0.0, "{r:?}: {hit:?}");
                            assert!(
                                hit.point.is_finite() && hit.normal.is_finite(),
                                "{r:?}: {hit:?}"
                            );
                        }
                    }
                }
            }
        }
    }
}
