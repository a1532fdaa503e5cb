//! Pixels that may show a light by way of mirrors and glass.
//!
//! Exact rays go through points in and around every pixel, and follow a chain of mirrors and glass until they meet something else.
//! If they do not all meet the same thing, the pixel shows an edge.

use super::{FilmBox, Mark};
use crate::film::coverage::Rect;
use crate::world::trace::{Hit, Met, Ray, camera_ray};
use crate::world::{Geometry, World};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// A ray refracts wherever it can. Other rays are reflected once instead, at one of this many first vertices.
const MAX_BRANCHES: usize = 3;

/// Pictures narrower than this get points between the corners of pixels too, because images of lights are small there.
const FINE_WIDTH: u32 = 384;

/// The largest number of points along the side of a pixel.
const MAX_FINE: u32 = 4;

/// Points of a light's rim whose images are looked for.
const RIM_POINTS: u32 = 16;

/// An image is small if the box around it has less than this, in pixels.
const SMALL_IMAGE: f64 = 4.0;

/// The share of an image's size that is added around these points.
const RIM_SLACK: f64 = 0.1;

/// The light that a ray reaches by way of mirrors and glass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Reached {
    /// 1 + the light's number; 0: none.
    light: u16,
    /// Number of the vertex on the light.
    vertex: u8,
    /// Whether glass might have sent the ray another way.
    by_chance: bool,
}

/// What the rays through one point of the film reach. The first one refracts wherever it can; number k, for k >= 1, is reflected
/// at vertex k.
type Sights = [Reached; 1 + MAX_BRANCHES];

/// The chains of mirrors and glass that a picture may show.
pub(super) struct Chains {
    world: World,
    size: [u32; 2],
    /// The last vertex at which rays look for lights.
    last_vertex: u32,
    /// Pixels that each mirror and each thing of glass may touch.
    pixels: Vec<FilmBox>,
    /// Points along the side of a pixel.
    fine: u32,
    /// Images that these points may miss, because they may be small.
    images: Vec<Image>,
}

/// The image of a light in the glass ball around it, which reflects it once: a part of the film, and its mark.
#[derive(Debug, Clone, Copy)]
struct Image {
    pixels: FilmBox,
    last_vertex: u8,
    branch_vertex: u8,
    /// It covers a small part of its pixels.
    small: bool,
}

impl Chains {
    pub fn new(world: &World, size: [u32; 2], last_vertex: u32) -> Self {
        let ball = |center, radius| FilmBox::of_ball(&world.camera, size, center, radius);
        let specular = world
            .primitives
            .iter()
            .filter(|p| world.materials[p.material].kind().is_specular());
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
            Geometry::Implicit(ref implicit) => {
                let (center, radius) = implicit.ball();
                ball(center, radius)
            }
            Geometry::Plane { .. } | Geometry::HugeSphere { .. } => Some(FilmBox::whole(size)),
        });
        Self {
            pixels: bounds.collect(),
            world: world.clone(),
            size,
            last_vertex,
            fine: FINE_WIDTH.div_ceil(size[0]).clamp(1, MAX_FINE),
            images: images(world, size, last_vertex),
        }
    }

    /// What the rays through a point of the film reach.
    fn sights_at(&self, x: f64, y: f64) -> Sights {
        let mut sights = Sights::default();
        let mut ray = camera_ray(&self.world.camera, self.size, x, y);
        let mut by_chance = false;
        for vertex in 1..=self.last_vertex {
            let Some(hit) = self.world.intersect(&ray) else {
                break;
            };
            let Some(next) = self.world.specular(&hit, &ray, false) else {
                if vertex > 1 {
                    sights[0] = reached(&hit, vertex, by_chance);
                }
                break;
            };
            if next.medium != ray.medium {
                by_chance = true;
                if let Some(branch) = sights.get_mut(vertex as usize) {
                    let reflected = self.world.specular(&hit, &ray, true);
                    *branch =
                        reflected.map_or(Reached::default(), |ray| self.follow(ray, vertex + 1));
                }
            }
            ray = next;
        }
        sights
    }

    /// What a ray reaches that chance has sent towards vertex `next`.
    fn follow(&self, mut ray: Ray, next: u32) -> Reached {
        for vertex in next..=self.last_vertex {
            let Some(hit) = self.world.intersect(&ray) else {
                break;
            };
            match self.world.specular(&hit, &ray, false) {
                Some(next) => ray = next,
                None => return reached(&hit, vertex, true),
            }
        }
        Reached::default()
    }

    /// The sights at the points `columns` x `rows` of a lattice, in rows, whose points lie `step` points of the finest lattice
    /// apart. `look` finds them where a mirror or glass may be; elsewhere there are none.
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
            let boxes = self.pixels.iter();
            let boxes: Vec<_> = boxes
                .filter(|b| (b.min_y..=b.max_y).contains(&y))
                .map(|b| b.min_x..=b.max_x)
                .collect();
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

    /// Where on the film a point of the finest lattice lies.
    fn place(&self, i: i64, j: i64) -> [f64; 2] {
        [i, j].map(|k| k as f64 / f64::from(self.fine))
    }

    /// Sets the marks of the pixels of `rect`.
    pub fn mark(&self, rect: Rect, marks: &mut [Mark]) {
        let fine = i64::from(self.fine);
        // The finest lattice has all points of the pixels, and those next to them. The coarse lattice has every other row and
        // column, and as many more as are compared below.
        let points = |first: u32, end: u32| fine * i64::from(first) - 1..=fine * i64::from(end) + 1;
        let (columns, rows) = (points(rect.x0, rect.x1), points(rect.y0, rect.y1));
        let coarse = |points: &RangeInclusive<i64>| {
            points.start().div_euclid(2) - 1..=points.end().div_euclid(2) + 2
        };
        let (coarse_columns, coarse_rows) = (coarse(&columns), coarse(&rows));
        let at = |i: i64, j: i64| {
            let [x, y] = self.place(i, j);
            self.sights_at(x, y)
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
            // Between coarse points that all show the same, nothing else is looked for.
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
        for image in &self.images {
            image.mark(rect, marks);
        }
    }
}

