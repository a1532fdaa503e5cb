//! What the flags of pictures ask for: `--exposure`, `--exr`, and `--layers`, which are written beside a picture.

use super::args::PictureArgs;
use super::failure::Failure;
use super::progress::Progress;
use crate::film::coverage::Rect;
use crate::layers::{View, beside};
use crate::output::{ExrChannels, Extra, Format};
use std::path::{Path, PathBuf};

/// Refuses flags that no picture would follow. `watched` is a picture that is rewritten during a render.
pub fn check(
    args: &PictureArgs,
    outputs: &[PathBuf],
    watched: Option<&Path>,
) -> Result<(), Failure> {
    let written = || outputs.iter().map(PathBuf::as_path).chain(watched);
    let has = |format| written().any(|path| Format::from_path(path) == Ok(format));
    let message = if !args.layers.is_empty() && args.exr != ExrChannels::All {
        "--layers can't be used with --exr rgb or rgb-half, which leave layers out"
    } else if !args.layers.is_empty() && !has(Format::Exr) {
        "--layers needs a picture that can hold them: name an .exr file with --output"
    } else if args.exr != ExrChannels::All && !has(Format::Exr) {
        "--exr is about EXR pictures, and none is written: name an .exr file with --output"
    } else if args.exposure != 0.0 && !has(Format::Png) {
        "--exposure is about PNG pictures, and none is written: name a .png file with --output"
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
