//! A film as it stood at one moment.

use super::layers::Layers;
use crate::engine::DeviceInfo;
use crate::film::Film;
use crate::provenance::Provenance;
use crate::render;
use crate::run::Tally;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// A film, and where it comes from. What is made of it is made when it is asked for.
#[derive(Debug)]
pub struct Snapshot {
    film: Film,
    before: Arc<Provenance>,
    work: Option<(DeviceInfo, Tally)>,
    layers: OnceLock<Layers>,
}

impl Snapshot {
    /// Of a film that a run on `device` has brought on from `before`.
    pub fn of_run(
        film: &Film,
        before: &Arc<Provenance>,
        device: &DeviceInfo,
        tally: &Tally,
    ) -> Self {
        Self {
            film: film.clone(),
            before: before.clone(),
            work: Some((device.clone(), *tally)),
            layers: OnceLock::new(),
        }
    }

    /// Of a film as it was saved.
    pub fn saved(film: Film, provenance: Provenance) -> Self {
        Self {
            film,
            before: Arc::new(provenance),
            work: None,
            layers: OnceLock::new(),
        }
    }

    /// The film.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Its provenance. This looks at every pixel.
    pub fn provenance(&self) -> Cow<'_, Provenance> {
        match &self.work {
            Some((device, tally)) => {
                Cow::Owned(render::provenance(&self.before, device, &self.film, tally))
            }
            None => Cow::Borrowed(&self.before),
        }
    }

    /// The values of its pixels.
    pub fn layers(&self) -> &Layers {
        self.layers.get_or_init(|| Layers::new(&self.film))
    }
}
