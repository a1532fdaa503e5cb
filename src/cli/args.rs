//! The command line as clap reads it.

use super::bench::args::BenchArgs;
use super::values;
use crate::compare::DEFAULT_ALPHA;
use crate::film::BLOCK;
use crate::film::coverage::Rect;
use crate::settings::{Integrator, LightParts, Overrides};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// A path tracer for analytic scenes that says how wrong every picture still is.
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  etendue render scenes/three_materials.toml
  etendue check scenes/*.toml
  etendue adapters
  etendue selftest

Exit status: 0 done, passed or the same, 1 failed or different, 2 bad command line or input, 3 no adapter or it failed, 4 a file can't be read or
written, 130 or 143 interrupted after saving what there is.")]
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
    Adapters,
    /// Print the JSON Schema of scene files
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
    /// Threads of the CPU reference and of work on films; default one for each core
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=5_000_000))]
    pub count: u32,
    /// Another one of the same kind
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u32,
    /// The scene file [default: spheres.toml or lights.toml]; rows go beside it, with the ending .csv
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

/// `--backend`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// A real GPU, else a software adapter, else the CPU reference.
    Auto,
    /// Any adapter.
    Gpu,
    /// The f64 reference.
    Cpu,
}

/// `etendue render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue render scenes/three_materials.toml
      three_materials.exr and three_materials.png at 256 samples a pixel
  etendue render scene.toml --error 2% --time 10m -o picture.exr
      until the error is 2 %, but no longer than ten minutes
  etendue render scene.toml --film long.npz --spp 10000
      leave it, kill it, and go on with the same command
  etendue render scene.toml --samples 0..512 --film a.npz
  etendue render scene.toml --samples 512..1024 --film b.npz
      on two machines; then: etendue merge whole.npz a.npz b.npz
  etendue render scene.toml --region 0,0,64,64 --region 100,80,164,144
      two parts, each bit-identical to the same pixels of the whole picture")]
pub struct RenderArgs {
    /// The scene file
    pub scene: PathBuf,

    /// Picture to write, .exr (32-bit float) or .png (8-bit); repeatable
    /// [default: STEM.exr and STEM.png in the working directory]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Exposure of PNG pictures, in stops; then the sRGB curve
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::exposure,
          allow_negative_numbers = true)]
    pub exposure: f64,
    /// Rewrite this .png every few seconds, for an image viewer to follow
    #[arg(long, value_name = "FILE.png")]
    pub watch: Option<PathBuf>,
    /// Write what happened as JSON; - is stdout
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the kernel made for this scene
    #[arg(long, value_name = "FILE")]
    pub dump_wgsl: Option<PathBuf>,

    /// Samples a pixel in all, what a film already holds included
    /// [default: 256 when nothing else ends the run]
    #[arg(long, value_name = "N", value_parser = values::samples, help_heading = "When to stop")]
    pub spp: Option<u64>,
    /// Rays for every stratum of a pixel: strata² x N samples a pixel
    #[arg(long, value_name = "N", value_parser = values::samples, help_heading = "When to stop")]
    pub rays: Option<u64>,
    /// Stop after this long rendering (90s, 2m, 1h30m), but not before every pixel has a sample
    #[arg(long, value_name = "TIME", value_parser = values::duration, help_heading = "When to stop")]
    pub time: Option<Duration>,
    /// Stop when the estimated relative error is at most this: 0.02 or 2%
    #[arg(long, value_name = "E", value_parser = values::relative_error, help_heading = "When to stop")]
    pub error: Option<f64>,
    #[arg(long, value_name = "A..B", value_parser = values::sample_range, help_heading = "When to stop",
          conflicts_with_all = ["spp", "rays", "time", "error"],
          help = format!("Just the samples numbered A to B-1, to share a picture among machines; slices that start \
                          and end on multiples of {BLOCK} merge to the single run within 1e-12, others within 1e-6"))]
    /// `--samples A..B`.
    pub samples: Option<Range<u64>>,

    /// Sample where the error is: --spp and --rays are then the mean over the pixels. Pilots, samples that are in no picture,
    /// decide where; they take a tenth of the time of short runs, and less of long ones. A film made so is gone on with so
    #[arg(long, conflicts_with = "samples", help_heading = "What to render")]
    pub adaptive: bool,
    /// Width and height in pixels instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "What to render")]
    pub size: Option<[u32; 2]>,
    /// Only this half-open pixel rectangle; repeatable
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = values::rect, help_heading = "What to render")]
    pub region: Vec<Rect>,
    /// Which light to keep, by commas: emitted (scattered nowhere), direct (once), indirect (more often)
    #[arg(long, value_name = "LIST", value_parser = values::light, help_heading = "What to render")]
    pub light: Option<LightParts>,
    /// How light travels; whitted: mirrors and glass are followed, other surfaces take direct light only
    #[arg(
        long,
        value_enum,
        default_value = "path",
        value_name = "NAME",
        help_heading = "What to render"
    )]
    pub integrator: IntegratorName,
    /// Light samples at every vertex, over all lights together [default: chosen from the scene]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
          help_heading = "What to render")]
    pub shadow_rays: Option<u32>,
    /// Path vertices after the eye, the one on the light included
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "What to render")]
    pub max_depth: Option<u32>,
    /// Cells a side into which a pixel is divided
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_STRATA),
          help_heading = "What to render")]
    pub strata: Option<u32>,
    /// Seed of every random number
    #[arg(long, value_name = "N", help_heading = "What to render")]
    pub seed: Option<u32>,

    /// What renders: any adapter (gpu), the f64 reference (cpu), or the best there is (auto)
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "What with")]
    pub backend: Backend,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", help_heading = "What with")]
    pub adapter: Option<String>,

    /// Progressive accumulation: create this film (.npz), or go on with it
    #[arg(long, value_name = "FILE", help_heading = "Films")]
    pub film: Option<PathBuf>,
    /// How often the film is saved meanwhile [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, requires = "film", help_heading = "Films")]
    pub checkpoint: Option<Duration>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}

/// The most strata a side: a round then has 2^20 samples.
const MAX_STRATA: i64 = 1024;

/// `--integrator`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IntegratorName {
    /// The whole of the rendering equation.
    Path,
    /// Mirrors and glass are followed, other surfaces take direct light only.
    Whitted,
}

impl RenderArgs {
    /// The flags that override the scene's own settings.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            max_depth: self.max_depth,
            strata: self.strata,
            seed: self.seed,
            shadow_rays: self.shadow_rays,
            light: self.light,
            integrator: Some(match self.integrator {
                IntegratorName::Path => Integrator::Path,
                IntegratorName::Whitted => Integrator::Whitted,
            }),
        }
    }
}

/// `etendue check`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  etendue check scenes/*.toml")]
pub struct CheckArgs {
    /// Scene files
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
}

/// `etendue develop`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  etendue develop long.npz -o picture.exr -o bright.png --exposure 1"
)]
pub struct DevelopArgs {
    /// The film
    pub film: PathBuf,
    /// Picture to write, .exr or .png; repeatable
    #[arg(short, long, required = true, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Exposure of PNG pictures, in stops; then the sRGB curve
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::exposure,
          allow_negative_numbers = true)]
    pub exposure: f64,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub quiet: bool,
}

/// `etendue merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  etendue merge whole.npz first.npz second.npz
  etendue develop whole.npz -o whole.exr")]
pub struct MergeArgs {
    /// The film to write; it must not exist yet
    pub out: PathBuf,
    /// The films to add
    #[arg(required = true, value_name = "FILM")]
    pub films: Vec<PathBuf>,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub quiet: bool,
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
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}

/// `etendue compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Pictures with error layers (EXR files and films that etendue made) need no threshold: --alpha is the rate at which
pictures of the same scene are called different. Others are held against the limits that you give; noise then counts
as a difference.

Examples:
  etendue compare before.exr after.exr
  etendue compare before.exr after.npz --html report.html
  etendue compare before.png after.png --max-flip 0.05

Exit status: 0 the same, 1 different, 2 not comparable.")]
pub struct CompareArgs {
    /// The reference: .exr, .npz (a film) or .png
    pub a: PathBuf,
    /// What is held against it
    pub b: PathBuf,
    /// False-alarm rate over the whole picture
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability)]
    pub alpha: f64,
    /// The most that the mean FLIP may be, 0 to 1
    #[arg(long, value_name = "X", value_parser = values::limit)]
    pub max_flip: Option<f64>,
    /// The most that the relative RMSE may be: 0.02 or 2%
    #[arg(long, value_name = "X", value_parser = values::limit)]
    pub max_relative_rmse: Option<f64>,
    /// Write one page with both pictures, their difference and all numbers
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// `etendue regress`.
#[derive(Debug, Args)]
#[command(after_help = "\
DIR/NAME.toml is rendered with the settings and samples of DIR/golden/NAME.exr, but another seed, and compared as
`etendue compare` does. What differs leaves golden/NAME.actual.npz and golden/NAME.report.html.

Examples:
  etendue regress scenes --bless
  etendue regress scenes --junit results.xml --html results.html
  etendue regress scenes --filter glass

Exit status: 0 all passed; 1 one failed, has no golden, or no scene; 2 one can't be compared (a scene with errors, a
damaged golden, one of another scene), or there is nothing to compare.")]
pub struct RegressArgs {
    /// The folder with the scenes
    pub dir: PathBuf,
    /// Make the goldens anew
    #[arg(long)]
    pub bless: bool,
    /// Only what has TEXT in its name
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Scenes at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub jobs: u16,
    /// False-alarm rate over each picture
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability)]
    pub alpha: f64,
    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write a page with all results
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Say nothing before the list at the end
    #[arg(long)]
    pub quiet: bool,

    /// Change of all light that is to be seen with 95 % probability; decides the samples
    #[arg(long, value_name = "X", default_value = "1%", value_parser = values::relative_error,
          help_heading = "With --bless")]
    pub power: f64,
    /// The most samples a pixel
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = values::samples, help_heading = "With --bless")]
    pub max_spp: u64,
    /// Width and height in pixels [default: the scene's, made 64 wide]
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "With --bless")]
    pub size: Option<[u32; 2]>,

    /// What renders: any adapter (gpu), the f64 reference (cpu), or the best there is (auto)
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "What with")]
    pub backend: Backend,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", help_heading = "What with")]
    pub adapter: Option<String>,
    /// Threads of the CPU reference; default one for each core
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096), help_heading = "What with")]
    pub threads: Option<u16>,
}
