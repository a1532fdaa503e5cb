//! Radiosity in a box of six diffuse walls with disk lights flush on them. It is a check on the path tracers, and shares no method
//! with them.
//!
//! The walls are cut into patches, and B = E + ρ Σ F B is solved for their mean radiosities \[Goral1984\]. The radiance of a point is
//! then gathered from that solution. Direct light and the form factors from points are closed forms ([`form_factor`]). Lights
//! absorb what falls on them. A patch that a light covers in part reflects with the rest of its area. The error that remains comes from
//! patches of constant radiosity, and is proportional to their area.

pub mod form_factor;

use crate::scene::{Bsdf, Primitive, Scene, Shape};
use form_factor::disk_in_rectangle;
use glam::DVec3;
use rayon::prelude::*;
use std::array::from_fn;
use std::f64::consts::PI;

/// The iteration ends when no radiosity changes by more than this fraction of the brightest.
const CONVERGED: f64 = 1e-10;

/// Each patch is divided into this many along each side for the last bounce.
const FINER: usize = 2;

/// An axis-parallel box. Wall 2a + s is perpendicular to axis a, at its lower end (s = 0) or its upper end (s = 1). The patches of a
/// wall are numbered along axis a + 1 first, then along axis a + 2 (mod 3).
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    /// Lower and upper corner.
    corners: [DVec3; 2],
    /// Reflectance of each wall.
    reflectance: [DVec3; 6],
    lights: Vec<Lamp>,
}

/// A disk light flush on a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lamp {
    wall: usize,
    center: DVec3,
    radius: f64,
    radiance: DVec3,
}

/// Mean radiosities of the patches of a room.
#[derive(Debug, Clone)]
pub struct Solution {
    room: Room,
    grid: Grid,
    /// Mean radiosity of each patch, wall by wall, times the fraction of its area that no light covers.
    shining: Vec<DVec3>,
}

/// How the walls are cut into patches.
#[derive(Debug, Clone)]
struct Grid {
    /// Patches along each side of a wall.
    n: usize,
    /// The ends of patches along each axis.
    nodes: [Vec<f64>; 3],
}

impl Room {
    /// The room that a scene describes, or the reason why it is not a room.
    pub fn new(scene: &Scene) -> Result<Self, String> {
        let mut corners = [DVec3::NAN; 2];
        let mut reflectance = [DVec3::NAN; 6];
        for p in &scene.primitives {
            let (wall, at, albedo) = wall_of(scene, p)?;
            if reflectance[wall].is_finite() {
                return Err(format!("line {}: a second wall on this side", p.line));
            }
            reflectance[wall] = albedo;
            corners[wall % 2][wall / 2] = at;
        }
        if !(corners[0].cmplt(corners[1]).all()) {
            return Err("the planes do not close a box".into());
        }
        let mut room = Self {
            corners,
            reflectance,
            lights: Vec::new(),
        };
        for l in &scene.lights {
            let wall = (0..6)
                .find(|&w| inward(w) == l.normal && l.center[w / 2] == room.plane(w))
                .ok_or_else(|| format!("line {}: the light is not flush on a wall", l.line))?;
            let [u, v] = across_of(wall);
            let reaches = |axis: usize| {
                l.center[axis] - l.radius < corners[0][axis]
                    || l.center[axis] + l.radius > corners[1][axis]
            };
            let meets =
                |o: &Lamp| o.wall == wall && o.center.distance(l.center) < o.radius + l.radius;
            if reaches(u) || reaches(v) || room.lights.iter().any(meets) {
                return Err(format!("line {}: the light does not fit the wall", l.line));
            }
            room.lights.push(Lamp {
                wall,
                center: l.center,
                radius: l.radius,
                radiance: l.radiance,
            });
        }
        Ok(room)
    }

    /// The wall that an `eye` in the room sees along `direction`, and the point that it sees there.
    pub fn seen(&self, eye: DVec3, direction: DVec3) -> (usize, DVec3) {
        let (t, wall) = (0..6)
            .filter(|&w| inward(w).dot(direction) < 0.0)
            .map(|w| ((self.plane(w) - eye[w / 2]) / direction[w / 2], w))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("a direction leads to a wall");
        (wall, eye + direction * t)
    }

