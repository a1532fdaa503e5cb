//! Rays that leave a primitive of any size at any place.

use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, cylinder, disk, grey, plane, sphere};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use crate::kernel::Access;
use crate::scene::{Bsdf, Shape};
use crate::world::{AIR, Geometry};
use glam::DVec3;

/// Primitives of each kind.
const SPECIMENS: usize = 32;
/// Rays aimed at each, of which those that land leave again, four times.
const AIMED: usize = 2500;

/// Kinds of primitive, by what they are made of.
const KINDS: [(&str, bool); 7] = [
    ("sphere", false),
    ("sphere", true),
    ("cylinder", false),
    ("cylinder", true),
    ("plane", false),
    ("plane", true),
    ("disk", false),
];

/// Shoots rays outwards, and inwards through transparent primitives, and counts the wrong hits.
pub fn rays_that_leave(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    let mut total = 0;
    for (kind, glass) in KINDS {
        let mut dice = Dice::new(100 + u32::from(glass));
        let (mut rays, mut wrong) = (0, 0);
        for _ in 0..SPECIMENS {
            let specimen = Specimen::random(&mut dice, kind, glass);
            let (n, bad) = specimen.leave(b, &mut dice)?;
            rays += n;
            wrong += bad;
        }
        total += rays;
        let made_of = if glass { "glass" } else { "opaque" };
        measures.push(Measure::none(
            format!("{made_of} {kind}: wrong of {rays}"),
            wrong,
        ));
    }
    measures.push(Measure::new("rays", total as f64, 1e6, Tolerance::Above));
    Ok(measures)
}

/// A scene with one primitive.
struct Specimen {
    build: Build,
    /// A point of the primitive, or inside it, in the file's coordinates; and its size.
    center: DVec3,
    size: f64,
}

impl Specimen {
    fn random(dice: &mut Dice, kind: &str, glass: bool) -> Self {
        let size = dice.scale(-3.0, 5.0);
        let center = if dice.uniform() < 0.2 {
            DVec3::ZERO
        } else {
            dice.direction() * dice.scale(0.0, 4.0)
        };
        let axis = dice.direction();
        let half = axis * size * dice.scale(-1.0, 0.5);
        let shape = match kind {
            "sphere" => sphere(center, size),
            "cylinder" => cylinder(center - half, center + half, size),
            "plane" => plane(center, axis),
            _ => disk(center, axis, size),
        };
        let bsdf: Bsdf = if glass { GLASS } else { grey(0.5) };
        // The eye, and with it the middle of things, is near the primitive or far; never inside.
        let reach = size + half.length();
        let eye = match shape {
            Shape::Plane { normal, .. } => center + (normal + dice.direction() * 0.5) * size,
            _ => center + dice.direction() * reach * (1.01 + dice.scale(-2.0, 3.0)),
        };
        let build = Build::new(eye, eye + dice.direction(), 40.0)
            .add(shape, bsdf)
            .light(eye, axis, 1e-3 * size, 1.0);
        Self {
            build,
            center,
            size,
        }
    }

    /// How many rays left it, and how many of those met it wrongly.
    fn leave(&self, b: &Backend, dice: &mut Dice) -> Result<(usize, usize), Trouble> {
        // One kernel for all of a kind, for its values are in buffers.
        let range = Range::new(b, &self.build, Some(Access::Buffers));
        let number = range.number(|_| true);
        let primitive = &range.world().primitives[0];
        let center = self.center - range.world().origin;
        // The eye's side, from which a plane can be met.
        let eye = range.world().camera.eye;
        let mut aimed = Vec::with_capacity(AIMED);
        for _ in 0..AIMED {
            let target = center + dice.point(1.0) * self.size;
            let from = match primitive.geometry {
                Geometry::Plane { .. } => eye,
                _ => center + dice.direction() * self.size * dice.between(6.0, 12.0),
            };
            aimed.push(Shot::free(from, target - from));
        }
        let on_it = |l: &Landing| l.surface == Some(number);
        let landed: Vec<Landing> = range.shoot(&aimed)?.into_iter().filter(on_it).collect();
        let mut shots = Vec::new();
        let mut starts = Vec::new();
        for l in &landed {
            for k in 0..4 {
                let cosine = if k < 2 {
                    dice.uniform()
                } else {
                    dice.scale(-6.0, 0.0)
                };
                let inwards = primitive.solid != AIR && k % 2 == 1;
                let (axis, medium) = if inwards {
                    (-l.normal, primitive.solid)
                } else {
                    (l.normal, AIR)
                };
                shots.push(Shot::from(l, dice.around(axis, cosine), medium));
                starts.push(l.normal);
            }
        }
        let landings = range.shoot(&shots)?;
        let scale = center.length() + self.size;
        let wrong = |((shot, start), landing): &((&Shot, &DVec3), &Landing)| {
            let exact = exit(&primitive.geometry, shot.origin, **start, shot.direction);
            match exact.filter(|_| shot.medium != AIR) {
                None => on_it(landing) || !landing.is_finite(),
                Some((exact, slope)) => {
                    // Rounding of the point, magnified by the slope at which the ray meets the surface again.
                    let slope = landing
                        .normal
                        .dot(shot.direction)
                        .abs()
                        .min(slope)
                        .max(1e-4);
                    let slack = 32.0 * b.epsilon() * scale / slope;
                    !on_it(landing) || !landing.is_finite() || (landing.t - exact).abs() > slack
                }
            }
        };
        let shot = shots.iter().zip(&starts).zip(&landings);
        Ok((shots.len(), shot.filter(wrong).count()))
    }
}

/// Distance at which a ray from the surface, where its normal is `start`, into the solid leaves it, exactly, and the
/// slope of the ray to a cylinder's axis; `None` for what it never leaves.
fn exit(geometry: &Geometry, from: DVec3, start: DVec3, direction: DVec3) -> Option<(f64, f64)> {
    match *geometry {
        Geometry::Sphere { center, .. } => Some((-2.0 * direction.dot(from - center), 1.0)),
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => Some((-2.0 * direction.dot(from - pole + normal * radius), 1.0)),
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let across = |p: DVec3| p - axis * axis.dot(p);
            let (m, d) = (across(from - base), across(direction));
            let (a, b) = (d.length_squared(), m.dot(d));
            // On the side itself one root is 0; from a cap the way out is the far root.
            let on_side = start.dot(axis).abs() < 0.5;
            let c = (m.length() - radius) * (m.length() + radius);
            let root = if on_side {
                -b
            } else {
                (b * b - a * c).max(0.0).sqrt()
            };
            let side = (-b + root) / a;
            let along = axis.dot(direction);
            let cap = if along > 0.0 { offsets[1] } else { offsets[0] };
            Some((side.min((cap - axis.dot(from)) / along), a.sqrt()))
        }
        Geometry::Plane { .. } | Geometry::Disk { .. } | Geometry::Implicit(_) => None,
    }
}
