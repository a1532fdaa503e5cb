//! A bounding volume hierarchy whose nodes are numbered like those of a heap: node k has the children 2k and 2k + 1.
//!
//! A walk through such a tree needs no stack. One bit for each level says whether the sibling is still to be visited, and the
//! number of the sibling follows from the number of the node. In exchange the number of levels is fixed, so a node must never hold
//! more boxes than the levels below it have room for. That room is twice what a balanced tree needs, which lets the surface
//! area heuristic split most nodes as it likes.
//!
//! The builder is our own. The crate `obvhs` had not finished after a minute with thirty thousand equal boxes, because it looks for
//! pairs of boxes that are nearest to each other. The crate `bvh` brings its own linear algebra, and was not tried. Neither numbers
//! nodes in this way.

use super::Geometry;
use glam::DVec3;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box of the points within `reach` of `center`, axis by axis.
    pub fn about(center: DVec3, reach: DVec3) -> Self {
        Self {
            min: center - reach,
            max: center + reach,
        }
    }

    /// The box around a disk.
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
    /// The box around it; `None` for a plane, which has none, and for a huge sphere, whose box would hold everything.
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

/// A node. An inner node has no item. An empty node has no item either, and its `min` is beyond its `max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Smallest coordinates of the box, rounded outwards.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
    /// The number of its box, for a leaf.
    pub item: Option<u32>,
}

impl Node {
    /// A node that no ray meets.
    pub const EMPTY: Self = Self {
        min: [2e30; 3],
        max: [-2e30; 3],
        item: None,
    };

    /// Centre and radius of a sphere around the box.
    pub fn sphere(&self) -> [f32; 4] {
        let [x, y, z] = [0, 1, 2].map(|k| 0.5 * (self.min[k] + self.max[k]));
        let half = [0, 1, 2].map(|k| 0.5 * (self.max[k] - self.min[k]));
        [x, y, z, half.iter().map(|h| h * h).sum::<f32>().sqrt()]
    }
}

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Node 1 is the root; it is a leaf if there is one box. Node 0 is empty. There are [`Tree::numbers`] nodes.
    pub nodes: Vec<Node>,
}

/// A numbered box. The builder sorts these entries, not their numbers: a million boxes do not fit the caches, so looking boxes up by
/// number would be slow.
#[derive(Clone, Copy)]
struct Entry {
    bounds: Box32,
    item: u32,
}

/// A box in f32.
#[derive(Clone, Copy)]
struct Box32 {
    min: [f32; 3],
    max: [f32; 3],
}

impl Box32 {
    /// The box of nothing.
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// A box in f32 that holds `b` even after the corners of what it bounds were rounded to f32, and after the rounding errors of a test
    /// in f32 for what it bounds: on each side it is larger by sixteen units in the last place of its corners. No coordinate is near the subnormal numbers, with which a processor takes a hundred cycles for a product. They
    /// would be common, because things stand on floors at 0.
    fn outwards(b: &Bounds) -> Self {
        const TINY: f32 = 1e-25;
        let slack = 1e-6 * b.min.abs().max(b.max.abs()).element_sum();
        let normal = |x: f32, instead: f32| if x.abs() < TINY { instead } else { x };
        Self {
            min: (b.min - slack)
                .to_array()
                .map(|x| normal((x as f32).next_down(), -TINY)),
            max: (b.max + slack)
                .to_array()
                .map(|x| normal((x as f32).next_up(), TINY)),
        }
    }

    fn add(&mut self, other: &Self) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
        }
    }

    /// Half the surface area; 0 for the box of nothing.
    fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from((self.max[k] - self.min[k]).max(0.0)));
        x * y + y * z + z * x
    }

    /// Twice the coordinate of the middle along an axis.
    fn twice_middle(&self, axis: usize) -> f32 {
        self.min[axis] + self.max[axis]
    }
}

/// The number of bins along each axis. A split lies between two bins.
const BINS: usize = 16;

