//! `etendue merge`: adds films of the same scene.

use super::args::MergeArgs;
use super::failure::Failure;
use super::{memory, say};
use crate::film::merge::{HoleKind, MergeError, holes, merge as add};
use crate::film::store::{self, Outline};
use crate::output::{FileError, atomic};
use std::path::{Path, PathBuf};

/// Holes that are listed; more would hide the rest.
const LISTED_HOLES: usize = 8;

/// Loads one film after the other, so that memory never holds more than the sum and one of them. They are added in the
/// order of their samples, whatever that of the command line: the sum has the same bits.
pub fn merge(args: &MergeArgs) -> Result<(), Failure> {
    if args.out.exists() {
        let message = "it exists already, and films are never replaced; remove it or name another";
        return Err(FileError::Io {
            path: args.out.clone(),
            message: message.into(),
        }
        .into());
    }
    atomic::check_writable(&args.out)?;
    let films = fitting(&args.films)?;
    let (first, _) = films[0];
    let (mut film, mut provenance) = store::load(first)?;
    for (path, _) in &films[1..] {
        let (other, its) = store::load(path)?;
        // Checked before, but a file may have been replaced since.
        provenance
            .same_samples(&its)
            .map_err(|e| refused(first, path, &e))?;
        add(&mut film, &other).map_err(|e| refused(first, path, &e.to_string()))?;
        provenance.absorb(&its);
    }
    provenance.describe(&film);

    let mut holes = holes(&film);
    if films.iter().any(|(_, its)| its.adaptive) {
        holes.retain(|hole| hole.kind != HoleKind::Short);
    }
    for hole in holes.iter().take(LISTED_HOLES) {
        say!("warning: {hole}");
    }
    if holes.len() > LISTED_HOLES {
        say!("warning: {} more such holes", holes.len() - LISTED_HOLES);
    }
    store::save(&args.out, &film, &provenance)?;
    if !args.quiet {
        let (least, most) = film.coverage.samples();
        say!(
            "wrote {}: {} films, {least} to {most} samples a pixel",
            args.out.display(),
            args.films.len()
        );
    }
    Ok(())
}

/// The films and what they say of themselves, in the order of their samples. Refuses films that don't fit together, by
/// name, before any is loaded.
fn fitting(paths: &[PathBuf]) -> Result<Vec<(&Path, Outline)>, Failure> {
    let mut films: Vec<(&Path, Outline)> = Vec::new();
    for path in paths {
        let new = store::outline(path)?;
        for (other, its) in &films {
            its.provenance
                .same_samples(&new.provenance)
                .map_err(|e| refused(other, path, &e))?;
            MergeError::overlap(&its.coverage, &new.coverage)
                .map_err(|e| refused(other, path, &e.to_string()))?;
        }
        films.push((path, new));
    }
    films.sort_by_key(|(_, film)| film.coverage.first());
    let sum = films[1..]
        .iter()
        .fold(films[0].1.bounds, |sum, (_, film)| sum.union(&film.bounds));
    let largest = films.iter().map(|(_, film)| film.bounds.area()).max();
    memory::check(sum.area() + largest.unwrap_or(0))?;
    Ok(films)
}

/// Names both films: the fault is in the pair.
fn refused(first: &Path, path: &Path, why: &str) -> Failure {
    let message = format!("cannot be added to {}: {why}", first.display());
    FileError::content(path, message).into()
}
