//! Building a tree by the surface area heuristic, with binned splits, to a bounded depth.

use super::{Below, Box32, Node, WIDTH};
use rayon::prelude::*;
use std::ops::Range;

/// A numbered box. The builder sorts these entries, not their numbers: a million boxes do not fit the caches, so looking boxes up by
/// number would be slow.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub bounds: Box32,
    pub item: u32,
}

/// Levels beyond those that a balanced tree needs. They let the heuristic split nodes as it likes.
const SPARE_LEVELS: u32 = 1;

/// See [`super::Tree::levels`].
pub(super) fn levels(boxes: usize) -> u32 {
    match boxes {
        0 | 1 => 0,
        n => {
            let bits = n.next_power_of_two().ilog2();
            bits.div_ceil(WIDTH.ilog2()) + SPARE_LEVELS
        }
    }
}

/// A node with fewer items is not worth another thread.
const MIN_PARALLEL: usize = 1 << 14;

/// The nodes of the tree of these items, the root first.
pub(super) fn nodes(items: &mut [Entry]) -> Vec<Node> {
    if items.is_empty() {
        return Vec::new();
    }
    let levels = levels(items.len());
    below(items, levels)
}

/// The tree of these items, at least one, within so many levels.
fn below(items: &mut [Entry], levels: u32) -> Vec<Node> {
    let bounds = around(items);
    if items.len() < MIN_PARALLEL {
        return one_by_one(items, bounds, levels);
    }
    let parts = parts(items, bounds, levels);
    let count = parts.len() as u32;
    // The parts, each with its own nodes.
    let mut rest = items;
    let mut slices = Vec::new();
    for (range, _) in &parts {
        let (first, others) = std::mem::take(&mut rest).split_at_mut(range.len());
        slices.push(first);
        rest = others;
    }
    let below: Vec<Vec<Node>> = slices
        .into_par_iter()
        .map(|part| below(part, levels - 1))
        .collect();
    // Their roots go side by side, and the nodes below these follow, part by part.
    let mut all = vec![Node {
        bounds,
        below: Below::Nodes { first: 1, count },
    }];
    let mut at = 1 + count;
    for nodes in &below {
        // What was node 1 of the part will be node `at`.
        all.push(moved(nodes[0], at - 1));
        at += nodes.len() as u32 - 1;
    }
    let mut at = 1 + count;
    for nodes in &below {
        all.extend(nodes[1..].iter().map(|n| moved(*n, at - 1)));
        at += nodes.len() as u32 - 1;
    }
    all
}

/// A node of a part, where the nodes of the part are moved by so many places.
fn moved(node: Node, by: u32) -> Node {
    let below = match node.below {
        Below::Nodes { first, count } => Below::Nodes {
            first: first + by,
            count,
        },
        item @ Below::Item(_) => item,
    };
    Node { below, ..node }
}

/// The same in one thread.
fn one_by_one(items: &mut [Entry], bounds: Box32, levels: u32) -> Vec<Node> {
    // Nodes whose children are still to be made have no item yet.
    let blank = |bounds| Node {
        bounds,
        below: Below::Item(u32::MAX),
    };
    let mut nodes = vec![blank(bounds)];
    let mut open = vec![(0, 0..items.len(), levels)];
    while let Some((at, range, levels)) = open.pop() {
        if range.len() == 1 {
            nodes[at].below = Below::Item(items[range.start].item);
            continue;
        }
        let first = nodes.len();
        let here = &mut items[range.clone()];
        for (part, bounds) in parts(here, nodes[at].bounds, levels) {
            let part = range.start + part.start..range.start + part.end;
            open.push((nodes.len(), part, levels - 1));
            nodes.push(blank(bounds));
        }
        nodes[at].below = Below::Nodes {
            first: first as u32,
            count: (nodes.len() - first) as u32,
        };
    }
    nodes
}

