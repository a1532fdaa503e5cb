//! The command lines of `etendue develop`, `etendue info` and `etendue merge`.

use super::{PictureArgs, Talk};
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
    /// How pictures are written.
    #[command(flatten)]
    pub pictures: PictureArgs,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}

/// `etendue info`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue info long.npz
  etendue info picture.exr --json

A film is read whole and checked. The keys are those of the headers of EXR and PNG files.")]
pub struct InfoArgs {
    /// Film (.npz) or picture (.exr or .png)
    pub file: PathBuf,
    /// Print JSON; of a film it has the text of the scene file too
    #[arg(long)]
    pub json: bool,
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
