//! Merges films of different samples, different regions, or both.

use super::coverage::{Coverage, Rect};
use super::{Film, Reach, fold};
use std::fmt;
use std::ops::Range;

/// Why two films can't be merged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// They are of pictures of different sizes.
    #[error("a film of {}x{} pixels can't be merged with one of {}x{}", other[0], other[1], into[0], into[1])]
    Size {
        /// Size of the film added to.
        into: [u32; 2],
        /// Size of the film to be added.
        other: [u32; 2],
    },
    /// They divide pixels differently.
    #[error("a film of {other} x {other} strata can't be merged with one of {into} x {into}")]
    Strata {
        /// Strata of the film added to.
        into: u32,
        /// Strata of the film to be added.
        other: u32,
    },
    /// Samples would count twice.
    #[error("samples {}..{} of pixels {} are in both films", samples.start, samples.end, rect)]
    Overlap {
        /// Pixels that both have.
        rect: Rect,
        /// Sample numbers that both have there.
        samples: Range<u64>,
    },
    /// Passes of light paths would count twice: one of the films was interrupted.
    #[error("passes {}..{} of light paths are in both films, for pixels {}", passes.start, passes.end, rect)]
    Passes {
        /// Pixels that both have.
        rect: Rect,
        /// Numbers of passes that both have there.
        passes: Range<u64>,
    },
    /// Only one has light paths, or they are not equally many.
    #[error("the films do not have the same light paths")]
    LightPaths,
}

impl MergeError {
    /// Refuses samples that would count twice.
    pub fn overlap(into: &Coverage, other: &Coverage) -> Result<(), Self> {
        match into.common(other) {
            Some((rect, samples)) => Err(Self::Overlap { rect, samples }),
            None => Ok(()),
        }
    }

    /// Refuses passes that would count twice.
    pub fn passes(into: &Coverage, other: &Coverage) -> Result<(), Self> {
        match into.common(other) {
            Some((rect, passes)) => Err(Self::Passes { rect, passes }),
            None => Ok(()),
        }
    }
}

/// Adds `other` to `into`, whose bounds grow to hold both. After an error `into` is unchanged.
///
/// Where both have samples, their unfinished blocks are folded into the f64 sums; where only one has,
/// its unfinished block stays as it is, so that a picture merged from regions is resumed with the same bits. The pilots of
/// adaptive films are dropped: the sum is resumed without `--adaptive`. The caller must check that scenes and seeds agree
/// ([`Provenance::same_samples`](crate::provenance::Provenance::same_samples)).
pub fn merge(into: &mut Film, other: &Film) -> Result<(), MergeError> {
    if into.size != other.size {
        return Err(MergeError::Size {
            into: into.size,
            other: other.size,
        });
    }
    if into.strata != other.strata {
        return Err(MergeError::Strata {
            into: into.strata,
            other: other.strata,
        });
    }
    MergeError::overlap(&into.coverage, &other.coverage)?;
    match (&into.splats, &other.splats) {
        (None, None) => {}
        (Some(a), Some(b)) if a.setup == b.setup => {
            MergeError::passes(&a.coverage, &b.coverage)?;
        }
        _ => return Err(MergeError::LightPaths),
    }
    grow(into, into.bounds.union(&other.bounds));
    if into.partial.is_empty() && !other.partial.is_empty() {
        into.partial = vec![Default::default(); into.sums.len()];
    }
    let before: Vec<Rect> = into.coverage.cells().map(|c| c.0).collect();
    for (rect, ranges) in other.coverage.cells() {
        let mut alone = vec![rect];
        for &shared in &before {
            if let Some(shared) = rect.intersection(&shared) {
                add(into, other, shared, true);
                alone = alone.iter().flat_map(|r| r.minus(&shared)).collect();
            }
        }
        for rect in alone {
            add(into, other, rect, false);
        }
        for samples in ranges {
            into.coverage.add(rect, samples.clone());
        }
    }
    if let (Some(a), Some(b)) = (&mut into.splats, &other.splats) {
        a.merge(b, [into.bounds, other.bounds], into.strata);
    }
    into.left_out.merge(&other.left_out);
    if !other.reached.is_empty() {
        for y in other.bounds.y0..other.bounds.y1 {
            for x in other.bounds.x0..other.bounds.x1 {
                let how = other.reached[other.index(x, y)];
                let known = Reach::ALL.into_iter().find(|r| *r as u8 == how);
                known.into_iter().for_each(|r| into.reach(x, y, r));
            }
        }
    }
    // The pilots of one film say nothing about the sum.
    into.pilot = None;
    Ok(())
}

