//! Where light paths are aimed: pairs of a light and a specular surface.
//!
//! A light path starts at a point of a light, in a direction to a specular surface, which must be the first thing that it meets. So
//! every light path belongs to one pair, and a path from the eye that ends on a light by way of that surface knows its density.

use super::bulbs::Bulb;
use super::geometry::DiskSide;
use super::visibility::lights_overlap;
use super::{Geometry, Side, World, WorldLight, WorldPrimitive};
use crate::scene::Bsdf;
use crate::stats::luminance;
use glam::DVec3;
use std::f64::consts::PI;

/// The most pairs. If there are more, the surfaces that get the least light are left to paths from the eye.
const MOST_PAIRS: usize = 1 << 20;

/// Probabilities of pairs are multiples of 1 / this: the kernel draws them with 24 bits.
const PARTS: f64 = (1u32 << 24) as f64;

/// The radius of the sphere around a surface that has no bounds. Its square fits f32.
const BOUNDLESS: f64 = 1e18;

/// Above this squared sine of half its angle a cone is too wide to aim into, and the direction is cosine-distributed about the light's
/// normal. `shaders/light_path/aims.wgsl` has the same number.
const WIDE: f64 = 0.9375;

/// A specular surface, and a sphere around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    /// Its number among lights and primitives.
    pub number: usize,
    /// Centre of the sphere.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

/// The pairs of a world. Pair l T + t has light l and target t of T.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Aims {
    /// Never empty.
    pub targets: Vec<Target>,
    /// Sums of the probabilities of the pairs so far, each pair's own included, times 2^24.
    pub cumulative: Vec<u32>,
    /// The light that the surfaces get and light paths look for, over all that the lights send out. Surfaces behind others count too, so it
    /// may be above 1.
    pub share: f64,
}

impl Aims {
    /// The pairs of `world`; `None` if no light can meet a specular surface. Paths from the eye sample most of the light of `bulbs`.
    pub fn new(world: &World, bulbs: &[Bulb]) -> Option<Self> {
        let overlap = lights_overlap(world);
        let usable: Vec<bool> = (0..world.lights.len())
            .map(|l| usable(world, l, overlap))
            .collect();
        let specular = |p: &WorldPrimitive| world.materials[p.material].kind().is_specular();
        let mut targets: Vec<Target> = (0..)
            .zip(&world.primitives)
            .filter(|(_, p)| specular(p))
            .map(|(i, p)| target(world.lights.len() + i, &p.geometry))
            .collect();
        let lights = || {
            world
                .lights
                .iter()
                .zip(&usable)
                .filter(|l| *l.1)
                .map(|l| l.0)
        };
        let left: Vec<f64> = (0..world.lights.len())
            .map(|l| left_to_light_paths(world, &targets, bulbs, l))
            .collect();
        let from_all = |t: &Target| -> f64 { lights().map(|l| flux(world, l, t)).sum() };
        let most = MOST_PAIRS / world.lights.len().max(1);
        if targets.len() > most {
            let mut ranked: Vec<(f64, Target)> =
                targets.iter().map(|t| (from_all(t), *t)).collect();
            ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.number.cmp(&b.1.number)));
            ranked.truncate(most);
            targets = ranked.into_iter().map(|r| r.1).collect();
            targets.sort_by_key(|t| t.number);
        }
        let weights: Vec<f64> = (world.lights.iter().zip(&usable).zip(&left))
            .flat_map(|((l, usable), left)| targets.iter().map(move |t| (l, *usable, left, t)))
            .map(|(l, usable, left, t)| {
                if usable {
                    left * flux(world, l, t)
                } else {
                    0.0
                }
            })
            .collect();
        let all: f64 = weights.iter().sum();
        if !(all > 0.0 && all.is_finite()) {
            return None;
        }
        let mut sum = 0.0;
        let mut cumulative: Vec<u32> = weights
            .iter()
            .map(|w| {
                sum += w;
                (sum / all * PARTS).round() as u32
            })
            .collect();
        // The sums may miss 1 by rounding.
        let last = weights.iter().rposition(|w| *w > 0.0)?;
        cumulative[last..].fill(PARTS as u32);
        Some(Self {
            targets,
            cumulative,
            share: all / world.lights.iter().map(power).sum::<f64>(),
        })
    }

    /// The probability of a pair.
    pub fn probability(&self, light: usize, target: usize) -> f64 {
        let pair = light * self.targets.len() + target;
        let before = pair.checked_sub(1).map_or(0, |k| self.cumulative[k]);
        f64::from(self.cumulative[pair] - before) / PARTS
    }
}

