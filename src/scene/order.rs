//! A canonical order for scenes with the same meaning. Reordering the tables of a file, or renaming its materials, changes
//! neither the picture's bits nor the hash.
//!
//! Order in the file matters only among surfaces of one kind that coincide. So all surfaces are sorted by their values, and
//! then each group that coincides is put back into file order.

use super::{Bsdf, Light, Material, Primitive, Scene, Shape};
use crate::coincidence::COINCIDENT;
use crate::implicit::Implicit;
use glam::DVec3;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// A scene in canonical order, with only the materials in use and without duplicates. Hash and world are made from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Canonical(Scene);

impl Canonical {
    /// Puts `scene` in order. With 10⁶ primitives this takes half a second or more, so do it once for hash and world.
    pub fn new(scene: &Scene) -> Self {
        Self(canonical(scene))
    }

    /// The scene in that order.
    pub(crate) fn scene(&self) -> &Scene {
        &self.0
    }
}

fn canonical(scene: &Scene) -> Scene {
    let mut s = scene.clone();
    merge_materials(&mut s);

    let bsdf = |p: &Primitive| s.materials[p.material].bsdf;
    let in_order = sorted(&s.primitives, primitive_key);
    let shapes: Vec<Shape> = in_order
        .iter()
        .map(|&i| s.primitives[i].shape.clone())
        .collect();
    let decides = |a: usize, b: usize| {
        let (p, q) = (&s.primitives[in_order[a]], &s.primitives[in_order[b]]);
        // Two surfaces of one opaque material look the same, so it does not matter which is met.
        let alike = p.material == q.material && !bsdf(p).is_dielectric();
        !alike && p.shape.may_coincide(&q.shape)
    };
    let kept = keep_file_order(&in_order, &shapes, decides);
    s.primitives = kept.iter().map(|&i| s.primitives[i].clone()).collect();

    let in_order = sorted(&s.lights, light_key);
    let disk = |i: &usize| {
        let l = &s.lights[*i];
        Shape::Disk {
            center: l.center,
            normal: l.normal,
            radius: l.radius,
        }
    };
    let shapes: Vec<Shape> = in_order.iter().map(disk).collect();
    let kept = keep_file_order(&in_order, &shapes, |a, b| {
        shapes[a].may_coincide(&shapes[b])
    });
    s.lights = kept.iter().map(|&i| s.lights[i]).collect();
    s
}

/// The numbers that identify an object, as bits in the same order.
type Key = [u64; 12];

/// How many numbers of a key are stored together for sorting: kind, size and two coordinates distinguish most objects.
const FIRST: usize = 4;

fn key(numbers: impl IntoIterator<Item = f64>) -> Key {
    let mut key = Key::default();
    for (k, x) in key.iter_mut().zip(numbers) {
        let bits = (x + 0.0).to_bits(); // the two zeros are one
        // The order of `f64::total_cmp`: the bits of negative numbers are reversed, and come before those of positive ones.
        *k = if bits >> 63 == 1 {
            !bits
        } else {
            bits | 1 << 63
        };
    }
    key
}

/// Indices into `list`, sorted by the keys of its elements. Elements with equal keys stay in order.
fn sorted<T: Sync>(list: &[T], key: impl Fn(&T) -> Key + Sync) -> Vec<usize> {
    let first = |thing: &T| *key(thing).first_chunk::<FIRST>().expect("keys are longer");
    let firsts = list.par_iter().map(first);
    let mut order: Vec<([u64; FIRST], usize)> = firsts.zip(0..list.len()).collect();
    order.par_sort_unstable_by(|(p, a), (q, b)| {
        p.cmp(q)
            .then_with(|| key(&list[*a]).cmp(&key(&list[*b])))
            .then(a.cmp(b))
    });
    order.into_iter().map(|(_, i)| i).collect()
}

