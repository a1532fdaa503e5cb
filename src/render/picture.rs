//! A finished picture with what is known of it.

use super::Error;
use crate::compare::{self, Comparison, Limits, compare};
use crate::film::error::RelativeError;
use crate::film::{Estimate, Film};
use crate::output::{Format, Pixels, WriteOptions, store, write_png};
use crate::provenance::Provenance;
use crate::run::StopReason;
use std::path::Path;

/// A picture, the error of each of its pixels, and where it comes from. Lists of pixels go row by row from the top left.
#[derive(Debug, Clone)]
pub struct Picture {
    film: Film,
    provenance: Provenance,
    ended: StopReason,
    note: Option<String>,
    pixels: Vec<[f32; 3]>,
    errors: Vec<[f32; 3]>,
    samples: Vec<u64>,
}

impl Picture {
    pub(super) fn new(
        film: Film,
        provenance: Provenance,
        ended: StopReason,
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

    /// What ended the rendering.
    pub fn ended(&self) -> StopReason {
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
            compare::Picture::from_film(name.into(), &p.film, &p.provenance).map_err(Error::Input)
        };
        let reference = to_compare("the reference", reference)?;
        let picture = to_compare("the picture", self)?;
        compare(&reference, &picture, &Limits::default()).map_err(|e| Error::Input(e.to_string()))
    }
}
