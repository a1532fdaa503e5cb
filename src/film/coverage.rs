//! Which pixels have which samples: disjoint rectangles, each with its ranges of sample numbers.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// Half-open pixel rectangle: x0 <= x < x1, y0 <= y < y1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Rect {
    /// Left column.
    pub x0: u32,
    /// Top row.
    pub y0: u32,
    /// One past the right column.
    pub x1: u32,
    /// One past the bottom row.
    pub y1: u32,
}

impl Rect {
    /// The whole of a picture.
    pub fn whole(size: [u32; 2]) -> Self {
        Self {
            x0: 0,
            y0: 0,
            x1: size[0],
            y1: size[1],
        }
    }

    /// Pixels per row.
    pub fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }

    /// Pixels in all.
    pub fn area(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }

    /// Whether pixel (x, y) lies inside.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y)
    }

    /// The common part, if there is one.
    pub fn intersection(&self, other: &Rect) -> Option<Rect> {
        let r = Rect {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        };
        (r.x0 < r.x1 && r.y0 < r.y1).then_some(r)
    }

    /// The smallest rectangle around both.
    pub fn union(&self, other: &Rect) -> Rect {
        Rect {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// This rectangle without `hole`, as up to four disjoint rectangles.
    pub fn minus(&self, hole: &Rect) -> Vec<Rect> {
        let Some(h) = self.intersection(hole) else {
            return vec![*self];
        };
        [
            Rect { y1: h.y0, ..*self },
            Rect { y0: h.y1, ..*self },
            Rect {
                x1: h.x0,
                y0: h.y0,
                y1: h.y1,
                ..*self
            },
            Rect {
                x0: h.x1,
                y0: h.y0,
                y1: h.y1,
                ..*self
            },
        ]
        .into_iter()
        .filter(|r| r.area() > 0)
        .collect()
    }

    /// The same pixels as `rects`, as disjoint rectangles.
    pub fn disjoint(rects: &[Rect]) -> Vec<Rect> {
        let mut out: Vec<Rect> = Vec::new();
        for r in rects {
            let mut rest = vec![*r];
            for have in &out {
                rest = rest.iter().flat_map(|p| p.minus(have)).collect();
            }
            out.extend(rest.into_iter().filter(|p| p.area() > 0));
        }
        out
    }
}

/// `x0,y0,x1,y1`, as `--region` reads it.
impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x0, y0, x1, y1 } = self;
        write!(f, "{x0},{y0},{x1},{y1}")
    }
}

/// Disjoint rectangles with the sample numbers that their pixels have had.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Coverage {
    cells: Vec<(Rect, Vec<Range<u64>>)>,
}

impl Coverage {
    /// The rectangles and their ranges; ranges are sorted, disjoint and not adjacent.
    pub fn cells(&self) -> impl Iterator<Item = (Rect, &[Range<u64>])> {
        self.cells.iter().map(|(r, s)| (*r, s.as_slice()))
    }

    /// Whether nothing is covered.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Adds samples that no pixel of `rect` has had.
    pub fn add(&mut self, rect: Rect, samples: Range<u64>) {
        debug_assert!(self.overlap(rect, &samples).is_none());
        if let Some((_, ranges)) = self.cells.iter_mut().find(|(r, _)| *r == rect) {
            insert(ranges, samples);
            return;
        }
        let mut new = Vec::new();
        let mut rest = vec![rect];
        for (r, ranges) in &self.cells {
            let Some(both) = r.intersection(&rect) else {
                new.push((*r, ranges.clone()));
                continue;
            };
            for part in r.minus(&both) {
                new.push((part, ranges.clone()));
            }
            let mut more = ranges.clone();
            insert(&mut more, samples.clone());
            new.push((both, more));
            rest = rest.iter().flat_map(|p| p.minus(&both)).collect();
        }
        new.extend(rest.into_iter().map(|r| (r, vec![samples.clone()])));
        self.cells = new;
    }

    /// Cuts the cells along the edges of `tiles`, disjoint rectangles: samples added to whole tiles then cut no cell.
    pub fn split(&mut self, tiles: &[Rect]) {
        let mut cells = Vec::new();
        for (rect, ranges) in &self.cells {
            if tiles.contains(rect) {
                cells.push((*rect, ranges.clone()));
                continue;
            }
            let mut rest = vec![*rect];
            for part in tiles.iter().filter_map(|t| t.intersection(rect)) {
                cells.push((part, ranges.clone()));
                rest = rest.iter().flat_map(|p| p.minus(&part)).collect();
            }
            cells.extend(rest.into_iter().map(|r| (r, ranges.clone())));
        }
        self.cells = cells;
    }

    /// Samples of all pixels together.
    pub fn total(&self) -> u128 {
        let of = |(rect, ranges): &(Rect, Vec<Range<u64>>)| {
            let samples: u64 = ranges.iter().map(|r| r.end - r.start).sum();
            u128::from(rect.area()) * u128::from(samples)
        };
        self.cells.iter().map(of).sum()
    }

    /// Samples of a covered pixel on average; 0 when nothing is covered.
    pub fn mean(&self) -> f64 {
        let pixels: u64 = self.cells.iter().map(|(r, _)| r.area()).sum();
        self.total() as f64 / pixels.max(1) as f64
    }

