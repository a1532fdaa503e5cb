//! Whether the answers to rays are right.

use super::rounded;
use etendue::gpu::probe::Values;
use etendue::implicit::Implicit;
use etendue::world::trace::{Met, Ray};
use etendue::world::{Geometry, World, WorldPrimitive};
use glam::DVec3;

pub fn vec(x: &[f32]) -> DVec3 {
    DVec3::new(x[0].into(), x[1].into(), x[2].into())
}

/// What a batch of rays has shown.
#[derive(Debug, Default)]
pub struct Report {
    rays: usize,
    /// Rays that were left out because they may or may not meet the surface on which they stand.
    at_once: usize,
    /// Rays that were left out because they end on the rim of an open surface. Some kinds run in its bounds.
    at_rim: usize,
    hits: usize,
    /// The reference meets the surface, and the kernel goes through more than rounding explains.
    missed: usize,
    /// The kernel meets what is not there.
    ghosts: usize,
    /// Both meet the surface at places that differ.
    displaced: usize,
    /// A hit's normal differs.
    turned: usize,
    pub turns: f64,
    pub most_turns: f64,
    example: Option<String>,
}

impl Report {
    pub fn wrong(&self) -> usize {
        self.missed + self.ghosts + self.displaced + self.turned
    }
}

/// The distance of a point from the surface, to first order, over the size of the bounds.
fn off(implicit: &Implicit, p: DVec3) -> f64 {
    let q = implicit.to_local(p);
    let (height, gradient) = implicit.sloped(q);
    let near = |h: f64| h.abs() / gradient.length().max(1e-9) / implicit.clip.radius();
    // On a cap the height does not matter.
    near(height).min(implicit.clip.depth(q).abs() / implicit.clip.radius())
}

/// Whether the formula is so near to 0 at a point that its rounding decides on which side it is. Where its gradient is small, that may be far
/// from the surface.
fn is_blurred(implicit: &Implicit, p: DVec3) -> bool {
    let q = implicit.to_local(p);
    implicit.height(q).abs() < 4.0 * rounded::of_height(implicit, q)
}

pub fn the_surface(world: &World) -> (&WorldPrimitive, &Implicit) {
    let p = world.primitives.last().expect("a primitive");
    match &p.geometry {
        Geometry::Implicit(implicit) => (p, implicit),
        _ => panic!("not implicit"),
    }
}

