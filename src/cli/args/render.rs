//! The command line of `etendue render`.

use super::{Backend, DenoiseArgs, PictureArgs, Talk};
use crate::cli::values;
use crate::film::BLOCK;
use crate::film::coverage::Rect;
use crate::render::MAX_SHADOW_RAYS;
use crate::scene::LARGEST_STRATA;
use crate::settings::{Integrator, LightParts, Overrides};
use crate::watch::Address;
use clap::{Args, ValueEnum};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// Heading of the stop conditions.
const STOP: &str = "When to stop (the first condition met ends the run)";

/// `etendue render`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  etendue render scenes/three_materials.toml
      writes three_materials.exr and three_materials.png at 256 samples per pixel
  etendue render scene.toml --error 2% --time 10m -o picture.exr
      stops at a relative error of 2 %, or after ten minutes
  etendue render scene.toml --film long.npz --spp 10000
      can be interrupted at any time: the same command resumes it
  etendue render scene.toml --samples 0..512 --film a.npz
  etendue render scene.toml --samples 512..1024 --film b.npz
      splits a picture across two machines; then: etendue merge whole.npz a.npz b.npz
  etendue render scene.toml --error 1% --listen 127.0.0.1:8080 --log scene.jsonl
      serves a page on which the picture grows; then: etendue plot scene.jsonl -o curve.svg
  etendue render scene.toml --region 0,0,64,64 --region 100,80,164,144
      renders two regions, bit-identical to the same pixels of the whole picture

Ctrl-C, SIGTERM and SIGHUP stop a run and save its results so far: film, pictures and report. A second signal stops it at \
once: anything not saved yet is lost, and the film stays as of the last checkpoint. A leftover .lock file beside the film is \
harmless.

The relative error is unknown while a pixel has only one sample: it is then null in the report and missing from headers. With \
up to strata² samples per pixel it is an upper estimate, from the second moment of the samples. With more it is estimated \
from the spread of independent replicates.")]
pub struct RenderArgs {
    /// Scene file
    pub scene: PathBuf,

