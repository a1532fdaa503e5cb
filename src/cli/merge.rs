//! `etendue merge`: adds films of the same scene.

use super::args::MergeArgs;
use super::failure::Failure;
use super::{memory, say};
use crate::film::merge::{holes, merge as add};
use crate::film::store;
use crate::output::{FileError, atomic};
use std::path::Path;

/// Holes that are listed; more would hide the rest.
const LISTED_HOLES: usize = 8;

/// Loads one film after the other, so that memory never holds more than the sum and one of them.
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
    let first = &args.films[0];
    let (mut film, mut provenance) = store::load(first)?;
    for path in &args.films[1..] {
        let (other, its) = store::load(path)?;
        let refuse = |why: String| refused(first, path, &why);
        provenance.same_samples(&its).map_err(refuse)?;
        memory::check(film.bounds.union(&other.bounds).area() - film.bounds.area())?;
        add(&mut film, &other).map_err(|e| refused(first, path, &e.to_string()))?;
        provenance.absorb(&its);
    }
    provenance.describe(&film);

    let holes = holes(&film);
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

/// Names both films: the fault is in the pair.
fn refused(first: &Path, path: &Path, why: &str) -> Failure {
    let message = format!("cannot be added to {}: {why}", first.display());
    FileError::content(path, message).into()
}
