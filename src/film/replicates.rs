//! A film's replicates as pictures of their own: four independent renders of the same picture.

use super::{Film, REPLICATES, replicate_counts};
use rayon::prelude::*;

/// The means of the replicates, light paths included, for the pixels of the film's bounds, row by row; linear RGB.
///
/// They are independent, and each has the true picture as its expected value. They may rest on different numbers of samples, in a film
/// that ended within a turn of the replicates or that is adaptive: how many is decided without a look at the samples themselves. So
/// nothing that is said of them may suppose that their variances are equal.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates {
    /// Width and height of the pictures in pixels.
    pub size: [u32; 2],
    /// The pictures.
    pub means: [Vec<[f32; 3]>; REPLICATES],
}

/// Why a film has no four replicates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoReplicates {
    /// Some of its pixels have no samples.
    #[error(
        "{0} pixels of the film have no samples, and a denoised picture needs all of them; render them, or one region alone"
    )]
    Holes(u64),
    /// Some pixel lacks a replicate.
    #[error(
        "the error of a denoised picture can't be known without four independent replicates of every pixel: take at least {0} samples per pixel"
    )]
    TooFew(u64),
    /// Samples that were not finite are not in its sums.
    #[error(
        "samples of {0} pixels were not finite and were left out, so the film's means are not right on average; the error of a denoised picture can't be known"
    )]
    LeftOut(usize),
    /// A replicate of some pixel has samples but no passes of light paths.
    #[error(
        "some replicates of the film have no light paths yet, so they are not independent; resume the film first"
    )]
    NoPasses,
}

impl Film {
    /// The replicates as pictures, or why there are none.
    pub fn replicates_apart(&self) -> Result<Replicates, NoReplicates> {
        let left_out = self.left_out.iter().count();
        if left_out > 0 {
            return Err(NoReplicates::LeftOut(left_out));
        }
        let covered: u64 = self.coverage.cells().map(|(rect, _)| rect.area()).sum();
        if covered < self.bounds.area() {
            return Err(NoReplicates::Holes(self.bounds.area() - covered));
        }
        if self.replicates().0 < REPLICATES as u32 {
            let round = u64::from(self.strata) * u64::from(self.strata);
            return Err(NoReplicates::TooFew(REPLICATES as u64 * round));
        }
        if self.splats.as_ref().is_some_and(|s| s.lacks_passes()) {
            return Err(NoReplicates::NoPasses);
        }
        let width = self.bounds.width() as usize;
        let mut all = vec![[[0.0f32; 3]; REPLICATES]; self.bounds.area() as usize];
        for (rect, ranges) in self.coverage.cells() {
            let counts = replicate_counts(ranges, self.strata);
            let rows = (rect.y0 - self.bounds.y0) as usize..(rect.y1 - self.bounds.y0) as usize;
            let rows = all[rows.start * width..rows.end * width].par_chunks_mut(width);
            rows.zip(rect.y0..rect.y1).for_each(|(row, y)| {
                for x in rect.x0..rect.x1 {
                    let sums = self.all_light(x, y, &counts);
                    let mean = |r: usize, c: usize| (sums[r][c] / counts[r] as f64) as f32;
                    row[(x - self.bounds.x0) as usize] =
                        std::array::from_fn(|r| std::array::from_fn(|c| mean(r, c)));
                }
            });
        }
        let means = std::array::from_fn(|r| all.iter().map(|pixel| pixel[r]).collect());
        Ok(Replicates {
            size: [self.bounds.width(), self.bounds.height()],
            means,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::coverage::Rect;
    use super::super::splats::{Passes, Splat, SplatSetup};
    use super::*;

    const SIZE: [u32; 2] = [3, 2];

    fn film(samples: u64) -> Film {
        let whole = Rect::whole(SIZE);
        let mut film = Film::new(SIZE, whole, 1);
        let counts = replicate_counts(std::slice::from_ref(&(0..samples)), 1);
        let pixel = std::array::from_fn(|r| [(r as f64 + 1.0) * counts[r] as f64; 4]);
        film.put_samples(whole, 0..samples, vec![pixel; 6]);
        film
    }

    #[test]
    fn each_replicate_is_the_mean_of_its_own_samples_and_passes() {
        // Two of replicate 0, one of the others.
        let mut film = film(5);
        film.begin_splats(SplatSetup {
            paths: 64,
            scale: 16.0,
        });
        let whole = Rect::whole(SIZE);
        let splats: Vec<Splat> = (0..4)
            .map(|r| Splat::new([2, 1], SIZE[0], r, [0.5 * r as f32; 3]))
            .collect();
        film.put_passes(whole, &Passes::new(0..3, SIZE[0], splats[..3].to_vec()));
        assert_eq!(film.replicates_apart(), Err(NoReplicates::NoPasses));
        film.put_passes(whole, &Passes::new(3..4, SIZE[0], splats[3..].to_vec()));
        let apart = film.replicates_apart().unwrap();
        let of = |r: usize, i: usize| apart.means[r][i][1];
        for r in 0..REPLICATES {
            assert_eq!(of(r, 0), r as f32 + 1.0);
            assert!((of(r, 5) - (1.5 * r as f32 + 1.0)).abs() < 1e-6);
        }
    }

    #[test]
    fn films_without_four_replicates_say_why() {
        assert_eq!(film(3).replicates_apart(), Err(NoReplicates::TooFew(4)));
        let mut holes = Film::new(SIZE, Rect::whole(SIZE), 1);
        let part = Rect {
            y1: 1,
            ..Rect::whole(SIZE)
        };
        holes.put_samples(part, 0..4, vec![[[1.0; 4]; REPLICATES]; 3]);
        assert_eq!(holes.replicates_apart(), Err(NoReplicates::Holes(3)));
        let mut left_out = film(8);
        left_out.leave_out(1, 1, [0, 1, 0, 0]);
        assert_eq!(left_out.replicates_apart(), Err(NoReplicates::LeftOut(1)));
    }
}
