//! `etendue check`.

use super::args::CheckArgs;
use super::failure::Failure;
use crate::scene::{Scene, check as lints, parse};
use std::path::Path;

/// Reads and lints every file. The exit status is that of the first file that fails.
pub fn check(args: &CheckArgs) -> Result<(), Failure> {
    let mut first_failure = None;
    for path in &args.scenes {
        match parse::read(path) {
            Ok(scene) => report(path, &scene)?,
            Err(e) => {
                let failure = Failure::from(e);
                failure.print();
                first_failure.get_or_insert(Failure::Said(failure.status()));
            }
        }
    }
    first_failure.map_or(Ok(()), Err)
}

/// Prints warnings on stderr, and a summary of the valid file on stdout.
fn report(path: &Path, scene: &Scene) -> Result<(), Failure> {
    let warnings = lints::lint(scene);
    for w in &warnings {
        super::say!("warning: {w}");
    }
    let verdict = match warnings.len() {
        0 => "ok".to_owned(),
        1 => "1 warning".to_owned(),
        n => format!("{n} warnings"),
    };
    super::write_stdout(&format!(
        "{}: {verdict}; primitives {}, lights {}, materials {}\n",
        path.display(),
        scene.primitives.len(),
        scene.lights.len(),
        scene.materials.len()
    ))
}
