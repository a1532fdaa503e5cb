//! Shadow rays from points where solids touch, compared with f64 segments and solids.

use super::backend::{Backend, Trouble};
use super::build::{Build, cylinder, grey, plane, sphere, v};
use super::measure::{Measure, Tolerance};
use super::rays::{Dice, Landing, Range, Shot};
use glam::DVec3;

/// Rays for each scene and light.
const RAYS: usize = 150_000;
/// Rays that pass a surface at a smaller distance are left out, since rounding decides about them.
const MARGIN: f64 = 1e-5;

/// An upright solid that stands on the floor y = 0.
#[derive(Clone, Copy)]
enum Solid {
    /// Of radius 1, touching the floor at this point.
    Ball(DVec3),
    /// Of radius 0.5 and height 1, standing at this point.
    Rod(DVec3),
}

impl Solid {
    /// Whether the segment from `p` to `q` comes into the solid made larger by `grown`.
    fn blocks(self, p: DVec3, q: DVec3, grown: f64) -> bool {
        let d = q - p;
        match self {
            Self::Ball(foot) => {
                let f = p - (foot + DVec3::Y);
                let nearest = (-f.dot(d) / d.length_squared()).clamp(0.0, 1.0);
                (f + d * nearest).length() < 1.0 + grown
            }
            Self::Rod(foot) => {
                // Where the segment is between the caps, then where within the side.
                let m = p - foot;
                let (low, high) = (-grown, 1.0 + grown);
                let (t0, t1) = ((low - m.y) / d.y, (high - m.y) / d.y);
                let (enter, leave) = (t0.min(t1).max(0.0), t0.max(t1).min(1.0));
                if enter > leave {
                    return false;
                }
                let (mx, dx) = (v(m.x, 0.0, m.z), v(d.x, 0.0, d.z));
                let nearest = (-mx.dot(dx) / dx.length_squared()).clamp(enter, leave);
                (mx + dx * nearest).length() < 0.5 + grown
            }
        }
    }
}

/// A point on the floor or on a solid close to where they touch: start and direction of a ray that finds it.
fn probe(dice: &mut Dice, solids: &[Solid]) -> (DVec3, DVec3) {
    let which = (dice.uniform() * solids.len() as f64) as usize;
    let around = dice.around(DVec3::Y, 0.0);
    let distance = dice.scale(-5.0, 0.3);
    match solids[which] {
        Solid::Ball(foot) if distance < 1.0 && solids.len() > 1 && dice.uniform() < 0.5 => {
            // Between two balls that touch at height 1, to one or the other.
            let across = dice.around(DVec3::X, 0.0);
            (DVec3::Y + across * distance, DVec3::X * foot.x)
        }
        Solid::Ball(foot) if distance < 1.0 => {
            // Between floor and ball, down or up.
            let gap = 1.0 - (1.0 - distance * distance).sqrt();
            let from = foot + around * distance + DVec3::Y * (gap / 2.0);
            (
                from,
                if dice.uniform() < 0.5 {
                    -DVec3::Y
                } else {
                    DVec3::Y
                },
            )
        }
        Solid::Ball(foot) => (foot + around * distance + DVec3::Y * 0.1, -DVec3::Y),
        Solid::Rod(foot) => (foot + around * (0.5 + distance) + DVec3::Y * 0.1, -DVec3::Y),
    }
}

/// All scenes: a ball, two balls that touch each other, a rod.
pub fn shadows(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let scenes: [(&str, Vec<Solid>); 3] = [
        ("ball on a plane", vec![Solid::Ball(v(0.0, 0.0, 0.0))]),
        (
            "two balls",
            vec![
                Solid::Ball(v(-1.0, 0.0, 0.0)),
                Solid::Ball(v(1.0, 0.0, 0.0)),
            ],
        ),
        ("rod on a plane", vec![Solid::Rod(v(0.0, 0.0, 0.0))]),
    ];
    let mut measures = Vec::new();
    for (name, solids) in scenes {
        let mut build = Build::new(v(0.0, 4.0, 9.0), DVec3::ZERO, 40.0)
            .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5));
        for &s in &solids {
            build = match s {
                Solid::Ball(foot) => build.add(sphere(foot + DVec3::Y, 1.0), grey(0.5)),
                Solid::Rod(foot) => build.add(cylinder(foot, foot + DVec3::Y, 0.5), grey(0.5)),
            };
        }
        // From above, and low from the side.
        let build = build.light(v(0.7, 6.0, 0.4), -DVec3::Y, 1.0, 1.0).light(
            v(7.0, 0.5, 1.0),
            -DVec3::X,
            0.45,
            1.0,
        );
        let range = Range::new(b, &build, None);
        let mut dice = Dice::new(200);
        let mut counts = Counts::default();
        for light in 0..2 {
            counts.add(&range, &solids, light, &mut dice)?;
        }
        measures.push(Measure::none(
            format!("{name}: leaked of {}", counts.dark),
            counts.leaked,
        ));
        measures.push(Measure::none(
            format!("{name}: lost of {}", counts.lit),
            counts.lost,
        ));
        // At least a tenth of the rays must be of each kind, or the scene tests nothing.
        let fewest = counts.dark.min(counts.lit) as f64;
        measures.push(Measure::new(
            format!("{name}: fewer rays of a kind"),
            fewest,
            0.1 * RAYS as f64,
            Tolerance::Above,
        ));
    }
    Ok(measures)
}

#[derive(Default)]
struct Counts {
    dark: usize,
    leaked: usize,
    lit: usize,
    lost: usize,
}

impl Counts {
    fn add(
        &mut self,
        range: &Range,
        solids: &[Solid],
        light: usize,
        dice: &mut Dice,
    ) -> Result<(), Trouble> {
        let world = range.world();
        let l = world.lights[light];
        let first: Vec<Shot> = (0..RAYS)
            .map(|_| {
                let (from, direction) = probe(dice, solids);
                Shot::free(from - world.origin, direction)
            })
            .collect();
        let mut shots = Vec::new();
        let mut targets = Vec::new();
        for landing in range.shoot(&first)? {
            let target = dice.on_disk(l.center, l.normal, l.radius, 1.0);
            let to = target - landing.point;
            // A surface that the light is behind sends no shadow ray.
            if landing.surface.is_some() && landing.normal.dot(to.normalize()) > 1e-4 {
                shots.push(Shot {
                    aim: Some((light, to.length())),
                    ..Shot::from(&landing, to, 0)
                });
                targets.push((landing, target + world.origin));
            }
        }
        for ((from, target), seen) in targets.iter().zip(range.shoot(&shots)?) {
            let p = from.point + world.origin;
            let own = |s: &Solid| own_surface(*s, p, from);
            let blocks = |grown: f64| {
                solids
                    .iter()
                    .any(|s| s.blocks(p, *target, if own(s) { -MARGIN } else { grown }))
            };
            match (blocks(MARGIN), blocks(-MARGIN)) {
                (true, true) => {
                    self.dark += 1;
                    self.leaked += usize::from(!seen.occluded);
                }
                (false, false) => {
                    self.lit += 1;
                    self.lost += usize::from(seen.occluded);
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Whether a landing is on this solid: then only its inside can be in the way.
fn own_surface(s: Solid, p: DVec3, landing: &Landing) -> bool {
    match s {
        Solid::Ball(foot) => landing.normal.dot((p - foot - DVec3::Y).normalize()) > 0.9,
        Solid::Rod(_) => false,
    }
}
