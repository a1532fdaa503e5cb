//! Files that are made of a picture when someone asks for them.

use super::snapshot::Snapshot;
use crate::files::FileError;
use crate::output::{Format, WriteOptions, store};
use std::fs::File;

/// A file's name without what a header or a file system may take amiss.
pub fn plain_name(name: &str) -> String {
    let plain = |c: char| match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '-' | '_' | '.' => c,
        _ => '_',
    };
    name.chars().map(plain).collect()
}

/// A file that is made of a snapshot.
#[derive(Clone, Copy)]
pub enum Download {
    /// Linear, with all layers.
    Exr,
    /// With so many stops of exposure.
    Png(f64),
    /// The film as it stands, to resume from.
    Film,
}

impl Download {
    /// How its name ends.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png(_) => "png",
            Self::Film => "npz",
        }
    }

    /// Its media type.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Exr => "image/x-exr",
            Self::Png(_) => "image/png",
            Self::Film => "application/zip",
        }
    }

    /// The file, which has no name any more, and its length.
    pub fn file(self, snapshot: &Snapshot) -> Result<(File, u64), FileError> {
        let failed =
            |e: std::io::Error| FileError::io("temporary file".as_ref(), "cannot write", &e);
        let dir = tempfile::tempdir().map_err(failed)?;
        let path = dir.path().join(format!("picture.{}", self.extension()));
        let (film, provenance) = (snapshot.film(), snapshot.provenance());
        match self {
            Self::Film => store::save(&path, film, &provenance)?,
            Self::Exr => Format::Exr.write(&path, film, &provenance, &WriteOptions::default())?,
            Self::Png(exposure_stops) => {
                let options = WriteOptions {
                    exposure_stops,
                    ..WriteOptions::default()
                };
                Format::Png.write(&path, film, &provenance, &options)?;
            }
        }
        let file = File::open(&path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        Ok((file, length))
    }
}
