//! The command line of `etendue render`.

use super::{Backend, Talk};
use crate::cli::values;
use crate::film::BLOCK;
use crate::film::coverage::Rect;
use crate::render::MAX_SHADOW_RAYS;
use crate::scene::LARGEST_STRATA;
use crate::settings::{Integrator, LightParts, Overrides};
use clap::{Args, ValueEnum};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

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
      two parts, each bit-identical to the same pixels of the whole picture

Ctrl-C, SIGTERM and SIGHUP end a run after saving what there is: film, pictures and report. A second one ends it at once, and \
what was not saved yet is lost; a film is then as the last checkpoint left it. The .lock file that may stay beside it holds up \
nobody.

The relative error is null in the report, and not in headers, where a pixel has a single sample: nothing is known then. With \
strata² samples or fewer it is an upper estimate, by the samples' second moment; with more, the spread of independent \
replicates tells it.")]
pub struct RenderArgs {
    /// The scene file
    pub scene: PathBuf,

    /// Picture to write, .exr (32-bit float) or .png (8-bit); repeatable
    /// [default: STEM.exr and STEM.png in the working directory]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Exposure of PNG pictures, in stops; then the sRGB curve
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::exposure,
          allow_hyphen_values = true)]
    pub exposure: f64,
    /// Rewrite this .png every few seconds, for an image viewer to follow
    #[arg(long, value_name = "FILE.png")]
    pub watch: Option<PathBuf>,
    /// Write what happened as JSON; - is stdout
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the kernel made for this scene; - is stdout
    #[arg(long, value_name = "FILE")]
    pub dump_wgsl: Option<PathBuf>,

    /// Samples a pixel in all, what a film already holds included
    /// [default: 256 when nothing else ends the run]
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true, help_heading = "When to stop")]
    pub spp: Option<u64>,
    /// Rays for every stratum of a pixel: strata² x N samples a pixel
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true, help_heading = "When to stop")]
    pub rays: Option<u64>,
    /// Stop after this long rendering (90s, 2m, 1h30m), but not before every pixel has a sample
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true, help_heading = "When to stop")]
    pub time: Option<Duration>,
    /// Stop when the estimated relative error is at most this: 0.02 or 2%
    #[arg(long, value_name = "E", value_parser = values::relative_error, allow_hyphen_values = true, help_heading = "When to stop")]
    pub error: Option<f64>,
    #[arg(long, value_name = "A..B", value_parser = values::sample_range, allow_hyphen_values = true, help_heading = "When to stop",
          conflicts_with_all = ["spp", "rays", "time", "error"],
          help = format!("Just the samples numbered A to B-1, to share a picture among machines; slices that start \
                          and end on multiples of {BLOCK} merge to the single run within 1e-12, others within 1e-6"))]
    /// `--samples A..B`.
    pub samples: Option<Range<u64>>,

    /// Sample where the error is: --spp and --rays are then the mean over the pixels. Pilots, samples that are in no picture,
    /// decide where; they take an eighth of the time of 32 samples, a 32nd of that of 128, and less of more. A film made so is
    /// gone on with so
    #[arg(long, conflicts_with = "samples", help_heading = "What to render")]
    pub adaptive: bool,
    /// Width and height in pixels instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "What to render")]
    pub size: Option<[u32; 2]>,
    /// Only this half-open pixel rectangle; repeatable
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = values::rect, allow_hyphen_values = true, help_heading = "What to render")]
    pub region: Vec<Rect>,
    /// Which light to keep, by commas: emitted (scattered nowhere), direct (once), indirect (more often)
    #[arg(long, value_name = "LIST", value_parser = values::light, allow_hyphen_values = true, help_heading = "What to render")]
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
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, MAX_SHADOW_RAYS.into()), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub shadow_rays: Option<u32>,
    /// Path vertices after the eye, the one on the light included
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, u32::MAX.into()), allow_hyphen_values = true, help_heading = "What to render")]
    pub max_depth: Option<u32>,
    /// Cells a side into which a pixel is divided
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, LARGEST_STRATA.into()), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub strata: Option<u32>,
    /// Seed of every random number
    #[arg(long, value_name = "N", value_parser = values::seed(), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub seed: Option<u32>,

    /// What renders: any adapter (gpu), the f64 reference (cpu), or the best there is (auto)
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "What with")]
    pub backend: Backend,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "What with")]
    pub adapter: Option<String>,

    /// Progressive accumulation: create this film (.npz), or go on with it
    #[arg(long, value_name = "FILE", help_heading = "Films")]
    pub film: Option<PathBuf>,
    /// How often the film is saved meanwhile [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true, requires = "film", help_heading = "Films")]
    pub checkpoint: Option<Duration>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}

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
