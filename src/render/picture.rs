//! A finished picture with what is known of it.

use super::Error;
use crate::compare::{Comparison, Limits, Side, compare};
use crate::files::FileError;
use crate::film::error::RelativeError;
use crate::film::{self, Estimate, Film};
use crate::output::{Format, Pixels, WriteOptions, store, write_png};
use crate::provenance::Provenance;
use crate::run::StopReason;
use std::fmt;
use std::path::Path;

/// A picture, the error of each of its pixels, and where it comes from. Lists of pixels go row by row from the top left.
#[derive(Clone)]
pub struct Picture {
    film: Film,
    provenance: Provenance,
    ended: Option<StopReason>,
    note: Option<String>,
    pixels: Vec<[f32; 3]>,
    errors: Vec<[f32; 3]>,
    samples: Vec<u64>,
}

/// A short summary, without the pixels.
impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Picture")
            .field("scene", &self.provenance.scene_title)
            .field("film", &self.film)
            .field("relative_error", &self.provenance.relative_error)
            .field("ended", &self.ended)
            .finish_non_exhaustive()
    }
}

impl Picture {
    pub(super) fn new(
        film: Film,
        provenance: Provenance,
        ended: Option<StopReason>,
        note: Option<String>,
    ) -> Self {
        let [width, height] = film.size;
        let pixels = Pixels::new(&film);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let all: Vec<Estimate> = places
            .map(|(x, y)| pixels.at(x, y).unwrap_or_default())
            .collect();
        let [r, g, b] = [0, 1, 2];
        Self {
            pixels: all.iter().map(|e| e.mean.map(|v| v as f32)).collect(),
            errors: all
                .iter()
                .map(|e| [r, g, b].map(|c: usize| e.error[c] as f32))
                .collect(),
            samples: all.iter().map(|e| e.samples).collect(),
            film,
            provenance,
            ended,
            note,
        }
    }

    /// Reads a film (`.npz`): one that [`save`](Self::save) or the program has written. It is what
    /// [`Renderer::resume`](crate::Renderer::resume) and [`merge`](crate::merge) take.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let (film, mut provenance) = store::load(path.as_ref())?;
        if film.coverage.is_empty() {
            return Err(FileError::content(path.as_ref(), "the film has no samples").into());
        }
        provenance.describe(&film);
        Ok(Self::new(film, provenance, None, None))
    }

    /// What it is made of.
    pub(super) fn into_parts(self) -> (Film, Provenance) {
        (self.film, self.provenance)
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.film.size
    }

    /// Mean radiance of each pixel, linear RGB; 0 where there are no samples.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// Standard error of each of those numbers. Where a pixel has strata² samples or fewer it is an upper estimate.
    pub fn errors(&self) -> &[[f32; 3]] {
        &self.errors
    }

    /// Samples that each pixel rests on.
    pub fn samples(&self) -> &[u64] {
        &self.samples
    }

    /// The picture's relative error, √ mean over pixels of s² / (Y² + (0.1 Ȳ)²), with s the standard error of the luminance Y
    /// and Ȳ the picture's mean luminance; with its uncertainty, and with the reason if it is in doubt.
    pub fn relative_error(&self) -> RelativeError {
        self.provenance.error(&self.film)
    }

    /// What it was made from, by and on.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// What ended the rendering; `None` if it was [read from a file](Self::open) or [merged](crate::merge).
    pub fn ended(&self) -> Option<StopReason> {
        self.ended
    }

    /// Why it was rendered on the CPU reference, where [`Backend::Auto`](super::Backend::Auto) found no adapter that will do.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The film behind it: sums in f64.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Writes it to `path`: `.exr` (32-bit float, with layers of errors and samples), `.png` (8 bits, sRGB) or `.npz` (the film,
    /// which `etendue render --film` resumes). The file is whole or as it was.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("npz"))
        {
            return Ok(store::save(path, &self.film, &self.provenance)?);
        }
        let format = Format::from_path(path)
            .map_err(|e| Error::Input(format!("{e}, or .npz for a film")))?;
        let options = WriteOptions::default();
        Ok(format.write(path, &self.film, &self.provenance, &options)?)
    }

    /// Writes it to `path` as PNG, brightened by `stops` powers of two. The name must end in `.png`.
    pub fn save_png(&self, path: impl AsRef<Path>, stops: f64) -> Result<(), Error> {
        let path = path.as_ref();
        if Format::from_path(path) != Ok(Format::Png) || !stops.is_finite() {
            let path = path.display();
            return Err(Error::Input(format!(
                "{path}: a PNG picture has a name that ends in .png, and a finite exposure; the exposure is {stops}"
            )));
        }
        Ok(write_png(path, &self.film, &self.provenance, stops)?)
    }

    /// Compares it with `reference`. The verdict has no threshold but its rate of false alarms, one in a thousand. It is exact
    /// for equal numbers of samples and different seeds.
    pub fn compare(&self, reference: &Picture) -> Result<Comparison, Error> {
        let to_compare = |name: &str, p: &Picture| {
            Side::from_film(name.into(), &p.film, &p.provenance).map_err(Error::Input)
        };
        let reference = to_compare("the reference", reference)?;
        let picture = to_compare("the picture", self)?;
        compare(&reference, &picture, &Limits::default()).map_err(|e| Error::Input(e.to_string()))
    }
}

/// Adds up pictures of one scene with the same settings and different samples: those of other [numbers](crate::Options::numbers), or
/// of other regions. The order does not matter.
///
/// ```
/// use etendue::{Backend, Options, Scene};
///
/// let scene = Scene::builder()
///     .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [16, 12])
///     .diffuse("white", [0.8; 3])
///     .sphere([0.0, 0.5, 0.0], 0.5, "white")
///     .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
///     .build()?;
/// let part = |numbers| {
///     let options = Options { numbers: Some(numbers), backend: Backend::Cpu, ..Options::default() };
///     etendue::render(&scene, &options)
/// };
/// let picture = etendue::merge(vec![part(0..8)?, part(8..16)?])?;
/// assert_eq!(picture.samples()[0], 16);
/// # Ok::<(), etendue::Error>(())
/// ```
pub fn merge(pictures: Vec<Picture>) -> Result<Picture, Error> {
    let mut parts: Vec<_> = pictures.into_iter().map(Picture::into_parts).collect();
    parts.sort_by_key(|(film, _)| film.coverage.first());
    let refused = |why: String| Error::Input(format!("the pictures cannot be merged: {why}"));
    let mut parts = parts.into_iter();
    let Some((mut film, mut provenance)) = parts.next() else {
        return Err(refused("there are none".into()));
    };
    for (other, its) in parts {
        provenance.same_samples(&its).map_err(refused)?;
        film::merge::merge(&mut film, &other).map_err(|e| refused(e.to_string()))?;
        provenance.absorb(&its);
    }
    provenance.describe(&film);
    Ok(Picture::new(film, provenance, None, None))
}
