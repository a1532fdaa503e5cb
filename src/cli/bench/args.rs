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
Each engine renders pictures with 1, 2, 4, ... samples per pixel, each with several seeds and each from the first sample. \
The engines take turns. Every picture is compared with a reference picture, whose own noise is subtracted from the squared \
errors. A spread (±) is the standard deviation of a single seed. Efficiency is 1 / (MSE x seconds); the seconds include \
reading back, but not compiling and warming up. Compare efficiencies only within one run. The cached reference depends on \
the scene, the engine and its kernel: to compare two kernels, give both runs the same --reference.

Examples:
  etendue bench scenes/three_materials.toml
  etendue bench scenes/*.toml --engine gpu-baked,gpu-buffers --time 1m --plot speed.svg --plot speed.png
  etendue bench scene.toml --reference long.npz --seeds 8 --json results.jsonl
  etendue bench --report-table --time 10m
  etendue bench --scaling --plot scaling.svg --json scaling.jsonl

Exit status: 0 success; 2 bad command line or invalid input; 3 no usable adapter, or the device failed; 4 a file can't be \
read or written; 130, 143 or 129 interrupted, after printing the results so far.")]
pub struct BenchArgs {
    /// Scene files
    #[arg(
        value_name = "SCENE",
        required_unless_present_any = ["report_table", "scaling"],
        conflicts_with_all = ["report_table", "scaling"]
    )]
    pub scenes: Vec<PathBuf>,
    /// Engines, separated by commas or repeated: gpu-baked (scene values as constants in the kernel), gpu-buffers (in
    /// buffers), gpu-tree (in a bounding-volume tree), cpu (the f64 reference), cpu-brute (the reference without light
    /// sampling). Ratios are relative to the first [default: the one that render would choose, and cpu unless
    /// --report-table is given; with --scaling gpu-baked,gpu-buffers,gpu-tree]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = engine)]
    pub engine: Vec<EngineKind>,
    /// Rendering time for each engine and scene (with --scaling: and series), over all its pictures. Pictures with one
    /// sample per pixel are always rendered [default: 20s, with --report-table 4m]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true)]
    pub time: Option<Duration>,
    /// Pictures per sample count, each with a different seed
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true)]
    pub seeds: u32,
    /// Most samples per pixel, even if time is left
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = values::samples, allow_hyphen_values = true)]
    pub max_spp: u64,
    /// Reproduce Figure 9 of the report instead: seconds for 1, 32, 128 and 256 rays per pixel-sample, for indirect light,
    /// direct light, both with several lights, and three materials
    #[arg(long, conflicts_with_all = ["reference", "plot"])]
    pub report_table: bool,
    /// Measure seconds per path against the number of spheres on a floor, of spheres in a cloud and of lights (1, 2, 4, ...)
    /// instead, and find the number from which a tree is faster than testing each one. An engine stops at the number where compiling takes seconds or its
    /// --time is used up
    #[arg(long, conflicts_with_all = ["report_table", "reference", "reference_spp", "cache", "seeds"])]
    pub scaling: bool,
    /// Most spheres, and most lights, for --scaling
    #[arg(long, value_name = "N", default_value_t = 100_000, conflicts_with_all = ["scenes", "report_table"],
          value_parser = values::whole::<u32>(1, 5_000_000), allow_hyphen_values = true)]
    pub up_to: u32,

    /// Compare with this picture, an .exr or a film of the same scene, instead of rendering a reference
    #[arg(long, value_name = "FILE", help_heading = "Reference")]
    pub reference: Option<PathBuf>,
    /// Samples per pixel of the reference, which the first engine other than cpu-brute renders
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = values::samples, allow_hyphen_values = true,
          conflicts_with = "reference", help_heading = "Reference")]
    pub reference_spp: u64,
    /// Folder where references are cached [default: etendue in the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Reference")]
    pub cache: Option<PathBuf>,

    /// Write the results as JSON lines. With - they go to stdout, and the tables go to stderr
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub json: Option<PathBuf>,
    /// Print all columns: MSE as claimed, relative and trimmed, FLIP, and full names of devices. Without it tables fit 100
    /// characters
    #[arg(long, conflicts_with_all = ["report_table", "scaling"], help_heading = "Output")]
    pub wide: bool,
    /// Plot error against seconds (with --scaling: seconds per path against number), .svg or .png. Repeatable
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub plot: Vec<PathBuf>,

    /// Width and height in pixels instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "What to render")]
    pub size: Option<[u32; 2]>,
    /// Which light to keep, separated by commas: emitted, direct, indirect [default: all]
    #[arg(long, value_name = "LIST", value_parser = values::light, allow_hyphen_values = true, conflicts_with = "report_table",
          help_heading = "What to render")]
    pub light: Option<LightParts>,
    /// Light samples per path vertex, over all lights together [default: chosen from the scene]
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub shadow_rays: Option<u32>,
    /// Divide each pixel into N x N strata
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 1024), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub strata: Option<u32>,
    /// First seed; the others follow it
    #[arg(long, value_name = "N", value_parser = values::seed(), allow_hyphen_values = true,
          help_heading = "What to render")]
    pub seed: Option<u32>,
    /// Use the adapter whose name contains NAME (ignoring case)
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "Device")]
    pub adapter: Option<String>,

    /// How much to print.
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
        format!("unknown engine; the engines are: {all}")
    })
}
