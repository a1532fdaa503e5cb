//! Pictures to compare: EXR files, films, other files, and films in memory.

use crate::files::FileError;
use crate::film::Film;
use crate::output::store;
use crate::output::{Kind, Pixels, entries, read_exr, read_image, read_png};
use crate::provenance::Provenance;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// A picture and its noise, if known.
#[derive(Clone, PartialEq)]
pub struct Side {
    /// Where it is from, for messages.
    pub name: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB, row by row; 0 where nothing was rendered.
    pub rgb: Vec<[f64; 3]>,
    /// Whether a pixel was rendered.
    pub covered: Vec<bool>,
    /// Its noise, if known.
    pub noise: Option<Noise>,
    /// Whether its file ends at white: it holds no value above 1.
    pub clipped: bool,
    /// The metadata in its header, by key.
    pub origin: Vec<(String, String)>,
}

/// The noise that a picture states.
#[derive(Clone, PartialEq)]
pub struct Noise {
    /// Standard errors of R, G, B and of the luminance, row by row.
    pub error: Vec<[f64; 4]>,
    /// Whether only the luminance's is known. Those of R, G and B are 0 then.
    pub luminance_alone: bool,
    /// How often each pixel was measured.
    pub samples: Vec<u64>,
    /// What `samples` counts.
    pub unit: Unit,
    /// Independent replicates behind every error, at least 2.
    pub replicates: u32,
}

/// A short summary, without the pixels.
impl fmt::Debug for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Side")
            .field("name", &self.name)
            .field("size", &self.size)
            .field("noise", &self.noise)
            .finish_non_exhaustive()
    }
}

/// The same.
impl fmt::Debug for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Noise")
            .field("unit", &self.unit)
            .field("replicates", &self.replicates)
            .finish_non_exhaustive()
    }
}

/// A measurement of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// A sample of this program's, or of another program that states its variance.
    Sample,
    /// A whole picture; nobody knows of how many samples.
    Render,
}