impl Image {
    fn mark(&self, rect: Rect, marks: &mut [Mark]) {
        let touched = |low: f64, high: f64, first: u32, end: u32| {
            let inside = |k: f64| k.clamp(f64::from(first), f64::from(end)) as u32;
            inside(low.floor())..inside(high.floor() + 1.0)
        };
        let FilmBox {
            min_x,
            max_x,
            min_y,
            max_y,
        } = self.pixels;
        for y in touched(min_y, max_y, rect.y0, rect.y1) {
            for x in touched(min_x, max_x, rect.x0, rect.x1) {
                let mark = &mut marks[((y - rect.y0) * rect.width() + x - rect.x0) as usize];
                mark.last_vertex = mark.last_vertex.max(self.last_vertex);
                mark.many |= self.small;
                if mark.branch_vertex == 0 {
                    mark.branch_vertex = self.branch_vertex;
                }
            }
        }
    }
}

/// The images of lights that glass balls around them reflect once.
fn images(world: &World, size: [u32; 2], last_vertex: u32) -> Vec<Image> {
    let camera = &world.camera;
    let mut images = Vec::new();
    for bulb in &world.bulbs {
        if camera.medium != bulb.medium {
            continue;
        }
        let light = &world.lights[bulb.light];
        let x = light.normal.any_orthonormal_vector();
        let y = light.normal.cross(x);
        let rim = (0..RIM_POINTS).map(|k| {
            let angle = TAU * f64::from(k) / f64::from(RIM_POINTS);
            light.center + (x * angle.cos() + y * angle.sin()) * light.radius
        });
        let points: Vec<DVec3> = rim.chain([light.center]).collect();
        for way in bulb.reflected_ways() {
            let [branch, last] = bulb.vertices(*way);
            let seen = points.iter().filter_map(|p| {
                let ray = bulb.ray(*way, *p, camera.eye)?;
                let faces = ray.leaves.dot(light.normal) > 0.0;
                faces
                    .then(|| FilmBox::of_direction(camera, size, ray.d))
                    .flatten()
            });
            let whole = seen.reduce(FilmBox::union).filter(|_| last <= last_vertex);
            images.extend(whole.map(|pixels| Image {
                small: pixels.area() < SMALL_IMAGE,
                pixels: pixels.widened(RIM_SLACK),
                last_vertex: last as u8,
                branch_vertex: branch as u8,
            }));
        }
    }
    images
}

/// What a ray that ends at `hit` has reached.
fn reached(hit: &Hit, vertex: u32, by_chance: bool) -> Reached {
    match hit.met {
        Met::Light { index, front: true } => Reached {
            light: index as u16 + 1,
            vertex: vertex as u8,
            by_chance,
        },
        _ => Reached::default(),
    }
}

/// The mark of a pixel with these sights in and around it.
fn mark_of<'a>(sights: impl Iterator<Item = &'a Sights>) -> Mark {
    let mut sights = sights.peekable();
    let first = sights.peek().map_or(Sights::default(), |s| **s);
    let mut mark = Mark::default();
    let mut note = |branch: u8, reached: &Reached| {
        mark.last_vertex = mark.last_vertex.max(reached.vertex);
        if branch > 0 && (mark.branch_vertex == 0 || branch < mark.branch_vertex) {
            mark.branch_vertex = branch;
        }
    };
    for sights in sights {
        for (branch, (a, b)) in (0..).zip(first.iter().zip(sights)) {
            if a != b || b.by_chance {
                note(branch, a);
                note(branch, b);
            }
        }
    }
    mark
}
