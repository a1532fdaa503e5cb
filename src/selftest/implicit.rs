//! Implicit surfaces whose answers are known: a thin shell is two spheres, a saddle is trilinear, and what loses no energy is invisible in the white dome.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, MIRROR, grey, sphere, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use crate::files::npy::Numbers;
use crate::implicit::{Grid, Implicit, Volume};
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
    Case {
        row: "I3",
        name: "saddle_in_a_volume",
        what: "rays at and inside a solid below z = x y, from a volume whose function is that exactly: cells, caps, two roots on a line",
        run: saddle,
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

/// The solid of z < x y in the cube from -1 to 1. The function is trilinear, so that of the cells is the same, and its numbers are exact.
fn saddle_volume() -> Shape {
    let size = [33, 17, 9];
    let along = |k: usize, n: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
    let mut all = Vec::new();
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let [x, y, z] = [(x, 0), (y, 1), (z, 2)].map(|(k, axis)| along(k, size[axis]));
                all.push((x * y - z) as f32);
            }
        }
    }
    let volume = Volume::new(size, Numbers::F32(all)).unwrap_or_else(|e| panic!("{e}"));
    let spacing = v(2.0 / 32.0, 2.0 / 16.0, 2.0 / 8.0);
    let mut implicit = Implicit::of_volume(Grid::new(volume, spacing), 0.0);
    implicit.center = DVec3::splat(-1.0);
    Shape::Implicit(Arc::new(implicit))
}

/// A line and the saddle.
struct OnLine {
    /// Where the line is in the cube.
    span: [f64; 2],
    /// x y - z along it: c0 + c1 t + c2 t².
    c: [f64; 3],
}

impl OnLine {
    /// None if it is not in the cube, or hardly.
    fn of(o: DVec3, d: DVec3) -> Option<Self> {
        let ends = [-1.0, 1.0].map(|side| (DVec3::splat(side) - o) / d);
        let enter = ends[0].min(ends[1]).max_element();
        let leave = ends[0].max(ends[1]).min_element();
        let c = [o.x * o.y - o.z, o.x * d.y + o.y * d.x - d.z, d.x * d.y];
        let span = [enter, leave];
        (leave > enter).then_some(Self { span, c })
    }

    fn value(&self, t: f64) -> f64 {
        self.c[0] + t * (self.c[1] + t * self.c[2])
    }

    fn slope(&self, t: f64) -> f64 {
        self.c[1] + 2.0 * t * self.c[2]
    }

    /// The first root after `start`, and in the cube.
    fn root_after(&self, start: f64) -> Option<f64> {
        let [c, h, a] = [self.c[0], 0.5 * self.c[1], self.c[2]];
        let square = h * h - a * c;
        let s = -(h + h.signum() * square.max(0.0).sqrt());
        let mut roots = [s / a, c / s];
        roots.sort_by(f64::total_cmp);
        let found = roots.into_iter().find(|t| *t > start && *t < self.span[1]);
        found.filter(|_| square > 0.0)
    }

    /// Whether rounding decides what is met: an edge of the cube, a line that nearly touches the surface, or meets it where it meets the
    /// cube.
    fn is_delicate(&self) -> bool {
        const NEAR: f64 = 1e-3;
        let [enter, leave] = self.span;
        let level = (-0.5 * self.c[1] / self.c[2]).clamp(enter, leave);
        let near = |t: f64| self.value(t).abs() < NEAR;
        leave - enter < NEAR || near(enter) || near(leave) || near(level)
    }
}

fn saddle(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let rays = if b.open_gpu().is_some() {
        200_000
    } else {
        40_000
    };
    let mut measures = Vec::new();
    for (name, bsdf) in [("opaque", grey(0.5)), ("glass", GLASS)] {
        let scene = Build::new(v(0.0, 0.0, 5.0), DVec3::ZERO, 40.0)
            .add(saddle_volume(), bsdf)
            .light(v(0.0, 0.0, 9.0), -DVec3::Z, 0.1, 1.0);
        let range = Range::new(b, &scene, None);
        let number = range.number(|_| true);
        let medium = range.world().primitives[0].solid;
        let mut dice = Dice::new(12);
        let shots: Vec<Shot> = (0..rays)
            .map(|_| {
                let from = dice.direction() * dice.between(2.0, 6.0);
                Shot::free(from, dice.point(1.3) - from)
            })
            .filter(|s| OnLine::of(s.origin, s.direction).is_none_or(|line| !line.is_delicate()))
            .collect();
        // What `landing` is off where the answer is `expected`: an error of the place is one along the ray over the slope there.
        let wrong = |shot: &Shot, landing: &Landing, expected: Option<f64>, slope: f64| {
            let slack = 64.0 * b.epsilon() * (1.0 + shot.origin.length()) / slope.abs().min(1.0);
            match expected {
                None => landing.surface == Some(number),
                Some(t) => {
                    landing.surface != Some(number)
                        || !landing.is_finite()
                        || (landing.t - t).abs() > slack
                }
            }
        };
        let landings = range.shoot(&shots)?;
        let mut mistakes = 0;
        let mut through = Vec::new();
        for (shot, landing) in shots.iter().zip(&landings) {
            let line = OnLine::of(shot.origin, shot.direction);
            let expected = line.as_ref().and_then(|line| {
                let capped = line.value(line.span[0]) > 0.0;
                let root = || line.root_after(line.span[0]);
                if capped { Some(line.span[0]) } else { root() }
            });
            let slope = match (&line, expected) {
                (Some(line), Some(t)) if t > line.span[0] => line.slope(t),
                // Of a cap: the largest side of a direction.
                _ => 0.5,
            };
            mistakes += usize::from(wrong(shot, landing, expected, slope));
            if medium != 0
                && landing.surface == Some(number)
                && let (Some(line), Some(t)) = (line, expected)
            {
                let next = line.root_after(t.max(line.span[0]) + 1e-6);
                let to = next.unwrap_or(line.span[1]);
                let slope = next.map_or(0.5, |t| line.slope(t));
                let from = Shot::from(landing, shot.direction, medium);
                through.push((from, to - t, slope));
            }
        }
        measures.push(Measure::none(
            format!("{name}: wrong of {}", shots.len()),
            mistakes,
        ));
        if medium == 0 {
            continue;
        }
        let inside: Vec<Shot> = through.iter().map(|(shot, ..)| *shot).collect();
        let landings = range.shoot(&inside)?;
        let mistakes = landings
            .iter()
            .zip(&through)
            .filter(|(landing, (shot, t, slope))| wrong(shot, landing, Some(*t), 0.2 * slope))
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
