//! `etendue merge`: adds films of the same scene.

use super::args::MergeArgs;
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::{plan, say};
use crate::files::FileError;
use crate::film::merge::{HoleKind, MergeError, holes, merge as add};
use crate::output::store::{self, Outline};
use crate::render::memory;
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
    let mut files = Files::default();
    for path in &args.films {
        files.reads("a film to add", path)?;
    }
    files.writes_film("the sum", &args.out)?;
    super::set_threads(args.talk.threads);
    let mut progress = Progress::new(&args.talk);
    let films = fitting(&args.films)?;
    let (first, _) = films[0];
    let steps = films.len() + 1;
    progress.step(0, steps, &first.display().to_string());
    let (mut film, mut provenance) = store::load(first)?;
    for (done, (path, _)) in films.iter().enumerate().skip(1) {
        progress.step(done, steps, &path.display().to_string());
        let (other, its) = store::load(path)?;
        // Checked before, but a file may have been replaced since.
        provenance
            .same_samples(&its)
            .map_err(|e| refused(first, path, &e))?;
        add(&mut film, &other).map_err(|e| refused(first, path, &e.to_string()))?;
        provenance.absorb(&its);
    }
    provenance.describe(&film);
    progress.step(films.len(), steps, &args.out.display().to_string());

    let mut holes = holes(&film);
    if films.iter().any(|(_, its)| its.adaptive) {
        holes.retain(|hole| hole.kind != HoleKind::Short);
    }
    for hole in holes.iter().take(LISTED_HOLES) {
        progress.say(&format!("warning: {hole}"));
    }
    if holes.len() > LISTED_HOLES {
        let more = holes.len() - LISTED_HOLES;
        progress.say(&format!("warning: {more} more such holes"));
    }
    store::save(&args.out, &film, &provenance)?;
    progress.finish();
    if !args.talk.quiet {
        let (out, n) = (args.out.display(), args.films.len());
        let s = if n == 1 { "" } else { "s" };
        say!("wrote {out}: {n} film{s}, {}", plan::samples_text(&film));
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

/// Names both films: the fault is in the pair, unless one of them is damaged, which may be why.
fn refused(first: &Path, path: &Path, why: &str) -> Failure {
    for film in [first, path] {
        if let Err(damage) = store::load(film) {
            return damage.into();
        }
    }
    let message = format!("cannot be added to {}: {why}", first.display());
    FileError::content(path, message).into()
}
