//! The empty cubes around the cells of a volume: a min–max hierarchy, as far as one level needs it.

use super::volume::{Number, Volume, for_each, with_numbers};
use crate::files::npy::Numbers;
use rayon::prelude::*;

/// What marks cells below the level in a [`hierarchy`](Volume::hierarchy).
pub const BELOW: u8 = 64;

const MIXED: u8 = 0;
const OVER: u8 = 1;
const UNDER: u8 = 2;

/// On which side of the level all of each cell is, if all of it is on one.
fn sides<T: Number>([nx, ny, nz]: [usize; 3], all: &[T], level: f64) -> Vec<u8> {
    let [cx, cy, cz] = [nx - 1, ny - 1, nz - 1];
    let mut cells = vec![MIXED; cx * cy * cz];
    cells
        .par_chunks_mut(cx * cy)
        .enumerate()
        .for_each(|(z, slab)| {
            for (y, row) in slab.chunks_mut(cx).enumerate() {
                let rows = [0, 1, 2, 3].map(|k| {
                    let start = nx * (y + (k & 1) + ny * (z + (k >> 1)));
                    &all[start..start + nx]
                });
                let column = |x: usize| {
                    let four = rows.map(|row| row[x].wide());
                    if four.iter().all(|v| *v > level) {
                        OVER
                    } else if four.iter().all(|v| *v < level) {
                        UNDER
                    } else {
                        MIXED
                    }
                };
                let mut left = column(0);
                for (x, cell) in row.iter_mut().enumerate() {
                    let right = column(x + 1);
                    *cell = if left == right { left } else { MIXED };
                    left = right;
                }
            }
        });
    cells
}

/// The same of cubes with twice the side.
fn coarser(size: [usize; 3], finer: &[u8]) -> ([usize; 3], Vec<u8>) {
    let [cx, cy, cz] = size.map(|n| n.div_ceil(2));
    let mut cubes = vec![MIXED; cx * cy * cz];
    cubes
        .par_chunks_mut(cx * cy)
        .enumerate()
        .for_each(|(z, slab)| {
            for (i, cube) in slab.iter_mut().enumerate() {
                let low = [2 * (i % cx), 2 * (i / cx), 2 * z];
                let high = [0, 1, 2].map(|k| (low[k] + 1).min(size[k] - 1));
                let first = finer[low[0] + size[0] * (low[1] + size[1] * low[2])];
                let mut same = true;
                for_each(low, high, |[x, y, z]| {
                    same &= finer[x + size[0] * (y + size[1] * z)] == first;
                });
                *cube = if same { first } else { MIXED };
            }
        });
    ([cx, cy, cz], cubes)
}

impl Volume {
    /// For each cell, x fastest, how the ray of a kernel may pass it. 0: the function may be `level` in it. Otherwise the aligned cube of
    /// cells around it with the side 2ⁿ, the largest, has none such: n + 1, and [`BELOW`] more where the function is below the level.
    ///
    /// These are the nodes of a min–max hierarchy \[Wald2005\], as far as one level needs them.
    pub fn hierarchy(&self, level: f64) -> Vec<u8> {
        let cells = self.cells();
        let first = with_numbers!(self.numbers(), all => sides(self.size(), all, level));
        let mut levels = vec![(cells, first)];
        while let Some((size, finer)) = levels.last()
            && size.iter().any(|n| *n > 1)
        {
            let next = coarser(*size, finer);
            levels.push(next);
        }
        let mut codes = vec![0; cells.iter().product()];
        codes
            .par_chunks_mut(cells[0] * cells[1])
            .enumerate()
            .for_each(|(z, slab)| {
                for (i, code) in slab.iter_mut().enumerate() {
                    let at = [i % cells[0], i / cells[0], z];
                    let uniform = |n: usize| {
                        let (size, sides) = &levels[n];
                        let [x, y, z] = at.map(|k| k >> n);
                        sides[x + size[0] * (y + size[1] * z)]
                    };
                    let side = uniform(0);
                    if side != MIXED {
                        let mut n = 0;
                        while n + 1 < levels.len() && uniform(n + 1) != MIXED {
                            n += 1;
                        }
                        *code = n as u8 + 1 + if side == UNDER { BELOW } else { 0 };
                    }
                }
            });
        codes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_cubes_are_as_large_as_they_are() {
        let side = 17;
        let mut numbers = vec![0u8; side * side * side];
        numbers[side * side * side - 1] = 9;
        let volume = Volume::new([side; 3], Numbers::U8(numbers)).expect("a volume");
        let codes = volume.hierarchy(4.5);
        let code = |x: usize, y: usize, z: usize| codes[x + 16 * (y + 16 * z)];
        assert_eq!(code(15, 15, 15), 0);
        assert_eq!(code(14, 15, 15), BELOW + 1);
        assert_eq!(code(13, 15, 15), BELOW + 2);
        assert_eq!(code(0, 15, 15), BELOW + 4);
        assert_eq!(volume.hierarchy(-1.0)[0], 5);
        assert_eq!(volume.hierarchy(0.0)[0], 0, "it touches the level");
    }
}
