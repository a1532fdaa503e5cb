//! Trees as records: see `shaders/tree/walk.wgsl`.

use crate::kernel::Cells;
use crate::kernel::layout::{ShapeKind, Surface};
use crate::kernel::trees::{Parted, UNIT, boxes};
use crate::world::tree::beam::Entry;
use crate::world::{AIR, Below, Box32, Tree, World, visibility};

/// A node, a leaf or a header.
type Unit = [[u32; 4]; UNIT];

/// The highest bit of a node's marks. The same word of a leaf is a radius.
const NODE: u32 = 1 << 31;

/// Appends the trees of every group, and fills in the units before all records, of which the first is where walks end and the others
/// are headers, and the records of `cells` from a place on.
pub(super) fn append(
    records: &mut Vec<[u32; 4]>,
    world: &World,
    parted: &Parted,
    surfaces: &[Surface],
    cells: Option<(&Cells, usize)>,
) {
    put(records, 0, &node(&[], 0));
    let blocks = visibility::blockers(world);
    for group in &parted.groups {
        let code = |number: usize| 2 * (number as u32 + 1) + u32::from(blocks[number]);
        let boxes = boxes(world, group);
        let mut header = group.header;
        let trees = Tree::forest(&boxes);
        for (k, tree) in trees.iter().enumerate() {
            let root = records.len() / UNIT;
            for n in &tree.nodes {
                let unit = match n.below {
                    Below::Item(item) => {
                        let number = group.numbers[item as usize];
                        leaf(group.function.shape, &surfaces[number], code(number))
                    }
                    Below::Nodes { first, count } => {
                        let children = first as usize..(first + count) as usize;
                        let boxes: Vec<Box32> =
                            tree.nodes[children].iter().map(|n| n.bounds).collect();
                        node(&boxes, root as u32 + first)
                    }
                };
                records.extend(unit);
            }
            let next = if k + 1 < trees.len() {
                records.extend([[0; 4]; UNIT]);
                records.len() / UNIT - 1
            } else {
                0
            };
            let around = tree.nodes[0].bounds.sphere().map(f32::to_bits);
            let links = [root as u32, next as u32, 0, 0];
            put(records, header, &[around, links, [0; 4], [0; 4]]);
            header = next;
        }
        if let Some((cells, at)) = cells {
            // Of several trees each is walked from its root.
            let root = (records.len() - UNIT * trees[0].nodes.len()) / UNIT;
            let entries = cells.beams(world).map(|beam| match &trees[..] {
                [tree] => entry(&tree.entry(&beam), root as u32),
                _ => AT_ROOTS,
            });
            for (record, entry) in records[at..].iter_mut().zip(entries) {
                *record = entry;
            }
        }
    }
}

/// The record of a cell whose rays begin at the roots of the trees.
const AT_ROOTS: [u32; 4] = [u32::MAX, 0, 0, 0];

/// The record of a cell: a unit, and what is put off as `put_off` of `shaders/tree/walk.wgsl` does it. The tree stands from unit `root` on.
fn entry(entry: &Entry, root: u32) -> [u32; 4] {
    let mut record = [0; 4];
    record[0] = entry.at.map_or(0, |at| root + at);
    for (word, group) in record[1..].iter_mut().zip(&entry.put_off) {
        let numbers = group
            .places
            .iter()
            .rfold(1, |word, place| word << 2 | place);
        *word = (root + group.first) << 7 | numbers;
    }
    record
}

fn put(records: &mut [[u32; 4]], unit: usize, what: &Unit) {
    records[UNIT * unit..][..UNIT].copy_from_slice(what);
}

/// The solid and its parent in the leaf of an opaque thing, which a ray meets in any medium: see `shaders/tree/walk.wgsl`.
const ANY_MEDIUM: u32 = u32::MAX;

/// A surface, its item in the words that its kind does not need.
fn leaf(shape: ShapeKind, s: &Surface, item: u32) -> Unit {
    let with = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w].map(f32::to_bits);
    let (point, axis) = (with(s.point, s.radius), with(s.axis, s.offset));
    let [x, y, z] = s.faces;
    let (solid, parent) = match s.solid {
        AIR => (ANY_MEDIUM, ANY_MEDIUM),
        solid => (solid, s.parent),
    };
    match shape {
        ShapeKind::Sphere => [point, [item, solid, parent, 0], [0; 4], [0; 4]],
        ShapeKind::Disk => [point, axis, [item, x, 0, 0], [0; 4]],
        ShapeKind::Cylinder => {
            let last = [s.top.to_bits(), solid, parent, item];
            [point, axis, [x, y, z, 0], last]
        }
        ShapeKind::Plane | ShapeKind::HugeSphere | ShapeKind::Implicit => {
            unreachable!("none is in a tree")
        }
    }
}