/// Splits the items of a node in two parts, and returns how many are in the first. Neither part is empty, or has more than `room`
/// items. The surface area heuristic decides; where it cannot tell the items apart, the parts are halves.
fn split(items: &mut [Entry], room: usize) -> usize {
    let mut best: Option<(f64, usize, f32)> = None;
    let mut longest: (f32, usize) = (0.0, 0);
    for axis in 0..3 {
        let middle = |e: &Entry| e.bounds.twice_middle(axis);
        let (low, high) = range(items.iter().map(middle));
        let scale = BINS as f32 / (high - low);
        if high <= low || !scale.is_finite() {
            continue;
        }
        if high - low > longest.0 {
            longest = (high - low, axis);
        }
        let mut bins = [(Box32::EMPTY, 0usize); BINS];
        for i in items.iter() {
            let bin = &mut bins[bin_of(middle(i), low, scale)];
            bin.0.add(&i.bounds);
            bin.1 += 1;
        }
        // First the costs of all items to the right of each border, then those of both sides. A border behind an empty bin splits
        // the items as the border before it does, and is skipped. Most nodes have few items, and most of their bins are empty.
        let mut right = [0.0; BINS];
        let (mut around, mut count, mut cost) = (Box32::EMPTY, 0, 0.0);
        for k in (1..BINS).rev() {
            if bins[k].1 > 0 {
                around.add(&bins[k].0);
                count += bins[k].1;
                cost = around.half_area() * count as f64;
            }
            right[k] = cost;
        }
        let (mut around, mut count) = (Box32::EMPTY, 0);
        for k in 1..BINS {
            if bins[k - 1].1 == 0 {
                continue;
            }
            around.add(&bins[k - 1].0);
            count += bins[k - 1].1;
            let cost = around.half_area() * count as f64 + right[k];
            let splits = count < items.len();
            let fits = count <= room && items.len() - count <= room;
            if splits && fits && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, k as f32));
            }
        }
    }
    let Some((_, axis, border)) = best else {
        let half = items.len() / 2;
        let middle = |e: &Entry| e.bounds.twice_middle(longest.1);
        items.select_nth_unstable_by(half, |a, b| {
            middle(a).total_cmp(&middle(b)).then(a.item.cmp(&b.item))
        });
        return half;
    };
    let middle = |e: &Entry| e.bounds.twice_middle(axis);
    let (low, high) = range(items.iter().map(middle));
    let scale = BINS as f32 / (high - low);
    let mut first = 0;
    for k in 0..items.len() {
        if (bin_of(middle(&items[k]), low, scale) as f32) < border {
            items.swap(k, first);
            first += 1;
        }
    }
    first
}

fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| {
        (a.min(x), b.max(x))
    })
}

fn bin_of(x: f32, low: f32, scale: f32) -> usize {
    (((x - low) * scale) as usize).min(BINS - 1)
}

/// Levels below the root of a tree with this many boxes.
fn levels(boxes: usize) -> u32 {
    match boxes {
        0..=1 => 0,
        2 => 1,
        n => n.next_power_of_two().ilog2() + 1,
    }
}

/// A node with fewer items is not worth another thread.
const MIN_PARALLEL: usize = 1 << 14;

/// Makes the node of these items, and all nodes below it. `rows` are the places of these nodes, one row for each level.
fn build(items: &mut [Entry], mut rows: Vec<&mut [Node]>) {
    if items.len() < MIN_PARALLEL {
        // Nodes that are still to be made: the level of each, its place there, and its items.
        let mut open = vec![(0, 0, 0..items.len())];
        while let Some((level, at, range)) = open.pop() {
            let middle = range.start + node(&mut items[range.clone()], &mut rows[level..], at);
            if range.len() > 1 {
                let halves = [
                    (2 * at, range.start..middle),
                    (2 * at + 1, middle..range.end),
                ];
                open.extend(halves.map(|(at, range)| (level + 1, at, range)));
            }
        }
        return;
    }
    let middle = node(items, &mut rows, 0);
    let (first, second) = items.split_at_mut(middle);
    let halves = rows.into_iter().skip(1);
    let (left, right) = halves.map(|row| row.split_at_mut(row.len() / 2)).unzip();
    rayon::join(|| build(first, left), || build(second, right));
}

