//! `--layers`: what is written beside a picture.

use super::args::PictureArgs;
use super::failure::Failure;
use super::progress::Progress;
use crate::film::coverage::Rect;
use crate::layers::{View, beside};
use crate::output::{ExrChannels, Extra, Format};
use std::path::PathBuf;

/// Refuses `--layers` where no picture could hold them.
pub fn check(args: &PictureArgs, outputs: &[PathBuf]) -> Result<(), Failure> {
    if args.layers.is_empty() {
        return Ok(());
    }
    let message = if args.exr != ExrChannels::All {
        "--layers can't be used with --exr rgb or rgb-half, which leave layers out"
    } else if !outputs
        .iter()
        .any(|p| Format::from_path(p) == Ok(Format::Exr))
    {
        "--layers needs a picture that can hold them: name an .exr file with --output"
    } else {
        return Ok(());
    };
    Err(Failure::Input(message.into()))
}

/// The layers that `args` asks for.
pub fn make(args: &PictureArgs, view: &View, bounds: Rect, progress: &mut Progress) -> Extra {
    let rows = bounds.height() as usize;
    beside(view, &args.layers, bounds, |done| {
        progress.step(done as usize, rows, "layers");
    })
}
