//! Spheres far away, at their edge and from inside, and rays that leave a primitive.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, cylinder, disk, grey, sphere, v};
use super::measure::{Mean, Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use crate::scene::{Bsdf, Shape};
use crate::settings::Settings;
use crate::world::{AIR, Geometry, WorldPrimitive};
use glam::DVec3;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        row: "3",
        name: "far_sphere",
        what: "a unit sphere at 10³ and 10⁴ through a long lens: b² - c",
        run: far_sphere,
    },
    Case {
        row: "4",
        name: "far_small_sphere",
        what: "a sphere of radius 0.01 at 10³: b² - c",
        run: far_small_sphere,
    },
    Case {
        row: "5",
        name: "tangent_rays",
        what: "rays that miss a sphere's centre by r(1 - k 2⁻²⁰): a square root near 0",
        run: tangent_rays,
    },
    Case {
        row: "7",
        name: "glancing_chords",
        what: "chords inside a sphere, down to grazing: a ray hits the surface that it starts on",
        run: glancing_chords,
    },
    Case {
        row: "40",
        name: "zero_components",
        what: "directions with components ±0, from centres, axes, rims and surfaces: NaN",
        run: zero_components,
    },
];

/// Share of the picture that a black sphere covers before a light, and what it should be; `direction` to the sphere,
/// which is `distance` away.
fn coverage(
    b: &Backend,
    radius: f64,
    distance: f64,
    direction: DVec3,
) -> Result<(Mean, f64), Trouble> {
    let direction = direction.normalize();
    let tangent = {
        let sine = radius / distance;
        sine / (1.0 - sine * sine).sqrt()
    };
    let half_height = 1.5 * tangent;
    let vfov = 2.0 * half_height.atan().to_degrees();
    let center = direction * distance;
    // Far enough behind and large enough to fill the view.
    let light = center + direction * (20.0 * radius);
    let build = Build::new(DVec3::ZERO, center, vfov)
        .add(sphere(center, radius), grey(0.0))
        .light(light, -direction, 8.0 * radius, 1.0);
    // Strata, for the sphere's edge is all that is left to chance.
    let settings = Settings {
        strata: 16,
        max_depth: 1,
        ..build.settings()
    };
    let picture = b.picture(&build, &settings, 1024)?;
    let (mut sum, mut variance) = (0.0, 0.0);
    picture.film.for_each(|_, _, e| {
        sum += 1.0 - e.mean[0];
        variance += e.error[0].powi(2);
    });
    let [w, h] = settings.size.map(f64::from);
    let window = (2.0 * half_height).powi(2) * w / h;
    let covered = Mean {
        mean: sum / (w * h),
        error: variance.sqrt() / (w * h),
    };
    Ok((covered, PI * tangent * tangent / window))
}

const OBLIQUE: DVec3 = DVec3::new(0.48, -0.36, 0.8);

fn far_sphere(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for distance in [1e3, 1e4] {
        for (way, direction) in [("along z", -DVec3::Z), ("obliquely", OBLIQUE)] {
            let (covered, expected) = coverage(b, 1.0, distance, direction)?;
            measures.push(Measure::sampled(
                format!("share covered at {distance}, {way}"),
                covered,
                expected,
                Tolerance::Relative(1e-3),
            ));
        }
    }
    Ok(measures)
}

fn far_small_sphere(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for (way, direction) in [("along z", -DVec3::Z), ("obliquely", OBLIQUE)] {
        let (covered, expected) = coverage(b, 0.01, 1e3, direction)?;
        // What the covered share of so narrow a view is in steradians.
        let solid_angle = 2.0 * PI * (1.0 - (1.0 - 1e-10f64).sqrt());
        let scale = solid_angle / expected;
        let measured = Mean {
            mean: covered.mean * scale,
            error: covered.error * scale,
        };
        measures.push(Measure::sampled(
            format!("solid angle, {way}"),
            measured,
            solid_angle,
            Tolerance::Relative(1e-3),
        ));
    }
    Ok(measures)
}