/// The share of a light's light that light paths look for. Of a bulb it is what its own glass has reflected more often than is sampled (glass
/// reflects about a twentieth), and what other mirrors and glass get.
fn left_to_light_paths(world: &World, targets: &[Target], bulbs: &[Bulb], light: usize) -> f64 {
    let Some(bulb) = bulbs.iter().find(|b| b.light == light) else {
        return 1.0;
    };
    let l = &world.lights[light];
    let is_shell = |t: &&Target| bulb.shells.iter().any(|s| s.number == t.number);
    let others = targets.iter().filter(|t| !is_shell(t));
    let sent: f64 = others.map(|t| flux(world, l, t)).sum();
    let own = if bulb.reflects { 0.01 } else { 0.1 };
    (own + sent / power(l).max(f64::MIN_POSITIVE)).min(1.0)
}

/// Whether every point of a light shines into the room, and into one medium. Light from points that no path from the eye reaches must
/// not be traced. Such lights are rare, and left to chance. `overlap` says whether some lights overlap in one plane.
fn usable(world: &World, light: usize, overlap: bool) -> bool {
    let l = &world.lights[light];
    let covered = || {
        world.lights[..light]
            .iter()
            .any(|before| before.face == l.face)
    };
    let in_room = |p: &WorldPrimitive| {
        let side = |wanted| p.geometry.side_of_disk(l.center, l.normal, l.radius) == wanted;
        match p.side {
            Side::Outside => side(DiskSide::Outside),
            Side::Inside => side(DiskSide::Inside),
            Side::Both => !world.materials[p.material].is_dielectric() || !side(DiskSide::Cut),
        }
    };
    l.medium.is_some() && !(overlap && covered()) && world.primitives.iter().all(in_room)
}

fn target(number: usize, geometry: &Geometry) -> Target {
    let (center, radius) = match *geometry {
        Geometry::Sphere { center, radius } | Geometry::Disk { center, radius, .. } => {
            (center, radius)
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let half = 0.5 * (offsets[1] - offsets[0]);
            (base + axis * half, half.hypot(radius))
        }
        Geometry::Implicit(ref implicit) => implicit.ball(),
        Geometry::Plane { .. } | Geometry::HugeSphere { .. } => (DVec3::ZERO, BOUNDLESS),
    };
    Target {
        number,
        center,
        radius,
    }
}

/// The light that a light sends out.
fn power(l: &WorldLight) -> f64 {
    luminance(l.radiance.to_array()) * PI * l.radius * l.radius * PI
}

