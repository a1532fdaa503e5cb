//! Denoised pictures of a film: what a denoiser gets, and what is made of its answer.
//!
//! Lamps are kept from the denoiser: it would bleed them into dark neighbours. Pixels whose light straight from lamps is brighter than the
//! picture on average are filled from around them before, and get their own values back after.

mod fill;
pub mod folder;
pub mod oidn;

use crate::film::Film;
use crate::film::replicates::{NoReplicates, Replicates};
use crate::layers::View;
use crate::layers::features::Features;
use crate::provenance::Provenance;
use crate::stats::denoised::{Denoised, PAIRS, Rgb, half, judge};

/// A film made ready for a denoiser.
pub struct Task {
    /// Four independent pictures.
    pub replicates: Replicates,
    /// What is seen in each pixel, without noise.
    pub features: Features,
    /// Pixels of lamps, which no denoiser sees.
    lamps: Vec<bool>,
    /// Why the film's own error is in doubt.
    doubt: Option<String>,
}

impl Task {
    /// Prepares `film`, a picture of `view`, which `provenance` describes. `done` hears how many rows of features are done.
    pub fn new(
        film: &Film,
        provenance: &Provenance,
        view: &View,
        done: impl FnMut(u32),
    ) -> Result<Self, NoReplicates> {
        let replicates = film.replicates_apart()?;
        let features = Features::new(view, film.bounds, done);
        let mean = film.mean_luminance();
        let lamps = features.lamps.iter().map(|l| f64::from(*l) > mean);
        Ok(Self {
            lamps: lamps.collect(),
            replicates,
            features,
            doubt: provenance.relative_error_doubt.clone(),
        })
    }

    /// How many pixels are lamps'.
    pub fn lamp_pixels(&self) -> usize {
        self.lamps.iter().filter(|l| **l).count()
    }

    /// The mean of each pair of [`PAIRS`], lamps filled: what is to be denoised.
    pub fn half(&self, pair: usize) -> Rgb {
        let mut picture = half(&self.replicates.means, pair);
        fill::fill(&mut picture, &self.lamps, self.replicates.size[0] as usize);
        picture
    }

    /// Puts the lamps back into a denoised half.
    pub fn restore(&self, pair: usize, denoised: &mut Rgb) {
        let own = half(&self.replicates.means, pair);
        let pixels = denoised.iter_mut().zip(own).zip(&self.lamps);
        for ((pixel, own), _) in pixels.filter(|(_, lamp)| **lamp) {
            *pixel = own;
        }
    }

    /// Judges the six denoised halves, lamps put back.
    pub fn judge(&self, folds: &[Rgb; PAIRS.len()]) -> Denoised {
        let width = self.replicates.size[0] as usize;
        judge(&self.replicates.means, folds, width, self.doubt.clone())
    }
}