/// A light that is out of the way.
fn with_light(build: Build) -> Build {
    build.light(v(0.0, 40.0, 40.0), DVec3::Y, 0.1, 1.0)
}

fn tangent_rays(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    const STEPS: i32 = 512;
    let mut measures = Vec::new();
    for (name, bsdf) in [("opaque", grey(0.5)), ("glass", GLASS)] {
        let scene = Build::new(v(0.0, 0.0, 20.0), DVec3::ZERO, 40.0);
        let range = Range::new(
            b,
            &with_light(scene.add(sphere(DVec3::ZERO, 1.0), bsdf)),
            None,
        );
        // Along the axes every number is exact; obliquely rounding is a fifth of a step.
        let ways = [
            (DVec3::X, DVec3::Y),
            (DVec3::Y, -DVec3::Z),
            (-DVec3::Z, DVec3::X),
            (v(0.6, 0.8, 0.0), v(-0.8, 0.6, 0.0)),
            (v(0.6, 0.0, -0.8), v(0.8, 0.0, 0.6)),
        ];
        let (mut reversals, mut broken, mut hits) = (0, 0, 0);
        for (direction, across) in ways {
            let shots: Vec<Shot> = (-STEPS..=STEPS)
                .map(|k| {
                    let miss = 1.0 - f64::from(k) * (-20f64).exp2();
                    Shot::free(across * miss - direction * 3.0, direction)
                })
                .collect();
            let landings = range.shoot(&shots)?;
            broken += landings.iter().filter(|l| !l.is_finite()).count();
            hits += landings.iter().filter(|l| l.surface.is_some()).count();
            let lost = |w: &[Landing]| w[0].surface.is_some() && w[1].surface.is_none();
            reversals += landings.windows(2).filter(|w| lost(w)).count();
        }
        measures.push(Measure::none(
            format!("{name}: hits lost as the miss distance falls"),
            reversals,
        ));
        measures.push(Measure::none(
            format!("{name}: results that are not finite"),
            broken,
        ));
        // k >= 0 in each of the five; the tangent itself may go either way, and obliquely its neighbour.
        measures.push(Measure::new(
            format!("{name}: hits of 5125"),
            hits as f64,
            5.0 * f64::from(STEPS + 1),
            Tolerance::Absolute(7.0),
        ));
    }
    Ok(measures)
}

fn glancing_chords(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    const RAYS: usize = 500_000;
    let mut measures = Vec::new();
    let (center, radius) = (v(0.3, -0.2, 0.1), 0.7);
    for (name, bsdf, eye) in [
        ("opaque", grey(0.5), center + v(0.1, 0.2, 0.0)),
        ("glass", GLASS, v(0.0, 0.0, 5.0)),
    ] {
        let scene = Build::new(eye, center + v(0.0, 0.0, 0.1), 40.0);
        let range = Range::new(
            b,
            &with_light(scene.add(sphere(center, radius), bsdf)),
            None,
        );
        let number = range.number(|_| true);
        let medium = range.world().primitives[0].solid;
        let center = center - range.world().origin;
        let mut dice = Dice::new(7);
        let first: Vec<Shot> = (0..RAYS)
            .map(|_| Shot {
                medium,
                ..Shot::free(center, dice.direction())
            })
            .collect();
        let mut cosines = Vec::with_capacity(RAYS);
        let second: Vec<Shot> = range
            .shoot(&first)?
            .iter()
            .map(|from| {
                let cosine = dice.scale(-6.0, 0.0);
                cosines.push(cosine);
                Shot::from(from, dice.around(from.normal, cosine), medium)
            })
            .collect();
        // A few roundings each of point, normal and direction.
        let slack = 32.0 * b.epsilon() * (center.length() + radius);
        let wrong = |(landing, cosine): &(Landing, f64)| {
            let off = (landing.t - 2.0 * radius * cosine).abs();
            landing.surface != Some(number) || !landing.is_finite() || off > slack
        };
        let landings = range.shoot(&second)?;
        let mistakes = landings.into_iter().zip(cosines).filter(wrong).count();
        measures.push(Measure::none(format!("{name}: wrong of {RAYS}"), mistakes));
    }
    Ok(measures)
}

