//! Bulbs: lights inside glass balls whose light can be sampled from outside.
//!
//! A shadow ray to a light inside glass must be refracted on its way. Through a sphere it stays in the plane of its two ends and the centre,
//! and n r sin(angle to the radius), its *impact*, is the same at every radius r and index n (Bouguer's law). So the angle that a ray sweeps
//! around the centre is a sum of arcsines of its impact, and `shaders/bulb/ray.wgsl` finds the one ray between two points by
//! Newton's method.
//!
//! There is one ray only if the swept angle grows with the angle at which light leaves. Newton's method is quick if it grows evenly. Both are
//! tried here for each light, and lights of which either fails are left to chance and to light paths.

#[cfg(test)]
mod tests;

use super::geometry::DiskSide;
use super::{AIR, Geometry, Side, World, WorldLight, WorldPrimitive};
use crate::coincidence::{slack, spheres};
use crate::scene::Bsdf;
use glam::DVec3;
use std::f64::consts::PI;

/// The most bulbs. The kernel has a line for each, and the others are left to chance.
const MOST: usize = 24;

/// The most pairs of a light in glass and a surface that are looked at. With more, none of the lights is sampled through glass.
const MOST_PAIRS: usize = 10_000_000;

/// The steps of Newton's method that the kernel takes. `shaders/bulb/ray.wgsl` has as many.
const STEPS: usize = 4;

/// What may be left of the angle after these steps, in radians: less than f32 resolves of a scene.
const LEFT: f64 = 1e-7;

/// The greatest sine of an angle to a shell's radius. Beyond, light grazes the glass, and rounding decides whether it passes.
const STEEPEST: f64 = 0.9;

/// Outer radii at whose multiples the receivers stand for which a bulb is tried.
const DISTANCES: [f64; 4] = [1.0, 1.05, 1.5, 1e6];

/// A spherical boundary between two media.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shell {
    /// Number of its sphere among lights and primitives.
    pub number: usize,
    /// Radius.
    pub radius: f64,
    /// Index of refraction inside and outside, relative to air.
    pub indices: [f64; 2],
    /// What it transmits of each colour.
    pub transmittance: DVec3,
}

/// A light in one or two concentric shells, with nothing else in them that its light could meet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bulb {
    /// Number of the light.
    pub light: usize,
    /// Centre of the shells.
    pub center: DVec3,
    /// From the light outwards; of one, both are the same.
    pub shells: [Shell; 2],
    /// How many shells there are.
    pub count: u32,
    /// Light that the shells have reflected once is sampled too.
    pub reflects: bool,
    /// The medium outside.
    pub medium: u32,
}

/// A way out of a bulb. `shaders/bulb/ways.wgsl` has the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// Through the shells.
    Straight,
    /// Reflected by the inner shell first.
    Inner,
    /// By the outer one.
    Outer,
}

/// A ray from a point of a bulb's light to a point outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BulbRay {
    /// Unit direction from the point outside to the bulb.
    pub d: DVec3,
    /// Unit direction in which the ray leaves the light.
    pub leaves: DVec3,
}

impl Bulb {
    /// The bulb of this light, if it is in one.
    fn of(world: &World, light: usize) -> Option<Self> {
        let l = &world.lights[light];
        let mut shells: Vec<Shell> = Vec::new();
        let mut medium = l.medium?;
        let mut center = DVec3::ZERO;
        while medium != AIR {
            let number = world.primitives.iter().position(|p| p.solid == medium)?;
            let p = &world.primitives[number];
            let (Geometry::Sphere { center: c, radius }, Bsdf::Dielectric { transmittance, .. }) =
                (&p.geometry, world.materials[p.material])
            else {
                break;
            };
            if shells.is_empty() {
                center = *c;
            } else if c.distance(center) > slack(*radius) {
                break;
            }
            if shells.len() == 2 {
                return None;
            }
            shells.push(Shell {
                number: world.lights.len() + number,
                radius: *radius,
                indices: [medium, p.parent].map(|m| world.indices[m as usize]),
                transmittance,
            });
            medium = p.parent;
        }
        let (first, last) = (*shells.first()?, *shells.last()?);
        let mut bulb = Self {
            light,
            center,
            shells: [first, last],
            count: shells.len() as u32,
            reflects: false,
            medium,
        };
        let farthest = farthest(l, center);
        let fits = has_receivers(world, medium)
            && is_alone(world, light, &bulb)
            && bulb.has_one_ray(Way::Straight, farthest);
        if !fits {
            return None;
        }
        let in_ball = |other: &&WorldLight| bulb.side_of(1, other) != DiskSide::Outside;
        let is_only = world.lights.iter().filter(in_ball).count() == 1;
        bulb.reflects = is_only
            && [Way::Inner, Way::Outer]
                .iter()
                .all(|way| bulb.has_one_ray(*way, farthest));
        Some(bulb)
    }

