//! Which samples bring the pixels of some regions to a number of them.

use crate::film::Film;
use crate::film::coverage::{Coverage, Rect};
use std::ops::Range;

/// The smallest rectangle around all regions, of which there is at least one.
pub fn bounds(regions: &[Rect]) -> Rect {
    regions[1..].iter().fold(regions[0], |a, b| a.union(b))
}

/// The regions that a film holds, if it is no film of the whole picture: those that it is resumed with.
pub fn held_regions(film: &Film) -> Vec<Rect> {
    if film.bounds == Rect::whole(film.size) {
        return Vec::new();
    }
    let cells: Vec<Rect> = film.coverage.cells().map(|c| c.0).collect();
    // If the first run ended before all regions had samples, the film knows only the rectangle around them.
    let all_begun = cells.iter().copied().reduce(|a, b| a.union(&b)) == Some(film.bounds);
    match &film.pilot {
        Some(pilot) => pilot.regions().to_vec(),
        None if all_begun => Rect::disjoint(&cells),
        None => vec![film.bounds],
    }
}

/// The end of the range from 0 that brings every pixel to `wanted` samples, those included that it holds beyond.
pub fn end_for(wanted: u64, regions: &[Rect], held: &Coverage) -> u64 {
    let regions = Rect::disjoint(regions);
    let mut end = 0;
    let mut bare: u64 = regions.iter().map(Rect::area).sum();
    for (rect, ranges) in held.cells() {
        let inside = regions.iter().filter_map(|r| r.intersection(&rect));
        let pixels: u64 = inside.map(|r| r.area()).sum();
        if pixels > 0 {
            bare -= pixels;
            end = end.max(end_for_pixel(wanted, ranges));
        }
    }
    if bare > 0 { wanted } else { end }
}

/// [`end_for`] for a pixel that holds `ranges` (sorted, disjoint).
fn end_for_pixel(wanted: u64, ranges: &[Range<u64>]) -> u64 {
    let held: u64 = ranges.iter().map(|r| r.end - r.start).sum();
    let mut lacking = wanted.saturating_sub(held);
    if lacking == 0 {
        return 0;
    }
    let mut at = 0;
    for r in ranges {
        let gap = r.start - at;
        if lacking <= gap {
            break;
        }
        lacking -= gap;
        at = r.end;
    }
    at + lacking
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x0: u32, y0: u32, x1: u32, y1: u32) -> Rect {
        Rect { x0, y0, x1, y1 }
    }

    #[test]
    fn what_a_film_holds_counts() {
        let whole = rect(0, 0, 4, 4);
        let end = |held: &[(u64, u64)], wanted| {
            let mut c = Coverage::default();
            for &(a, b) in held {
                c.add(whole, a..b);
            }
            end_for(wanted, &[whole], &c)
        };
        assert_eq!(end(&[], 100), 100);
        assert_eq!(end(&[(0, 40)], 100), 100);
        assert_eq!(end(&[(512, 1024)], 512), 0);
        assert_eq!(end(&[(512, 1024)], 600), 88);
        assert_eq!(end(&[(10, 20), (30, 40)], 35), 25);
        assert_eq!(end(&[(10, 20)], 10), 0);
        assert_eq!(end(&[(10, 20), (30, 40)], 45), 45);
    }

    #[test]
    fn pixels_that_hold_nothing_need_all() {
        let mut c = Coverage::default();
        c.add(rect(0, 0, 2, 4), 0..500);
        assert_eq!(end_for(100, &[rect(0, 0, 4, 4)], &c), 100);
        assert_eq!(end_for(100, &[rect(0, 0, 2, 2), rect(1, 1, 2, 3)], &c), 0);
    }

    #[test]
    fn bounds_hold_all_regions() {
        assert_eq!(
            bounds(&[rect(4, 4, 6, 6), rect(1, 5, 2, 9)]),
            rect(1, 4, 6, 9)
        );
    }
}
