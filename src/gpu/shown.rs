//! What mirrors and glass show of lights: rays followed in f64 from points about each pixel.

use super::seen::around;
use crate::film::coverage::Rect;
use crate::kernel::BRANCH_SHIFT;
use crate::scene::Bsdf;
use crate::settings::Settings;
use crate::world::trace::{Hit, Met, Ray, camera_ray};
use crate::world::{Geometry, World};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Vertices at which a ray that refracts wherever it can may be reflected instead.
const TURNS: usize = 3;

/// Pictures narrower than this are looked at between the corners of pixels too: images in them are small.
const FINE_WIDTH: u32 = 384;

/// The most parts of a pixel's side that are looked at.
const FINEST: u32 = 4;

/// The light that a ray reaches by way of mirrors and glass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Reached {
    /// 1 + its number; 0: none.
    light: u16,
    /// Number of its vertex.
    depth: u8,
    /// Whether glass might have sent the ray another way.
    by_chance: bool,
}

/// What is reached by way of refraction wherever it is possible; and, for each of the first vertices, by reflection there
/// instead.
type Sights = [Reached; 1 + TURNS];

/// What mirrors and glass show of lights.
pub(super) struct Shown {
    world: World,
    size: [u32; 2],
    /// The last vertex at which lights are looked for.
    sight: u32,
    /// Of each mirror and each thing of glass, as [`around`] says.
    around: Vec<[f64; 4]>,
    /// Points looked at along the side of a pixel.
    fine: u32,
}

