//! `etendue develop`: pictures from a film.

use super::args::DevelopArgs;
use super::ending::warn_of_doubt;
use super::failure::Failure;
use super::files::{Files, Written};
use super::progress::Progress;
use crate::output::Format;
use crate::output::store;

/// Writes the pictures that `render` would have written.
pub fn develop(args: &DevelopArgs) -> Result<(), Failure> {
    let formats: Vec<Format> = args
        .output
        .iter()
        .map(|path| Format::from_path(path).map_err(Failure::Input))
        .collect::<Result<_, _>>()?;
    let mut files = Files::default();
    files.reads("the film", &args.film)?;
    for path in &args.output {
        files.writes("--output", path)?;
    }
    super::set_threads(args.talk.threads);
    let mut progress = Progress::new(&args.talk);
    let steps = 1 + args.output.len();
    progress.step(0, steps, &args.film.display().to_string());
    let (film, provenance) = store::load(&args.film)?;
    let mut written = Written::default();
    for (done, (format, path)) in formats.iter().zip(&args.output).enumerate() {
        progress.step(1 + done, steps, &path.display().to_string());
        let result = format.write(path, &film, &provenance, &args.pictures.options());
        written.note(path, result);
    }
    progress.finish();
    if let Some(list) = written.list().filter(|_| !args.talk.quiet) {
        progress.say(&format!("wrote {list}"));
    }
    warn_of_doubt(&provenance.error(&film));
    written.end()
}
