//! `etendue check`.

use super::args::CheckArgs;
use super::failure::Failure;
use crate::scene::{Scene, check as lints, parse};
use std::path::Path;

/// Reads and lints every file; the status of the first that fails is the command's.
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

/// Says what is suspect on stderr, and that the file is legal on stdout.
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