fn zero_components(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let shapes: [(&str, Shape); 4] = [
        ("sphere", sphere(DVec3::ZERO, 1.0)),
        ("cylinder", cylinder(DVec3::ZERO, DVec3::Y, 1.0)),
        ("disk", disk(DVec3::ZERO, DVec3::Y, 1.0)),
        ("plane", super::build::plane(DVec3::ZERO, DVec3::Y)),
    ];
    let eyes = [v(0.0, 5.0, 9.0), v(0.1, 0.3, 0.2)];
    let mut measures = Vec::new();
    for (name, shape) in shapes {
        let (mut shots_fired, mut broken) = (0, 0);
        for (eye, bsdf) in [(eyes[0], grey(0.5)), (eyes[1], grey(0.5)), (eyes[0], GLASS)] {
            if name == "disk" && matches!(bsdf, Bsdf::Dielectric { .. }) {
                continue;
            }
            let scene = Build::new(eye, eye + v(0.1, 0.2, 1.0), 40.0);
            let range = Range::new(b, &with_light(scene.add(shape.clone(), bsdf)), None);
            let p = &range.world().primitives[0];
            let shots = axial_shots(p);
            let landings = range.shoot(&shots)?;
            shots_fired += shots.len();
            broken += landings
                .iter()
                .filter(|l| !l.is_finite() || l.t < 0.0)
                .count();
        }
        measures.push(Measure::none(
            format!("{name}: not finite of {shots_fired}"),
            broken,
        ));
    }
    Ok(measures)
}

/// Along every axis, with zeros of either sign, from where a square root or a quotient may end.
fn axial_shots(p: &WorldPrimitive) -> Vec<Shot> {
    let origins = [
        DVec3::ZERO,
        v(0.0, 0.5, 0.0),
        v(0.0, 1.0, 0.0),
        v(1.0, 0.0, 0.0),
        v(1.0, 0.5, 0.0),
        v(1.0, 1.0, 0.0),
        v(0.0, 0.0, -1.0),
        v(-1.0, 0.0, -0.0),
        v(2.0, 0.0, 0.0),
        v(1.0, -3.0, 0.0),
    ];
    // The faces that one can stand on there, and none.
    let faces = |o: DVec3| {
        let (side, flat) = (o.x.hypot(o.z), |y: f64| o.y == y && o.x.hypot(o.z) <= 1.0);
        let stands = match p.geometry {
            Geometry::Sphere { .. } => [o.length() == 1.0, false, false],
            Geometry::Cylinder { .. } => {
                let on_side = side == 1.0 && (0.0..=1.0).contains(&o.y);
                [on_side, flat(0.0), flat(1.0)]
            }
            Geometry::Disk { .. } => [flat(0.0), false, false],
            _ => [o.y == 0.0, false, false],
        };
        let named = p.faces.into_iter().zip(stands);
        named.filter_map(|(face, on)| on.then_some(face)).chain([0])
    };
    let mut shots = Vec::new();
    for zero in [0.0, -0.0] {
        for one in [1.0, -1.0] {
            for direction in [v(one, zero, zero), v(zero, one, zero), v(zero, zero, one)] {
                for origin in origins {
                    for (face, medium) in faces(origin).flat_map(|f| [(f, AIR), (f, p.solid)]) {
                        shots.push(Shot {
                            origin,
                            direction,
                            face,
                            medium,
                            aim: None,
                        });
                    }
                }
            }
        }
    }
    shots
}
