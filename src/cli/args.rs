//! The command line as clap reads it.

mod compare;
mod films;
mod render;

pub use compare::{CompareArgs, RegressArgs};
pub use films::{DevelopArgs, MergeArgs};
pub use render::RenderArgs;

use super::bench::args::BenchArgs;
use super::values;
use crate::scene::generate::MOST_IN_TABLES;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// A path tracer for analytic scenes that says how wrong every picture still is.
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  etendue render scenes/three_materials.toml
  etendue check scenes/*.toml
  etendue adapters
  etendue selftest

Exit status: 0 done, passed or the same; 1 failed or different; 2 bad command line or input; 3 no adapter or it failed; \
4 a file can't be read or written; 130, 143 or 129 interrupted (Ctrl-C, SIGTERM, SIGHUP), after saving what there is.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// One of the program's commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene file into pictures
    Render(Box<RenderArgs>),
    /// Read scene files and say what is wrong or suspect in them
    Check(CheckArgs),
    /// Make pictures from a film
    Develop(DevelopArgs),
    /// Add films of the same scene
    Merge(MergeArgs),
    /// Run the hard cases, whose answers are known, on this adapter
    Selftest(SelftestArgs),
    /// Say whether two pictures are the same up to their noise
    Compare(CompareArgs),
    /// Render every scene of a folder and compare it with its golden picture
    Regress(RegressArgs),
    /// Write a scene of many spheres or many lights
    MakeScene(MakeSceneArgs),
    /// Measure speed against error
    Bench(Box<BenchArgs>),
    /// List the adapters, which one would be taken, and why not the others
    #[command(after_help = "\
Examples:
  etendue adapters
  etendue render scene.toml --adapter llvmpipe
      on the adapter whose name contains that")]
    Adapters,
    /// Print the JSON Schema of scene files
    #[command(after_help = "\
Example:
  etendue schema > scene.schema.json
      for a TOML editor: completion, and most errors while typing")]
    Schema,
}

/// How much a long command says.
#[derive(Debug, Clone, Copy, Args)]
pub struct Talk {
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub quiet: bool,
    /// How to show progress: a bar on a terminal and a line every few seconds elsewhere (auto), always lines
    /// (plain), or nothing (none)
    #[arg(long, value_enum, default_value_t = ProgressStyle::Auto, value_name = "STYLE")]
    pub progress: ProgressStyle,
    /// Threads of the CPU reference and of a software adapter [default: one for each core]
    #[arg(long, value_name = "N", value_parser = values::whole::<u16>(1, 4096), allow_hyphen_values = true)]
    pub threads: Option<u16>,
}

/// `etendue make-scene`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue make-scene spheres --count 1000
      spheres.toml, with the spheres in spheres.csv
  etendue make-scene lights --count 100 -o hall.toml")]
pub struct MakeSceneArgs {
    /// What there are many of
    #[arg(value_enum)]
    pub kind: SceneKind,
    /// How many
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 5_000_000), allow_hyphen_values = true)]
    pub count: u32,
    /// Another one of the same kind
    #[arg(long, value_name = "S", default_value_t = 0, value_parser = values::seed(), allow_hyphen_values = true)]
    pub seed: u32,
    #[arg(help = format!("The scene file [default: spheres.toml or lights.toml]. More than {MOST_IN_TABLES} things go into a \
                          file of rows beside it, which has the ending .csv"))]
    /// `--output`.
    #[arg(short, long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
}

/// What `etendue make-scene` makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SceneKind {
    /// Spheres on a floor, in the order of a sunflower's seeds.
    Spheres,
    /// Lamps in a hall of columns.
    Lights,
}

/// `--progress`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressStyle {
    /// A bar on a terminal, lines elsewhere.
    Auto,
    /// A line every few seconds.
    Plain,
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

/// `etendue selftest`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue selftest
  etendue selftest --filter dome
  etendue selftest --backend cpu --markdown > hard-cases.md

Exit status 1: a case failed.")]
pub struct SelftestArgs {
    /// Only the cases whose row, name or description contains TEXT, in any case
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Print a Markdown table
    #[arg(long)]
    pub markdown: bool,
    /// What is tested: any adapter (gpu), the f64 reference (cpu), or what a render would take (auto)
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME")]
    pub backend: Backend,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name)]
    pub adapter: Option<String>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}
