//! Volumes: numbers on a grid of points, and the trilinear function between them.

use super::interval::Interval;
use crate::files::npy::{Array, Numbers};
use glam::DVec3;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::fmt;

/// The most points along an axis.
pub const MOST_POINTS: usize = 2048;

/// The most points of a volume.
pub const MOST_VALUES: u64 = 1 << 30;

/// Cells along the side of a brick.
const BRICK: usize = 8;

/// Which index of an array is which axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisOrder {
    /// `a[z, y, x]`.
    Zyx,
    /// `a[x, y, z]`.
    Xyz,
}

/// Numbers on a grid of points, x fastest.
#[derive(Clone)]
pub struct Volume {
    /// Points along x, y and z, each at least 2.
    size: [usize; 3],
    numbers: Numbers,
    /// The least number, and the greatest.
    range: [f64; 2],
    /// The same of each brick, x fastest.
    bricks: Vec<[f64; 2]>,
    /// SHA-256 of type, size and numbers.
    digest: [u8; 32],
}

impl PartialEq for Volume {
    fn eq(&self, other: &Self) -> bool {
        self.digest == other.digest
    }
}

impl fmt::Debug for Volume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.size;
        write!(f, "Volume({x} × {y} × {z}, {:?})", self.range)
    }
}

/// A type of numbers in volumes.
pub(super) trait Number: bytemuck::Pod + Send + Sync {
    fn wide(self) -> f64;
}

impl Number for u8 {
    fn wide(self) -> f64 {
        self.into()
    }
}

impl Number for u16 {
    fn wide(self) -> f64 {
        self.into()
    }
}

impl Number for f32 {
    fn wide(self) -> f64 {
        self.into()
    }
}

impl Number for f64 {
    fn wide(self) -> f64 {
        self
    }
}

/// Does `$body` with the numbers as a slice of their type.
macro_rules! with_numbers {
    ($numbers:expr, $slice:ident => $body:expr) => {
        match $numbers {
            Numbers::U8($slice) => $body,
            Numbers::U16($slice) => $body,
            Numbers::F32($slice) => $body,
            Numbers::F64($slice) => $body,
        }
    };
}

pub(super) use with_numbers;

impl Volume {
    /// The volume of these numbers, x fastest: those of `size[0]` points along x, and so on.
    ///
    /// # Errors
    /// When there are fewer than two points along an axis, too many, or a number is not finite.
    pub fn new(size: [usize; 3], numbers: Numbers) -> Result<Self, String> {
        for (k, n) in size.into_iter().enumerate() {
            if !(2..=MOST_POINTS).contains(&n) {
                return Err(format!(
                    "the volume has {n} point{} along {}, but must have from 2 to {MOST_POINTS}",
                    if n == 1 { "" } else { "s" },
                    ["x", "y", "z"][k]
                ));
            }
        }
        let count: usize = size.iter().product();
        let given = with_numbers!(&numbers, all => all.len());
        if given != count {
            return Err(format!(
                "the volume has {given} numbers, but its size says {count}"
            ));
        }
        let wrong = with_numbers!(&numbers, all => first_not_finite(all));
        if let Some(at) = wrong {
            let [x, y] = [size[0], size[1]];
            let value = with_numbers!(&numbers, all => all[at].wide());
            return Err(format!(
                "the number at x = {}, y = {}, z = {} is {value}, but all must be finite",
                at % x,
                at / x % y,
                at / x / y
            ));
        }
        let bricks = with_numbers!(&numbers, all => bricks(size, all));
        let ends = bricks.iter().fold([f64::MAX, f64::MIN], |r, b| {
            [r[0].min(b[0]), r[1].max(b[1])]
        });
        Ok(Self {
            digest: digest(size, &numbers),
            size,
            numbers,
            range: ends,
            bricks,
        })
    }