/// Adds the sums of `rect`. `fold_blocks` decides whether unfinished blocks are added to the f64 sums.
fn add(into: &mut Film, other: &Film, rect: Rect, fold_blocks: bool) {
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            let (i, j) = (into.index(x, y), other.index(x, y));
            let sums = &mut into.sums[i];
            for (s, o) in sums
                .iter_mut()
                .flatten()
                .zip(other.sums[j].iter().flatten())
            {
                *s += o;
            }
            let theirs = other.partial.get(j);
            match into.partial.get_mut(i) {
                Some(ours) if fold_blocks => {
                    fold(sums, ours);
                    *ours = Default::default();
                    theirs.into_iter().for_each(|block| fold(sums, block));
                }
                Some(ours) => *ours = theirs.copied().unwrap_or_default(),
                None => {}
            }
        }
    }
}

/// Enlarges the film to `bounds`, which contain its own. Moves rows in place, since a film may fill
/// most of the memory.
fn grow(film: &mut Film, bounds: Rect) {
    let old = film.bounds;
    film.bounds = bounds;
    move_rows(&mut film.sums, old, bounds);
    if !film.partial.is_empty() {
        move_rows(&mut film.partial, old, bounds);
    }
    if !film.reached.is_empty() {
        move_rows(&mut film.reached, old, bounds);
    }
    if let Some(splats) = &mut film.splats {
        splats.move_rows(old, bounds);
    }
}

pub(super) fn move_rows<T: Copy + Default>(pixels: &mut Vec<T>, old: Rect, new: Rect) {
    if old == new {
        return;
    }
    let [width, new_width] = [old, new].map(|r| r.width() as usize);
    let [left, top] = [old.x0 - new.x0, old.y0 - new.y0].map(|n| n as usize);
    pixels.resize(new.area() as usize, T::default());
    // From the last row on: each moves towards the end, onto what has been moved already.
    for y in (0..old.height() as usize).rev() {
        let (from, to) = (y * width, (y + top) * new_width + left);
        pixels.copy_within(from..from + width, to);
        // What it leaves behind, unless the row's new place covers it.
        let vacated = from..(from + width).min(to);
        pixels[vacated].fill(T::default());
    }
}

/// Samples that are missing from a merged film.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hole {
    /// Where.
    pub rect: Rect,
    /// Sample numbers that are missing there.
    pub samples: Range<u64>,
    /// In what way.
    pub kind: HoleKind,
}

/// The ways of lacking samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HoleKind {
    /// There are samples with higher numbers: a slice is missing.
    Gap,
    /// Other pixels have samples with higher numbers. Usual where sampling is adaptive.
    Short,
    /// There are no samples at all. Usual where only regions are wanted.
    Uncovered,
}

impl fmt::Display for Hole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rect = self.rect;
        match self.kind {
            HoleKind::Uncovered => write!(f, "pixels {rect} have no samples"),
            HoleKind::Gap | HoleKind::Short => write!(
                f,
                "samples {}..{} of pixels {rect} are missing",
                self.samples.start, self.samples.end
            ),
        }
    }
}