/// Lengths and points come first in the key, because the last bits of a direction depend on how it was normalised.
fn primitive_key(p: &Primitive) -> Key {
    let material = p.material as f64;
    let numbers = |kind: f64, radius: f64, a: DVec3, b: DVec3| {
        let [a, b] = [a.to_array(), b.to_array()];
        let geometry = [kind, radius, a[0], a[1], a[2], b[0], b[1], b[2], material];
        key(geometry)
    };
    match p.shape {
        Shape::Sphere { center, radius } => numbers(0.0, radius, center, DVec3::ZERO),
        Shape::Plane { point, normal } => numbers(1.0, 0.0, point, normal),
        Shape::Disk {
            center,
            normal,
            radius,
        } => numbers(2.0, radius, center, normal),
        Shape::Cylinder { base, top, radius } => numbers(3.0, radius, base, top),
        Shape::Implicit(ref implicit) => {
            let all = DVec3::new(implicit.level, number_of(implicit), 0.0);
            numbers(4.0, implicit.scale, implicit.center, all)
        }
    }
}

/// A number that no two implicit surfaces that differ have in common, but for one chance in 2⁵³.
fn number_of(implicit: &Implicit) -> f64 {
    let mut digest = Sha256::new();
    for word in implicit.words() {
        digest.update(word.to_le_bytes());
    }
    let first = digest
        .finalize()
        .first_chunk()
        .map_or(0, |b| u64::from_le_bytes(*b));
    (first >> 11) as f64
}

fn light_key(l: &Light) -> Key {
    let vectors = [l.radiance, l.center, l.normal].map(|v| v.to_array());
    key([l.radius].into_iter().chain(vectors.into_iter().flatten()))
}

fn bsdf_key(bsdf: &Bsdf) -> Key {
    let colors = bsdf.colors().into_iter().flat_map(|c| c.to_array());
    let kind = f64::from(bsdf.kind() as u32);
    key([kind].into_iter().chain(bsdf.numbers()).chain(colors))
}

/// Sorts the materials, and removes those that nothing uses or that are equal to another.
fn merge_materials(s: &mut Scene) {
    let mut used = vec![false; s.materials.len()];
    for p in &s.primitives {
        used[p.material] = true;
    }
    let mut merged: Vec<Material> = Vec::new();
    let mut index = vec![0; s.materials.len()];
    for i in sorted(&s.materials, |m| bsdf_key(&m.bsdf)) {
        if !used[i] {
            continue;
        }
        let bsdf = s.materials[i].bsdf;
        if merged.last().is_none_or(|m| m.bsdf != bsdf) {
            merged.push(s.materials[i].clone());
        }
        index[i] = merged.len() - 1;
    }
    for p in &mut s.primitives {
        p.material = index[p.material];
    }
    s.materials = merged;
}

/// `order` with some of its indices sorted among themselves: those of things that `decides` joins, directly or by way of others.
/// `shapes` has the shapes of the things in `order`. The arguments of `decides` are places in `order`.
fn keep_file_order(
    order: &[usize],
    shapes: &[Shape],
    decides: impl Fn(usize, usize) -> bool,
) -> Vec<usize> {
    let mut groups = Groups((0..order.len()).collect());
    for_each_near_pair(shapes, |a, b| {
        if groups.root(a) != groups.root(b) && decides(a, b) {
            groups.join(a, b);
        }
    });
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for k in 0..order.len() {
        let root = groups.root(k);
        if root != k {
            members.entry(root).or_insert_with(|| vec![root]).push(k);
        }
    }
    let mut kept = order.to_vec();
    for places in members.values_mut() {
        places.sort_unstable();
        let mut things: Vec<usize> = places.iter().map(|&k| order[k]).collect();
        things.sort_unstable();
        for (&place, thing) in places.iter().zip(things) {
            kept[place] = thing;
        }
    }
    kept
}

/// Disjoint sets, by the parent of every element.
struct Groups(Vec<usize>);

