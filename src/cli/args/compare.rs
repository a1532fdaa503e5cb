//! The command lines of `etendue compare` and `etendue regress`.

use super::{Backend, Talk};
use crate::cli::values;
use crate::compare::DEFAULT_ALPHA;
use clap::Args;
use std::path::PathBuf;

/// `etendue compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Pictures with error layers (EXR files and films that etendue made) need no threshold: --alpha is the rate at which \
pictures of the same scene are called different. Others are held against the limits that you give; noise then counts \
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
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability,
          allow_hyphen_values = true)]
    pub alpha: f64,
    /// The most that the mean FLIP may be, 0 to 1
    #[arg(long, value_name = "X", value_parser = values::share, allow_hyphen_values = true)]
    pub max_flip: Option<f64>,
    /// The most that the relative RMSE may be: 0.02 or 2%
    #[arg(long, value_name = "X", value_parser = values::limit, allow_hyphen_values = true)]
    pub max_relative_rmse: Option<f64>,
    /// Write one page with both pictures, their difference and all numbers
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}

/// `etendue regress`.
#[derive(Debug, Args)]
#[command(after_help = "\
DIR/NAME.toml is rendered with the settings and samples of DIR/golden/NAME.exr, but another seed, and compared as \
`etendue compare` does. What differs leaves golden/NAME.actual.npz and golden/NAME.report.html.

Examples:
  etendue regress scenes --bless
  etendue regress scenes --junit results.xml --html results.html
  etendue regress scenes --filter glass

Exit status: 0 all passed; 1 one failed, has no golden, or no scene; 2 one can't be compared (a scene with errors, a \
damaged golden, one of another scene), or there is nothing to compare; 3 no adapter or it failed.")]
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
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::whole::<u16>(1, 256),
          allow_hyphen_values = true)]
    pub jobs: u16,
    /// False-alarm rate over each picture
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, value_parser = values::probability,
          allow_hyphen_values = true)]
    pub alpha: f64,
    /// Write the results as JUnit XML; - is stdout, and the list then goes to stderr
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write a page with all results
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,

    /// Change of all light that is to be seen with 95 % probability; decides the samples
    #[arg(long, value_name = "X", default_value = "1%", value_parser = values::change, allow_hyphen_values = true,
          requires = "bless", help_heading = "With --bless")]
    pub power: f64,
    /// The most samples a pixel; 2 strata² at least, for their error must be known
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = values::samples, allow_hyphen_values = true,
          requires = "bless", help_heading = "With --bless")]
    pub max_spp: u64,
    /// Width and height in pixels [default: the scene's, made 64 wide]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, requires = "bless",
          help_heading = "With --bless")]
    pub size: Option<[u32; 2]>,

    /// What renders: any adapter (gpu), the f64 reference (cpu), or the best there is (auto)
    #[arg(long, value_enum, default_value_t = Backend::Auto, value_name = "NAME", help_heading = "What with")]
    pub backend: Backend,
    /// The adapter whose name contains NAME, in any case
    #[arg(long, value_name = "NAME", value_parser = values::part_of_name, help_heading = "What with")]
    pub adapter: Option<String>,

    /// How much to say.
    #[command(flatten)]
    pub talk: Talk,
}