pub fn judge(world: &World, x: &Values, y: &Values, report: &mut Report) {
    /// Places nearer than this are one, over the size.
    const PLACE: f64 = 1e-3;
    /// Cosines below this are grazing.
    const GRAZING: f64 = 1e-2;
    /// What the rounding of f32 explains, over the size.
    const ROUNDING: f64 = 2e-5;

    let (p, implicit) = the_surface(world);
    let size = implicit.ball().1;
    let ray = Ray {
        origin: vec(&x[..3]),
        direction: vec(&x[3..6]).normalize(),
        medium: x[7] as u32,
        face: x[6] as u32,
    };
    let explained = |p: DVec3| off(implicit, p) <= ROUNDING || is_blurred(implicit, p);
    // The light is far away, and no matter here.
    let of_surface = |hit: &etendue::world::trace::Hit| matches!(hit.met, Met::Primitive(_));
    let expected = world.intersect(&ray).filter(of_surface);
    let first = 4.0 * world.lights.len() as f32;
    let found = (y[1] >= first).then_some(f64::from(y[0]));
    // Of a ray that leaves the surface at a grazing angle, the rounding of its start decides whether it meets the surface at once.
    let normal = implicit.rotation * implicit.sloped(implicit.to_local(ray.origin)).1;
    let level = normal.normalize_or_zero().dot(ray.direction).abs() < GRAZING;
    if ray.face > 0 && level && expected.as_ref().is_some_and(|hit| hit.t < PLACE * size) {
        report.at_once += 1;
        return;
    }
    // An open surface doesn't know on which side a ray starts that is on it but for rounding. Nor does it know whether the ray has crossed
    // it before it is clear of it.
    let on_surface = |hit: &etendue::world::trace::Hit| {
        let mut way = (0..=20).map(|k| ray.at(hit.t * f64::from(k) / 20.0));
        !implicit.closed && way.all(|p| off(implicit, p) < 0.01 * ROUNDING)
    };
    if expected.as_ref().is_some_and(on_surface) {
        report.at_once += 1;
        return;
    }
    // The rim of an open surface is where it is but for the rounding of its bounds.
    let at_rim = |hit: &etendue::world::trace::Hit| {
        let depth = implicit.clip.depth(implicit.to_local(hit.point));
        !implicit.closed && depth.abs() < 0.1 * ROUNDING * implicit.clip.radius()
    };
    if expected.as_ref().is_some_and(at_rim) {
        report.at_rim += 1;
        return;
    }
    report.rays += 1;
    report.hits += usize::from(expected.is_some());
    report.turns += f64::from(y[8]);
    report.most_turns = report.most_turns.max(y[8].into());
    let mut wrong = |count: fn(&mut Report) -> &mut usize, what: String| {
        *count(report) += 1;
        if report.example.is_none() {
            report.example = Some(format!("{ray:?}: {expected:?}, found {found:?}: {what}"));
        }
    };
    // How deep a ray goes between two places where it should have met the surface in between. Thin parts are just behind the first.
    let deepest = |from: f64, to: f64| {
        let side = if !implicit.closed {
            let before = from - (1e-6 * size).min(0.5 * from);
            -implicit.height(implicit.to_local(ray.at(before))).signum()
        } else if p.solid > 0 && ray.medium == p.solid {
            1.0
        } else {
            -1.0
        };
        let even = (1..200).map(|k| f64::from(k) / 200.0);
        let near = (1..100).map(|k| 0.9f64.powi(k));
        even.chain(near)
            .map(|part| ray.at(from + (to - from) * part))
            .filter(|p| implicit.clip.holds(implicit.to_local(*p)))
            .filter(|p| implicit.height(implicit.to_local(*p)) * side > 0.0)
            .filter(|p| !explained(*p))
            .map(|p| off(implicit, p))
            .fold(0.0, f64::max)
    };
    match (&expected, found) {
        (None, None) => {}
        (Some(hit), None) => {
            let deep = deepest(hit.t, hit.t + 3.0 * size);
            if deep > 0.0 {
                wrong(|r| &mut r.missed, format!("{deep:e} deep"));
            }
        }
        (Some(hit), Some(t)) if t > hit.t + PLACE * size => {
            let deep = deepest(hit.t, t);
            if deep > 0.0 {
                wrong(|r| &mut r.missed, format!("{deep:e} deep"));
            }
        }
        (expected, Some(t)) => {
            let early = expected.as_ref().is_none_or(|hit| t < hit.t - PLACE * size);
            let o = off(implicit, ray.at(t));
            if early && !explained(ray.at(t)) {
                wrong(|r| &mut r.ghosts, format!("{o:e} off"));
            } else if !early && o > 20.0 * ROUNDING && !is_blurred(implicit, ray.at(t)) {
                wrong(|r| &mut r.displaced, format!("{o:e} off"));
            }
            if let Some(hit) = expected.as_ref().filter(|_| !early) {
                let (p, n) = (vec(&y[2..5]), vec(&y[5..8]));
                let normal = n * n.dot(hit.normal).signum();
                // Where the surface bends within the rounding of a place, normals differ.
                if off(implicit, p) > ROUNDING || !(n.length() - 1.0).abs().le(&1e-4) {
                    wrong(|r| &mut r.displaced, format!("vertex {p} {n}"));
                } else if normal.dot(hit.normal) < 0.98
                    && hit.point.distance(p) < 1e-5 * size
                    && !near_edge(implicit, p)
                {
                    wrong(|r| &mut r.turned, format!("normal {n}"));
                }
            }
        }
    }
}

/// Whether the bounds or an edge of the formula are near, where normals change at once.
fn near_edge(implicit: &Implicit, p: DVec3) -> bool {
    const NEAR: f64 = 1e-4;
    let q = implicit.to_local(p);
    let reach = NEAR * implicit.clip.radius();
    // The cells around a point, across faces, edges and corners.
    let around: Vec<DVec3> = (0..27)
        .map(|k| {
            let side = DVec3::from_array([k % 3, k / 3 % 3, k / 9].map(|n| f64::from(n) - 1.0));
            let (_, gradient) = implicit.sloped(q + side * reach);
            gradient.normalize_or_zero()
        })
        .collect();
    let differs = |a: &DVec3| around.iter().any(|b| a.dot(*b) < 0.98);
    implicit.clip.depth(q).abs() < reach || around.iter().any(differs)
}

/// What is wrong with the answers to `count` rays.
pub fn failures_of(name: &str, report: &Report, count: usize) -> Option<String> {
    println!(
        "{name}: {} rays, {} hits, {} missed, {} ghosts, {} displaced, {} turned; {:.1} turns, at most {}",
        report.rays,
        report.hits,
        report.missed,
        report.ghosts,
        report.displaced,
        report.turned,
        report.turns,
        report.most_turns
    );
    if let Some(example) = &report.example {
        println!("{example}");
    }
    assert!(report.hits > report.rays / 20, "{name}: {report:?}");
    // Few are left out: of many rays a fiftieth at most, and of few up to four standard deviations more. Of the rays along an axis, which
    // are a sixth, also those in the faces of the bounds: three in ten of a volume of twelve points a side.
    let most = |share: f64| count as f64 * share + 4.0 * (count as f64 * share).sqrt();
    assert!(
        (report.at_once as f64) < most(1.0 / 50.0),
        "{name}: {report:?}"
    );
    assert!(
        (report.at_rim as f64) < most(1.0 / 18.0),
        "{name}: {report:?}"
    );
    (report.wrong() > 0).then(|| format!("{name}: {report:?}"))
}
