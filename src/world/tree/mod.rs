//! A bounding volume hierarchy, four wide: each inner node has up to four children, which stand side by side.
//!
//! The builder is our own. The crate `obvhs` had not finished after a minute with thirty thousand equal boxes, because it looks for
//! pairs of boxes that are nearest to each other. The crate `bvh` brings its own linear algebra, and was not tried. Neither bounds the
//! depth of a tree, on which the room for a walk's stack depends.

pub(crate) mod beam;
mod build;
mod forest;

use super::Bounds;

/// The most children of a node.
pub const WIDTH: usize = 4;

/// A node, or a leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its box, rounded outwards.
    pub bounds: Box32,
    /// What is in it.
    pub below: Below,
}

/// What a node holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Below {
    /// One box: its number.
    Item(u32),
    /// Other nodes: the index of the first, and how many there are, 2 to [`WIDTH`].
    Nodes {
        /// Index into [`Tree::nodes`].
        first: u32,
        /// The others follow it.
        count: u32,
    },
}

/// A box in f32.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box32 {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
}

impl Box32 {
    /// The box of nothing.
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// A box in f32 that holds `b` even after the corners of what it bounds were rounded to f32, and after the rounding errors of a test
    /// in f32 for what it bounds: on each side it is larger by sixteen units in the last place of its corners.
    fn outwards(b: &Bounds) -> Self {
        let slack = 1e-6 * b.min.abs().max(b.max.abs()).element_sum();
        Self {
            min: (b.min - slack).to_array().map(|x| (x as f32).next_down()),
            max: (b.max + slack).to_array().map(|x| (x as f32).next_up()),
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

    /// Centre and radius of the sphere around it.
    pub fn sphere(&self) -> [f32; 4] {
        let [x, y, z] = [0, 1, 2].map(|k| 0.5 * (self.min[k] + self.max[k]));
        let half = [0, 1, 2].map(|k| 0.5 * (self.max[k] - self.min[k]));
        [x, y, z, half.iter().map(|h| h * h).sum::<f32>().sqrt()]
    }
}

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// The first is the root, a leaf if there is one box. There are none for no boxes.
    pub nodes: Vec<Node>,
}

impl Tree {
    /// The tree of these boxes, which have finite corners and are numbered in their order. Each leaf has one box.
    pub fn new(boxes: &[Bounds]) -> Self {
        Self::of((0..).zip(boxes.iter().copied()))
    }

    /// The tree of these boxes with their numbers.
    fn of(numbered: impl Iterator<Item = (u32, Bounds)>) -> Self {
        let entry = |(item, b): (u32, Bounds)| build::Entry {
            bounds: Box32::outwards(&b),
            item,
        };
        let mut items: Vec<build::Entry> = numbered.map(entry).collect();
        Self {
            nodes: build::nodes(&mut items),
        }
    }

    /// The most nodes on a way from the root to a leaf, not counting the leaf, in any tree of this many boxes.
    pub fn levels(boxes: usize) -> u32 {
        build::levels(boxes)
    }

    /// Calls `found` with the number of every box that touches `bounds`.
    pub fn touching(&self, bounds: &Bounds, mut found: impl FnMut(usize)) {
        let Box32 {
            min: low,
            max: high,
        } = Box32::outwards(bounds);
        let mut open: Vec<u32> = (0..self.nodes.len().min(1) as u32).collect();
        while let Some(k) = open.pop() {
            let Node { bounds, below } = &self.nodes[k as usize];
            if (0..3).all(|k| bounds.min[k] <= high[k] && bounds.max[k] >= low[k]) {
                match *below {
                    Below::Item(item) => found(item as usize),
                    Below::Nodes { first, count } => open.extend(first..first + count),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
