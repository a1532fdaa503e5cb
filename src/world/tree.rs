//! A bounding volume hierarchy as a list: depth first, with the place to go on where a box is missed.
//!
//! So it is walked without a stack, by the kernel and by the host alike, and no shape of it is too deep. On a software
//! adapter an ordered walk with a stack in registers visits fewer nodes and takes as long.
//!
//! The builder is our own. `obvhs` was tried: it had not ended after a minute over thirty thousand equal boxes, for it looks for pairs of
//! which each is the other's nearest, and `bvh`, not tried, brings a linear algebra of its own.

use super::Geometry;
use glam::DVec3;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub min: DVec3,
    /// Greatest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// Of the points within `reach` of `center`, axis by axis.
    pub fn about(center: DVec3, reach: DVec3) -> Self {
        Self {
            min: center - reach,
            max: center + reach,
        }
    }

    /// Of a disk.
    pub fn disk(center: DVec3, normal: DVec3, radius: f64) -> Self {
        let across = (DVec3::ONE - normal * normal).max(DVec3::ZERO);
        Self::about(
            center,
            radius * DVec3::from_array(across.to_array().map(f64::sqrt)),
        )
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

impl Geometry {
    /// The box around it; `None` for what has no bounds, or bounds that say nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        match *self {
            Self::Plane { .. } | Self::HugeSphere { .. } => None,
            Self::Sphere { center, radius } => Some(Bounds::about(center, DVec3::splat(radius))),
            Self::Disk {
                center,
                normal,
                radius,
                ..
            } => Some(Bounds::disk(center, normal, radius)),
            Self::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let top = base + axis * (offsets[1] - offsets[0]);
                Some(Bounds::disk(base, axis, radius).union(Bounds::disk(top, axis, radius)))
            }
        }
    }
}

/// A node, or (with an item) a leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Least coordinates of the box, rounded outwards.
    pub min: [f32; 3],
    /// Greatest coordinates.
    pub max: [f32; 3],
    /// Number of the node after all that is below this one.
    pub escape: u32,
    /// Number of the box that a leaf stands for.
    pub item: Option<u32>,
}

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tree {
    /// Depth first: the node after an inner one is its first child. Two less one for each box.
    pub nodes: Vec<Node>,
}

/// A box in f32.
#[derive(Clone, Copy)]
struct Box32 {
    min: [f32; 3],
    max: [f32; 3],
}

impl Box32 {
    /// Of nothing.
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// Around one in f64 whose corners may have been rounded to f32 already: a step farther on each side.
    fn outwards(b: &Bounds) -> Self {
        Self {
            min: b.min.to_array().map(|x| (x as f32).next_down()),
            max: b.max.to_array().map(|x| (x as f32).next_up()),
        }
    }

    fn add(&mut self, other: &Self) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
        }
    }

    /// Half the surface area; 0 of nothing.
    fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from((self.max[k] - self.min[k]).max(0.0)));
        x * y + y * z + z * x
    }

    /// Twice the middle along an axis.
    fn middle(&self, axis: usize) -> f32 {
        self.min[axis] + self.max[axis]
    }
}

/// Parts in which a split may lie along each axis.
const BINS: usize = 16;

/// Parts the items of a node in two, by the surface area heuristic where that can tell them apart, else in halves; returns
/// how many are in the first part, which is neither none nor all.
fn split(boxes: &[Box32], items: &mut [u32]) -> usize {
    let mut best: Option<(f64, usize, f32)> = None;
    for axis in 0..3 {
        let middle = |i: &u32| boxes[*i as usize].middle(axis);
        let (low, high) = items
            .iter()
            .map(middle)
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| {
                (a.min(x), b.max(x))
            });
        let scale = BINS as f32 / (high - low);
        if high <= low || !scale.is_finite() {
            continue;
        }
        let mut bins = [(Box32::EMPTY, 0usize); BINS];
        for i in items.iter() {
            let bin = &mut bins[bin_of(middle(i), low, scale)];
            bin.0.add(&boxes[*i as usize]);
            bin.1 += 1;
        }
        // Costs of all that lies right of each border, then of both sides.
        let mut right = [0.0; BINS];
        let (mut around, mut count) = (Box32::EMPTY, 0);
        for k in (1..BINS).rev() {
            around.add(&bins[k].0);
            count += bins[k].1;
            right[k] = around.half_area() * count as f64;
        }
        let (mut around, mut count) = (Box32::EMPTY, 0);
        for k in 1..BINS {
            around.add(&bins[k - 1].0);
            count += bins[k - 1].1;
            let cost = around.half_area() * count as f64 + right[k];
            let parts = count > 0 && count < items.len();
            if parts && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, k as f32));
            }
        }
    }
    let halves = items.len() / 2;
    let Some((_, axis, border)) = best else {
        return halves;
    };
    let middle = |i: u32| boxes[i as usize].middle(axis);
    let (low, high) = items
        .iter()
        .map(|&i| middle(i))
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
    let scale = BINS as f32 / (high - low);
    let mut first = 0;
    for k in 0..items.len() {
        if (bin_of(middle(items[k]), low, scale) as f32) < border {
            items.swap(k, first);
            first += 1;
        }
    }
    first
}