    /// Picture to write, .exr (32-bit float) or .png (8-bit). Repeatable
    /// [default: STEM.exr and STEM.png in the working directory]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// How pictures are written.
    #[command(flatten)]
    pub pictures: PictureArgs,
    /// Whether it denoises.
    #[command(flatten)]
    pub denoise: DenoiseArgs,
    /// Rewrite this .png every few seconds, for an image viewer that reloads it
    #[arg(long, value_name = "FILE.png")]
    pub watch: Option<PathBuf>,
    /// Serve a page on which the picture grows, such as 127.0.0.1:8080; port 0 is any free one. Everyone who can reach the address can
    /// see it
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::address)]
    pub listen: Option<Address>,
    /// With --listen: answer requests for this host too, as a reverse proxy passes them on. Repeatable
    #[arg(long, value_name = "NAME", requires = "listen")]
    pub host: Vec<String>,
    /// Send the picture and its layers to tev, the image viewer, as they grow
    #[arg(long, value_name = "HOST:PORT", value_parser = values::address)]
    pub tev: Option<Address>,
    /// Keep the progress in this file, as JSON lines: see etendue plot. The log of a film that is resumed goes on
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// Write a run summary as JSON, to stdout with -
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the WGSL kernel generated for this scene, to stdout with -
    #[arg(long, value_name = "FILE")]
    pub dump_wgsl: Option<PathBuf>,

    /// Total samples per pixel, including those already in the film
    /// [default: 256 if no other stop condition is given; on the CPU reference also --time 30s]
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true, help_heading = STOP)]
    pub spp: Option<u64>,
    /// Rays per pixel-sample, as in the report: strata² x N samples per pixel
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true, help_heading = STOP)]
    pub rays: Option<u64>,
    /// Stop after this rendering time (90s, 2m, 1h30m), but not before every pixel has a sample
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true, help_heading = STOP)]
    pub time: Option<Duration>,
    /// Stop when the relative error plus twice its uncertainty is at most E, such as 0.02 or 2%
    #[arg(long, value_name = "E", value_parser = values::relative_error, allow_hyphen_values = true, help_heading = STOP)]
    pub error: Option<f64>,
    #[arg(long, value_name = "A..B", value_parser = values::sample_range, allow_hyphen_values = true, help_heading = STOP,
          conflicts_with_all = ["spp", "rays", "time", "error"],
          help = format!("Take only samples A to B-1, to split a picture across machines. Merged films equal a single run to \
                          1e-12 if A and B are multiples of {BLOCK}, else to 1e-6"))]
    /// `--samples A..B`.
    pub samples: Option<Range<u64>>,

    /// Take more samples where the error is larger. --spp and --rays then set the mean over the pixels. Pilot samples, which
    /// are not part of the picture, measure the error; they cost 1/8 of the time at 32 samples per pixel, 1/32 at 128. They
    /// pay where noise is uneven, as beside caustics. An adaptive film is resumed adaptively
    #[arg(long, conflicts_with = "samples", help_heading = "What to render")]
    pub adaptive: bool,
    /// Width and height in pixels instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "What to render")]
    pub size: Option<[u32; 2]>,
    /// Render only this pixel rectangle; X1 and Y1 are exclusive. Repeatable
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = values::rect, allow_hyphen_values = true, help_heading = "What to render")]
    pub region: Vec<Rect>,
    /// Which light to keep, separated by commas: emitted (not scattered), direct (scattered once), indirect (scattered twice or more) [default: all]
    #[arg(long, value_name = "LIST", value_parser = values::light, allow_hyphen_values = true, help_heading = "What to render")]
    pub light: Option<LightParts>,
    /// path is full path tracing; whitted follows mirrors and glass, with only direct light on other surfaces [default: path]
    #[arg(long, value_enum, value_name = "NAME", help_heading = "What to render")]
    pub integrator: Option<IntegratorName>,
    /// Whether light that comes by way of mirrors and glass is also traced from the lights [default: auto, where the scene has a use for it]
    #[arg(
        long,
        value_enum,
        value_name = "auto|off",
        help_heading = "What to render"
    )]
    pub light_paths: Option<Switch>,
    /// Light samples per path vertex, over all lights together [default: chosen from the scene]
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, MAX_SHADOW_RAYS.into()), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub shadow_rays: Option<u32>,
    /// Most path vertices after the eye, including the one on the light
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, u32::MAX.into()), allow_hyphen_values = true, help_heading = "What to render")]
    pub max_depth: Option<u32>,
    /// Divide each pixel into N x N strata
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, LARGEST_STRATA.into()), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub strata: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", value_parser = values::seed(), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub seed: Option<u32>,

    /// What to render on: gpu is any adapter, cpu the f64 reference, auto the best available
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "Device")]
    pub backend: Backend,
    /// Use the adapter whose name contains NAME (ignoring case)
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "Device")]
    pub adapter: Option<String>,

    /// Accumulate samples in this film (.npz): create it, or resume it with its own settings if it exists
    #[arg(long, value_name = "FILE", help_heading = "Films")]
    pub film: Option<PathBuf>,
    /// How often to save the film during the run [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true, requires = "film", help_heading = "Films")]
    pub checkpoint: Option<Duration>,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}

/// `--light-paths`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Traced where the scene has a use for them.
    Auto,
    /// Not traced.
    Off,
}

/// `--integrator`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IntegratorName {
    /// The full rendering equation.
    Path,
    /// Follows mirrors and glass, with only direct light on other surfaces.
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
            integrator: self.integrator.map(|name| match name {
                IntegratorName::Path => Integrator::Path,
                IntegratorName::Whitted => Integrator::Whitted,
            }),
            light_paths: self.light_paths.map(|switch| switch == Switch::Auto),
        }
    }
}
