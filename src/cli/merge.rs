//! `etendue merge`: adds up films of the same scene.

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

/// Most holes that are listed: more would hide the other messages.
const LISTED_HOLES: usize = 8;

/// Loads one film at a time, so that memory holds only the sum and one film. Adds them in the order of their samples, so that
/// the sum has the same bits for every order on the command line.
pub fn merge(args: &MergeArgs) -> Result<(), Failure> {
    if args.out.exists() {
        let message = "this file exists already, and merge never overwrites a film; remove it or name another";
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
        // `fitting` has checked this, but the file may have been replaced since.
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
        progress.say(&format!("warning: {more} more such gaps"));
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

/// The films with their outlines, in the order of their samples. Refuses films that don't fit together before any is loaded.
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
            if let (Some(a), Some(b)) = (&its.passes, &new.passes) {
                MergeError::passes(a, b).map_err(|e| refused(other, path, &e.to_string()))?;
            }
        }
        films.push((path, new));
    }
    films.sort_by_key(|(_, film)| film.coverage.first());
    let sum = films[1..]
        .iter()
        .fold(films[0].1.bounds, |sum, (_, film)| sum.union(&film.bounds));
    let largest = films.iter().map(|(_, film)| film.bounds.area()).max();
    let light_paths = films[0].1.passes.is_some();
    memory::check(sum.area() + largest.unwrap_or(0), light_paths)?;
    Ok(films)
}

/// The error that two films don't fit together, or that one of them is damaged, which may be the cause.
fn refused(first: &Path, path: &Path, why: &str) -> Failure {
    for film in [first, path] {
        if let Err(damage) = store::load(film) {
            return damage.into();
        }
    }
    let message = format!("cannot be merged with {}: {why}", first.display());
    FileError::content(path, message).into()
}