    /// Where a light lies relative to one of the shells.
    fn side_of(&self, shell: usize, l: &WorldLight) -> DiskSide {
        let ball = Geometry::Sphere {
            center: self.center,
            radius: self.shells[shell].radius,
        };
        ball.side_of_disk(l.center, l.normal, l.radius)
    }

    /// The angle around the centre that a ray sweeps from a point at distance `d` from it, which it leaves at angle `alpha` to the
    /// direction from the centre, to distance `x` outside, less pi if it is reflected; and its derivative by `alpha`. `None` if it meets
    /// a shell too steeply. `shaders/bulb/ray.wgsl` has the same sum.
    fn sweep(&self, way: Way, d: f64, alpha: f64, x: f64) -> Option<[f64; 2]> {
        let n = self.shells[0].indices[0];
        let (impact, slope) = (n * d * alpha.sin(), n * d * alpha.cos());
        let (mut angle, mut derivative, mut passes) = (alpha, 1.0, true);
        let mut add = |times: f64, n: f64, r: f64| {
            let k = 1.0 / (n * r);
            let s = impact * k;
            angle += times * s.asin();
            derivative += times * slope * k / (1.0 - s * s).sqrt();
            passes &= s.abs() <= STEEPEST;
        };
        let [inner, outer] = &self.shells;
        let [in_cavity, in_glass] = match way {
            Way::Straight => [1.0, 1.0],
            Way::Inner => [3.0, 1.0],
            Way::Outer => [3.0, 3.0],
        };
        add(-in_cavity, inner.indices[0], inner.radius);
        if self.count == 2 {
            add(in_glass, inner.indices[1], inner.radius);
            add(-in_glass, outer.indices[0], outer.radius);
        }
        add(1.0, outer.indices[1], outer.radius);
        add(-1.0, outer.indices[1], x);
        passes.then_some([angle, derivative])
    }

    /// The angle to the direction from the centre at which a ray of this way leaves a point at distance `d` from the centre to sweep `angle`
    /// to distance `x`, modulo a turn.
    fn leaving_angle(&self, way: Way, d: f64, angle: f64, x: f64) -> Option<f64> {
        // A reflected ray sweeps pi more.
        let target = if way == Way::Straight {
            angle
        } else {
            angle - PI
        };
        let mut alpha = target;
        for _ in 0..STEPS {
            let [swept, derivative] = self.sweep(way, d, alpha, x)?;
            // The kernel's step turns a direction.
            alpha -= ((swept - target).sin() / derivative).atan();
        }
        let [swept, _] = self.sweep(way, d, alpha, x)?;
        ((swept - target).abs() <= LEFT).then_some(alpha)
    }

    /// The ray of this way from `y`, a point of the light, to `x` outside.
    pub fn ray(&self, way: Way, y: DVec3, x: DVec3) -> Option<BulbRay> {
        let (from, to) = (y - self.center, x - self.center);
        let (d, distance) = (from.length(), to.length());
        let outwards = to / distance;
        let along = if d > 0.0 { from / d } else { outwards };
        let across = (outwards - along * along.dot(outwards)).normalize_or_zero();
        let angle = across.dot(outwards).atan2(along.dot(outwards));
        let alpha = self.leaving_angle(way, d, angle, distance)?;
        let impact = self.shells[0].indices[0] * d * alpha.sin();
        let sin = impact / (self.shells[1].indices[1] * distance);
        let onwards = across * angle.cos() - along * angle.sin();
        Some(BulbRay {
            d: -outwards * (1.0 - sin * sin).sqrt() - onwards * sin,
            leaves: along * alpha.cos() + across * alpha.sin(),
        })
    }

    /// The ways whose light is sampled, but for the straight one.
    pub fn reflected_ways(&self) -> &'static [Way] {
        match (self.reflects, self.count) {
            (false, _) => &[],
            (true, 1) => &[Way::Outer],
            (true, _) => &[Way::Inner, Way::Outer],
        }
    }

    /// As in `shaders/bulb/ways.wgsl`: the vertex at which a path from outside is reflected on this way, and that of the light; the first has 1.
    pub fn vertices(&self, way: Way) -> [u32; 2] {
        match (way, self.count) {
            (Way::Straight, n) => [0, n + 1],
            (Way::Outer, 1) => [2, 3],
            (Way::Inner, _) => [3, 4],
            (Way::Outer, _) => [4, 6],
        }
    }

    /// Whether there is one such ray from every point at most `farthest` from the centre to every point outside, and the kernel finds it.
    fn has_one_ray(&self, way: Way, farthest: f64) -> bool {
        const POINTS: usize = 4;
        const ANGLES: usize = 32;
        let grows = |d: f64, angle: f64, x: f64| {
            let [_, derivative] = self.sweep(way, d, angle, x)?;
            Some(derivative > 0.0)
        };
        let points = (1..=POINTS).map(|i| farthest * i as f64 / POINTS as f64);
        let mut tried = points.flat_map(|d| (0..=ANGLES).map(move |k| (d, k)));
        tried.all(|(d, k)| {
            let angle = PI * k as f64 / ANGLES as f64;
            DISTANCES.iter().all(|far| {
                let x = far * self.shells[1].radius;
                grows(d, angle, x) == Some(true) && self.leaving_angle(way, d, angle, x).is_some()
            })
        })
    }
}