    /// A pixel rectangle and sample numbers that are covered already, if any of the given ones are.
    pub fn overlap(&self, rect: Rect, samples: &Range<u64>) -> Option<(Rect, Range<u64>)> {
        self.cells.iter().find_map(|(r, ranges)| {
            let both = r.intersection(&rect)?;
            let common = ranges
                .iter()
                .map(|s| s.start.max(samples.start)..s.end.min(samples.end));
            common
                .into_iter()
                .find(|s| s.start < s.end)
                .map(|s| (both, s))
        })
    }

    /// Pixels and sample numbers that both have, if there are any.
    pub fn common(&self, other: &Self) -> Option<(Rect, Range<u64>)> {
        other
            .cells()
            .flat_map(|(rect, ranges)| ranges.iter().map(move |samples| (rect, samples)))
            .find_map(|(rect, samples)| self.overlap(rect, samples))
    }

    /// The lowest sample number, and the first pixels that have it; `None` when nothing is covered. Where nothing is
    /// [common](Self::common), no two are equal.
    pub fn first(&self) -> Option<(u64, Rect)> {
        let starts = self
            .cells()
            .filter_map(|(r, s)| Some((s.first()?.start, r)));
        starts.min()
    }

    /// The samples of `wanted` that pixels of `rect` do not have: disjoint rectangles, each with sorted ranges.
    pub fn missing(&self, rect: Rect, wanted: Range<u64>) -> Vec<(Rect, Vec<Range<u64>>)> {
        let mut out = Vec::new();
        let mut rest = vec![rect];
        for (r, ranges) in &self.cells {
            let Some(both) = r.intersection(&rect) else {
                continue;
            };
            let mut gaps = Vec::new();
            let mut at = wanted.start;
            for s in ranges {
                if s.start > at && at < wanted.end {
                    gaps.push(at..s.start.min(wanted.end));
                }
                at = at.max(s.end);
            }
            if at < wanted.end {
                gaps.push(at..wanted.end);
            }
            if !gaps.is_empty() {
                out.push((both, gaps));
            }
            rest = rest.iter().flat_map(|p| p.minus(&both)).collect();
        }
        out.extend(rest.into_iter().map(|r| (r, vec![wanted.clone()])));
        out
    }

    /// The fewest and the most samples of any covered pixel; (0, 0) when nothing is covered.
    pub fn samples(&self) -> (u64, u64) {
        let counts = || {
            self.cells
                .iter()
                .map(|(_, s)| s.iter().map(|r| r.end - r.start).sum::<u64>())
        };
        (counts().min().unwrap_or(0), counts().max().unwrap_or(0))
    }
}

/// Inserts a range disjoint from those there, joining neighbours.
fn insert(ranges: &mut Vec<Range<u64>>, new: Range<u64>) {
    let at = ranges.partition_point(|r| r.start < new.start);
    ranges.insert(at, new);
    let mut joined: Vec<Range<u64>> = Vec::with_capacity(ranges.len());
    for r in ranges.drain(..) {
        match joined.last_mut() {
            Some(last) if last.end >= r.start => last.end = last.end.max(r.end),
            _ => joined.push(r),
        }
    }
    *ranges = joined;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x0: u32, y0: u32, x1: u32, y1: u32) -> Rect {
        Rect { x0, y0, x1, y1 }
    }

    #[test]
    fn quadrants_and_slices_cover_each_pixel_once() {
        let mut c = Coverage::default();
        c.add(rect(0, 0, 4, 4), 0..10);
        c.add(rect(2, 2, 6, 6), 10..20);
        c.add(rect(0, 0, 4, 4), 20..30);
        let mut seen = [[0u64; 6]; 6];
        for (r, ranges) in c.cells() {
            for y in r.y0..r.y1 {
                for x in r.x0..r.x1 {
                    assert_eq!(seen[y as usize][x as usize], 0, "cells overlap");
                    seen[y as usize][x as usize] = ranges.iter().map(|s| s.end - s.start).sum();
                }
            }
        }
        assert_eq!(
            (seen[0][0], seen[3][3], seen[5][5], seen[0][5]),
            (20, 30, 10, 0)
        );
        assert!(c.overlap(rect(3, 3, 5, 5), &(15..16)).is_some());
        assert!(c.overlap(rect(0, 0, 2, 2), &(10..20)).is_none());
    }

    #[test]
    fn missing_is_the_complement() {
        let mut c = Coverage::default();
        c.add(rect(0, 0, 2, 2), 3..5);
        let m = c.missing(rect(0, 0, 3, 2), 0..8);
        let gaps: Vec<_> = m
            .iter()
            .flat_map(|(r, s)| s.iter().map(|g| (*r, g.start, g.end)))
            .collect();
        let (left, right) = (rect(0, 0, 2, 2), rect(2, 0, 3, 2));
        assert_eq!(gaps, [(left, 0, 3), (left, 5, 8), (right, 0, 8)]);
    }

    #[test]
    fn minus_leaves_exactly_the_rest() {
        let a = rect(0, 0, 5, 5);
        for hole in [
            rect(1, 1, 3, 4),
            rect(0, 0, 5, 2),
            rect(4, 4, 9, 9),
            rect(7, 7, 8, 8),
        ] {
            let parts = a.minus(&hole);
            let left: u64 = parts.iter().map(Rect::area).sum();
            assert_eq!(left, 25 - a.intersection(&hole).map_or(0, |h| h.area()));
        }
    }
}
