//! Cylinders along their axis, almost along it, and from inside.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, cylinder, grey, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use crate::scene::Bsdf;
use crate::world::{AIR, Geometry};
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "28",
        name: "along_the_axis",
        what: "rays along a cylinder's axis, inside and outside: A = 0",
        run: along_the_axis,
    },
    Case {
        row: "29",
        name: "almost_along_the_axis",
        what: "rays 10⁻⁴ rad off the axis in a tube 2·10⁴ radii long: division by A",
        run: almost_along_the_axis,
    },
    Case {
        row: "30",
        name: "tube_from_inside",
        what: "chords of a cylinder from its side: a ray hits the surface that it starts on",
        run: from_inside,
    },
];

/// The cylinder of a scene that has nothing else, in the scene's coordinates.
struct Tube {
    base: DVec3,
    axis: DVec3,
    length: f64,
    radius: f64,
    number: usize,
    solid: u32,
}

/// A scene with a cylinder, and a light out of the way.
fn tube<'a>(
    b: &'a Backend,
    eye: DVec3,
    ends: [DVec3; 2],
    radius: f64,
    bsdf: Bsdf,
) -> (Range<'a>, Tube) {
    let aside = (ends[1] - ends[0]).any_orthonormal_vector() * (9.0 * radius);
    let build = Build::new(eye, eye + v(0.1, 0.2, 1.0), 40.0)
        .add(cylinder(ends[0], ends[1], radius), bsdf)
        .light(ends[0] + aside, aside, radius, 1.0);
    let range = Range::new(b, &build, None);
    let p = &range.world().primitives[0];
    let Geometry::Cylinder {
        base,
        axis,
        offsets,
        radius,
    } = p.geometry
    else {
        unreachable!("the scene has a cylinder only");
    };
    let tube = Tube {
        base,
        axis,
        length: offsets[1] - offsets[0],
        radius,
        number: range.number(|_| true),
        solid: p.solid,
    };
    (range, tube)
}

fn along_the_axis(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for (name, axis, slack) in [
        // Every number is exact here.
        ("upright", DVec3::Y, 0.0),
        ("oblique", v(1.0, 2.0, 3.0).normalize(), 16.0 * b.epsilon()),
    ] {
        for (kind, bsdf, eye_inside) in [
            ("opaque", grey(0.5), false),
            ("opaque", grey(0.5), true),
            ("glass", GLASS, false),
        ] {
            let eye = if eye_inside { axis * 0.25 } else { axis * 7.0 };
            let (range, tube) = tube(b, eye, [-axis, axis], 0.5, bsdf);
            let inside = eye_inside || tube.solid != AIR;
            let outside = !eye_inside;
            let mut shots = Vec::new();
            let mut expected = Vec::new();
            for off in [0.0, 0.25, 0.499, 0.501, 0.75] {
                let side = axis.any_orthonormal_vector() * off;
                for way in [1.0, -1.0] {
                    let met = off < 0.5;
                    if outside {
                        shots.push(Shot::free(side - axis * (3.0 * way), axis * way));
                        expected.push(met.then_some(2.0));
                    }
                    if inside && met {
                        shots.push(Shot {
                            medium: tube.solid,
                            ..Shot::free(side, axis * way)
                        });
                        expected.push(Some(1.0));
                    }
                }
            }
            let wrong = |(landing, expected): &(Landing, Option<f64>)| match expected {
                None => landing.surface.is_some(),
                Some(t) => {
                    let cap = landing.normal.dot(axis).abs() > 0.99;
                    landing.surface != Some(tube.number)
                        || !cap
                        || (landing.t - t).abs() > 3.0 * slack
                }
            };
            let count = shots.len();
            let mistakes = range
                .shoot(&shots)?
                .into_iter()
                .zip(expected)
                .filter(wrong)
                .count();
            let place = if eye_inside { "inside" } else { "outside" };
            measures.push(Measure::none(
                format!("{name}, {kind}, eye {place}: wrong of {count}"),
                mistakes,
            ));
        }
    }
    Ok(measures)
}

