//! Small crowds far from everything else get trees of their own.
//!
//! A walk moves a ray that starts far from a tree to where the tree begins, because far away a point is known only to 2⁻²⁴ of its
//! distance (`approach` in `shaders/tree/walk.wgsl`). One far thing in the same tree would make the tree too large for that: rays that
//! start near this thing would meet every box of the crowd.

use super::{Below, Bounds, Box32, Tree, WIDTH};

/// A part of a tree is small if it is so many times smaller than the whole. It is also how many radii away a ray is moved.
const SMALLER: f32 = 1e3;

/// A smaller crowd gets no tree of its own: visiting all of it is no great loss.
const LEAST_CROWD: usize = 64;

/// Every walk begins at the root of every tree, so they are few. If there are more crowds, the largest ones get trees.
const MOST_TREES: usize = 8;

impl Tree {
    /// Trees that together hold these boxes, each box once, numbered as in [`Tree::new`]. There are few of them, nearly always one; there are none for no boxes.
    pub fn forest(boxes: &[Bounds]) -> Vec<Self> {
        if boxes.is_empty() {
            return Vec::new();
        }
        let mut open = vec![Self::new(boxes)];
        let mut done = Vec::new();
        while let Some(tree) = open.pop() {
            let another = open.len() + done.len() + 1 < MOST_TREES;
            match another.then(|| tree.crowd()).flatten() {
                Some(crowd) => {
                    let mut within = vec![false; boxes.len()];
                    crowd.iter().for_each(|&i| within[i as usize] = true);
                    let all = tree.items();
                    let others = all.into_iter().filter(|&i| !within[i as usize]).collect();
                    let of = |items: Vec<u32>| {
                        Self::of(items.into_iter().map(|i| (i, boxes[i as usize])))
                    };
                    open.extend([of(others), of(crowd)]);
                }
                None => done.push(tree),
            }
        }
        done
    }

    /// The numbers of the boxes in it.
    pub(super) fn items(&self) -> Vec<u32> {
        let item = |below: &Below| match *below {
            Below::Item(item) => Some(item),
            Below::Nodes { .. } => None,
        };
        self.nodes.iter().filter_map(|n| item(&n.below)).collect()
    }

    /// The largest crowd in a small part of it.
    fn crowd(&self) -> Option<Vec<u32>> {
        let whole = self.nodes.first()?.bounds.sphere()[3];
        let small = |b: &Box32| b.sphere()[3] * SMALLER < whole;
        // Children come after their parents.
        let mut counts = vec![1; self.nodes.len()];
        for (k, node) in self.nodes.iter().enumerate().rev() {
            if let Below::Nodes { first, count } = node.below {
                let children = first as usize..(first + count) as usize;
                counts[k] = counts[children].iter().sum::<usize>();
            }
        }
        // The small nodes whose parents are not small.
        let mut parts = Vec::new();
        let mut open = vec![0];
        while let Some(k) = open.pop() {
            match self.nodes[k].below {
                _ if small(&self.nodes[k].bounds) => parts.push(k),
                Below::Nodes { first, count } => {
                    open.extend(first as usize..(first + count) as usize);
                }
                Below::Item(_) => {}
            }
        }
        // A crowd may lie in several nodes beside each other: the one with the most boxes, and what is near it.
        let seed = parts.iter().copied().max_by_key(|&k| (counts[k], k))?;
        if counts[seed] * WIDTH < LEAST_CROWD {
            return None;
        }
        let mut around = self.nodes[seed].bounds;
        let mut open = Vec::new();
        for k in parts {
            let mut wider = around;
            wider.add(&self.nodes[k].bounds);
            if small(&wider) {
                around = wider;
                open.push(k);
            }
        }
        let mut crowd = Vec::new();
        while let Some(k) = open.pop() {
            match self.nodes[k].below {
                Below::Item(item) => crowd.push(item),
                Below::Nodes { first, count } => {
                    open.extend(first as usize..(first + count) as usize);
                }
            }
        }
        crowd.sort_unstable();
        (crowd.len() >= LEAST_CROWD).then_some(crowd)
    }
}
