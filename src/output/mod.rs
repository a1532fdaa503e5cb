//! Writes pictures, films, reports and other files.

mod exr;
mod exr_read;
mod metadata;
mod npz;
pub mod pixels;
mod png;
pub mod report;
pub mod store;

pub use exr::write_exr;
pub use exr_read::{Picture, read_exr};
pub(crate) use metadata::entries;
pub(crate) use pixels::Pixels;
pub use png::write_png;
pub use report::Report;

use crate::files::FileError;
use crate::film::Film;
use crate::provenance::Provenance;
use std::path::Path;

/// Picture formats, chosen by a file name's extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// `.exr`: 32-bit float, linear, with error layers.
    Exr,
    /// `.png`: 8-bit sRGB.
    Png,
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

    /// Writes `film` to `path` in this format; `exposure_stops` is for PNG only.
    pub fn write(
        self,
        path: &Path,
        film: &Film,
        provenance: &Provenance,
        exposure_stops: f64,
    ) -> Result<(), FileError> {
        match self {
            Self::Exr => write_exr(path, film, provenance),
            Self::Png => write_png(path, film, provenance, exposure_stops),
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