/// Makes the node at place `at` in the first of `rows`, unless it has no items, and splits its items. Returns how many of them are in
/// the first part.
fn node(items: &mut [Entry], rows: &mut [&mut [Node]], at: usize) -> usize {
    if items.is_empty() {
        return 0;
    }
    let mut around = Box32::EMPTY;
    items.iter().for_each(|e| around.add(&e.bounds));
    rows[0][at] = Node {
        min: around.min,
        max: around.max,
        item: (items.len() == 1).then(|| items[0].item),
    };
    if items.len() == 1 {
        return 1;
    }
    split(items, 1 << (rows.len() - 2))
}

impl Tree {
    /// The number of nodes of a tree with this many boxes, empty ones included.
    pub fn numbers(boxes: usize) -> usize {
        2 << levels(boxes)
    }

    /// The tree of these boxes, which have finite corners and are numbered in their order. Each leaf has one box.
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut items: Vec<Entry> = (0..)
            .zip(boxes)
            .map(|(item, b)| Entry {
                bounds: Box32::outwards(b),
                item,
            })
            .collect();
        let mut nodes = vec![Node::EMPTY; Self::numbers(boxes.len())];
        let mut rest = &mut nodes[1..];
        let rows = (0..=levels(boxes.len())).map(|level| {
            let (row, below) = std::mem::take(&mut rest).split_at_mut(1 << level);
            rest = below;
            row
        });
        build(&mut items, rows.collect());
        Self { nodes }
    }

    /// Calls `found` with the number of every box that touches `bounds`.
    pub fn touching(&self, bounds: &Bounds, mut found: impl FnMut(usize)) {
        let Box32 {
            min: low,
            max: high,
        } = Box32::outwards(bounds);
        let mut open = vec![1];
        while let Some(k) = open.pop() {
            let node = &self.nodes[k];
            if (0..3).all(|k| node.min[k] <= high[k] && node.max[k] >= low[k]) {
                match node.item {
                    Some(item) => found(item as usize),
                    None => open.extend([2 * k, 2 * k + 1]),
                }
            }
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

    /// Points spread over a cube, the same every time.
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
                assert_eq!(tree.nodes.len(), Tree::numbers(count));
                let mut items: Vec<u32> = tree.nodes.iter().filter_map(|n| n.item).collect();
                items.sort_unstable();
                assert!(items.iter().copied().eq(0..count as u32));
                for (i, n) in tree.nodes.iter().enumerate().skip(2) {
                    let above = &tree.nodes[i / 2];
                    assert!(
                        *n == Node::EMPTY
                            || (0..3).all(|k| n.min[k] >= above.min[k] && n.max[k] <= above.max[k])
                    );
                }
                let empty = |k: usize| tree.nodes[k] == Node::EMPTY;
                for (i, n) in tree.nodes.iter().enumerate().skip(1) {
                    let below = 2 * i < tree.nodes.len() && !(empty(2 * i) && empty(2 * i + 1));
                    // An inner node has two children. A leaf or an empty node has none.
                    assert_eq!(below, !empty(i) && n.item.is_none());
                    assert!(!below || !(empty(2 * i) || empty(2 * i + 1)));
                }
            }
        }
    }

    #[test]
    fn a_giant_and_dust_at_all_scales_have_room() {
        // Each box is a tenth as far away as the last. The heuristic would like to split them off one by one.
        let places = |i: usize| DVec3::splat(10f64.powi(10 - (i % 40) as i32));
        for count in [40, 63, 64, 65, 1000] {
            let tree = Tree::new(&boxes(count, places, 1e-4));
            assert_eq!(
                tree.nodes.iter().filter(|n| n.item.is_some()).count(),
                count
            );
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
