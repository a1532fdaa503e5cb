//! Writes pictures, films, reports and other files.

mod exr;
mod exr_read;
mod exr_stated;
mod image_read;
mod metadata;
mod npz;
pub mod pixels;
mod png;
mod png_read;
pub mod report;
pub mod store;

pub use exr::{CHANNELS, Extra, channel_values, write_exr, write_exr_rgb, write_exr_with};
pub use exr_read::{ExrHeader, ExrLayer, Picture, read_exr, read_exr_header, read_exr_layers};
pub use exr_stated::Moments;
pub use image_read::{Image, read_image};
#[cfg(feature = "cli")]
pub(crate) use metadata::NUMBERS;
pub use metadata::Value;
pub(crate) use metadata::entries;
pub(crate) use pixels::Pixels;
pub use png::{write_png, write_png_of};
pub use png_read::{PngHeader, read_png, read_png_header};
pub use report::{DenoisedReport, Report};

use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use crate::film::Film;
use crate::provenance::Provenance;
use std::io::Read as _;
use std::path::Path;

/// Picture formats, chosen by a file name's extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// `.exr`: 32-bit float, linear, with error layers.
    Exr,
    /// `.png`: 8-bit sRGB.
    Png,
}

/// The kinds of files that hold pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `.npz`.
    Film,
    /// `.exr`.
    Exr,
    /// `.png`.
    Png,
    /// `.hdr`, `.jpg`, `.tif`, `.webp`, which are read only.
    Other,
}

impl Kind {
    /// The kind of a file by its extension, in any case. Under another name it may be one of these still, by its first bytes.
    pub fn of(path: &Path) -> Result<Self, FileError> {
        let mut file = open(path)?;
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => return Ok(Self::Exr),
            Some("npz") => return Ok(Self::Film),
            Some("png") => return Ok(Self::Png),
            Some("hdr" | "jpg" | "jpeg" | "tif" | "tiff" | "webp") => return Ok(Self::Other),
            _ => {}
        }
        let mut start = [0; 12];
        let read = file.read_exact(&mut start);
        match FileKind::of(&start).filter(|_| read.is_ok()) {
            Some(FileKind::Zip) => Ok(Self::Film),
            Some(FileKind::Exr) => Ok(Self::Exr),
            Some(FileKind::Png) => Ok(Self::Png),
            Some(kind) if kind.is_other_picture() => Ok(Self::Other),
            _ => {
                let why = "not a picture that etendue reads (.exr, .png, .hdr, .jpg, .tif, .webp, or .npz film)";
                let error = FileError::content(path, why);
                Err(kind::explain(error, "a picture or a film", None))
            }
        }
    }
}

/// Which channels an EXR file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum ExrChannels {
    /// R, G, B, A, and the layers of errors and samples, as 32-bit floats.
    #[default]
    All,
    /// R, G and B as 32-bit floats.
    Rgb,
    /// R, G and B as 16-bit floats.
    RgbHalf,
}

/// How pictures are written.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WriteOptions {
    /// Brightens a PNG by this many powers of two.
    pub exposure_stops: f64,
    /// What an EXR file holds.
    pub exr: ExrChannels,
}

impl Format {
    /// The format that the extension of `path` names, in any case. The error states the rule.
    pub fn from_path(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some(other) => Err(format!(
                "{}: unknown picture format \".{other}\"; use .exr or .png",
                path.display()
            )),
            None => Err(format!(
                "{}: the name of a picture must end in .exr or .png",
                path.display()
            )),
        }
    }

    /// Writes `film` to `path` in this format.
    pub fn write(
        self,
        path: &Path,
        film: &Film,
        provenance: &Provenance,
        options: &WriteOptions,
    ) -> Result<(), FileError> {
        self.write_with(path, film, provenance, options, &Extra::default())
    }

    /// The same with other channels beside, where the format has room for them.
    pub fn write_with(
        self,
        path: &Path,
        film: &Film,
        provenance: &Provenance,
        options: &WriteOptions,
        extra: &Extra,
    ) -> Result<(), FileError> {
        match self {
            Self::Exr => write_exr_with(path, film, provenance, options.exr, extra),
            Self::Png => write_png(path, film, provenance, options.exposure_stops),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_by_extension_in_any_case() {
        let of = |name: &str| Format::from_path(Path::new(name));
        assert_eq!(of("a/b.EXR"), Ok(Format::Exr));
        assert_eq!(of("x.tiff.Png"), Ok(Format::Png));
        let wrong = of("x.tiff").unwrap_err();
        assert!(
            wrong.contains("\".tiff\"") && wrong.contains("use .exr or .png"),
            "{wrong}"
        );
        for none in ["x", ".exr", "exr", "a.exr/"] {
            // The last is a path whose name has the extension, like "a.exr".
            assert_eq!(of(none).is_ok(), none == "a.exr/", "{none}");
        }
    }
}
