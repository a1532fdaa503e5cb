//! Warnings of disks that have too little room for what a render writes at its end.

use super::args::RenderArgs;
use super::say;
use crate::files::room;
use crate::film::Film;
use crate::output::{Format, store};
use std::path::{Path, PathBuf};

/// Bytes that a rendered pixel may take in an EXR picture: nine channels of four bytes, which compression seldom makes more of. Pixels
/// that are not rendered compress to nothing.
const EXR_BYTES: u64 = 36;

/// The same in a PNG picture: three colours and whether there is a pixel.
const PNG_BYTES: u64 = 4;

/// A warning for every disk that has too little room for what is written to it at the end. Others may use it until then, and files are
/// written beside those that they replace.
pub(super) fn say_little(args: &RenderArgs, outputs: &[PathBuf], film: &Film, light_paths: bool) {
    let pixels = film.bounds.area();
    let films = args
        .film
        .iter()
        .map(|path| (path, store::pixel_bytes(light_paths)));
    let pictures = outputs.iter().map(|path| (path, picture_bytes(path)));
    for (path, of_pixel) in films.chain(pictures) {
        let needed = pixels * of_pixel;
        // Devices take anything.
        let is_file = std::fs::metadata(path).map_or(true, |m| m.is_file());
        if let Some(free) = room::free(path).filter(|free| is_file && *free < needed) {
            say!(
                "warning: {}: there is room for {:.1} MB, and it may take {:.1} MB at the end",
                path.display(),
                free as f64 / 1e6,
                needed as f64 / 1e6
            );
        }
    }
}

/// Bytes that a rendered pixel may take in the picture at `path`.
fn picture_bytes(path: &Path) -> u64 {
    match Format::from_path(path) {
        Ok(Format::Png) => PNG_BYTES,
        Ok(Format::Exr) | Err(_) => EXR_BYTES,
    }
}
