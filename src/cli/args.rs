//! The command line as clap reads it.

mod compare;
mod films;
mod render;
mod watch;

pub use compare::{CompareArgs, RegressArgs};
pub use films::{DevelopArgs, InfoArgs, MergeArgs};
pub use render::RenderArgs;
pub use watch::{PlotArgs, WatchArgs};

use super::bench::args::BenchArgs;
use super::values;
use crate::layers::Layer;
use crate::output::{ExrChannels, WriteOptions};
use crate::scene::generate::MOST_IN_TABLES;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// A GPU path tracer for analytic scenes that reports the error of every picture
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  etendue render scenes/three_materials.toml
  etendue check scenes/*.toml
  etendue adapters
  etendue selftest

Exit status: 0 success; 1 pictures differ or a test failed; 2 bad command line or invalid input; 3 no usable adapter, or the \
device failed; 4 a file can't be read or written; 130, 143 or 129 interrupted (Ctrl-C, SIGTERM, SIGHUP), after saving the \
results so far.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// One of the program's commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to pictures
    Render(Box<RenderArgs>),
    /// Check scene files for errors and likely mistakes
    Check(CheckArgs),
    /// Convert a film to pictures
    Develop(DevelopArgs),
    /// Show what a film or a picture says of itself
    Info(InfoArgs),
    /// Merge films of the same scene into one
    Merge(MergeArgs),
    /// Test this adapter on hard cases with known answers
    Selftest(SelftestArgs),
    /// Test whether two pictures are equal up to noise
    Compare(CompareArgs),
    /// Render every scene in a folder and compare it with its golden picture
    Regress(RegressArgs),
    /// Generate a scene with many spheres or many lights
    MakeScene(MakeSceneArgs),
    /// Write a scene for another renderer: Mitsuba 3 or pbrt-v4
    Export(ExportArgs),
    /// Measure error against rendering time
    Bench(Box<BenchArgs>),
    /// Serve a page on which films grow that other processes write
    Watch(WatchArgs),
    /// Draw the relative error of runs against time, from their logs
    Plot(PlotArgs),
    /// List the adapters, the default one, and why the others are not used
    #[command(after_help = "\
Examples:
  etendue adapters
  etendue render scene.toml --adapter llvmpipe
      render on the adapter whose name contains llvmpipe")]
    Adapters,
    /// Print the JSON Schema of scene files
    #[command(after_help = "\
Example:
  etendue schema > scene.schema.json
      gives a TOML editor completion and error checking")]
    Schema,
    /// Print the completion script of a shell
    Completions(CompletionsArgs),
    /// Write the man pages
    Man(ManArgs),
}

impl Command {
    /// How much it prints, if it is a long one.
    pub fn talk(&self) -> Option<Talk> {
        match self {
            Self::Render(args) => Some(args.talk),
            Self::Develop(args) => Some(args.talk),
            Self::Merge(args) => Some(args.talk),
            Self::Selftest(args) => Some(args.talk),
            Self::Compare(args) => Some(args.talk),
            Self::Regress(args) => Some(args.talk),
            Self::Bench(args) => Some(args.talk),
            _ => None,
        }
    }
}

/// How much a long command prints.
#[derive(Debug, Clone, Copy, Args)]
pub struct Talk {
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
    /// How to show progress: auto is a bar on a terminal and lines elsewhere, plain is always lines, json is JSON lines for programs
    /// (see docs/watch.md), none is nothing. A line comes every 5 seconds at first, later every minute
    #[arg(long, value_enum, default_value_t = ProgressStyle::Auto, value_name = "STYLE")]
    pub progress: ProgressStyle,
    /// Threads for the CPU reference or a software adapter [default: as many cores as the process may use]
    #[arg(long, value_name = "N", value_parser = values::whole::<u16>(1, 4096), allow_hyphen_values = true)]
    pub threads: Option<u16>,
}

/// How a command writes pictures.
#[derive(Debug, Clone, Args)]
pub struct PictureArgs {
    /// Exposure of PNG pictures in stops, applied before the sRGB curve
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::exposure,
          allow_hyphen_values = true)]
    pub exposure: f64,
    /// Channels of EXR pictures: all of them, with errors and samples, or R, G and B alone, for programs that don't know layers
    #[arg(long, value_enum, default_value_t = ExrChannels::All, value_name = "CHANNELS")]
    pub exr: ExrChannels,
    /// Layers to write into EXR pictures, separated by commas: what the eye meets first in each pixel (see docs/layers.md)
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub layers: Vec<Layer>,
}

/// Whether a command denoises.
#[derive(Debug, Clone, Args)]
pub struct DenoiseArgs {
    /// Denoise with Open Image Denoise, and say how wrong the denoised picture is. It becomes layers of EXR pictures, and with each
    /// NAME.png there is a NAME.denoised.png; all else stays the unbiased picture
    #[arg(long)]
    pub denoise: bool,
    /// The library of Open Image Denoise, or its folder [default: ETENDUE_OIDN, else where it is usually, such as in the Python
    /// package pyoidn]
    #[arg(long, value_name = "PATH", requires = "denoise")]
    pub oidn: Option<PathBuf>,
}

impl PictureArgs {
    /// The same for the writers.
    pub fn options(&self) -> WriteOptions {
        WriteOptions {
            exposure_stops: self.exposure,
            exr: self.exr,
        }
    }
}

/// `etendue make-scene`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue make-scene spheres --count 1000
      writes spheres.toml, and the spheres themselves to spheres.csv
  etendue make-scene particles --count 500000
      writes particles.toml, and the atoms to particles.xyz
  etendue make-scene lights --count 100 -o hall.toml")]
pub struct MakeSceneArgs {
    /// Which objects the scene has many of, or a volume
    #[arg(value_enum)]
    pub kind: SceneKind,
    /// How many of them; of a volume, the points along each side, 8 to 1024
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 5_000_000), allow_hyphen_values = true)]
    pub count: u32,
    /// Seed of the generator: each gives a different scene of the same kind
    #[arg(long, value_name = "S", default_value_t = 0, value_parser = values::seed(), allow_hyphen_values = true)]
    pub seed: u32,
    #[arg(help = format!("Scene file to write [default: the kind's name and .toml]. More than {MOST_IN_TABLES} objects go to a \
                          .csv file beside it, particles to an .xyz file, and a volume to an .npy file"))]
    /// `--output`.
    #[arg(short, long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Replace files that exist with other contents
    #[arg(long)]
    pub force: bool,
    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `etendue export`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue export scene.toml --to mitsuba -o scene.xml
  etendue export scene.toml --to pbrt -o scene.pbrt --spp 1024

What the other renderer has no equal for becomes what comes nearest, and a warning says what differs. Planes end where nothing of \
them is seen.")]
pub struct ExportArgs {
    /// Scene file
    pub scene: PathBuf,
    /// The renderer
    #[arg(long, value_enum, value_name = "RENDERER")]
    pub to: ExportTarget,
    /// File to write. With - it goes to stdout
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = values::whole::<u64>(1, 1 << 31), allow_hyphen_values = true)]
    pub spp: u64,
    /// Width and height in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true)]
    pub size: Option<[u32; 2]>,
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `--to` of `etendue export`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportTarget {
    /// Mitsuba 3, for its RGB variants.
    Mitsuba,
    /// pbrt-v4.
    Pbrt,
}

/// What `etendue make-scene` makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SceneKind {
    /// Spheres on a floor, placed like the seeds of a sunflower.
    Spheres,
    /// Equal spheres at random in a box over a floor.
    Cloud,
    /// A ball of atoms, in an extended XYZ file.
    Particles,
    /// Lamps in a hall of columns.
    Lights,
    /// Isosurfaces of a volume.
    Volume,
}

/// `--progress`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressStyle {
    /// A bar on a terminal, lines elsewhere.
    Auto,
    /// A line now and then.
    Plain,
    /// Every line of stderr is a JSON object.
    Json,
    /// Nothing.
    None,
}

pub use crate::render::Backend;

/// `etendue check`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  etendue check scenes/*.toml")]
pub struct CheckArgs {
    /// Scene files
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
}

/// `etendue completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue completions bash > ~/.local/share/bash-completion/completions/etendue
  etendue completions zsh > ~/.zfunc/_etendue
      for a ~/.zshrc with: fpath+=~/.zfunc; autoload -U compinit; compinit
  etendue completions fish > ~/.config/fish/completions/etendue.fish")]
pub struct CompletionsArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}

/// `etendue man`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue man ~/.local/share/man/man1
      then: man etendue-render
  etendue man | man -l -")]
pub struct ManArgs {
    /// Folder for etendue.1, etendue-render.1 and so on, made if it does not exist. Without it, etendue.1 goes to stdout
    pub dir: Option<PathBuf>,
}

/// `etendue selftest`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue selftest
  etendue selftest --filter dome
  etendue selftest --backend cpu --markdown > hard-cases.md

Exit status: 0 if every case passed, 1 if one failed.")]
pub struct SelftestArgs {
    /// Run only cases whose row, name or description contains TEXT (ignoring case)
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Print a Markdown table
    #[arg(long)]
    pub markdown: bool,
    /// What to test: gpu is any adapter, cpu the f64 reference, auto what `etendue render` would choose
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME")]
    pub backend: Backend,
    /// Use the adapter whose name contains NAME (ignoring case)
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name)]
    pub adapter: Option<String>,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}
