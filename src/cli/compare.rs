//! `etendue compare`: whether two pictures are the same up to their noise.

use super::args::CompareArgs;
use super::failure::Failure;
use super::{say, write_stdout};
use crate::compare::{Limits, Picture, compare as compare_pictures, html};
use crate::output::atomic;
use std::io::Write;

/// Prints what it finds; exit status 1 when the pictures differ.
pub fn compare(args: &CompareArgs) -> Result<(), Failure> {
    if let Some(path) = &args.html {
        atomic::check_writable(path)?;
    }
    let a = Picture::read(&args.a)?;
    let b = Picture::read(&args.b)?;
    let limits = Limits {
        alpha: args.alpha,
        max_flip: args.max_flip,
        max_relative_rmse: args.max_relative_rmse,
    };
    let comparison =
        compare_pictures(&a, &b, &limits).map_err(|e| Failure::Input(e.to_string()))?;
    write_stdout(&comparison.report())?;
    if let Some(path) = &args.html {
        let page = html::page(&a, &b, &comparison);
        atomic::replace(path, |f| f.write_all(page.as_bytes()))?;
        say!("wrote {}", path.display());
    }
    if comparison.same() {
        Ok(())
    } else {
        Err(Failure::Said(1))
    }
}