/// Sorts the items of a node, at least two, into its children: their ranges and boxes. `levels` is what the node has left, itself
/// included.
fn parts(items: &mut [Entry], bounds: Box32, levels: u32) -> Vec<(Range<usize>, Box32)> {
    // The most items of a child.
    let room = WIDTH.pow(levels - 1);
    let needed = |n: usize| n.div_ceil(room);
    let mut parts = vec![(0..items.len(), bounds)];
    while parts.len() < WIDTH {
        // The largest that can be split; one with too many items before others.
        let splits = parts.iter().enumerate().filter(|(_, p)| p.0.len() > 1);
        let largest = splits.max_by(|(_, a), (_, b)| {
            let over = |p: &(Range<usize>, Box32)| p.0.len() > room;
            let area = |p: &(Range<usize>, Box32)| p.1.half_area();
            over(a)
                .cmp(&over(b))
                .then(area(a).total_cmp(&area(b)))
                .then(a.0.start.cmp(&b.0.start))
        });
        let Some((k, _)) = largest else { break };
        let range = parts[k].0.clone();
        let all: usize = parts.iter().map(|p| needed(p.0.len())).sum();
        let children = WIDTH - (all - needed(range.len()));
        let here = &mut items[range.clone()];
        let middle = range.start + split(here, room, children);
        let [a, b] = [range.start..middle, middle..range.end];
        parts[k] = (a.clone(), around(&items[a]));
        parts.insert(k + 1, (b.clone(), around(&items[b])));
    }
    parts
}

fn around(items: &[Entry]) -> Box32 {
    let mut all = Box32::EMPTY;
    items.iter().for_each(|e| all.add(&e.bounds));
    all
}

/// The number of bins along each axis. A split lies between two bins.
const BINS: usize = 16;

/// Splits items, at least two, in two parts, and returns how many are in the first. Neither part is empty, and `children` nodes of `room`
/// items each have room for both. The surface area heuristic decides; where it cannot tell the items apart, the parts are halves.
fn split(items: &mut [Entry], room: usize, children: usize) -> usize {
    let all = items.len();
    let fits = |first: usize| first.div_ceil(room) + (all - first).div_ceil(room) <= children;
    let mut best: Option<(f64, usize, usize)> = None;
    let mut longest: (f32, usize) = (0.0, 0);
    for axis in 0..3 {
        let Some(grid) = Grid::new(items, axis) else {
            continue;
        };
        if grid.length > longest.0 {
            longest = (grid.length, axis);
        }
        let mut bins = [(Box32::EMPTY, 0usize); BINS];
        for i in items.iter() {
            let bin = &mut bins[grid.bin(i)];
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
            if count < all && fits(count) && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, k));
            }
        }
    }
    let grid = best.and_then(|(_, axis, border)| Some((Grid::new(items, axis)?, border)));
    let Some((grid, border)) = grid else {
        // Halves; or, if these do not fit, the first has nodes that are full.
        let half = all / 2;
        let first = if fits(half) {
            half
        } else {
            half.next_multiple_of(room)
        };
        let middle = |e: &Entry| e.bounds.twice_middle(longest.1);
        items.select_nth_unstable_by(first, |a, b| {
            middle(a).total_cmp(&middle(b)).then(a.item.cmp(&b.item))
        });
        return first;
    };
    let mut first = 0;
    for k in 0..all {
        if grid.bin(&items[k]) < border {
            items.swap(k, first);
            first += 1;
        }
    }
    first
}

/// Bins along an axis, by the middles of boxes.
struct Grid {
    axis: usize,
    low: f32,
    length: f32,
    scale: f32,
}

impl Grid {
    /// `None` if the middles are the same.
    fn new(items: &[Entry], axis: usize) -> Option<Self> {
        let middles = items.iter().map(|e| e.bounds.twice_middle(axis));
        let (low, high) = middles.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        let length = high - low;
        let scale = BINS as f32 / length;
        (length > 0.0 && scale.is_finite()).then_some(Self {
            axis,
            low,
            length,
            scale,
        })
    }

    fn bin(&self, e: &Entry) -> usize {
        let x = e.bounds.twice_middle(self.axis);
        (((x - self.low) * self.scale) as usize).min(BINS - 1)
    }
}
