//! Estimates of all pixels of the picture, in any order of access.

use crate::film::coverage::Rect;
use crate::film::{Estimate, Film, REPLICATES, replicate_counts};

/// Estimates by pixel.
pub struct Pixels<'a> {
    film: &'a Film,
    /// For each pixel of the film's bounds, one more than its place in `counts`; 0 where there is nothing.
    cell: Vec<u32>,
    counts: Vec<[u64; REPLICATES]>,
    /// Errors of pixels that share theirs with their neighbours.
    unlit: Option<Vec<Option<[f32; 4]>>>,
    covered: u64,
}

impl<'a> Pixels<'a> {
    /// Indexes the film's coverage.
    pub fn new(film: &'a Film) -> Self {
        let mut cell = vec![0; film.bounds.area() as usize];
        let mut counts = Vec::new();
        let mut covered = 0;
        for (rect, ranges) in film.coverage.cells() {
            counts.push(replicate_counts(ranges, film.strata));
            covered += rect.area();
            for y in rect.y0..rect.y1 {
                let start = film.index(rect.x0, y);
                cell[start..start + rect.width() as usize].fill(counts.len() as u32);
            }
        }
        Self {
            film,
            cell,
            counts,
            unlit: film.errors_of_unlit(),
            covered,
        }
    }

    /// The estimate of pixel (x, y) of the picture; `None` if it has no samples.
    pub fn at(&self, x: u32, y: u32) -> Option<Estimate> {
        if !self.film.bounds.contains(x, y) {
            return None;
        }
        let cell = self.cell[self.film.index(x, y)];
        let counts = self.counts.get((cell as usize).checked_sub(1)?)?;
        let mut estimate = self.film.estimate(x, y, counts);
        if let Some(errors) = self.unlit.as_ref().and_then(|s| s[self.film.index(x, y)]) {
            estimate.error = errors.map(f64::from);
        }
        Some(estimate)
    }

    /// Whether every pixel of the picture has samples.
    pub fn complete(&self) -> bool {
        self.covered == Rect::whole(self.film.size).area()
    }
}

/// The nearest float that is finite. NaN, which only an overflow can have left, counts as too large.
pub fn finite(x: f64) -> f32 {
    let largest = f64::from(f32::MAX);
    if x.is_nan() {
        return f32::MAX;
    }
    x.clamp(-largest, largest) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_too_large_for_f32_become_the_largest_f32() {
        assert_eq!(finite(1e300), f32::MAX);
        assert_eq!(finite(f64::INFINITY), f32::MAX);
        assert_eq!(finite(f64::NAN), f32::MAX);
        assert_eq!(finite(-1e39), f32::MIN);
        // Half an ulp above the largest float would round to infinity.
        assert_eq!(finite(f64::from(f32::MAX) * (1.0 + 1e-8)), f32::MAX);
        assert_eq!(finite(0.1), 0.1);
    }
}