    /// The volume in an array of three indices.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn of_array(array: Array, order: AxisOrder) -> Result<Self, String> {
        let Array {
            shape,
            first_fastest,
            numbers,
        } = array;
        let [a, b, c] = [shape[0], shape[1], shape[2]];
        let size = match order {
            AxisOrder::Zyx => [c, b, a],
            AxisOrder::Xyz => [a, b, c],
        };
        let x_fastest = first_fastest == (order == AxisOrder::Xyz);
        let numbers = if x_fastest {
            numbers
        } else {
            match numbers {
                Numbers::U8(all) => Numbers::U8(reversed(size, &all)),
                Numbers::U16(all) => Numbers::U16(reversed(size, &all)),
                Numbers::F32(all) => Numbers::F32(reversed(size, &all)),
                Numbers::F64(all) => Numbers::F64(reversed(size, &all)),
            }
        };
        Self::new(size, numbers)
    }

    /// Points along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Cells along x, y and z.
    pub fn cells(&self) -> [usize; 3] {
        self.size.map(|n| n - 1)
    }

    /// The numbers, x fastest.
    pub fn numbers(&self) -> &Numbers {
        &self.numbers
    }

    /// The least number, and the greatest.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// What tells it from every other volume.
    pub fn digest(&self) -> [u8; 32] {
        self.digest
    }

    /// The number at a point of the grid.
    pub fn at(&self, [x, y, z]: [usize; 3]) -> f64 {
        let i = x + self.size[0] * (y + self.size[1] * z);
        with_numbers!(&self.numbers, all => all[i].wide())
    }

    /// The cell in which `g` lies, or the one that is nearest; `g` counts cells.
    pub fn cell_at(&self, g: DVec3) -> [usize; 3] {
        let cells = self.cells();
        [0, 1, 2].map(|k| (g[k].max(0.0) as usize).min(cells[k] - 1))
    }

    /// The function in a cell.
    pub fn cell(&self, at: [usize; 3]) -> Trilinear {
        let [x, y, z] = at;
        let corner = |k: usize| self.at([x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)]);
        Trilinear([0, 1, 2, 3, 4, 5, 6, 7].map(corner))
    }

    /// What the function may be between two points, which count cells. Exact, but for large boxes, where it may be more.
    pub fn between(&self, low: DVec3, high: DVec3) -> Interval {
        /// Above this many cells along an axis bricks are looked at.
        const CELLS: usize = 2 * BRICK;
        let (a, b) = (self.cell_at(low), self.cell_at(high));
        let mut all = [f64::MAX, f64::MIN];
        let mut add = |[least, most]: [f64; 2]| all = [all[0].min(least), all[1].max(most)];
        if (0..3).any(|k| b[k] - a[k] > CELLS) {
            let count = self.cells().map(|n| n.div_ceil(BRICK));
            let [from, to] = [a, b].map(|c| c.map(|n| n / BRICK));
            for_each(from, to, |[x, y, z]| {
                add(self.bricks[x + count[0] * (y + count[1] * z)]);
            });
        } else {
            for_each(a, b, |at| {
                let cell = self.cell(at);
                let corner = DVec3::from_array(at.map(|n| n as f64));
                let [low, high] = [low, high].map(|p| (p - corner).clamp(DVec3::ZERO, DVec3::ONE));
                for k in 0..8 {
                    let side =
                        |bit: usize, i: usize| if k >> bit & 1 == 0 { low[i] } else { high[i] };
                    let value = cell.value(DVec3::new(side(0, 0), side(1, 1), side(2, 2)));
                    add([value, value]);
                }
            });
        }
        // The values have roundings of f64 behind them.
        let slack = 8.0 * f64::EPSILON * self.range[0].abs().max(self.range[1].abs());
        Interval::new(all[0] - slack, all[1] + slack)
    }
}

/// Does `what` for every index from `low` to `high`, both included.
pub(super) fn for_each(low: [usize; 3], high: [usize; 3], mut what: impl FnMut([usize; 3])) {
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                what([x, y, z]);
            }
        }
    }
}

fn first_not_finite<T: Number>(all: &[T]) -> Option<usize> {
    all.par_iter().position_first(|x| !x.wide().is_finite())
}

/// The least and the greatest number of each brick, whose cells share points with their neighbours'.
fn bricks<T: Number>(size: [usize; 3], all: &[T]) -> Vec<[f64; 2]> {
    let count = size.map(|n| (n - 1).div_ceil(BRICK));
    (0..count.iter().product())
        .into_par_iter()
        .map(|i: usize| {
            let at = [
                i % count[0],
                i / count[0] % count[1],
                i / count[0] / count[1],
            ];
            let low = at.map(|n| n * BRICK);
            let high = [0, 1, 2].map(|k| (low[k] + BRICK).min(size[k] - 1));
            let mut ends = [f64::MAX, f64::MIN];
            for_each(low, high, |[x, y, z]| {
                let value = all[x + size[0] * (y + size[1] * z)].wide();
                ends = [ends[0].min(value), ends[1].max(value)];
            });
            ends
        })
        .collect()
}

/// Numbers with z fastest as numbers with x fastest.
fn reversed<T: Number>([nx, ny, nz]: [usize; 3], all: &[T]) -> Vec<T> {
    let mut turned = vec![T::zeroed(); all.len()];
    turned
        .par_chunks_mut(nx * ny)
        .enumerate()
        .for_each(|(z, slab)| {
            for (i, to) in slab.iter_mut().enumerate() {
                *to = all[z + nz * (i / nx + ny * (i % nx))];
            }
        });
    turned
}

fn digest(size: [usize; 3], numbers: &Numbers) -> [u8; 32] {
    let kind: u64 = match numbers {
        Numbers::U8(_) => 0,
        Numbers::U16(_) => 1,
        Numbers::F32(_) => 2,
        Numbers::F64(_) => 3,
    };
    let mut sha = Sha256::new_with_prefix("etendue volume 1\0");
    sha.update(kind.to_le_bytes());
    for n in size {
        sha.update((n as u64).to_le_bytes());
    }
    with_numbers!(numbers, all => sha.update(bytemuck::cast_slice(all)));
    sha.finalize().into()
}

/// The function in a cell, by its values at the corners, x fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trilinear(pub [f64; 8]);

