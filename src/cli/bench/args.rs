//! The command line of `etendue bench`.

use crate::bench::EngineKind;
use crate::cli::args::Talk;
use crate::cli::values;
use crate::settings::{LightParts, Overrides};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// `etendue bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
Every engine makes pictures of 1, 2, 4, ... samples a pixel, each with several seeds and each begun anew; engines take \
turns. All are held against a reference picture, whose own noise is subtracted from squared errors. A spread (±) is the \
standard deviation of a single seed. Efficiency is 1 / (MSE x seconds), reading back included, compiling and warming up \
not; compare it within one run alone. The reference's file depends on the scene and on all it is made with, the kernel \
too: to compare kernels, give both the same --reference.

Examples:
  etendue bench scenes/three_materials.toml
  etendue bench scenes/*.toml --engine gpu-baked,gpu-buffers --time 1m --plot speed.svg --plot speed.png
  etendue bench scene.toml --reference long.npz --seeds 8 --json results.jsonl
  etendue bench --report-table --time 10m
  etendue bench --scaling --plot scaling.svg --json scaling.jsonl

Exit status: 0 measured; 2 bad command line or input; 3 no adapter or it failed; 4 a file can't be read or written; \
130, 143 or 129 interrupted, after showing what was measured.")]
pub struct BenchArgs {
    /// Scene files
    #[arg(
        value_name = "SCENE",
        required_unless_present_any = ["report_table", "scaling"],
        conflicts_with_all = ["report_table", "scaling"]
    )]
    pub scenes: Vec<PathBuf>,
    /// Engines, by commas or repeated: gpu-baked (scene values in the kernel's text), gpu-buffers, gpu-tree, cpu (the f64
    /// reference), cpu-brute (the same without light sampling); ratios are to the first
    /// [default: what render would take, and without --report-table cpu; with --scaling gpu-baked,gpu-buffers,gpu-tree]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = engine)]
    pub engine: Vec<EngineKind>,
    /// Rendering time of each engine and scene (with --scaling, series), over all its pictures; its pictures of one sample
    /// are made whatever they take [default: 20s, with --report-table 4m]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true)]
    pub time: Option<Duration>,
    /// Pictures of each sample count, each with another seed
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true)]
    pub seeds: u32,
    /// The most samples a pixel, however much time is left
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = values::samples, allow_hyphen_values = true)]
    pub max_spp: u64,
    /// The report's Figure 9 instead: seconds for 1, 32, 128 and 256 rays per pixel-sample of indirect light, direct
    /// light, both with several lights, and three materials
    #[arg(long, conflicts_with_all = ["reference", "plot"])]
    pub report_table: bool,
    /// Seconds a path against the number of spheres and of lights instead, 1, 2, 4, ..., and the number from which a tree
    /// costs less than a look at each. An engine goes no further when its compiler takes seconds or its --time is over
    #[arg(long, conflicts_with_all = ["report_table", "reference", "reference_spp", "cache", "seeds"])]
    pub scaling: bool,
    /// The most spheres, and lights, of --scaling
    #[arg(long, value_name = "N", default_value_t = 100_000, conflicts_with_all = ["scenes", "report_table"],
          value_parser = values::whole::<u32>(1, 5_000_000), allow_hyphen_values = true)]
    pub up_to: u32,

    /// Hold pictures against this one, an .exr or a film of the same scene, instead of making one
    #[arg(long, value_name = "FILE", help_heading = "Reference")]
    pub reference: Option<PathBuf>,
    /// Samples a pixel of a reference that is made, by the first engine that is not cpu-brute
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = values::samples, allow_hyphen_values = true,
          conflicts_with = "reference", help_heading = "Reference")]
    pub reference_spp: u64,
    /// Where references are kept [default: etendue in the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Reference")]
    pub cache: Option<PathBuf>,

    /// Write what was measured as JSON lines; - is stdout, and the tables then go to stderr
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub json: Option<PathBuf>,
    /// Draw error against seconds (with --scaling, seconds a path against number), .svg or .png; repeatable
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub plot: Vec<PathBuf>,

    /// Width and height in pixels instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "What to render")]
    pub size: Option<[u32; 2]>,
    /// Which light to keep, by commas: emitted, direct, indirect
    #[arg(long, value_name = "LIST", value_parser = values::light, allow_hyphen_values = true, conflicts_with = "report_table",
          help_heading = "What to render")]
    pub light: Option<LightParts>,
    /// Light samples at every vertex, over all lights together [default: chosen from the scene]
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub shadow_rays: Option<u32>,
    /// Cells a side into which a pixel is divided
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub strata: Option<u32>,
    /// The first of the seeds
    #[arg(long, value_name = "N", value_parser = values::seed(), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub seed: Option<u32>,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "What with")]
    pub adapter: Option<String>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}

impl BenchArgs {
    /// The flags that override the scene's own settings.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            strata: self.strata,
            seed: self.seed,
            shadow_rays: self.shadow_rays,
            light: self.light,
            ..Overrides::default()
        }
    }
}

fn engine(name: &str) -> Result<EngineKind, String> {
    EngineKind::from_name(name.trim()).ok_or_else(|| {
        let all = EngineKind::ALL.map(EngineKind::name).join(", ");
        format!("no engine of that name; there are: {all}")
    })
}