    /// Distance from `point` to the rim of the nearest light on the same wall. It is negative on a light, and infinite without one.
    pub fn distance_to_light(&self, wall: usize, point: DVec3) -> f64 {
        self.lights
            .iter()
            .filter(|l| l.wall == wall)
            .map(|l| l.center.distance(point) - l.radius)
            .fold(f64::INFINITY, f64::min)
    }

    /// The solution with `n` x `n` patches on each wall. For the last bounce each patch is divided further ([`FINER`]), so that
    /// variation of direct light within a patch matters less.
    pub fn solve(&self, n: usize) -> Solution {
        let grid = Grid::new(self, n);
        let patches = grid.patches();
        let row = |&(wall, ends): &_| grid.mean_row(self, wall, ends);
        let rows: Vec<(DVec3, Vec<f64>)> = patches.par_iter().map(row).collect();
        let reflected: Vec<DVec3> = patches.iter().map(|&(w, e)| self.reflected(w, e)).collect();
        let mut shining = vec![DVec3::ZERO; patches.len()];
        // Gauss-Seidel iteration: new values are used at once.
        loop {
            let (mut change, mut brightest) = (0.0f64, 0.0f64);
            for (k, (direct, factors)) in rows.iter().enumerate() {
                let new = reflected[k] * (*direct + sum_of(factors, &shining));
                change = change.max((new - shining[k]).abs().max_element());
                brightest = brightest.max(new.max_element());
                shining[k] = new;
            }
            if change <= CONVERGED * brightest {
                break;
            }
        }
        let fine = Grid::new(self, FINER * n);
        let last = |&(wall, ends): &_| {
            let (direct, factors) = grid.mean_row(self, wall, ends);
            self.reflected(wall, ends) * (direct + sum_of(&factors, &shining))
        };
        Solution {
            room: self.clone(),
            shining: fine.patches().par_iter().map(last).collect(),
            grid: fine,
        }
    }

    /// The fraction of the light falling on a patch that it reflects. Where lights cover the patch it reflects none.
    fn reflected(&self, wall: usize, [x, y]: [[f64; 2]; 2]) -> DVec3 {
        let [u, v] = across_of(wall);
        let lights = self.lights.iter().filter(|l| l.wall == wall);
        let covered = lights.map(|l| {
            let c = l.center;
            disk_in_rectangle(l.radius, x.map(|x| x - c[u]), y.map(|y| y - c[v]))
        });
        let covered = covered.sum::<f64>() / ((x[1] - x[0]) * (y[1] - y[0]));
        self.reflectance[wall] * (1.0 - covered)
    }

    /// The coordinate of a wall's plane on its axis.
    fn plane(&self, wall: usize) -> f64 {
        self.corners[wall % 2][wall / 2]
    }

    /// Irradiance of a point of `wall` directly from the lights.
    fn direct(&self, wall: usize, p: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for l in self.lights.iter().filter(|l| l.wall != wall) {
            let normal = inward(l.wall);
            let h = normal.dot(p - l.center);
            let to_axis = normal * h - (p - l.center);
            let [parallel, across] = form_factor::disk(to_axis.length(), h, l.radius);
            // A wall is either opposite that of the light, or perpendicular to it with the whole light in front.
            sum += l.radiance
                * PI
                * if wall / 2 == l.wall / 2 {
                    parallel
                } else {
                    across * to_axis.normalize().dot(inward(wall))
                };
        }
        sum
    }
}

impl Solution {
    /// The radiance that leaves a point of `wall` that no light covers.
    pub fn radiance(&self, wall: usize, p: DVec3) -> DVec3 {
        let mut row = vec![0.0; self.shining.len()];
        self.grid.add_row(&self.room, wall, p, 1.0, &mut row);
        let received = self.room.direct(wall, p) + sum_of(&row, &self.shining);
        self.room.reflectance[wall] * received / PI
    }
}

impl Grid {
    fn new(room: &Room, n: usize) -> Self {
        let [lower, upper] = room.corners;
        let nodes = from_fn(|axis| {
            let node = |k| lower[axis] + (upper[axis] - lower[axis]) * (k as f64 / n as f64);
            (0..=n).map(node).collect()
        });
        Self { n, nodes }
    }