impl Trilinear {
    /// The value at a point of the cell, whose sides have the length 1.
    pub fn value(&self, f: DVec3) -> f64 {
        let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
        let c = self.0;
        let [low, high] =
            [0, 4].map(|k| mix(mix(c[k], c[k + 1], f.x), mix(c[k + 2], c[k + 3], f.x), f.y));
        mix(low, high, f.z)
    }

    /// The gradient there.
    pub fn gradient(&self, f: DVec3) -> DVec3 {
        let c = self.0;
        let over = |pairs: [(usize, usize); 4], s: f64, t: f64| {
            let d = pairs.map(|(a, b)| c[b] - c[a]);
            let low = d[0] * (1.0 - s) + d[1] * s;
            let high = d[2] * (1.0 - s) + d[3] * s;
            low * (1.0 - t) + high * t
        };
        DVec3::new(
            over([(0, 1), (2, 3), (4, 5), (6, 7)], f.y, f.z),
            over([(0, 2), (1, 3), (4, 6), (5, 7)], f.x, f.z),
            over([(0, 4), (1, 5), (2, 6), (3, 7)], f.x, f.y),
        )
    }

    /// The coefficients of 1, x, y, xy, z, xz, yz, xyz.
    pub fn monomials(&self) -> [f64; 8] {
        let mut c = self.0;
        for bit in [1, 2, 4] {
            for k in 0..8 {
                if k & bit > 0 {
                    c[k] -= c[k - bit];
                }
            }
        }
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Volume {
        let numbers = (0..3 * 4 * 5).map(|i| {
            let [x, y, z] = [i % 3, i / 3 % 4, i / 12];
            (x + 10 * y + 50 * z) as u16
        });
        Volume::new([3, 4, 5], Numbers::U16(numbers.collect())).expect("a volume")
    }

    #[test]
    fn arrays_in_each_order_are_one_volume() {
        let volume = ramp();
        assert_eq!(volume.at([2, 3, 4]), 232.0);
        assert_eq!(volume.range(), [0.0, 232.0]);
        let all = |shape: [usize; 3], first_fastest, order, value: fn([usize; 3]) -> usize| {
            let mut numbers = Vec::new();
            let [a, b, c] = shape;
            if first_fastest {
                for_each([0; 3], [a - 1, b - 1, c - 1], |at| {
                    numbers.push(value(at) as u16);
                });
            } else {
                for_each([0; 3], [c - 1, b - 1, a - 1], |[k, j, i]| {
                    numbers.push(value([i, j, k]) as u16);
                });
            }
            let array = Array {
                shape: shape.to_vec(),
                first_fastest,
                numbers: Numbers::U16(numbers),
            };
            Volume::of_array(array, order).expect("a volume")
        };
        for first_fastest in [false, true] {
            let zyx = all([5, 4, 3], first_fastest, AxisOrder::Zyx, |[z, y, x]| {
                x + 10 * y + 50 * z
            });
            let xyz = all([3, 4, 5], first_fastest, AxisOrder::Xyz, |[x, y, z]| {
                x + 10 * y + 50 * z
            });
            assert_eq!(zyx, volume, "{first_fastest}");
            assert_eq!(xyz, volume, "{first_fastest}");
        }
    }

    #[test]
    fn a_cell_has_its_corners_values_and_their_differences() {
        let cell = ramp().cell([1, 2, 3]);
        assert_eq!(cell.value(DVec3::ZERO), 171.0);
        assert_eq!(cell.value(DVec3::ONE), 232.0);
        let f = DVec3::new(0.2, 0.7, 0.4);
        assert!((cell.value(f) - (171.0 + 0.2 + 7.0 + 20.0)).abs() < 1e-12);
        assert!((cell.gradient(f) - DVec3::new(1.0, 10.0, 50.0)).length() < 1e-12);
        assert_eq!(cell.monomials()[..3], [171.0, 1.0, 10.0]);
    }

    #[test]
    fn intervals_hold_what_is_between() {
        let volume = ramp();
        let low = DVec3::new(0.5, 1.5, 2.0);
        let found = volume.between(low, low + DVec3::splat(0.75));
        let exact = [0.5 + 15.0 + 100.0, 1.25 + 22.5 + 137.5];
        assert!((found.low - exact[0]).abs() < 1e-9 && (found.high - exact[1]).abs() < 1e-9);
        let all = volume.between(DVec3::splat(-9.0), DVec3::splat(99.0));
        assert!((all.low - 0.0).abs() < 1e-9 && (all.high - 232.0).abs() < 1e-9);
    }

    #[test]
    fn wrong_volumes_are_refused() {
        let refused = |size, numbers| Volume::new(size, numbers).unwrap_err();
        assert!(refused([1, 2, 2], Numbers::U8(vec![0; 4])).contains("1 point along x"));
        assert!(refused([2, 2, 2], Numbers::U8(vec![0; 4])).contains("4 numbers"));
        let mut some = vec![0.0f32; 12];
        some[7] = f32::NAN;
        let message = refused([2, 3, 2], Numbers::F32(some));
        assert!(message.contains("x = 1, y = 0, z = 1 is NaN"), "{message}");
    }
}