/// All gaps: the samples below the highest sample number of the film that some pixels of the picture do not have.
pub fn holes(film: &Film) -> Vec<Hole> {
    let ends = film.coverage.cells().filter_map(|(_, r)| r.last());
    let end = ends.map(|r| r.end).max().unwrap_or(0);
    let mut holes = Vec::new();
    for (rect, missing) in film.coverage.missing(Rect::whole(film.size), 0..end.max(1)) {
        for samples in missing {
            let kind = if samples == (0..end.max(1)) {
                HoleKind::Uncovered
            } else if samples.end == end {
                HoleKind::Short
            } else {
                HoleKind::Gap
            };
            holes.push(Hole {
                rect,
                samples,
                kind,
            });
        }
    }
    holes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{BLOCK, REPLICATES, Sums};

    fn rect(x0: u32, y0: u32, x1: u32, y1: u32) -> Rect {
        Rect { x0, y0, x1, y1 }
    }

    /// What sample k of pixel (x, y) adds: an arbitrary function, the same for every film.
    fn sample(x: u32, y: u32, k: u64) -> Sums<f32> {
        let h = (u64::from(x) * 7919 + u64::from(y) * 104_729 + k * 15_485_863) % 1009;
        [0.1, 0.7, 1.3, 0.01].map(|c| c * h as f32)
    }

    /// Renders as a GPU does: block by block in f32, going on with the film's unfinished one.
    fn render(film: &mut Film, area: Rect, samples: Range<u64>) {
        let mut at = samples.start;
        while at < samples.end {
            let end = ((at / BLOCK + 1) * BLOCK).min(samples.end);
            let before = film.clone();
            film.put_block(area, at..end, |x, y| {
                let mut running = before.partial_at(x, y);
                for k in at..end {
                    let replicate = (k / 4) as usize % REPLICATES;
                    for (r, s) in running[replicate].iter_mut().zip(sample(x, y, k)) {
                        *r += s;
                    }
                }
                running
            });
            at = end;
        }
    }

    const SIZE: [u32; 2] = [5, 4];

    fn rendered(area: Rect, samples: Range<u64>) -> Film {
        let mut film = Film::new(SIZE, area, 2);
        render(&mut film, area, samples);
        film
    }

    /// Largest relative difference of any sum.
    fn difference(a: &Film, b: &Film) -> f64 {
        let mut worst = 0.0f64;
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let (a, b) = (a.total(x, y), b.total(x, y));
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    worst = worst.max((a - b).abs() / b.abs().max(1e-9));
                }
            }
        }
        worst
    }

    #[test]
    fn slices_in_any_order_equal_one_run() {
        let whole = Rect::whole(SIZE);
        let one = rendered(whole, 0..1000);
        // On block boundaries the f64 sums differ by their order alone; elsewhere f32 sums of up to a
        // block of samples are cut in two.
        for (cuts, tolerance) in [([256, 768], 1e-12), ([100, 301], 1e-6)] {
            let slices = [0..cuts[0], cuts[0]..cuts[1], cuts[1]..1000];
            for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0], [2, 1, 0]] {
                let mut sum = rendered(whole, slices[order[0]].clone());
                for i in &order[1..] {
                    merge(&mut sum, &rendered(whole, slices[*i].clone())).unwrap();
                }
                let off = difference(&sum, &one);
                assert!(off <= tolerance, "cuts {cuts:?}, order {order:?}: {off}");
                assert_eq!(sum.coverage, one.coverage);
                assert!(holes(&sum).is_empty());
            }
        }
    }

    #[test]
    fn samples_left_out_of_either_are_left_out_of_both() {
        let whole = Rect::whole(SIZE);
        let (mut sum, mut other) = (rendered(whole, 0..256), rendered(whole, 256..512));
        sum.leave_out(1, 2, [1, 0, 0, 0]);
        other.leave_out(1, 2, [2, 0, 0, 5]);
        other.leave_out(4, 0, [0, 1, 0, 0]);
        merge(&mut sum, &other).unwrap();
        let expected = [(4, 0, [0, 1, 0, 0]), (1, 2, [3, 0, 0, 5])];
        assert_eq!(sum.left_out().iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn merged_quadrants_have_the_bits_of_one_run_and_can_be_resumed() {
        let quadrants = [
            rect(2, 1, 5, 4),
            rect(0, 0, 2, 1),
            rect(2, 0, 5, 1),
            rect(0, 1, 2, 4),
        ];
        let mut sum = rendered(quadrants[0], 0..300);
        for q in &quadrants[1..] {
            merge(&mut sum, &rendered(*q, 0..300)).unwrap();
        }
        let whole = Rect::whole(SIZE);
        let mut one = rendered(whole, 0..300);
        for samples in [300..400, 400..600] {
            assert_eq!(sum.sums(), one.sums());
            assert_eq!(sum.partial(), one.partial());
            assert_eq!(sum.bounds, whole);
            render(&mut sum, whole, samples.clone());
            render(&mut one, whole, samples);
        }
        assert_eq!(sum.sums(), one.sums());
    }

    #[test]
    fn overlapping_and_foreign_films_are_refused_and_change_nothing() {
        let mut film = rendered(rect(0, 0, 3, 3), 0..10);
        let before = film.clone();
        let refused = |film: &mut Film, other: &Film| merge(film, other).unwrap_err().to_string();
        assert_eq!(
            refused(&mut film, &rendered(rect(1, 2, 5, 4), 6..20)),
            "samples 6..10 of pixels 1,2,3,3 are in both films"
        );
        assert_eq!(
            refused(&mut film, &Film::new([6, 4], rect(0, 0, 6, 4), 2)),
            "a film of 6x4 pixels can't be merged with one of 5x4"
        );
        assert_eq!(
            refused(&mut film, &Film::new(SIZE, rect(0, 0, 5, 4), 3)),
            "a film of 3 x 3 strata can't be merged with one of 2 x 2"
        );
        assert_eq!(film, before);
    }

    #[test]
    fn holes_are_named() {
        let mut film = rendered(rect(0, 0, 3, 4), 0..100);
        merge(&mut film, &rendered(rect(0, 0, 3, 4), 200..300)).unwrap();
        merge(&mut film, &rendered(rect(3, 0, 4, 4), 0..250)).unwrap();
        let text: Vec<String> = holes(&film).iter().map(Hole::to_string).collect();
        assert_eq!(
            text,
            [
                "samples 100..200 of pixels 0,0,3,4 are missing",
                "samples 250..300 of pixels 3,0,4,4 are missing",
                "pixels 4,0,5,4 have no samples",
            ]
        );
        let kinds: Vec<HoleKind> = holes(&film).iter().map(|h| h.kind).collect();
        assert_eq!(kinds, [HoleKind::Gap, HoleKind::Short, HoleKind::Uncovered]);
        let empty = Film::new(SIZE, Rect::whole(SIZE), 2);
        assert_eq!(holes(&empty).len(), 1);
    }
}