/// The bulbs of a world.
pub(super) fn bulbs(world: &World) -> Vec<Bulb> {
    let may_be_one =
        |l: &&WorldLight| l.medium.is_some_and(|m| m != AIR) && l.emitted.max_element() > 0.0;
    let candidates = world.lights.iter().filter(may_be_one).count();
    // A light that a surface cuts is in several media, and radiances are without the factors of refraction then.
    if world.light_scales.is_some() || candidates * world.surface_count() > MOST_PAIRS {
        return Vec::new();
    }
    let lights = (0..world.lights.len()).filter(|&l| may_be_one(&&world.lights[l]));
    lights
        .filter_map(|l| Bulb::of(world, l))
        .take(MOST)
        .collect()
}

/// The distance of the light's farthest point from `center`.
fn farthest(l: &WorldLight, center: DVec3) -> f64 {
    let v = l.center - center;
    let along = v.dot(l.normal);
    along.hypot((v - l.normal * along).length() + l.radius)
}

/// Whether surfaces that scatter lie in this medium, as far as their middle tells.
fn has_receivers(world: &World, medium: u32) -> bool {
    let solid = world.primitives.iter().find(|p| p.solid == medium);
    let mut scattering =
        (world.primitives.iter()).filter(|p| !world.materials[p.material].kind().is_specular());
    match solid.filter(|_| medium != AIR) {
        None => true,
        Some(solid) => scattering.any(|p| {
            let middle = match p.geometry {
                Geometry::Disk { center, .. } => center,
                Geometry::HugeSphere { pole, .. } => pole,
                _ => p.geometry.core().0,
            };
            solid.geometry.holds(middle)
        }),
    }
}

/// Whether nothing in the outer shell can stand in the way of the light but the shells themselves.
fn is_alone(world: &World, light: usize, bulb: &Bulb) -> bool {
    let l = &world.lights[light];
    let outer = bulb.shells[1];
    let clear = |other: &WorldLight| match [0, 1].map(|shell| bulb.side_of(shell, other)) {
        [_, DiskSide::Outside] => true,
        // Within the inner shell rays are straight, so what lies behind the light is in no ray's way. In the glass they bend.
        [DiskSide::Inside, _] => {
            let reach = other.radius * l.normal.cross(other.normal).length();
            other.face != l.face && l.normal.dot(other.center) + reach <= l.offset
        }
        _ => false,
    };
    let others = (0..world.lights.len()).filter(|&k| k != light);
    let is_shell = |number: usize| bulb.shells.iter().any(|s| s.number == number);
    let primitives = (world.lights.len()..).zip(&world.primitives);
    others.map(|k| &world.lights[k]).all(clear)
        && primitives
            .filter(|(number, _)| !is_shell(*number))
            .all(|(_, p)| is_clear_of(p, bulb.center, outer.radius))
}

/// Whether no part of the surface lies in the ball. A cylinder or an implicit surface is taken for its box.
fn is_clear_of(p: &WorldPrimitive, center: DVec3, radius: f64) -> bool {
    let far = radius - slack(radius);
    match p.geometry {
        Geometry::Sphere {
            center: c,
            radius: r,
        } => {
            let between = c.distance(center);
            let coincide = spheres([center, c], [radius, r], crate::coincidence::MAY_COINCIDE);
            !coincide && (between >= far + r || r >= far + between)
        }
        Geometry::Plane { normal, offset } => (normal.dot(center) - offset).abs() >= far,
        Geometry::HugeSphere {
            pole,
            normal,
            radius: r,
        } => {
            let v = center - pole;
            // The height over the sphere, to second order in v / r.
            let height = normal.dot(v) + 0.5 * v.length_squared() / r;
            height.abs() >= far * (1.0 + 1e-3)
        }
        Geometry::Disk {
            center: c,
            normal,
            radius: r,
            ..
        } => {
            let v = center - c;
            let along = v.dot(normal);
            let beside = ((v - normal * along).length() - r).max(0.0);
            along.hypot(beside) >= far
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius: r,
        } if p.side == Side::Inside => {
            // The ball lies in the solid.
            let along = axis.dot(center);
            let v = center - base;
            let beside = (v - axis * v.dot(axis)).length();
            along - offsets[0] >= far && offsets[1] - along >= far && r - beside >= far
        }
        _ => p.geometry.bounds().is_some_and(|b| {
            let nearest = center.clamp(b.min, b.max);
            nearest.distance(center) >= far
        }),
    }
}