    /// Every patch: its wall, and its ends along the two axes of the wall.
    fn patches(&self) -> Vec<(usize, [[f64; 2]; 2])> {
        let patch = |k: usize| {
            let (wall, i) = (k / (self.n * self.n), k % (self.n * self.n));
            let [u, v] = across_of(wall).map(|axis| &self.nodes[axis]);
            let (j, k) = (i % self.n, i / self.n);
            (wall, [[u[j], u[j + 1]], [v[k], v[k + 1]]])
        };
        (0..6 * self.n * self.n).map(patch).collect()
    }

    /// For a rectangle of `wall`, given by its ends: the irradiance directly from the lights, and the form factors to all patches.
    /// Both are means over the rectangle, by Gauss's rule with two points along each side.
    fn mean_row(&self, room: &Room, wall: usize, [x, y]: [[f64; 2]; 2]) -> (DVec3, Vec<f64>) {
        let [u, v] = across_of(wall);
        let places = [0.5 - 0.75f64.sqrt() / 3.0, 0.5 + 0.75f64.sqrt() / 3.0];
        let mut direct = DVec3::ZERO;
        let mut row = vec![0.0; 6 * self.n * self.n];
        for s in places {
            for t in places {
                let mut p = DVec3::splat(room.plane(wall));
                p[u] = x[0] + s * (x[1] - x[0]);
                p[v] = y[0] + t * (y[1] - y[0]);
                direct += 0.25 * room.direct(wall, p);
                self.add_row(room, wall, p, 0.25, &mut row);
            }
        }
        (direct, row)
    }

    /// Adds the form factors of a point of `wall` to all patches, times `weight`.
    fn add_row(&self, room: &Room, wall: usize, p: DVec3, weight: f64, row: &mut [f64]) {
        let patches = self.n * self.n;
        for (source, row) in row.chunks_exact_mut(patches).enumerate() {
            if source == wall {
                continue;
            }
            let [u, v] = across_of(source);
            let d = (p[source / 2] - room.plane(source)).abs();
            // The direction that the point faces along the axis of its wall, if that is perpendicular to the source.
            let ahead = inward(wall)[wall / 2];
            let corner = |j: usize, k: usize| {
                let (x, y) = (self.nodes[u][j] - p[u], self.nodes[v][k] - p[v]);
                match wall / 2 {
                    a if a == source / 2 => form_factor::point_parallel(x, y, d),
                    a if a == u => ahead * form_factor::point_across(x * ahead, y, d),
                    _ => ahead * form_factor::point_across(y * ahead, x, d),
                }
            };
            let mut before: Vec<f64> = (0..=self.n).map(|j| corner(j, 0)).collect();
            for k in 0..self.n {
                let after: Vec<f64> = (0..=self.n).map(|j| corner(j, k + 1)).collect();
                for j in 0..self.n {
                    let factor = after[j + 1] - after[j] - before[j + 1] + before[j];
                    row[k * self.n + j] += weight * factor;
                }
                before = after;
            }
        }
    }
}

/// Irradiance, from form factors and radiosities.
fn sum_of(factors: &[f64], radiosities: &[DVec3]) -> DVec3 {
    factors.iter().zip(radiosities).map(|(f, b)| *b * *f).sum()
}

/// The axes in the plane of a wall.
fn across_of(wall: usize) -> [usize; 2] {
    [(wall / 2 + 1) % 3, (wall / 2 + 2) % 3]
}

/// Normal of a wall, into the room.
fn inward(wall: usize) -> DVec3 {
    DVec3::AXES[wall / 2] * if wall.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// The wall that a primitive describes: its number, its coordinate on its axis, and its reflectance.
fn wall_of(scene: &Scene, p: &Primitive) -> Result<(usize, f64, DVec3), String> {
    let Bsdf::Diffuse { reflectance } = scene.materials[p.material].bsdf else {
        return Err(format!("line {}: not diffuse", p.line));
    };
    let Shape::Plane { point, normal } = p.shape else {
        return Err(format!("line {}: not a plane", p.line));
    };
    let wall = (0..6).find(|&w| inward(w) == normal);
    let wall = wall.ok_or_else(|| format!("line {}: a wall askew", p.line))?;
    Ok((wall, point[wall / 2], reflectance))
}

#[cfg(test)]
mod tests;
