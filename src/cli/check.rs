//! `etendue check`.

use super::args::CheckArgs;
use super::failure::Failure;
use crate::render::{Backend, Options, render};
use crate::scene::{Light, Place, Primitive, Scene, Shape, check as lints, parse};
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
                // Errors in a file of rows do not name the scene.
                if let Failure::Scene(all) = &failure {
                    let s = if all.len() == 1 { "" } else { "s" };
                    let (path, n) = (path.display(), all.len());
                    super::write_stdout(&format!("{path}: {n} error{s}\n"))?;
                }
                first_failure.get_or_insert(Failure::Said(failure.status()));
            }
        }
    }
    first_failure.map_or(Ok(()), Err)
}

/// Size and samples of the pictures that show whether a light reaches the eye.
const SIZE: [u32; 2] = [32, 24];
const SAMPLES: u64 = 16;
pub(super) const PATHS: u64 = SIZE[0] as u64 * SIZE[1] as u64 * SAMPLES;

/// Scenes with more pairs of a light and a surface are not tried: a ray of the reference meets every surface, and each light has a
/// picture of its own.
const MOST_PAIRS: usize = 1000;

/// Where the lights stand that a small picture shows nothing of. Lights that emit nothing, or are known to be hidden, have another
/// warning. Scenes of very many things, and of formulas that the reference would take minutes for, are not looked at.
pub(super) fn idle_lights(scene: &Scene) -> Vec<Place> {
    if scene.lights.len() * (scene.primitives.len() + 1) > MOST_PAIRS {
        return Vec::new();
    }
    let is_wild = |p: &Primitive| matches!(&p.shape, Shape::Implicit(i) if i.is_wild());
    if scene.primitives.iter().any(is_wild) {
        return Vec::new();
    }
    let known: Vec<usize> = lints::lint(scene).iter().map(|w| w.line).collect();
    let options = Options {
        spp: Some(SAMPLES),
        size: Some(SIZE),
        backend: Backend::Cpu,
        ..Options::default()
    };
    let is_idle = |light: &&Light| {
        let alone = Scene {
            lights: vec![**light],
            ..scene.clone()
        };
        let picture = render(&alone, &options);
        picture.is_ok_and(|p| p.pixels().iter().flatten().all(|x| *x == 0.0))
    };
    let candidates = scene.lights.iter().filter(|l| !known.contains(&l.line));
    candidates.filter(is_idle).map(Light::place).collect()
}

/// Prints warnings on stderr, and a summary of the valid file on stdout.
fn report(path: &Path, scene: &Scene) -> Result<(), Failure> {
    let warnings = lints::lint(scene);
    let idle = idle_lights(scene);
    for w in &warnings {
        super::say!("warning: {w}");
    }
    for place in &idle {
        super::say!(
            "warning: {}:{}:{}: the light at line {} has lit nothing: none of {PATHS} paths has found any of its light",
            path.display(),
            place.line,
            place.column,
            place.line
        );
    }
    let verdict = match warnings.len() + idle.len() {
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
