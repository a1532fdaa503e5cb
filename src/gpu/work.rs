//! What a call makes of the pixels of a tile, and how it is shared among workgroups and submissions.

use crate::engine::Part;
use crate::film::coverage::Rect;
use crate::kernel::GROUP_SIDE;
use std::ops::Range;

/// The samples that each pixel of a tile is to have.
pub(super) struct Work {
    tile: Rect,
    /// Rows of the tile.
    pixels: Vec<Range<u32>>,
    /// The most samples of any pixel.
    pub longest: u64,
}

impl Work {
    /// `parts` are disjoint and lie in `tile`.
    pub fn new(tile: Rect, parts: &[Part]) -> Self {
        let width = tile.width() as usize;
        let mut pixels = vec![0..0; tile.area() as usize];
        for Part { rect, samples } in parts {
            let samples = samples.start as u32..samples.end as u32;
            for y in rect.y0..rect.y1 {
                let first = (y - tile.y0) as usize * width + (rect.x0 - tile.x0) as usize;
                pixels[first..first + rect.width() as usize].fill(samples.clone());
            }
        }
        let samples = parts.iter().map(|p| p.samples.end - p.samples.start);
        Self {
            tile,
            pixels,
            longest: samples.max().unwrap_or(0),
        }
    }

    /// As the kernel reads it: the sample that each pixel begins with, then for each one past its last.
    pub fn ranges(&self) -> Vec<u32> {
        let first = self.pixels.iter().map(|r| r.start);
        first.chain(self.pixels.iter().map(|r| r.end)).collect()
    }

    /// How many paths each workgroup has, in the order of dispatch, in a round of at most `most` samples a pixel, of which
    /// each has had `done`.
    pub fn paths(&self, done: u64, most: u64) -> Vec<u64> {
        let of = |r: &Range<u32>| u64::from(r.end - r.start).saturating_sub(done).min(most);
        let width = self.tile.width() as usize;
        let side = GROUP_SIDE as usize;
        let mut groups: Vec<u64> = Vec::with_capacity(workgroups(self.tile) as usize);
        for rows in self.pixels.chunks(side * width) {
            let first = groups.len();
            groups.resize(first + width.div_ceil(side), 0);
            for row in rows.chunks(width) {
                for (group, pixels) in groups[first..].iter_mut().zip(row.chunks(side)) {
                    *group += pixels.iter().map(of).sum::<u64>();
                }
            }
        }
        let n = groups.len() as u64;
        let stride = u64::from(coprime_stride(n as u32));
        (0..n).map(|k| groups[(k * stride % n) as usize]).collect()
    }
}

/// Workgroups that cover `rect`.
pub(super) fn workgroups(rect: Rect) -> u32 {
    rect.width().div_ceil(GROUP_SIDE) * rect.height().div_ceil(GROUP_SIDE)
}

/// About 0.618 of `groups`, and without a common divisor with it: steps of this visit every group once.
pub(super) fn coprime_stride(groups: u32) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let start = (f64::from(groups) * 0.618_034) as u32;
    (start..)
        .find(|&s| s > 0 && gcd(s, groups) == 1)
        .unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strides_visit_every_group() {
        for groups in [1, 2, 3, 7, 64, 3072, 16384] {
            let stride = coprime_stride(groups);
            let mut seen = vec![false; groups as usize];
            for g in 0..groups {
                seen[(u64::from(g) * u64::from(stride) % u64::from(groups)) as usize] = true;
            }
            assert!(seen.iter().all(|s| *s), "{groups} groups, stride {stride}");
        }
    }

    #[test]
    fn pixels_have_the_samples_of_their_part_or_none() {
        let rect = |x0, y0, x1, y1| Rect { x0, y0, x1, y1 };
        let part = |rect, samples| Part { rect, samples };
        let parts = [
            part(rect(10, 20, 12, 21), 3..7),
            part(rect(13, 20, 14, 22), 256..266),
        ];
        let work = Work::new(rect(10, 20, 14, 22), &parts);
        assert_eq!(work.longest, 10);
        let (first, end) = ([3, 3, 0, 256, 0, 0, 0, 256], [7, 7, 0, 266, 0, 0, 0, 266]);
        assert_eq!(work.ranges(), [first, end].concat());
        // In rounds of 6, of the one workgroup that there is.
        assert_eq!(work.paths(0, 6), [2 * 4 + 2 * 6]);
        assert_eq!(work.paths(6, 6), [2 * 4]);
    }

    #[test]
    fn every_workgroup_has_its_paths_once() {
        let tile = Rect::whole([64, 50]);
        let rows = (0..50u32).map(|y| Part {
            rect: Rect {
                y0: y,
                y1: y + 1,
                ..tile
            },
            samples: 0..u64::from(y),
        });
        let mut paths = Work::new(tile, &rows.collect::<Vec<_>>()).paths(0, 1000);
        assert!(paths[0] == 8 * 28 && paths[1] > 2 * paths[0], "far apart");
        paths.sort();
        // Eight blocks side by side, of eight rows each but the last two rows'.
        let rows = |k: u64| (8 * k..50.min(8 * k + 8)).sum::<u64>();
        let mut expected: Vec<u64> = (0..7).flat_map(|k| [8 * rows(k); 8]).collect();
        expected.sort();
        assert_eq!(paths, expected);
    }
}
