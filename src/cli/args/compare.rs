//! The command lines of `etendue compare` and `etendue regress`.

use super::{Backend, Talk};
use crate::cli::values;
use crate::compare::DEFAULT_ALPHA;
use crate::layers::Layer;
use clap::Args;
use std::path::PathBuf;

/// `etendue compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Pictures with error layers (films, and EXR files written by etendue) need no threshold: the test compares them up to their \
noise, and --alpha is its false-alarm rate. Other pictures need a limit (--max-flip or --max-relative-rmse); noise then \
counts as a difference. Several independent renders of each side state their noise by their spread. Pictures of Mitsuba's \
integrator `moment` and of pbrt's film `gbuffer` state the variance of their luminance.

Examples:
  etendue compare before.exr after.exr
  etendue compare before.exr after.npz --html report.html
  etendue compare before.png after.png --max-flip 0.05
  etendue compare --a old1.exr old2.exr old3.exr old4.exr --b new1.exr new2.exr new3.exr new4.exr
      four renders of each side, with four seeds, by any program
  etendue compare ours.npz --b new1.exr new2.exr new3.exr new4.exr
      a picture that states its noise, and four renders that do not
  etendue compare ours.npz moments.exr --spp-b 256
      a picture of Mitsuba's integrator `moment`, of 256 samples a pixel

Exit status: 0 equal, 1 different, 2 not comparable, 4 a file can't be read or written.")]
pub struct CompareArgs {
    /// Reference picture: .exr, .png, .npz (a film); or .hdr, .jpg, .tif, .webp
    #[arg(required_unless_present = "renders_a", conflicts_with = "renders_a")]
    pub a: Option<PathBuf>,
    /// Picture to compare with it
    #[arg(required_unless_present_any = ["renders_a", "renders_b"], conflicts_with_all = ["renders_a", "renders_b"])]
    pub b: Option<PathBuf>,
    /// Independent renders of the reference, by any program: their spread is its noise
    #[arg(long = "a", id = "renders_a", value_name = "FILE", num_args = 1.., requires = "renders_b")]
    pub renders_a: Vec<PathBuf>,
    /// Independent renders to compare with it
    #[arg(long = "b", id = "renders_b", value_name = "FILE", num_args = 1..)]
    pub renders_b: Vec<PathBuf>,
    /// Samples per pixel of the reference, if it states variances without saying so
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true)]
    pub spp_a: Option<u64>,
    /// Samples per pixel of the other picture, likewise
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true)]
    pub spp_b: Option<u64>,
    /// Probability that two pictures of the same scene are reported as different
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability,
          allow_hyphen_values = true)]
    pub alpha: f64,
    /// Largest mean FLIP allowed, 0 to 1
    #[arg(long, value_name = "X", value_parser = values::share, allow_hyphen_values = true)]
    pub max_flip: Option<f64>,
    /// Largest relative RMSE allowed, such as 0.02 or 2%
    #[arg(long, value_name = "X", value_parser = values::limit, allow_hyphen_values = true)]
    pub max_relative_rmse: Option<f64>,
    /// Compare these layers of two EXR files too, separated by commas: they must be equal but for rounding (see docs/layers.md). Without
    /// it layers are ignored
    #[arg(long, value_delimiter = ',', value_name = "LIST", requires = "b")]
    pub layers: Vec<String>,
    /// Write an HTML page with both pictures, their difference and all numbers
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write the verdict and all numbers as JSON. With - they go to stdout, and the text goes to stderr
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}

/// `etendue regress`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each scene DIR/NAME.toml is rendered with the settings and sample count of its golden picture DIR/golden/NAME.exr, but with \
a different seed. The two are compared as by `etendue compare`. A scene that differs leaves golden/NAME.actual.npz and \
golden/NAME.report.html.

--bless leaves goldens alone that still pass, unless --size, --power, --max-spp or --layers asks for others. --review and --accept change only goldens of scenes that fail, are new, or were changed.

Examples:
  etendue regress scenes --bless
  etendue regress scenes --review
  etendue regress scenes --accept downloaded
      the films of a failed run in CI become the goldens
  etendue regress scenes --junit results.xml --html results.html
  etendue regress scenes --filter glass
  etendue regress scenes --bless --layers id,depth
      goldens that hold what is seen where, too

Exit status: 0 all passed; 1 one failed, or a scene or its golden is missing; 2 one can't be compared (the scene has errors, \
or its golden is damaged or of another scene), or there is nothing to compare; 3 no usable adapter, or the device failed; 4 the \
folder, a scene or a golden can't be read, or a golden or the results can't be written; 130, 143 or 129 interrupted, after telling the results so far.")]
pub struct RegressArgs {
    /// Folder with the scenes
    pub dir: PathBuf,
    /// Create the goldens, and re-create those that no longer pass
    #[arg(long, group = "making")]
    pub bless: bool,
    /// Show what changed, old beside new, and ask before each golden is created or re-created
    #[arg(long, group = "making")]
    pub review: bool,
    /// Make goldens of the films NAME.actual.npz that a failed run left in the folder RESULTS or below it, without rendering
    #[arg(long, value_name = "RESULTS", conflicts_with_all = ["making", "junit", "html", "summary"])]
    pub accept: Option<PathBuf>,
    /// Run only scenes whose name contains TEXT
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Run only the scene of this name. Repeatable
    #[arg(long, value_name = "NAME", conflicts_with = "filter")]
    pub scene: Vec<String>,
    /// Number of scenes rendered at the same time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::whole::<u16>(1, 256),
          allow_hyphen_values = true)]
    pub jobs: u16,
    /// Probability that an unchanged scene is reported as failed
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability,
          allow_hyphen_values = true)]
    pub alpha: f64,
    /// Compare these layers of the goldens too, separated by commas: they must be equal but for rounding (see docs/layers.md). With
    /// --bless, --review or --accept, goldens get them. Without it layers are ignored
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub layers: Vec<Layer>,
    /// Write the results as JUnit XML. With - they go to stdout, and the list goes to stderr
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write an HTML page with all results
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write the results as Markdown, such as to $GITHUB_STEP_SUMMARY
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,

    /// Smallest change of the whole picture's brightness to detect with 95 % probability. Sets the number of samples [default: 1%]
    #[arg(long, value_name = "X", value_parser = values::change, allow_hyphen_values = true,
          requires = "making", help_heading = "With --bless or --review")]
    pub power: Option<f64>,
    /// Most samples per pixel. At least 2 strata² are taken, so that the error can be estimated [default: 4096]
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true,
          requires = "making", help_heading = "With --bless or --review")]
    pub max_spp: Option<u64>,
    /// Width and height in pixels [default: the scene's, scaled to 64 wide]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, requires = "making",
          help_heading = "With --bless or --review")]
    pub size: Option<[u32; 2]>,

    /// What to render on: gpu is any adapter, cpu the f64 reference, auto the best available
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "Device")]
    pub backend: Backend,
    /// Use the adapter whose name contains NAME (ignoring case)
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "Device")]
    pub adapter: Option<String>,

    /// How much to print.
    #[command(flatten)]
    pub talk: Talk,
}
