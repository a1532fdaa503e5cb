//! Light that must not get through, and light that must.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, cylinder, disk, grey, plane, sphere, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use super::{contact, leaving};
use crate::world::Geometry;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "25",
        name: "flush_on_a_wall",
        what: "lights and a disk flush on a wall and on a cap: z-fighting",
        run: flush,
    },
    Case {
        row: "26",
        name: "light_outside_a_box",
        what: "lights outside closed rooms: leaks",
        run: outside_a_box,
    },
    Case {
        row: "27",
        name: "light_inside_a_cylinder",
        what: "lights inside a closed cylinder: leaks at the rim",
        run: inside_a_cylinder,
    },
    Case {
        row: "L1",
        name: "leaving_a_surface",
        what: "rays that leave primitives of size 10⁻³ to 10⁵, up to 10⁴ from the origin: false hits",
        run: leaving::rays_that_leave,
    },
    Case {
        row: "L2",
        name: "shadows_at_contact",
        what: "shadow rays from points where solids touch: leaks and false hits",
        run: contact::shadows,
    },
];

fn flush(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    const RAYS: usize = 350_000;
    let normal = v(0.2, -1.0, 0.1).normalize();
    let (lamp, patch) = (
        v(0.1, 1.2, -0.3),
        v(0.1, 1.2, -0.3) + normal.any_orthonormal_vector(),
    );
    let build = Build::new(v(0.0, 0.0, 3.0), DVec3::ZERO, 60.0)
        .add(plane(lamp, normal), grey(0.5))
        .add(disk(patch, -normal, 0.3), grey(0.5))
        .add(
            cylinder(v(0.0, -9.0, 0.0), v(0.3, -7.0, 0.2), 0.5),
            grey(0.5),
        )
        .light(lamp, normal, 0.4, 1.0)
        .light(v(0.3, -7.0, 0.2), v(0.3, 2.0, 0.2), 0.4, 1.0);
    let range = Range::new(b, &build, None);
    let world = range.world();
    let patch = range.number(|p| matches!(p.geometry, Geometry::Disk { .. }));
    let Geometry::Disk { center, .. } = world.primitives[patch - world.lights.len()].geometry
    else {
        unreachable!("it was looked for");
    };
    let mut dice = Dice::new(25);
    let mut measures = Vec::new();
    for (name, number, center, radius, n) in [
        ("light on a plane", 0, world.lights[0].center, 0.4, normal),
        (
            "light on a cap",
            1,
            world.lights[1].center,
            0.4,
            world.lights[1].normal,
        ),
        ("disk on a plane", patch, center, 0.3, normal),
    ] {
        let shots: Vec<Shot> = (0..RAYS)
            .map(|_| {
                // Up to a hundred-thousandth of the rim, from any side of the front.
                let target = dice.on_disk(center, n, radius, 1.0 - 1e-5);
                let cosine = dice.between(0.05, 1.0);
                let distance = dice.scale(-2.0, 0.3);
                let from = target + dice.around(n, cosine) * distance;
                Shot {
                    aim: Some((number.min(1), distance)),
                    ..Shot::free(from, target - from)
                }
            })
            .collect();
        let landings = range.shoot(&shots)?;
        let light = number < 2;
        let wrong = |l: &&Landing| l.surface != Some(number) || (light && l.occluded);
        measures.push(Measure::none(
            format!("{name}: wall hits of {RAYS}"),
            landings.iter().filter(wrong).count(),
        ));
    }
    Ok(measures)
}

fn outside_a_box(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let eye = v(0.1, 0.2, 0.3);
    let room = Build::new(eye, v(0.0, 0.0, -1.0), 100.0);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let normals = || axes.into_iter().flat_map(|n| [n, -n]);
    let lit = |build: Build| {
        build
            .light(v(0.0, 2.0, 0.0), -DVec3::Y, 1.5, 1e6)
            .light(v(2.0, 0.0, 0.0), -DVec3::X, 1.5, 1e6)
            .light(v(0.0, -1.001, 0.0), DVec3::Y, 0.9, 1e6)
    };
    let white = grey(1.0);
    let rooms = [
        (
            "six planes",
            normals().fold(room.clone(), |r, n| r.add(plane(-n, n), white)),
        ),
        (
            "six huge spheres",
            normals().fold(room.clone(), |r, n| {
                r.add(sphere(-n * (1.0 + 1e5), 1e5), white)
            }),
        ),
        (
            "a sphere",
            room.clone().add(sphere(DVec3::ZERO, 1.0), white),
        ),
        (
            "a cylinder",
            room.add(cylinder(-DVec3::Y, DVec3::Y, 1.0), white),
        ),
    ];
    let mut measures = Vec::new();
    let mut rays = 0;
    for (name, room) in rooms {
        let room = lit(room);
        let picture = b.picture(&room, &room.depth(40), 64)?;
        rays += picture.counters.rays;
        measures.push(Measure::none(
            format!("{name}: lit pixels"),
            picture.lit_pixels(),
        ));
        if b.open_gpu().is_some() {
            // Roulette ends no path between white walls, so a path that ends early has escaped.
            let out = picture.counters.paths - picture.counters.truncated;
            measures.push(Measure::none(
                format!("{name}: paths that escaped"),
                out as usize,
            ));
        }
    }
    measures.push(Measure::new("rays", rays as f64, 1e7, Tolerance::Above));
    Ok(measures)
}

fn inside_a_cylinder(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // A floor without horizon: f32 directions cannot aim at a thing from ten million of its sizes away.
    let build = Build::new(v(0.0, 2.5, 3.0), v(0.0, 0.3, 0.0), 40.0)
        .add(disk(DVec3::ZERO, DVec3::Y, 100.0), grey(0.9))
        .add(cylinder(DVec3::ZERO, v(0.0, 1.0, 0.0), 0.5), grey(0.9))
        .add(cylinder(v(0.9, 0.5, 0.3), v(1.4, 0.9, 0.1), 0.3), grey(0.9))
        // Close to caps and side.
        .light(v(0.0, 0.999, 0.0), -DVec3::Y, 0.4995, 1e6)
        .light(v(0.0, 0.001, 0.0), DVec3::Y, 0.4995, 1e6)
        .light(v(1.15, 0.7, 0.2), v(0.5, 0.4, -0.2), 0.2995, 1e6);
    let picture = b.picture(&build, &build.depth(8), 512)?;
    Ok(vec![
        Measure::none("lit pixels outside", picture.lit_pixels()),
        Measure::new("rays", picture.counters.rays as f64, 1e6, Tolerance::Above),
    ])
}
