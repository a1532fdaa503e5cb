//! The command lines of `etendue watch` and `etendue plot`.

use crate::cli::values;
use crate::watch::Address;
use clap::Args;
use std::path::PathBuf;

/// `etendue watch`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  etendue watch long.npz
      serves http://127.0.0.1:8080/, on which the film's picture grows whenever another process saves it
  etendue watch night/
      all films of a folder, those that come later too: small pictures, errors and forecasts
  ssh -L 8080:127.0.0.1:8080 server etendue watch night/
      the page of another machine, at http://127.0.0.1:8080/

Ctrl-C ends it. Films are only read.")]
pub struct WatchArgs {
    /// Films (.npz), or folders of films
    #[arg(required = true, value_name = "FILM|DIR")]
    pub paths: Vec<PathBuf>,
    /// Address and port of the page; port 0 is any free one
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:8080", value_parser = values::address)]
    pub listen: Address,
    /// Forecast when this relative error will be reached, such as 0.02 or 2%, where a film's log does not say
    #[arg(long, value_name = "E", value_parser = values::relative_error, allow_hyphen_values = true)]
    pub error: Option<f64>,
    /// Answer requests for this host too, as a reverse proxy passes them on. Repeatable
    #[arg(long, value_name = "NAME")]
    pub host: Vec<String>,
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `etendue plot`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Example:
  etendue render a.toml --time 10m --log a.jsonl
  etendue render b.toml --time 10m --log b.jsonl
  etendue plot a.jsonl b.jsonl -o curve.svg")]
pub struct PlotArgs {
    /// Logs of render --log
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// Plot to write, .svg or .png. Repeatable
    #[arg(short, long, required = true, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}
