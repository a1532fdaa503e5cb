//! `etendue develop`: pictures from a film.

use super::args::DevelopArgs;
use super::failure::Failure;
use super::say;
use crate::film::store;
use crate::output::{Format, atomic};

/// Writes each picture as `render` would have.
pub fn develop(args: &DevelopArgs) -> Result<(), Failure> {
    let formats: Vec<Format> = args
        .output
        .iter()
        .map(|path| Format::from_path(path).map_err(Failure::Input))
        .collect::<Result<_, _>>()?;
    for path in &args.output {
        atomic::check_writable(path)?;
    }
    let (film, provenance) = store::load(&args.film)?;
    for (format, path) in formats.iter().zip(&args.output) {
        format.write(path, &film, &provenance, args.exposure)?;
        if !args.quiet {
            say!("wrote {}", path.display());
        }
    }
    Ok(())
}
