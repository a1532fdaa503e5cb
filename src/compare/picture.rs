//! Pictures to compare: EXR files, films, PNG files, and films in memory.

use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use crate::film::Film;
use crate::output::store;
use crate::output::{Pixels, entries, read_exr};
use crate::provenance::Provenance;
use std::io::{BufReader, Read as _};
use std::path::Path;

/// A picture and its noise, if known.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
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
    /// The metadata in its header, by key.
    pub origin: Vec<(String, String)>,
}

/// The noise that a picture states.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard errors of R, G, B and of the luminance, row by row.
    pub error: Vec<[f64; 4]>,
    /// Samples of each pixel.
    pub samples: Vec<u64>,
    /// Independent replicates behind every error, at least 2.
    pub replicates: u32,
}

impl Picture {
    /// Reads a picture by its extension: `.exr`, `.npz` (a film) or `.png`, which has no error layers. Under another name it may
    /// be one of these still, by its first bytes.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let mut file = open(path)?;
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let kind = match extension.as_deref() {
            Some("exr") => Some(FileKind::Exr),
            Some("npz") => Some(FileKind::Zip),
            Some("png") => Some(FileKind::Png),
            _ => {
                let mut start = [0; 4];
                let read = file.read_exact(&mut start);
                FileKind::of(&start).filter(|_| read.is_ok())
            }
        };
        match kind {
            Some(FileKind::Exr) => Self::from_exr(path),
            Some(FileKind::Zip) => {
                let (film, provenance) = store::load(path)?;
                Self::from_film(path.display().to_string(), &film, &provenance)
                    .map_err(|why| FileError::content(path, why))
            }
            Some(FileKind::Png) => {
                let wanted = Some(FileKind::Png);
                Self::from_png(path).map_err(|e| kind::explain(e, "a PNG picture", wanted))
            }
            _ => {
                let why = "not a picture that can be compared (.exr, .png, or .npz film)";
                let error = FileError::content(path, why);
                Err(kind::explain(error, "a picture or a film", None))
            }
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
                samples: estimates.iter().map(|e| e.samples).collect(),
                replicates: provenance.replicates,
            }),
            origin: entries(&provenance)
                .into_iter()
                .map(|(key, value)| (key.to_owned(), value.to_string()))
                .collect(),
        };
        picture.not_empty()
    }

    fn from_exr(path: &Path) -> Result<Self, FileError> {
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
            None => exr.alpha.iter().map(|&a| a > 0.0).collect(),
        };
        let noise = match (exr.error, exr.samples) {
            (Some(error), Some(samples)) if replicates >= 2 => Some(Noise {
                error: error.iter().map(|e| e.map(f64::from)).collect(),
                samples: samples.into_iter().map(u64::from).collect(),
                replicates,
            }),
            _ => None,
        };
        let picture = Self {
            name: path.display().to_string(),
            size: exr.size,
            rgb: exr.rgb.iter().map(|p| p.map(f64::from)).collect(),
            covered,
            noise,
            origin: exr.attributes.into_iter().collect(),
        };
        picture.not_empty().map_err(wrong)
    }

    /// 8 or 16 bits per channel; grey is taken for R = G = B, and alpha says only what is covered.
    fn from_png(path: &Path) -> Result<Self, FileError> {
        let wrong = |e: png::DecodingError| match e {
            png::DecodingError::IoError(e) => FileError::reading(path, &e),
            other => FileError::content(path, format!("invalid PNG: {other}")),
        };
        let mut decoder = png::Decoder::new(BufReader::new(open(path)?));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(wrong)?;
        let bytes = reader
            .output_buffer_size()
            .ok_or_else(|| FileError::content(path, "the picture is too large"))?;
        let mut data = vec![0; bytes];
        let info = reader.next_frame(&mut data).map_err(wrong)?;
        reader.finish().map_err(wrong)?;
        let channels = info.color_type.samples();
        let pixels = data[..info.buffer_size()].chunks_exact(channels);
        let text = &reader.info().uncompressed_latin1_text;
        let utf8 = &reader.info().utf8_text;
        let picture = Self {
            name: path.display().to_string(),
            size: [info.width, info.height],
            rgb: pixels
                .clone()
                .map(|p| match channels {
                    1 | 2 => [p[0]; 3],
                    _ => [p[0], p[1], p[2]],
                })
                .map(|p| p.map(decode_srgb))
                .collect(),
            covered: pixels
                .map(|p| !matches!(channels, 2 | 4) || p[channels - 1] > 0)
                .collect(),
            noise: None,
            origin: text
                .iter()
                .map(|t| (t.keyword.clone(), t.text.clone()))
                .chain(
                    utf8.iter()
                        .filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?))),
                )
                .collect(),
        };
        picture
            .not_empty()
            .map_err(|why| FileError::content(path, why))
    }

    fn not_empty(self) -> Result<Self, String> {
        if self.covered.contains(&true) {
            Ok(self)
        } else {
            Err("no pixel has samples, so there is nothing to compare".into())
        }
    }
}

/// Linear value of an sRGB level: IEC 61966-2-1, both pieces of its curve.
fn decode_srgb(level: u8) -> f64 {
    let v = f64::from(level) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}
