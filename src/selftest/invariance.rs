//! Scenes that must look the same: with huge spheres instead of planes, moved, in another order, on another backend.

use super::Case;
use super::backend::{Backend, Picture, Trouble};
use super::build::{Build, GLASS, MIRROR, cylinder, disk, grey, plane, sphere, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Range, Shot};
use crate::reference::Estimator;
use crate::scene::{Bsdf, Scene, Shape};
use crate::settings::Settings;
use glam::DVec3;
use std::sync::Arc;

pub const CASES: &[Case] = &[
    Case {
        row: "1",
        name: "walls_of_radius_1e5",
        what: "a box made of spheres of radius 10⁵, compared with one made of planes: cancellation",
        run: |b| huge_walls(b, 1e5),
    },
    Case {
        row: "2",
        name: "walls_of_radius_1e7",
        what: "the same with spheres of radius 10⁷",
        run: |b| huge_walls(b, 1e7),
    },
    Case {
        row: "6",
        name: "moved_by_1e4",
        what: "the whole scene moved by 10⁴, where one ulp is 10⁻³",
        run: moved,
    },
    Case {
        row: "42",
        name: "another_order",
        what: "primitives and lights in another file order: ties, choice of lights",
        run: another_order,
    },
    Case {
        row: "43",
        name: "another_device",
        what: "compared with the CPU reference (or that with its other estimator): rounding",
        run: another_device,
    },
];

/// Largest relative standard error of each of two pictures, so that their difference is known to 10⁻³.
const EACH: f64 = 0.65e-3;

/// The six walls of the cube |x|, |y|, |z| <= 1, with their inward normals.
const WALLS: [DVec3; 6] = [
    DVec3::X,
    DVec3::NEG_X,
    DVec3::Y,
    DVec3::NEG_Y,
    DVec3::Z,
    DVec3::NEG_Z,
];

fn white(k: usize) -> Bsdf {
    let reflectance = [v(0.5, 0.1, 0.1), v(0.1, 0.5, 0.1)];
    reflectance
        .get(k)
        .map_or(grey(0.5), |&reflectance| Bsdf::Diffuse { reflectance })
}

fn cornell(wall: impl Fn(DVec3) -> Shape) -> Build {
    let mut build = Build::new(v(0.2, 0.1, 0.9), v(0.0, -0.1, 0.0), 70.0);
    for (k, n) in WALLS.into_iter().enumerate() {
        build = build.add(wall(n), white(k));
    }
    build
        .add(sphere(v(-0.4, -0.6, -0.3), 0.35), grey(0.6))
        .add(sphere(v(0.5, -0.5, -0.2), 0.3), MIRROR)
        .light(v(0.0, 0.95, 0.0), -DVec3::Y, 0.8, 1.0)
}

/// Two pictures of one thing: their means, and blocks of them.
fn same_picture(what: &str, a: &Picture, b: &Picture) -> Vec<Measure> {
    let pairs: Vec<_> = a
        .blocks(6)
        .into_iter()
        .zip(b.blocks(6))
        .map(|(a, b)| {
            let error = a.error.hypot(b.error);
            (super::Mean { error, ..a }, b.mean)
        })
        .collect();
    vec![
        Measure::same(format!("{what}: mean"), a.mean(), b.mean()),
        Measure::farthest(&format!("{what}: blocks"), &pairs),
    ]
}

fn huge_walls(b: &Backend, radius: f64) -> Result<Vec<Measure>, Trouble> {
    let flat = cornell(|n| plane(-n, n));
    let round = cornell(|n| sphere(-n * (1.0 + radius), radius));
    let settings = flat.settings();
    let error = EACH * approximate_mean(b, &flat, &settings)?;
    let planes = b.picture_to(&flat, &settings, error)?;
    let spheres = b.picture_to(&round, &settings, error)?;
    let mut measures = same_picture("against planes", &spheres, &planes);

    // Distances to the walls alone, against the same quadratic in f64.
    let mut walls = Build::new(v(0.2, 0.1, 0.9), DVec3::ZERO, 70.0);
    for n in WALLS {
        walls = walls.add(sphere(-n * (1.0 + radius), radius), grey(0.5));
    }
    let range = Range::new(
        b,
        &walls.light(v(0.0, 0.95, 0.0), DVec3::Y, 1e-3, 1.0),
        None,
    );
    let origin = range.world().origin;
    let mut dice = Dice::new(1);
    let shots: Vec<Shot> = (0..20_000)
        .map(|_| Shot::free(dice.point(0.9) - origin, dice.direction()))
        .collect();
    let mut worst = 0.0f64;
    for (shot, landing) in shots.iter().zip(range.shoot(&shots)?) {
        if landing.surface == Some(0) {
            continue;
        }
        let to_wall = |n: DVec3| {
            let f = shot.origin + origin + n * (1.0 + radius);
            let (b, c) = (f.dot(shot.direction), f.length_squared() - radius * radius);
            let disc = b * b - c;
            if b < 0.0 && disc >= 0.0 {
                c / (-b + disc.sqrt())
            } else {
                f64::INFINITY
            }
        };
        let nearest = WALLS.into_iter().map(to_wall).fold(f64::INFINITY, f64::min);
        let met = landing.surface.is_some();
        worst = worst.max(if met {
            (landing.t - nearest).abs()
        } else {
            f64::INFINITY
        });
    }
    measures.push(Measure::new(
        "largest error of a distance",
        worst,
        0.0,
        Tolerance::Absolute(1e-4),
    ));
    Ok(measures)
}