impl Groups {
    fn root(&mut self, mut k: usize) -> usize {
        while self.0[k] != k {
            self.0[k] = self.0[self.0[k]];
            k = self.0[k];
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// A ball around a shape, as centre and radius. The balls of two shapes of one kind touch if the shapes may coincide.
fn ball_of(shape: &Shape) -> (DVec3, f64) {
    // Well above `MAY_COINCIDE`, which decides in the end.
    const SLACK: f64 = 10.0 * COINCIDENT;
    let (center, reach) = match *shape {
        Shape::Sphere { center, radius } => (center, SLACK * radius),
        // The point of the plane nearest the file's origin. It does not depend on the sign of the normal.
        Shape::Plane { point, normal } => {
            let foot = normal * normal.dot(point);
            (foot, SLACK * foot.length())
        }
        Shape::Disk { center, radius, .. } => (center, (1.0 + SLACK) * radius),
        Shape::Cylinder { base, top, radius } => (
            (base + top) / 2.0,
            (1.0 + SLACK) * (base.distance(top) / 2.0).hypot(radius),
        ),
        Shape::Implicit(ref implicit) => {
            let (center, radius) = implicit.ball();
            (center, SLACK * radius)
        }
    };
    // Cells are counted in f64, so a ball must not be too small for its distance from the origin.
    (center, reach.max(1e-12 * center.length()).max(1e-30))
}

fn kind(shape: &Shape) -> u8 {
    match shape {
        Shape::Sphere { .. } => 0,
        Shape::Plane { .. } => 1,
        Shape::Disk { .. } => 2,
        Shape::Cylinder { .. } => 3,
        Shape::Implicit(_) => 4,
    }
}

/// Where a ball is found: its kind of shape, its level, which is log₂ of its radius rounded up, and its cell in the grid of that level.
type Cell = (u8, i32, [i64; 3]);

/// Edge of a cell, divided by the largest radius of a ball in that grid. With this number most balls touch one cell only.
const CELL: f64 = 8.0;

fn cell(kind: u8, level: i32, p: DVec3) -> Cell {
    let at = p / (CELL * f64::from(level).exp2());
    (kind, level, at.to_array().map(|x| x.floor() as i64))
}

/// Balls by their cells: a hash table whose slots are lists of balls.
struct Grid {
    balls: Vec<Ball>,
    /// The kinds and levels of all balls.
    levels: Vec<(u8, i32)>,
    /// The first ball of each slot, or [`NONE`].
    heads: Vec<u32>,
    /// For each ball the next one in its slot, or [`NONE`].
    next: Vec<u32>,
}

/// No ball.
const NONE: u32 = u32::MAX;

struct Ball {
    center: DVec3,
    reach: f64,
    cell: Cell,
}

impl Grid {
    fn new(shapes: &[Shape]) -> Self {
        let ball = |shape| {
            let (center, reach) = ball_of(shape);
            let level = reach.log2().ceil() as i32;
            let cell = cell(kind(shape), level, center);
            Ball {
                center,
                reach,
                cell,
            }
        };
        let balls: Vec<Ball> = shapes.par_iter().map(ball).collect();
        let mut levels = Vec::new();
        let mut heads = vec![NONE; (2 * balls.len()).next_power_of_two()];
        let mut next = vec![NONE; balls.len()];
        for (k, ball) in (0..).zip(&balls) {
            let (kind, level, _) = ball.cell;
            if !levels.contains(&(kind, level)) {
                levels.push((kind, level));
            }
            let head = &mut heads[Self::slot(&ball.cell, balls.len())];
            next[k as usize] = std::mem::replace(head, k);
        }
        Self {
            balls,
            levels,
            heads,
            next,
        }
    }

    /// The slot of a cell, in a grid of `balls` balls.
    fn slot(&(kind, level, at): &Cell, balls: usize) -> usize {
        // An odd number without a pattern in its bits, from the golden ratio.
        const MIX: u64 = 0x9e37_79b9_7f4a_7c15;
        let words = [u64::from(kind), level as u64]
            .into_iter()
            .chain(at.map(|x| x as u64));
        let hash = words.fold(0, |h: u64, x| (h.rotate_left(23) ^ x).wrapping_mul(MIX));
        (hash >> 32) as usize & ((2 * balls).next_power_of_two() - 1)
    }

    /// Calls `found` with the balls of the same kind that ball `k` touches, and some more, until it breaks. Each pair is found once: from
    /// the ball of the lower level, or from the later of two on one level.
    fn near(&self, k: usize, mut found: impl FnMut(usize) -> ControlFlow<()>) -> ControlFlow<()> {
        let ball = &self.balls[k];
        let (own_kind, own_level, _) = ball.cell;
        for &(kind, level) in &self.levels {
            if kind != own_kind || level < own_level {
                continue;
            }
            let reach = ball.reach + f64::from(level).exp2();
            let (_, _, low) = cell(kind, level, ball.center - reach);
            let (_, _, high) = cell(kind, level, ball.center + reach);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let there = (kind, level, [x, y, z]);
                        let mut next = self.heads[Self::slot(&there, self.balls.len())];
                        while next != NONE {
                            let m = next as usize;
                            if (level > own_level || m < k) && self.balls[m].cell == there {
                                found(m)?;
                            }
                            next = self.next[m];
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Calls `visit` with all pairs of shapes of one kind whose balls touch, and some more.
fn for_each_near_pair(shapes: &[Shape], mut visit: impl FnMut(usize, usize)) {
    let grid = Grid::new(shapes);
    // Most objects have no near neighbour, which can be checked in parallel.
    let all = (0..shapes.len()).into_par_iter();
    let some_near: Vec<usize> =
        (all.filter(|&k| grid.near(k, |_| ControlFlow::Break(())).is_break())).collect();
    for k in some_near {
        let _ = grid.near(k, |m| {
            visit(m, k);
            ControlFlow::Continue(())
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_pairs_are_all_that_a_search_of_every_pair_finds() {
        // Multiples of the golden ratio: a spread of sizes and places without a pattern.
        let spread = |k: usize, salt: f64| (k as f64 * 0.618_033_988_749 * salt).fract();
        let shapes: Vec<Shape> = (0..400)
            .map(|k| Shape::Disk {
                center: DVec3::new(spread(k, 1.0), spread(k, 17.0), spread(k, 131.0)) * 4.0 - 2.0,
                normal: DVec3::Y,
                radius: (-8.0 * spread(k, 1009.0)).exp2(),
            })
            .collect();
        let meet = |a: usize, b: usize| {
            let ((c, r), (d, s)) = (ball_of(&shapes[a]), ball_of(&shapes[b]));
            c.distance(d) <= r + s
        };
        let mut found = Vec::new();
        for_each_near_pair(&shapes, |a, b| {
            if meet(a, b) {
                found.push((a.min(b), a.max(b)));
            }
        });
        found.sort_unstable();
        let mut all = Vec::new();
        for b in 0..shapes.len() {
            all.extend((0..b).filter(|&a| meet(a, b)).map(|a| (a, b)));
        }
        all.sort_unstable();
        assert!(all.len() > 100, "{}", all.len());
        assert_eq!(found, all);
    }

    #[test]
    fn file_order_stays_where_joined_and_nowhere_else() {
        let ball = |x: f64| Shape::Sphere {
            center: DVec3::X * x,
            radius: 1.0,
        };
        // Things 0 to 4 of a file, sorted as 4, 3, 2, 1, 0. Things 0, 2 and 4 are in one place.
        let shapes = [ball(0.0), ball(5.0), ball(0.0), ball(9.0), ball(0.0)];
        let order = [4, 3, 2, 1, 0];
        let joined = |a: usize, b: usize| shapes[a] == shapes[b];
        assert_eq!(keep_file_order(&order, &shapes, joined), [0, 3, 2, 1, 4]);
        assert_eq!(keep_file_order(&order, &shapes, |_, _| false), order);
    }
}
