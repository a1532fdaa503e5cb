//! Where camera rays enter a tree: all rays of a few pixels meet the same few parts of it, in every sample.

use super::{Below, Box32, Tree, WIDTH};
use crate::world::WorldCamera;
use std::ops::Range;

/// The most groups of an [`Entry`].
pub(crate) const GROUPS: usize = 3;

/// Rays from one point, whose directions lie in a box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beam {
    eye: [f64; 3],
    /// Least and greatest components of the directions, which have no unit length.
    least: [f64; 3],
    greatest: [f64; 3],
}

/// Where the rays of a beam begin their walks: they can meet no other part of the tree.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Entry {
    /// The node that is visited first; none if the beam meets nothing.
    pub at: Option<u32>,
    /// What is visited afterwards, the last group first.
    pub put_off: Vec<Group>,
}

/// Nodes with the same parent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Group {
    /// The parent's first child.
    pub first: u32,
    /// How many places after it each of them is, in the order of their visits: fewer than [`WIDTH`].
    pub places: Vec<u32>,
}

impl Beam {
    /// The camera rays of a rectangle of pixels of a picture of `size`, as they are in f32.
    pub fn new(camera: &WorldCamera, size: [u32; 2], pixels: [Range<u32>; 2]) -> Self {
        // In pixels, and in parts of a direction's length.
        const AROUND: f64 = 0.05;
        const ROUNDING: f64 = 1e-6;
        let [(x, across), (y, down)] = [0, 1].map(|k| {
            let Range { start, end } = &pixels[k];
            let middle = 0.5 * (f64::from(*start) + f64::from(*end) - f64::from(size[k]));
            (middle, 0.5 * f64::from(end - start) + AROUND)
        });
        let middle = camera.forward + x * camera.dx + y * camera.dy;
        let half = across * camera.dx.abs() + down * camera.dy.abs();
        let half = half + ROUNDING * (middle.length() + half.length());
        Self {
            eye: camera.eye.to_array(),
            least: (middle - half).to_array(),
            greatest: (middle + half).to_array(),
        }
    }

    /// Where its rays may enter a box at the earliest, in lengths of their directions; `None` if none can meet it.
    fn enters(&self, b: &Box32) -> Option<f64> {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        let around = self.eye.iter().map(|x| x.abs()).sum::<f64>();
        for k in 0..3 {
            let [min, max] = [b.min[k], b.max[k]].map(f64::from);
            // What a walk allows for, and more: see `Slabs` of shaders/tree/walk.wgsl.
            let slack = 2e-6 * (around + min.abs().max(max.abs()));
            let [low, high] = [min - self.eye[k] - slack, max - self.eye[k] + slack];
            // For some direction d, t d >= low and t d <= high.
            let (d, e) = (self.greatest[k], self.least[k]);
            match (low <= 0.0, d > 0.0) {
                (true, true) => {}
                (true, false) if d == 0.0 => {}
                (true, false) => far = far.min(low / d),
                (false, true) => near = near.max(low / d),
                (false, false) => return None,
            }
            match (high >= 0.0, e < 0.0) {
                (true, true) => {}
                (true, false) if e == 0.0 => {}
                (true, false) => far = far.min(high / e),
                (false, true) => near = near.max(high / e),
                (false, false) => return None,
            }
        }
        (near * (1.0 - 1e-5) <= far).then_some(near)
    }
}

impl Tree {
    /// Where the rays of `beam` enter it. The room for a walk's stack suffices from there: a node at depth k comes with at most k groups.
    pub(crate) fn entry(&self, beam: &Beam) -> Entry {
        let Some(root) = self.nodes.first() else {
            return Entry::default();
        };
        if beam.enters(&root.bounds).is_none() {
            return Entry::default();
        }
        let mut at = 0;
        let mut open: Vec<Group> = Vec::new();
        loop {
            let Some(met) = self.children_met(beam, at) else {
                // A leaf. What comes after it may still be looked at closely.
                if self.look_closely(beam, &mut open) {
                    continue;
                }
                break;
            };
            match met.places.len() {
                0 => match next_of(&mut open) {
                    Some(next) => at = next,
                    None => return Entry::default(),
                },
                n if n == 1 || open.len() < GROUPS => {
                    at = met.first + met.places[0];
                    let places = met.places[1..].to_vec();
                    if !places.is_empty() {
                        open.push(Group { places, ..met });
                    }
                }
                _ if self.look_closely(beam, &mut open) => {}
                _ => break,
            }
        }
        Entry {
            at: Some(at),
            put_off: open.into_iter().rev().collect(),
        }
    }

    /// The children of a node that a beam meets, the nearest first; `None` of a leaf.
    fn children_met(&self, beam: &Beam, node: u32) -> Option<Group> {
        let Below::Nodes { first, count } = self.nodes[node as usize].below else {
            return None;
        };
        let enters = |k: u32| beam.enters(&self.nodes[(first + k) as usize].bounds);
        let mut met: Vec<(f64, u32)> = (0..count)
            .filter_map(|k| enters(k).map(|t| (t, k)))
            .collect();
        met.sort_by(|a, b| a.0.total_cmp(&b.0));
        let places = met.into_iter().map(|m| m.1).collect();
        Some(Group { first, places })
    }

