//! The command lines of `etendue develop` and `etendue merge`.

use super::Talk;
use crate::cli::values;
use clap::Args;
use std::path::PathBuf;

/// `etendue develop`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  etendue develop long.npz -o picture.exr -o bright.png --exposure 1"
)]
pub struct DevelopArgs {
    /// Film to read
    pub film: PathBuf,
    /// Picture to write, .exr or .png. Repeatable
    #[arg(short, long, required = true, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Exposure of PNG pictures in stops, applied before the sRGB curve
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::exposure,
          allow_hyphen_values = true)]
    pub exposure: f64,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}

/// `etendue merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue merge whole.npz first.npz second.npz
  etendue develop whole.npz -o whole.exr")]
pub struct MergeArgs {
    /// Film to write. It must not exist yet
    pub out: PathBuf,
    /// Films to merge
    #[arg(required = true, value_name = "FILM")]
    pub films: Vec<PathBuf>,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}