/// A node with children in these boxes, at most four, which stand from unit `first` on.
fn node(boxes: &[Box32], first: u32) -> Unit {
    let [x, y, z] = [0, 1, 2].map(|k| {
        let side = |b: &Box32| [b.min[k], b.max[k]];
        Grid::new(&boxes.iter().map(side).collect::<Vec<_>>())
    });
    let origin = [&x, &y, &z].map(|g| g.origin.to_bits());
    let exponents = x.exponent | y.exponent << 8 | z.exponent << 16;
    let marks = exponents | (boxes.len() as u32) << 24 | NODE;
    [
        [origin[0], origin[1], origin[2], marks],
        [x.low, y.low, z.low, x.high],
        [y.high, z.high, first, 0],
        [0; 4],
    ]
}

/// The sides of boxes along one axis, in steps of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    origin: f32,
    /// Of the step, which is a power of two, as f32 has it.
    exponent: u32,
    /// A byte for each box, of the first in the lowest bits.
    low: u32,
    high: u32,
}

impl Grid {
    /// The smallest grid for these sides, each the least and the greatest coordinate of a box. The coordinates on the grid lie outside
    /// of them by at least the rounding errors of a walk, which takes the distances to the origin of the grid, and from there to a side.
    ///
    /// With M the greatest absolute coordinate, and o that of the ray's origin, the shader's rounding errors are below
    /// 2⁻²⁴ (7 M + 3 |o|). The first part is made up for here, the second in `slabs_of`.
    fn new(sides: &[[f32; 2]]) -> Self {
        const STEPS: f64 = 255.0;
        // The step 2⁻¹⁰⁰ is normal in f32, as must be its product with the inverse of a direction.
        const LEAST_EXPONENT: u32 = 27;
        const GREATEST_EXPONENT: u32 = 254;
        // Subnormal numbers take a processor a hundred cycles a product, and are common: things stand on floors at 0.
        const TINY: f32 = 1e-25;

        let of = |k: usize| sides.iter().map(move |s| f64::from(s[k]));
        let (least, greatest) = (
            of(0).fold(f64::INFINITY, f64::min),
            of(1).fold(f64::NEG_INFINITY, f64::max),
        );
        if least > greatest {
            return Self {
                origin: 0.0,
                exponent: LEAST_EXPONENT,
                low: 0,
                high: 0,
            };
        }
        let slack = 5e-7 * least.abs().max(greatest.abs());
        let origin = ((least - slack) as f32).next_down();
        let origin = if origin.abs() < TINY { -TINY } else { origin };
        let from = |x: f64| x - f64::from(origin);
        let step = |exponent: u32| f64::from(f32::from_bits(exponent << 23));
        let exponent = (LEAST_EXPONENT..GREATEST_EXPONENT)
            .find(|e| from(greatest + slack) <= STEPS * step(*e))
            .unwrap_or(GREATEST_EXPONENT);
        let bytes = |k: usize, on_grid: &dyn Fn(f64) -> f64| {
            (0..).zip(of(k)).fold(0, |word, (i, x)| {
                word | (on_grid(x).clamp(0.0, STEPS) as u32) << (8 * i)
            })
        };
        Self {
            origin,
            exponent,
            low: bytes(0, &|x| (from(x - slack) / step(exponent)).floor()),
            high: bytes(1, &|x| (from(x + slack) / step(exponent)).ceil()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::probe::Uniform;
    use crate::world::Bounds;
    use glam::DVec3;

    /// What a walk reads of a node: the step, and the least and the greatest coordinate of a child, by axis. Without rounding.
    fn read(unit: &Unit, child: usize) -> [[f64; 3]; 3] {
        let [a, b, c, _] = unit;
        assert!(a[3] & NODE != 0 && child < (a[3] >> 24 & 7) as usize);
        let high = [b[3], c[0], c[1]];
        [0, 1, 2].map(|k| {
            let step = f64::from(f32::from_bits((a[3] >> (8 * k) & 255) << 23));
            let byte = |word: u32| f64::from(word >> (8 * child) & 255);
            let at = |word| f64::from(f32::from_bits(a[k])) + byte(word) * step;
            [step, at(b[k]), at(high[k])]
        })
    }

    /// Boxes of one to four children, about as large as `size`, around a point `offset` away from the origin.
    fn families(size: f64, offset: f64, numbers: &mut Uniform) -> Vec<Vec<Bounds>> {
        let middle = offset * numbers.vector();
        let ball = |at: DVec3, r: f64| Bounds::about(middle + at, DVec3::splat(r));
        let mut all = Vec::new();
        for count in 1..=4 {
            let mut some = |of: &mut dyn FnMut(&mut Uniform, usize) -> Bounds| {
                all.push((0..count).map(|i| of(numbers, i)).collect());
            };
            // Of all sizes, equal ones, the same one, points, one point.
            some(&mut |n, _| ball(size * n.vector(), size * n.next().powi(8)));
            some(&mut |n, _| ball(size * n.vector(), 0.1 * size));
            some(&mut |_, _| ball(DVec3::ZERO, size));
            some(&mut |n, _| ball(size * n.vector(), 0.0));
            some(&mut |_, _| ball(DVec3::ZERO, 0.0));
            // Flat along one axis, and in one plane; side by side, with sides in common.
            some(&mut |n, i| {
                let mut half = size * n.vector().abs();
                half[i % 3] = 0.0;
                Bounds::about(middle + size * n.vector(), half)
            });
            some(&mut |n, _| {
                let flat = DVec3::new(1.0, 0.0, 1.0);
                Bounds::about(
                    middle + size * flat * n.vector(),
                    size * flat * n.vector().abs(),
                )
            });
            some(&mut |_, i| ball(DVec3::X * (2.0 * size * i as f64), size));
            // A giant and dust.
            some(&mut |n, i| ball(size * n.vector(), size * 1e-3f64.powi(i as i32)));
        }
        all
    }

    #[test]
    fn a_node_holds_its_children_in_all_sizes_and_places() {
        // What a walk's rounding errors come to, in parts of the greatest coordinate: see `Grid::new`.
        const ERRORS: f64 = 7.0 / (1 << 24) as f64;
        let mut numbers = Uniform(1);
        let scales = || (-6..=6).step_by(2).map(|e| 10f64.powi(e));
        for (size, offset) in scales().flat_map(|s| {
            std::iter::once(0.0)
                .chain(scales())
                .map(move |offset| (s, offset))
        }) {
            for family in families(size, offset, &mut numbers) {
                let boxes: Vec<Box32> = Tree::new(&family).nodes[1..]
                    .iter()
                    .filter(|n| matches!(n.below, Below::Item(_)))
                    .map(|n| n.bounds)
                    .collect();
                // A box alone is the root. The builder sorts the others.
                let boxes = match family.len() {
                    1 => vec![Tree::new(&family).nodes[0].bounds],
                    _ => boxes,
                };
                assert_eq!(boxes.len(), family.len());
                let unit = node(&boxes, 7);
                assert_eq!(unit[2][2], 7);
                for (i, b) in boxes.iter().enumerate() {
                    for (k, [step, low, high]) in read(&unit, i).into_iter().enumerate() {
                        let side = |of: fn(f32, f32) -> f32, s: fn(&Box32) -> [f32; 3]| {
                            f64::from(boxes.iter().map(|b| s(b)[k]).reduce(of).expect("a box"))
                        };
                        let (least, greatest) =
                            (side(f32::min, |b| b.min), side(f32::max, |b| b.max));
                        let far = least.abs().max(greatest.abs());
                        let (min, max) = (f64::from(b.min[k]), f64::from(b.max[k]));
                        let what =
                            || format!("{size} {offset} {boxes:?}: {min} {max} in {low} {high}");
                        assert!(low <= min - ERRORS * far, "{}", what());
                        assert!(high >= max + ERRORS * far, "{}", what());
                        // The grid is no coarser than it must be, and a child's box on it no larger.
                        let room = 1e-6 * far + 1e-24;
                        assert!(
                            step <= (greatest - least + 4.0 * room) / 127.0,
                            "{}",
                            what()
                        );
                        assert!(min - low <= step + room, "{}", what());
                        assert!(high - max <= step + room, "{}", what());
                    }
                }
            }
        }
    }
}