    /// Puts the children in the place of groups of one node. Whether anything has changed.
    fn look_closely(&self, beam: &Beam, open: &mut Vec<Group>) -> bool {
        let mut changed = false;
        open.retain_mut(|group| {
            if let [place] = group.places[..]
                && let Some(met) = self.children_met(beam, group.first + place)
                && met.places.len() < WIDTH
            {
                changed = true;
                *group = met;
            }
            !group.places.is_empty()
        });
        changed
    }
}

/// Takes the next node away.
fn next_of(open: &mut Vec<Group>) -> Option<u32> {
    let group = open.last_mut()?;
    let next = group.first + group.places.remove(0);
    if group.places.is_empty() {
        open.pop();
    }
    Some(next)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::probe::Uniform;
    use crate::world::{AIR, Bounds};
    use glam::DVec3;

    fn camera(eye: DVec3, to: DVec3, pixel: f64) -> WorldCamera {
        let forward = (to - eye).normalize();
        let dx = forward.any_orthonormal_vector();
        WorldCamera {
            eye,
            forward,
            dx: dx * pixel,
            dy: forward.cross(dx) * pixel,
            medium: AIR,
        }
    }

    /// Whether a ray meets a box.
    fn meets(eye: DVec3, d: DVec3, b: &Box32) -> bool {
        let [min, max] = [b.min, b.max].map(|c| DVec3::from_array(c.map(f64::from)));
        let [a, b] = [(min - eye) / d, (max - eye) / d];
        a.min(b).max_element().max(0.0) <= a.max(b).min_element()
    }

    /// The numbers of the boxes that a walk reaches from here, and whether its stack has room: `depths` are those of the nodes.
    fn reached(tree: &Tree, entry: &Entry, depths: &[u32]) -> Vec<u32> {
        let mut open: Vec<u32> = entry.at.into_iter().collect();
        let mut below = entry.put_off.len();
        assert!(below <= GROUPS);
        for at in &open {
            assert!(below <= depths[*at as usize] as usize);
        }
        for group in &entry.put_off {
            assert!((1..WIDTH).contains(&group.places.len()));
            below -= 1;
            for (k, place) in group.places.iter().enumerate() {
                let rest = usize::from(k + 1 < group.places.len());
                assert!(below + rest <= depths[(group.first + place) as usize] as usize);
                open.push(group.first + place);
            }
        }
        let mut items = Vec::new();
        while let Some(k) = open.pop() {
            match tree.nodes[k as usize].below {
                Below::Item(item) => items.push(item),
                Below::Nodes { first, count } => open.extend(first..first + count),
            }
        }
        items
    }

    fn depths(tree: &Tree) -> Vec<u32> {
        let mut depths = vec![0; tree.nodes.len()];
        for (k, node) in tree.nodes.iter().enumerate() {
            if let Below::Nodes { first, count } = node.below {
                for child in first..first + count {
                    depths[child as usize] = depths[k] + 1;
                }
            }
        }
        depths
    }

    #[test]
    fn a_walk_from_an_entry_meets_what_a_walk_from_the_root_meets() {
        let mut n = Uniform(7);
        let (mut all, mut left, mut nothing) = (0, 0, 0);
        for count in [1, 2, 5, 60, 1000, 20_000] {
            let radius = 0.5 / f64::from(count).sqrt();
            let boxes: Vec<Bounds> = (0..count)
                .map(|i| {
                    // Some large, some flat.
                    let half = match i % 7 {
                        0 => n.vector().abs() * 0.2,
                        1 => DVec3::new(0.0, radius, radius),
                        _ => DVec3::splat(radius),
                    };
                    Bounds::about(n.vector(), half)
                })
                .collect();
            let tree = Tree::new(&boxes);
            let depths = depths(&tree);
            for k in 0..60 {
                // Outside, inside, far away; and along an axis.
                let eye = n.vector() * [3.0, 0.9, 1e4][k % 3];
                let to = if k % 5 == 0 {
                    eye - DVec3::Z
                } else {
                    n.vector()
                };
                let camera = camera(eye, to, [1e-3, 0.1, 1e-5][k % 3]);
                let size = [640, 480];
                let x = n.between(20.0, 620.0) as u32;
                let y = n.between(40.0, 440.0) as u32;
                let beam = Beam::new(&camera, size, [x..x + 4, y..y + 4]);
                let entry = tree.entry(&beam);
                let found = reached(&tree, &entry, &depths);
                all += boxes.len();
                left += found.len();
                nothing += usize::from(entry.at.is_none());
                for _ in 0..50 {
                    let [u, v] = [0; 2].map(|_| n.between(0.0, 4.0));
                    let at = [f64::from(x) + u - 320.0, f64::from(y) + v - 240.0];
                    let d = (camera.forward + at[0] * camera.dx + at[1] * camera.dy).normalize();
                    // As f32 has them.
                    let rounded = |v: DVec3| v.as_vec3().as_dvec3();
                    for (eye, d) in [(eye, d), (rounded(eye), rounded(d))] {
                        for node in &tree.nodes {
                            if let Below::Item(item) = node.below
                                && meets(eye, d, &node.bounds)
                            {
                                assert!(found.contains(&item), "{count} {k}: {item}");
                            }
                        }
                    }
                }
            }
        }
        // It leaves out most of a tree, though some boxes are large and some beams wide.
        assert!(left * 5 < all, "{left} of {all}");
        assert!((20..300).contains(&nothing), "{nothing}");
    }
}
