//! The command lines of `etendue develop`, `etendue info` and `etendue merge`.

use super::{DenoiseArgs, PictureArgs, Talk};
use crate::denoise::folder::Form;
use clap::Args;
use std::path::PathBuf;

/// `etendue develop`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue develop long.npz -o picture.exr -o bright.png --exposure 1
  etendue develop long.npz -o picture.exr --layers albedo,normal,id
  etendue develop long.npz -o picture.exr -o picture.png --denoise
      writes picture.denoised.png too, and says how wrong it is
  etendue develop long.npz --folds halves
  etendue develop long.npz --denoised halves -o picture.exr
      the same for any denoiser, which makes halves/denoised01.pfm of halves/half01.pfm, and so on for six")]
pub struct DevelopArgs {
    /// Film to read
    pub film: PathBuf,
    /// Picture to write, .exr or .png. Repeatable
    #[arg(short, long, required_unless_present = "folds", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// With layers or denoising: the film's scene file, if the film lies elsewhere and its scene names other files (rows, volumes)
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// How pictures are written.
    #[command(flatten)]
    pub pictures: PictureArgs,
    /// Whether it denoises.
    #[command(flatten)]
    pub denoise: DenoiseArgs,
    /// Write what a denoiser needs to this folder: six half-pictures with lamps filled, half01 to half23, and noise-free features
    #[arg(long, value_name = "DIR")]
    pub folds: Option<PathBuf>,
    /// Format of the pictures in that folder
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = Form::Pfm, requires = "folds")]
    pub folds_as: Form,
    /// Take what a denoiser has made of them, denoised01 to denoised23 (.pfm or .exr), and say how wrong it is
    #[arg(long, value_name = "DIR", conflicts_with_all = ["denoise", "folds"])]
    pub denoised: Option<PathBuf>,
    /// Write how wrong the denoised picture is as JSON, to stdout with -
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,

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
