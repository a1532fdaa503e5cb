//! A film as it stood at one moment.

use super::layers::Layers;
use crate::engine::DeviceInfo;
use crate::files::FileError;
use crate::film::Film;
use crate::output::store;
use crate::provenance::Provenance;
use crate::render;
use crate::run::Tally;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

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
                Cow::Owned(render::provenance(&self.before, device, &self.film, tally).0)
            }
            None => Cow::Borrowed(&self.before),
        }
    }

    /// The values of its pixels.
    pub fn layers(&self) -> &Layers {
        self.layers.get_or_init(|| Layers::new(&self.film))
    }
}

/// A film to show.
#[derive(Debug, Clone)]
pub enum Picture {
    /// It is in memory.
    Held(Arc<Snapshot>),
    /// It is in a file, which is read when someone looks.
    Saved(Arc<SavedFilm>),
}

impl Picture {
    /// The film. This may read a file.
    pub fn open(&self) -> Result<Arc<Snapshot>, FileError> {
        match self {
            Self::Held(snapshot) => Ok(snapshot.clone()),
            Self::Saved(saved) => saved.open(),
        }
    }
}

/// A film in a file.
#[derive(Debug)]
pub struct SavedFilm {
    path: PathBuf,
    shelf: Arc<Shelf>,
    kept: Mutex<Weak<Snapshot>>,
}

impl SavedFilm {
    /// The film that `path` holds now. What is read of it stays on `shelf` for a while.
    pub fn new(path: PathBuf, shelf: Arc<Shelf>) -> Self {
        let kept = Mutex::default();
        Self { path, shelf, kept }
    }

    fn open(&self) -> Result<Arc<Snapshot>, FileError> {
        // Who comes second waits for the first, instead of reading it again.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(snapshot) = kept.upgrade() {
            return Ok(snapshot);
        }
        let (film, provenance) = store::load(&self.path)?;
        let snapshot = Arc::new(Snapshot::saved(film, provenance));
        *kept = Arc::downgrade(&snapshot);
        self.shelf.put(snapshot.clone());
        Ok(snapshot)
    }
}

/// Pixels of all films on a [`Shelf`], at most, but for the last one. A pixel takes about 200 bytes.
const MOST_SHELVED: u64 = 2 << 20;

/// The films that were read last. Of a folder's films only these are in memory.
#[derive(Debug, Default)]
pub struct Shelf(Mutex<VecDeque<Arc<Snapshot>>>);

impl Shelf {
    fn put(&self, snapshot: Arc<Snapshot>) {
        let mut films = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        films.push_back(snapshot);
        let pixels = |films: &VecDeque<Arc<Snapshot>>| {
            let each = films.iter().map(|s| s.film().bounds.area());
            each.sum::<u64>()
        };
        while films.len() > 1 && pixels(&films) > MOST_SHELVED {
            films.pop_front();
        }
    }
}