impl Side {
    /// Reads a picture of any [`Kind`]. Only films and EXR files state their noise.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::read_sampled(path, None)
    }

    /// The same, where `samples` is the number of samples of a pixel. A picture that states variances, but does not say of how many
    /// samples they are, has known noise only with it.
    pub fn read_sampled(path: &Path, samples: Option<u64>) -> Result<Self, FileError> {
        match Kind::of(path)? {
            Kind::Exr => Self::from_exr(path, samples),
            Kind::Film => {
                let (film, provenance) = store::load(path)?;
                Self::from_film(path.display().to_string(), &film, &provenance)
                    .map_err(|why| FileError::content(path, why))
            }
            Kind::Png => Self::from_png(path),
            Kind::Other => Self::from_image(path),
        }
    }

    /// The header's value of `key`.
    pub fn origin(&self, key: &str) -> Option<&str> {
        let entry = self.origin.iter().find(|(k, _)| k == key)?;
        Some(&entry.1)
    }

    /// A film as a picture. The error says why it can't be compared.
    pub fn from_film(name: String, film: &Film, provenance: &Provenance) -> Result<Self, String> {
        let pixels = Pixels::new(film);
        let [width, height] = film.size;
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let estimates: Vec<_> = places
            .map(|(x, y)| pixels.at(x, y).unwrap_or_default())
            .collect();
        if let Some(i) = estimates
            .iter()
            .position(|e| !e.mean.iter().chain(&e.error).all(|v| v.is_finite()))
        {
            let (x, y) = (i as u32 % width, i as u32 / width);
            return Err(format!("pixel ({x}, {y}) is not finite"));
        }
        let mut provenance = provenance.clone();
        provenance.describe(film);
        let picture = Self {
            name,
            size: film.size,
            rgb: estimates.iter().map(|e| e.mean).collect(),
            covered: estimates.iter().map(|e| e.samples > 0).collect(),
            noise: (provenance.replicates >= 2).then(|| Noise {
                error: estimates.iter().map(|e| e.error).collect(),
                luminance_alone: false,
                samples: estimates.iter().map(|e| e.samples).collect(),
                unit: Unit::Sample,
                replicates: provenance.replicates,
            }),
            clipped: false,
            origin: entries(&provenance)
                .into_iter()
                .map(|(key, value)| (key.to_owned(), value.to_string()))
                .collect(),
        };
        picture.not_empty()
    }

    fn from_exr(path: &Path, samples: Option<u64>) -> Result<Self, FileError> {
        let exr = read_exr(path)?;
        let wrong = |why: String| FileError::content(path, why);
        let replicates = match exr.attributes.get("replicates") {
            Some(text) => text.parse::<u32>().map_err(|_| {
                wrong(format!(
                    "its header has the invalid value replicates = {text}"
                ))
            })?,
            None => 0,
        };
        let covered: Vec<bool> = match &exr.samples {
            Some(samples) => samples.iter().map(|&n| n > 0).collect(),
            // Where another renderer's rays meet nothing is no gap.
            None if exr.moments.is_some() => vec![true; exr.rgb.len()],
            None => exr.alpha.iter().map(|&a| a > 0.0).collect(),
        };
        if let Some(samples) = &exr.samples {
            check_samples(&exr.attributes, samples).map_err(wrong)?;
        }
        let noise = match (exr.error, exr.samples, exr.moments) {
            (Some(error), Some(samples), _) if replicates >= 2 => Some(Noise {
                error: error.iter().map(|e| e.map(f64::from)).collect(),
                luminance_alone: false,
                samples: samples.into_iter().map(u64::from).collect(),
                unit: Unit::Sample,
                replicates,
            }),
            (None, _, Some(moments)) => {
                // pbrt says how many, Mitsuba does not.
                let told = exr.attributes.get("samplesPerPixel");
                let told = told.and_then(|n| n.parse::<u64>().ok());
                samples.or(told).filter(|n| *n >= 2).map(|samples| Noise {
                    error: moments
                        .errors(samples)
                        .into_iter()
                        .map(|e| [0.0, 0.0, 0.0, e])
                        .collect(),
                    luminance_alone: true,
                    samples: vec![samples; exr.rgb.len()],
                    unit: Unit::Sample,
                    replicates: samples.try_into().unwrap_or(u32::MAX),
                })
            }
            _ => None,
        };
        let picture = Self {
            name: path.display().to_string(),
            size: exr.size,
            rgb: exr.rgb.iter().map(|p| p.map(f64::from)).collect(),
            covered,
            noise,
            clipped: false,
            origin: exr.attributes.into_iter().collect(),
        };
        picture.not_empty().map_err(wrong)
    }

    fn from_png(path: &Path) -> Result<Self, FileError> {
        let png = read_png(path)?;
        let picture = Self {
            name: path.display().to_string(),
            size: png.size,
            rgb: png.rgb,
            covered: png.covered,
            noise: None,
            clipped: true,
            origin: png.texts,
        };
        picture
            .not_empty()
            .map_err(|why| FileError::content(path, why))
    }

    fn from_image(path: &Path) -> Result<Self, FileError> {
        let image = read_image(path)?;
        let picture = Self {
            name: path.display().to_string(),
            size: image.size,
            rgb: image.rgb,
            covered: image.covered,
            noise: None,
            clipped: image.clipped,
            origin: Vec::new(),
        };
        picture
            .not_empty()
            .map_err(|why| FileError::content(path, why))
    }

    pub(super) fn not_empty(self) -> Result<Self, String> {
        if self.covered.contains(&true) {
            Ok(self)
        } else {
            Err("no pixel has samples, so there is nothing to compare".into())
        }
    }
}

/// Refuses a header whose number of samples is not that of the pixels that have any, on average.
fn check_samples(header: &BTreeMap<String, String>, samples: &[u32]) -> Result<(), String> {
    // Headers of other programs mean other things.
    let told = header
        .get("samples")
        .filter(|_| header.contains_key("scene_hash"));
    let Some(told) = told else {
        return Ok(());
    };
    let covered = samples.iter().filter(|n| **n > 0).count();
    let sum: f64 = samples.iter().map(|n| f64::from(*n)).sum();
    let mean = sum / covered.max(1) as f64;
    // A header has f32, and so have counts above 2^24.
    let is_mean = |told: f64| (told - mean).abs() <= 1e-6 * mean;
    if told.parse().is_ok_and(is_mean) {
        return Ok(());
    }
    Err(format!(
        "damaged: its header says samples = {told}, but its pixels have {mean} on average"
    ))
}
