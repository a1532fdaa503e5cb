//! Implicit surfaces whose answers are known: a thin shell is two spheres, and what loses no energy is invisible in the white dome.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, MIRROR, grey, sphere, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use crate::implicit::Implicit;
use crate::scene::{Bsdf, Shape};
use glam::DVec3;
use std::sync::Arc;

pub const CASES: &[Case] = &[
    Case {
        row: "I1",
        name: "thin_shell_by_formula",
        what: "rays at and inside a shell of 10⁻³ of its size, given by a formula: roots that are passed over",
        run: thin_shell,
    },
    Case {
        row: "I2",
        name: "formulas_in_dome",
        what: "a white torus, a mirror ellipsoid and a glass torus, by their formulas, in the white dome: rays that leave surfaces",
        run: in_dome,
    },
];

/// Half the thickness of the shell, whose middle has radius 1.
const HALF: f64 = 5e-4;

/// A formula within a ball of radius `radius`.
fn formula(text: &str, radius: f64, center: DVec3, scale: f64) -> Shape {
    let mut implicit = Implicit::new(text, &[]).unwrap_or_else(|e| panic!("{text}: {e}"));
    implicit.clip = crate::implicit::Clip::Ball { radius };
    (implicit.center, implicit.scale) = (center, scale);
    Shape::Implicit(Arc::new(implicit))
}

/// Distance from `o`, which is outside, to where the ray enters a sphere about the origin; from inside, to where it leaves.
fn to_sphere(o: DVec3, d: DVec3, radius: f64) -> Option<f64> {
    let b = -o.dot(d);
    let rest = radius * radius - (o + d * b).length_squared();
    let half = (rest >= 0.0).then(|| rest.sqrt())?;
    let t = if o.length() > radius {
        b - half
    } else {
        b + half
    };
    (t > 0.0).then_some(t)
}

fn thin_shell(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let rays = if b.open_gpu().is_some() {
        400_000
    } else {
        40_000
    };
    let text = "abs(sqrt(x^2 + y^2 + z^2) - 1) - 0.0005";
    let mut measures = Vec::new();
    for (name, bsdf) in [("opaque", grey(0.5)), ("glass", GLASS)] {
        let scene = Build::new(v(0.0, 0.0, 5.0), DVec3::ZERO, 40.0)
            .add(formula(text, 1.2, DVec3::ZERO, 1.0), bsdf)
            .light(v(0.0, 0.0, 9.0), -DVec3::Z, 0.1, 1.0);
        let range = Range::new(b, &scene, None);
        let number = range.number(|_| true);
        let medium = range.world().primitives[0].solid;
        let mut dice = Dice::new(11);
        let shots: Vec<Shot> = (0..rays)
            .map(|_| {
                let from = dice.direction() * dice.between(2.0, 6.0);
                Shot::free(from, dice.point(1.3) - from)
            })
            .collect();
        // Where the ray is not level, an error along it is one of the place over the cosine. What is nearer to the rim than rounding
        // may be met or not.
        let wrong = |shot: &Shot, landing: &Landing, radius: f64| {
            let nearest = (shot.origin - shot.direction * shot.origin.dot(shot.direction)).length();
            let cosine = (1.0 - (nearest / radius).powi(2)).max(0.0).sqrt();
            let slack = 64.0 * b.epsilon() * (1.0 + shot.origin.length()) / cosine.max(1e-3);
            match to_sphere(shot.origin, shot.direction, radius) {
                None => landing.surface == Some(number) && nearest > radius + 1e-5,
                Some(_) if landing.surface != Some(number) => nearest < radius - 1e-5,
                Some(t) => !landing.is_finite() || (landing.t - t).abs() > slack,
            }
        };
        let landings = range.shoot(&shots)?;
        let outer = 1.0 + HALF;
        let pairs = || shots.iter().zip(&landings);
        let mistakes = pairs().filter(|(s, l)| wrong(s, l, outer)).count();
        measures.push(Measure::none(format!("{name}: wrong of {rays}"), mistakes));
        if medium == 0 {
            continue;
        }
        // Straight on through the glass, to its inner side; a level ray meets the outer one again.
        let through: Vec<Shot> = pairs()
            .filter(|(_, l)| l.surface == Some(number))
            .map(|(s, l)| Shot::from(l, s.direction, medium))
            .collect();
        let mistakes = range
            .shoot(&through)?
            .iter()
            .zip(&through)
            .filter(|(landing, shot)| {
                let b = -shot.origin.dot(shot.direction);
                let nearest = (shot.origin + shot.direction * b).length();
                let inner = 1.0 - HALF;
                if (nearest - inner).abs() < 1e-5 || nearest > outer - 1e-5 {
                    return false;
                }
                let (expected, cosine) = if nearest < inner {
                    let t = to_sphere(shot.origin, shot.direction, inner);
                    (t, (1.0 - (nearest / inner).powi(2)).sqrt())
                } else {
                    (Some(2.0 * b), b / outer)
                };
                let off = |t: f64| (landing.t - t).abs() > 1e-5 + 3e-6 / cosine;
                landing.surface != Some(number) || expected.is_none_or(off)
            })
            .count();
        measures.push(Measure::none(
            format!(
                "{name}, from one side to the other: wrong of {}",
                through.len()
            ),
            mistakes,
        ));
    }
    Ok(measures)
}

fn in_dome(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let torus = "(x^2 + y^2 + z^2 + 0.91)^2 - 4 (x^2 + y^2)";
    let things: [(Shape, Bsdf); 3] = [
        (formula(torus, 1.4, v(-0.35, 0.4, 0.0), 0.16), grey(1.0)),
        (
            formula("x^2 + 2 y^2 + 3 z^2 - 1", 1.1, v(0.0, 0.45, -0.2), 0.2),
            MIRROR,
        ),
        (formula(torus, 1.4, v(0.35, 0.4, 0.0), 0.16), GLASS),
    ];
    let build = Build::new(v(0.0, 0.3, 0.9), v(0.0, 0.4, 0.0), 60.0)
        .add(sphere(DVec3::ZERO, 1.0), grey(1.0))
        .add_all(&things)
        .light(DVec3::ZERO, DVec3::Y, 1.0, 1.0);
    let picture = b.picture_to(&build, &build.settings(), 3.3e-4)?;
    Ok(vec![
        Measure::sampled(
            "radiance: mean".to_owned(),
            picture.mean(),
            1.0,
            Tolerance::Relative(1e-3),
        ),
        picture.even("radiance: blocks", 6, 1.0),
    ])
}