impl Shown {
    pub fn new(world: &World, settings: &Settings, sight: u32) -> Self {
        let [width, height] = settings.size;
        let all = Some([-2.0, f64::from(width) + 2.0, -2.0, f64::from(height) + 2.0]);
        let ball = |center, radius| around(&world.camera, settings.size, center, radius);
        let specular = world.primitives.iter().filter(|p| {
            let bsdf = &world.materials[p.material];
            matches!(bsdf, Bsdf::Mirror { .. } | Bsdf::Dielectric { .. })
        });
        let bounds = specular.filter_map(|p| match p.geometry {
            Geometry::Sphere { center, radius } | Geometry::Disk { center, radius, .. } => {
                ball(center, radius)
            }
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let half = (offsets[1] - offsets[0]) / 2.0;
                ball(base + axis * half, half.hypot(radius))
            }
            Geometry::Plane { .. } | Geometry::HugeSphere { .. } => all,
        });
        Self {
            around: bounds.collect(),
            world: world.clone(),
            size: settings.size,
            sight,
            fine: FINE_WIDTH.div_ceil(width).clamp(1, FINEST),
        }
    }

    /// What is seen at a place of the film.
    fn at(&self, x: f64, y: f64) -> Sights {
        let mut sights = Sights::default();
        let mut ray = camera_ray(&self.world.camera, self.size, x, y);
        let mut by_chance = false;
        for depth in 1..=self.sight {
            let Some(hit) = self.world.intersect(&ray) else {
                break;
            };
            let Some(next) = self.world.specular(&hit, &ray, false) else {
                if depth > 1 {
                    sights[0] = self.reached(&hit, depth, by_chance);
                }
                break;
            };
            if next.medium != ray.medium {
                by_chance = true;
                if let Some(turned) = sights.get_mut(depth as usize) {
                    let reflected = self.world.specular(&hit, &ray, true);
                    *turned = reflected.map_or(Reached::default(), |ray| self.end(ray, depth + 1));
                }
            }
            ray = next;
        }
        sights
    }

    /// What a ray reaches that chance has sent towards vertex `depth`.
    fn end(&self, mut ray: Ray, depth: u32) -> Reached {
        for depth in depth..=self.sight {
            let Some(hit) = self.world.intersect(&ray) else {
                break;
            };
            match self.world.specular(&hit, &ray, false) {
                Some(next) => ray = next,
                None => return self.reached(&hit, depth, true),
            }
        }
        Reached::default()
    }

    fn reached(&self, hit: &Hit, depth: u32, by_chance: bool) -> Reached {
        match hit.met {
            Met::Light { index, front: true } => Reached {
                light: index as u16 + 1,
                depth: depth as u8,
                by_chance,
            },
            _ => Reached::default(),
        }
    }

    /// What is seen at the points `columns` x `rows` of the lattice, in rows: `look` says it where a mirror may be.
    fn grid(
        &self,
        columns: &RangeInclusive<i64>,
        rows: &RangeInclusive<i64>,
        step: i64,
        look: impl Fn(i64, i64) -> Sights + Sync,
    ) -> Vec<Sights> {
        let width = (columns.end() - columns.start() + 1) as usize;
        let height = (rows.end() - rows.start() + 1) as usize;
        let mut sights = vec![Sights::default(); width * height];
        let first = rows.start();
        let rows = sights.par_chunks_exact_mut(width).enumerate();
        rows.for_each(|(row, sights)| {
            let j = first + row as i64;
            let [_, y] = self.place(0, step * j);
            let boxes = self
                .around
                .iter()
                .filter(|[_, _, y0, y1]| (*y0..=*y1).contains(&y));
            let boxes: Vec<_> = boxes.map(|[x0, x1, ..]| *x0..=*x1).collect();
            if boxes.is_empty() {
                return;
            }
            for (sights, i) in sights.iter_mut().zip(columns.clone()) {
                let [x, _] = self.place(step * i, 0);
                if boxes.iter().any(|b| b.contains(&x)) {
                    *sights = look(i, j);
                }
            }
        });
        sights
    }

    /// Where on the film a point of the lattice lies.
    fn place(&self, i: i64, j: i64) -> [f64; 2] {
        [i, j].map(|k| k as f64 / f64::from(self.fine))
    }

    /// Marks the pixels of `rect`.
    pub fn mark(&self, rect: Rect, marks: &mut [u32]) {
        let fine = i64::from(self.fine);
        // All points of the pixels and those next to them; of every other row and column as many more as are compared.
        let points = |first: u32, end: u32| fine * i64::from(first) - 1..=fine * i64::from(end) + 1;
        let (columns, rows) = (points(rect.x0, rect.x1), points(rect.y0, rect.y1));
        let coarse = |points: &RangeInclusive<i64>| {
            points.start().div_euclid(2) - 1..=points.end().div_euclid(2) + 2
        };
        let (coarse_columns, coarse_rows) = (coarse(&columns), coarse(&rows));
        let at = |i: i64, j: i64| {
            let [x, y] = self.place(i, j);
            self.at(x, y)
        };
        let few = self.grid(&coarse_columns, &coarse_rows, 2, |i, j| at(2 * i, 2 * j));
        let across = (coarse_columns.end() - coarse_columns.start() + 1) as usize;
        let sights = self.grid(&columns, &rows, 1, |i, j| {
            let x = (i.div_euclid(2) - coarse_columns.start()) as usize;
            let y = (j.div_euclid(2) - coarse_rows.start()) as usize;
            let known = few[y * across + x];
            if i % 2 == 0 && j % 2 == 0 {
                return known;
            }
            // Between points that all show the same nothing else is looked for.
            let mut around = (y - 1..=y + 2).map(|y| &few[y * across + x - 1..][..4]);
            if around.all(|row| row.iter().all(|s| *s == known)) {
                known
            } else {
                at(i, j)
            }
        });
        let across = (columns.end() - columns.start() + 1) as usize;
        let (width, fine) = (rect.width() as usize, self.fine as usize);
        let rows = marks.par_chunks_exact_mut(width).enumerate();
        rows.for_each(|(y, row)| {
            let own = &sights[y * fine * across..][..(fine + 3) * across];
            if own.iter().all(|s| *s == Sights::default()) {
                return;
            }
            for (x, mark) in row.iter_mut().enumerate() {
                let own = |j: usize| &sights[(y * fine + j) * across + x * fine..][..fine + 3];
                *mark = mark_of((0..fine + 3).flat_map(own));
            }
        });
    }
}

/// The mark of a pixel that has these sights at and about it: see [`SeenLights::marks`](super::seen::SeenLights::marks).
fn mark_of<'a>(sights: impl Iterator<Item = &'a Sights>) -> u32 {
    let mut sights = sights.peekable();
    let first = sights.peek().map_or(Sights::default(), |s| **s);
    let (mut sight, mut branch) = (0, 0);
    let mut note = |k: usize, reached: &Reached| {
        sight = sight.max(reached.depth);
        if k > 0 && (branch == 0 || k < branch) {
            branch = k;
        }
    };
    for sights in sights {
        for (k, (a, b)) in first.iter().zip(sights).enumerate() {
            if a != b || b.by_chance {
                note(k, a);
                note(k, b);
            }
        }
    }
    u32::from(sight) | (branch as u32) << BRANCH_SHIFT
}
