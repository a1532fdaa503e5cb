//! `etendue compare`: whether two pictures are the same up to their noise.

use super::args::CompareArgs;
use super::failure::Failure;
use super::files::{Files, is_stdout, write_text};
use super::progress::Progress;
use super::{say, write_stdout};
use crate::compare::{
    Incomparable, LABELS, Limits, Side, compare as compare_pictures, html, layers,
};
use crate::files::atomic;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Read one picture, read the other, compare them.
const STEPS: usize = 3;

/// Why two pictures can't be compared, and what to type.
fn advised(why: &Incomparable) -> String {
    let advice = match why {
        Incomparable::NoNoise { .. } => {
            ": use --max-flip or --max-relative-rmse. Pictures of other programs state it by several renders (--a, --b), or by \
             variances with --spp-a or --spp-b"
        }
        Incomparable::Size { .. } | Incomparable::Regions { .. } => "",
    };
    format!("{why}{advice}")
}

/// Prints the comparison. The exit status is 1 if the pictures differ.
pub fn compare(args: &CompareArgs) -> Result<(), Failure> {
    let mut files = Files::default();
    let sides = sides(args);
    for path in sides.iter().flatten() {
        files.reads("a picture to compare", path)?;
    }
    if let Some(path) = &args.html {
        files.writes("--html", path)?;
    }
    if let Some(path) = &args.report {
        files.writes_text("--report", path)?;
    }
    super::set_threads(args.talk.threads);
    let mut progress = Progress::new(&args.talk);
    let mut read = |done: usize, samples: Option<u64>| {
        let paths = &sides[done];
        progress.step(done, STEPS, &paths[0].display().to_string());
        Side::read_renders(paths, samples)
    };
    let (a, b) = (read(0, args.spp_a)?, read(1, args.spp_b)?);
    progress.step(2, STEPS, "comparing");
    let limits = Limits {
        alpha: args.alpha,
        max_flip: args.max_flip,
        max_relative_rmse: args.max_relative_rmse,
    };
    let mut comparison =
        compare_pictures(&a, &b, &limits).map_err(|e| Failure::Input(advised(&e)))?;
    if let (false, [a, b]) = (args.layers.is_empty(), &sides) {
        comparison.layers = layers::differing(&a[0], &b[0], &args.layers)?;
    }
    match &sides {
        [a, b] if a.len() == 1 && b.len() == 1 => {
            if is_same_file(&a[0], &b[0]) {
                comparison.notes = vec!["both names lead to the same file".into()];
            }
        }
        // Noise that both share is no evidence.
        [a, b] => {
            let twice = |p: &&PathBuf| b.iter().any(|q| is_same_file(p, q));
            if let Some(path) = a.iter().find(twice) {
                let path = path.display();
                return Err(Failure::Input(format!(
                    "{path} is a render of both sides; each side needs renders of its own"
                )));
            }
        }
    }
    progress.finish();
    if !(args.talk.quiet && comparison.same()) {
        let text = comparison.report();
        if args.report.as_deref().is_some_and(is_stdout) {
            say!("{}", text.trim_end());
        } else {
            write_stdout(&text)?;
        }
    }
    if let Some(path) = &args.report {
        write_text(path, &comparison.to_json())?;
    }
    if let Some(path) = &args.html {
        let page = html::page(&a, &b, LABELS, &comparison);
        atomic::replace(path, |f| f.write_all(page.as_bytes()))?;
        if !args.talk.quiet {
            say!("wrote {}", path.display());
        }
    }
    if comparison.same() {
        Ok(())
    } else {
        Err(Failure::Said(1))
    }
}

/// The files of both sides: one picture each, or several renders.
fn sides(args: &CompareArgs) -> [Vec<PathBuf>; 2] {
    let side = |one: &Option<PathBuf>, renders: &[PathBuf]| {
        one.iter().chain(renders).cloned().collect::<Vec<_>>()
    };
    [
        side(&args.a, &args.renders_a),
        side(&args.b, &args.renders_b),
    ]
}

/// Whether two names lead to one file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    real(a).is_some_and(|a| Some(a) == real(b))
}
