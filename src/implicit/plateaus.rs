//! Where a volume equals a level in whole cells: the surface has no place there.

use super::volume::{Number, Volume, for_each, with_numbers};
use crate::files::npy::Numbers;
use rayon::prelude::*;

/// Where a volume equals a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plateaus {
    /// How many numbers equal it.
    pub numbers: u64,
    /// Cells with nothing else at their corners: the surface has no place there.
    pub cells: u64,
    /// The largest number below the level.
    pub below: Option<f64>,
    /// The least number above the level.
    pub above: Option<f64>,
}

impl Volume {
    /// Where it equals `level`.
    pub fn plateaus(&self, level: f64) -> Plateaus {
        with_numbers!(self.numbers(), all => plateaus(self.size(), all, level))
    }
}

fn plateaus<T: Number>([nx, ny, nz]: [usize; 3], all: &[T], level: f64) -> Plateaus {
    let nothing = || (0, f64::NEG_INFINITY, f64::INFINITY);
    let (numbers, below, above) = all
        .par_iter()
        .map(|x| x.wide())
        .fold(nothing, |(n, low, high), x| {
            if x < level {
                (n, low.max(x), high)
            } else if x > level {
                (n, low, high.min(x))
            } else {
                (n + 1, low, high)
            }
        })
        .reduce(nothing, |a, b| (a.0 + b.0, a.1.max(b.1), a.2.min(b.2)));
    let flat = |z: usize| {
        let mut count = 0;
        for_each([0, 0, z], [nx - 2, ny - 2, z], |[x, y, z]| {
            count += u64::from((0..8).all(|k| {
                let [x, y, z] = [x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)];
                all[x + nx * (y + ny * z)].wide() == level
            }));
        });
        count
    };
    let cells = match numbers {
        0..8 => 0,
        _ => (0..nz - 1).into_par_iter().map(flat).sum(),
    };
    Plateaus {
        numbers,
        cells,
        below: below.is_finite().then_some(below),
        above: above.is_finite().then_some(above),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plateaus_are_counted() {
        let mut numbers = vec![5u8; 4 * 3 * 3];
        for z in 0..3 {
            for y in 0..3 {
                numbers[4 * (y + 3 * z)] = 2;
            }
        }
        numbers[35] = 9;
        let volume = Volume::new([4, 3, 3], Numbers::U8(numbers)).expect("a volume");
        let found = volume.plateaus(5.0);
        let expected = Plateaus {
            numbers: 26,
            cells: 7,
            below: Some(2.0),
            above: Some(9.0),
        };
        assert_eq!(found, expected);
        let none = volume.plateaus(4.5);
        assert_eq!((none.numbers, none.cells), (0, 0));
        assert_eq!((none.below, none.above), (Some(2.0), Some(5.0)));
        assert_eq!(volume.plateaus(2.0).cells, 0);
        assert_eq!(volume.plateaus(2.0).below, None);
    }
}