fn almost_along_the_axis(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let angle: f64 = 1e-4;
    let mut measures = Vec::new();
    for (name, axis) in [
        ("along z", DVec3::Z),
        ("oblique", v(1.0, 2.0, 3.0).normalize()),
    ] {
        let (range, tube) = tube(b, axis * 10.0, [DVec3::ZERO, axis * 2e4], 1.0, grey(0.5));
        let mut dice = Dice::new(29);
        let shots: Vec<Shot> = (0..1000)
            .map(|_| {
                Shot::free(
                    tube.base + tube.axis * 10.0,
                    dice.around(tube.axis, angle.cos()),
                )
            })
            .collect();
        let expected = tube.radius / angle.tan();
        let mut worst = 0.0f64;
        for l in range.shoot(&shots)? {
            let side = l.surface == Some(tube.number) && l.normal.dot(tube.axis).abs() < 0.01;
            let z = tube.axis.dot(l.point - tube.base) - 10.0;
            worst = worst.max(if side {
                (z / expected - 1.0).abs()
            } else {
                f64::INFINITY
            });
        }
        measures.push(Measure::new(
            format!("{name}: largest relative error of z"),
            worst,
            0.0,
            Tolerance::Absolute(1e-3),
        ));
    }
    Ok(measures)
}

/// Distance from a point on the side to where a ray leaves the tube, exactly.
fn chord(tube: &Tube, from: DVec3, direction: DVec3) -> f64 {
    let across = |p: DVec3| p - tube.axis * tube.axis.dot(p);
    let (m, d) = (across(from - tube.base), across(direction));
    let side = -2.0 * m.dot(d) / d.length_squared();
    let along = tube.axis.dot(direction);
    let height = tube.axis.dot(from - tube.base);
    let left = if along > 0.0 {
        tube.length - height
    } else {
        -height
    };
    side.min(left / along)
}

fn from_inside(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    const RAYS: usize = 500_000;
    let mut measures = Vec::new();
    let ends = [v(0.3, -0.6, 0.1), v(0.5, 0.9, -0.2)];
    for (kind, bsdf, eye) in [
        ("opaque", grey(0.5), (ends[0] + ends[1]) / 2.0),
        ("glass", GLASS, v(0.0, 0.0, 5.0)),
    ] {
        let (range, tube) = tube(b, eye, ends, 0.7, bsdf);
        let mut dice = Dice::new(30);
        let middle = tube.base + tube.axis * (tube.length / 2.0);
        let first: Vec<Shot> = (0..RAYS)
            .map(|_| {
                let across = dice.around(tube.axis, 0.0);
                let from = middle + tube.axis * dice.between(-0.49, 0.49) * tube.length;
                Shot {
                    medium: tube.solid,
                    ..Shot::free(from, across)
                }
            })
            .collect();
        let starts = range.shoot(&first)?;
        let second: Vec<Shot> = starts
            .iter()
            .map(|l| {
                // Half of them grazing; none along the axis, where the side is no nearer than the caps.
                let cosine = if dice.uniform() < 0.5 {
                    dice.uniform()
                } else {
                    dice.scale(-5.0, 0.0)
                };
                Shot::from(l, dice.around(l.normal, cosine), tube.solid)
            })
            .collect();
        let size = middle.length() + tube.length;
        let wrong = |(shot, landing): &(&Shot, Landing)| {
            let exact = chord(&tube, shot.origin, shot.direction);
            // A few roundings of point and direction; in a chord they are magnified by the slope of the ray to the axis.
            let slope = 1.0 / (1.0 - tube.axis.dot(shot.direction).powi(2)).max(1e-4);
            let slack = 32.0 * b.epsilon() * size * slope;
            let off = (landing.t - exact).abs();
            landing.surface != Some(tube.number) || !landing.is_finite() || off > slack
        };
        let landings = range.shoot(&second)?;
        let mistakes = second.iter().zip(landings).filter(wrong).count();
        measures.push(Measure::none(format!("{kind}: wrong of {RAYS}"), mistakes));
    }
    Ok(measures)
}