fn bin_of(x: f32, low: f32, scale: f32) -> usize {
    (((x - low) * scale) as usize).min(BINS - 1)
}

impl Tree {
    /// Of boxes with finite corners, numbered in their order: a binary tree by the surface area heuristic, one box a leaf.
    pub fn new(boxes: &[Bounds]) -> Self {
        let boxes: Vec<Box32> = boxes.iter().map(Box32::outwards).collect();
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity((2 * boxes.len()).saturating_sub(1));
        // What is still to be written; the second part of a node waits until the first is complete.
        let mut open: Vec<_> = std::iter::once(0..items.len()).collect();
        while let Some(range) = open.pop() {
            let these = &mut items[range.clone()];
            if these.is_empty() {
                continue;
            }
            let mut around = Box32::EMPTY;
            these.iter().for_each(|&i| around.add(&boxes[i as usize]));
            nodes.push(Node {
                min: around.min,
                max: around.max,
                // A tree of n boxes has 2 n - 1 nodes.
                escape: (nodes.len() + 2 * these.len() - 1) as u32,
                item: (these.len() == 1).then(|| these[0]),
            });
            if these.len() > 1 {
                let middle = range.start + split(&boxes, these);
                open.extend([middle..range.end, range.start..middle]);
            }
        }
        Self { nodes }
    }

    /// Calls `found` with the number of every box that touches `around`.
    pub fn touching(&self, around: &Bounds, mut found: impl FnMut(usize)) {
        let Box32 {
            min: low,
            max: high,
        } = Box32::outwards(around);
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let meets = (0..3).all(|k| node.min[k] <= high[k] && node.max[k] >= low[k]);
            if let (true, Some(item)) = (meets, node.item) {
                found(item as usize);
            }
            at = if meets { at + 1 } else { node.escape as usize };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(count: usize, place: impl Fn(usize) -> DVec3, size: f64) -> Vec<Bounds> {
        (0..count)
            .map(|i| Bounds::about(place(i), DVec3::splat(size)))
            .collect()
    }

    /// Spread over a cube, the same every time.
    fn scattered(i: usize) -> DVec3 {
        let part = |k: f64| (i as f64 * k).fract() * 10.0;
        DVec3::new(part(0.618_034), part(0.414_214), part(0.732_051))
    }

    #[test]
    fn every_box_is_in_the_tree_once_and_within_its_ancestors() {
        let same = |_: usize| DVec3::new(3.0, 0.0, -1.0);
        let flat = |i: usize| DVec3::new(i as f64 % 7.0, 0.0, i as f64 / 7.0);
        let places: [&dyn Fn(usize) -> DVec3; 3] = [&scattered, &same, &flat];
        for place in places {
            for (count, size) in [(1, 1.0), (2, 0.0), (777, 0.1), (500, 0.0)] {
                let tree = Tree::new(&boxes(count, place, size));
                assert_eq!(tree.nodes.len(), 2 * count - 1);
                let mut items: Vec<u32> = tree.nodes.iter().filter_map(|n| n.item).collect();
                items.sort_unstable();
                assert!(items.iter().copied().eq(0..count as u32));
                for (i, n) in tree.nodes.iter().enumerate() {
                    for below in &tree.nodes[i..n.escape as usize] {
                        assert!(
                            (0..3).all(|k| below.min[k] >= n.min[k] && below.max[k] <= n.max[k])
                        );
                    }
                    assert!(n.item.is_none() || n.escape as usize == i + 1);
                }
            }
        }
    }

    #[test]
    fn what_touches_a_box_is_found() {
        let boxes = boxes(1000, scattered, 0.8);
        let tree = Tree::new(&boxes);
        for probe in boxes.iter().step_by(97) {
            let touches = |b: &Bounds| b.min.cmple(probe.max).all() && b.max.cmpge(probe.min).all();
            let expected: Vec<usize> = (0..1000).filter(|&i| touches(&boxes[i])).collect();
            let mut found = Vec::new();
            tree.touching(probe, |i| found.push(i));
            found.sort_unstable();
            assert!(expected.len() > 1 && expected == found);
        }
        Tree::new(&[]).touching(&boxes[0], |_| panic!("nothing is there"));
    }

    #[test]
    fn equal_boxes_take_no_quadratic_time() {
        let start = std::time::Instant::now();
        Tree::new(&boxes(30_000, |_| DVec3::ONE, 0.5));
        // A builder that is quadratic in them takes more than a minute.
        assert!(
            start.elapsed().as_secs_f64() < 20.0,
            "{:?}",
            start.elapsed()
        );
    }
}