fn approximate_mean(b: &Backend, build: &Build, settings: &Settings) -> Result<f64, Trouble> {
    Ok(b.picture(build, settings, 64)?.mean().mean)
}

/// A closed box with a thing of every kind and two lights.
fn room() -> Build {
    let gloss = Bsdf::Phong {
        diffuse: v(0.3, 0.1, 0.1),
        specular: DVec3::splat(0.4),
        exponent: 20.0,
    };
    let mut build = Build::new(v(0.2, 0.1, 0.9), v(0.0, -0.1, 0.0), 70.0).size(36, 24);
    for (k, n) in WALLS.into_iter().enumerate() {
        build = build.add(plane(-n, n), white(k));
    }
    build
        .add(sphere(v(-0.5, -0.7, -0.5), 0.3), MIRROR)
        .add(sphere(v(0.0, -0.75, -0.1), 0.25), gloss)
        .add(sphere(v(0.5, -0.7, 0.1), 0.25), GLASS)
        .add(
            cylinder(v(0.5, -1.0, -0.6), v(0.5, -0.2, -0.6), 0.25),
            grey(0.6),
        )
        .add(disk(v(-0.8, 0.3, -0.2), v(1.0, 0.3, 0.0), 0.4), gloss)
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 0.7, 1.0)
        .light(v(0.99, 0.3, 0.3), -DVec3::X, 0.4, 0.6)
}

fn moved(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let here = room();
    let by = v(1e4, -1e4, 1e4);
    let mut there = here.clone();
    let scene = &mut there.0;
    scene.camera.eye += by;
    scene.camera.look_at += by;
    for p in &mut scene.primitives {
        match &mut p.shape {
            Shape::Sphere { center, .. } | Shape::Disk { center, .. } => *center += by,
            Shape::Plane { point, .. } => *point += by,
            Shape::Cylinder { base, top, .. } => {
                *base += by;
                *top += by;
            }
            Shape::Implicit(implicit) => Arc::make_mut(implicit).center += by,
        }
    }
    for l in &mut scene.lights {
        l.center += by;
    }
    compare(b, "against the unmoved", &there, &here)
}

fn compare(b: &Backend, what: &str, one: &Build, other: &Build) -> Result<Vec<Measure>, Trouble> {
    let settings = other.settings();
    let error = EACH * approximate_mean(b, other, &settings)?;
    // Other random numbers: the pictures are independent.
    let again = Settings {
        seed: 1,
        ..settings.clone()
    };
    let a = b.picture_to(one, &again, error)?;
    Ok(same_picture(
        what,
        &a,
        &b.picture_to(other, &settings, error)?,
    ))
}

fn another_order(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let forwards = room();
    let mut backwards = forwards.clone();
    let Scene {
        primitives, lights, ..
    } = &mut backwards.0;
    primitives.reverse();
    lights.reverse();
    let settings = forwards.settings();
    let [a, b] = [
        b.picture(&forwards, &settings, 16)?,
        b.picture(&backwards, &settings, 16)?,
    ];
    let pairs = a.film.sums().iter().zip(b.film.sums());
    let partial = a.film.partial().iter().zip(b.film.partial());
    let other = pairs.filter(|(a, b)| a != b).count() + partial.filter(|(a, b)| a != b).count();
    Ok(vec![
        Measure::none("against file order: pixels with other bits", other),
        Measure::new("lit pixels", a.lit_pixels() as f64, 0.0, Tolerance::Above),
    ])
}

fn another_device(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // Without light sampling the light must be easy to hit.
    let (what, estimator, build) = if b.open_gpu().is_some() {
        ("against the reference", Estimator::LightSampling, room())
    } else {
        let flat = cornell(|n| plane(-n, n));
        (
            "against no light sampling",
            Estimator::NoLightSampling,
            flat,
        )
    };
    let settings = build.settings();
    let error = EACH * approximate_mean(b, &build, &settings)?;
    let this = b.picture_to(&build, &settings, error)?;
    let again = Settings {
        seed: 1,
        ..settings
    };
    let other = b.reference_to(&build, &again, estimator, error)?;
    Ok(same_picture(what, &this, &other))
}