/// An estimate of the light that a specular surface gets from a light, and sends on: the mean over some points of the light.
fn flux(world: &World, l: &WorldLight, t: &Target) -> f64 {
    let p = &world.primitives[t.number - world.lights.len()];
    let passed = match world.materials[p.material] {
        Bsdf::Mirror { reflectance } => luminance(reflectance.to_array()),
        _ => 1.0,
    };
    let x = l.normal.any_orthonormal_vector();
    let y = l.normal.cross(x);
    let points = [DVec3::ZERO, x, -x, y, -y].map(|d| l.center + d * (0.7 * l.radius));
    let to_target = |point: DVec3| -> f64 {
        // A plane covers a share of the hemisphere.
        if let Geometry::Plane { normal, offset } = p.geometry {
            let towards = if normal.dot(point) > offset {
                -normal
            } else {
                normal
            };
            return PI * 0.5 * (1.0 + towards.dot(l.normal));
        }
        let to = t.center - point;
        let distance2 = to.length_squared();
        let sin2 = t.radius * t.radius / distance2;
        if sin2 >= WIDE {
            return PI;
        }
        let solid_angle = 2.0 * PI * sin2 / (1.0 + (1.0 - sin2).sqrt());
        let cos = (l.normal.dot(to) + t.radius) / distance2.sqrt();
        solid_angle * cos.clamp(0.0, 1.0)
    };
    let mean = points.map(to_target).iter().sum::<f64>() / points.len() as f64;
    passed * power(l) * mean / PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;

    fn world(things: &str) -> World {
        let text = format!(
            "[camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
             [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
             [[plane]]\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n{things}"
        );
        let scene = parse_str("room.toml".as_ref(), &text).expect("a scene");
        World::new(&scene, [8, 8])
    }

    fn aims(things: &str) -> Option<Aims> {
        Aims::new(&world(things), &[])
    }

    fn light(center: &str) -> String {
        format!(
            "[[light]]\ncenter = {center}\nnormal = [0, -1, 0]\nradius = 0.2\nradiance = [1, 1, 1]\n"
        )
    }

    fn ball(center: &str, radius: f64) -> String {
        format!("[[sphere]]\ncenter = {center}\nradius = {radius}\nmaterial = 'glass'\n")
    }

    #[test]
    fn nothing_specular_is_no_aim() {
        assert_eq!(aims(&light("[0, 2, 0]")), None);
        let above = light("[0, 2, 0]") + &ball("[0, 4, 0]", 0.5);
        assert_eq!(aims(&above), None, "behind the light");
    }

    #[test]
    fn probabilities_add_up_to_one_and_follow_solid_angles() {
        let scene = light("[0, 2, 0]") + &ball("[0, 0, 0]", 0.5) + &ball("[0, 0, 1.5]", 0.25);
        let aims = aims(&scene).expect("aims");
        let p: Vec<f64> = (0..2).map(|t| aims.probability(0, t)).collect();
        assert_eq!(p.iter().sum::<f64>(), 1.0);
        assert!(
            p.iter().any(|p| *p > 0.8) && p.iter().all(|p| *p > 0.05),
            "{p:?}"
        );
    }

    #[test]
    fn the_share_of_the_light_is_that_of_solid_angles() {
        let share = |things: &str| aims(&(light("[0, 2, 0]") + things)).expect("aims").share;
        // Straight below a small light, a ball gets the squared sine of half its angle.
        let below = share(&ball("[0, -0.5, 0]", 0.25));
        assert!((below - 0.01).abs() < 1e-3, "{below}");
        let inside = share(&ball("[0, 2, 0]", 1.0));
        assert!((inside - 1.0).abs() < 1e-12, "all of it: {inside}");
        let mirror = "[material.silver]\ntype = 'mirror'\nreflectance = [0.5, 0.5, 0.5]\n\
             [[plane]]\npoint = [-5, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n";
        let beside = share(mirror);
        assert!((beside - 0.25).abs() < 1e-3, "half of half of it: {beside}");
    }

    #[test]
    fn of_bulbs_light_paths_look_for_what_other_mirrors_get() {
        let share = |things: &str| {
            let world = world(things);
            let bulbs = &world.bulbs;
            assert_eq!(bulbs.len(), 1);
            Aims::new(&world, bulbs).expect("aims").share
        };
        let bulb = light("[0, 2, 0]") + &ball("[0, 2, 0]", 1.5);
        assert!(share(&bulb) <= 0.1, "{}", share(&bulb));
        let mirror = "[material.silver]\ntype = 'mirror'\nreflectance = [0.8, 0.8, 0.8]\n\
             [[plane]]\npoint = [-5, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n";
        let beside = share(&(bulb + mirror));
        assert!(
            beside > 0.4,
            "half of 0.8 to the wall, and all to the glass: {beside}"
        );
    }

    #[test]
    fn lights_that_glass_cuts_are_left_to_chance() {
        let cut = light("[0, 0.48, 0]") + &ball("[0, 0, 0]", 0.5);
        assert_eq!(aims(&cut), None);
        let inside = light("[0, 0.1, 0]") + &ball("[0, 0, 0]", 0.5);
        assert!(aims(&inside).is_some());
    }
}
