//! `--layers`: what is written beside a picture.

use super::args::PictureArgs;
use super::failure::Failure;
use super::progress::Progress;
use crate::film::coverage::Rect;
use crate::layers::{Layer, View, planes};
use crate::output::{ExrChannels, Extra, Format, Value};
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

/// Adds the layers that `args` asks for.
pub fn add(
    extra: &mut Extra,
    args: &PictureArgs,
    view: &View,
    bounds: Rect,
    progress: &mut Progress,
) {
    let mut layers: Vec<Layer> = args.layers.clone();
    layers.sort_unstable();
    layers.dedup();
    if layers.is_empty() {
        return;
    }
    let rows = bounds.height() as usize;
    let made = planes(view, &layers, bounds, |done| {
        progress.step(done as usize, rows, "layers");
    });
    extra.channels.extend(made);
    if layers.contains(&Layer::Material) {
        // A list of strings can always be written.
        let names = serde_json::to_string(view.names()).unwrap_or_default();
        extra.entries.push(("material_names", Value::Text(names)));
    }
}
