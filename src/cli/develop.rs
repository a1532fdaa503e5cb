//! `etendue develop`: pictures from a film.

use super::args::DevelopArgs;
use super::denoise::{self, Denoiser, Made, prepare, with_denoised, write_pictures};
use super::ending::warn_of_doubt;
use super::failure::Failure;
use super::files::{Files, Written, write_text};
use super::layers;
use super::progress::Progress;
use crate::denoise::folder;
use crate::files::FileError;
use crate::layers::{NoScene, View, check_scene};
use crate::output::{Extra, Format, store};
use crate::provenance::Provenance;
use crate::scene::parse;
use std::path::PathBuf;

/// Writes the pictures that `render` would have written, and what a denoiser needs.
pub fn develop(args: &DevelopArgs) -> Result<(), Failure> {
    let outputs = check(args)?;
    super::set_threads(args.talk.threads);
    let denoiser = match &args.denoised {
        Some(folder) => Some(Denoiser::Folder(folder)),
        None => args.denoise.denoiser(args.talk.threads)?,
    };
    let mut progress = Progress::new(&args.talk);
    let steps = 1 + outputs.len();
    progress.step(0, steps, &args.film.display().to_string());
    let (film, mut provenance) = store::load(&args.film)?;
    let error = provenance.describe(&film);
    if let Some(path) = &args.scene {
        let why = |no: NoScene| FileError::content(path, no.to_string());
        check_scene(&provenance, &parse::read(path)?).map_err(why)?;
    }

    // What is made from the scene.
    let mut extra = Extra::default();
    let mut made = None;
    let denoises = denoiser.is_some() || args.folds.is_some();
    if denoises || !args.pictures.layers.is_empty() {
        let view = view(args, &provenance)?;
        let bounds = film.bounds;
        extra = layers::make(&args.pictures, &view, bounds, &mut progress);
        if denoises {
            let task = prepare(&film, &provenance, &view, &mut progress);
            let task = task.map_err(|why| FileError::content(&args.film, why.to_string()))?;
            if let Some(folder) = &args.folds {
                folder::write(folder, &task, &provenance, args.folds_as, |name| {
                    progress.step(0, 1, name);
                })?;
            }
            if let Some(by) = &denoiser {
                made = Some(Made::new(by, &task, &film, &provenance, &mut progress)?);
            }
        }
    }
    if let Some(made) = &made {
        made.add_to(&mut extra);
    }

    let mut written = Written::default();
    let of = (&film, &provenance);
    let beside = (&extra, made.as_ref());
    write_pictures(
        &outputs,
        of,
        &args.pictures,
        beside,
        &mut written,
        |k, path| {
            progress.step(1 + k, steps, &path.display().to_string());
        },
    )?;
    progress.finish();
    if !args.talk.quiet {
        if let Some(made) = &made {
            progress.say(&made.statement());
        }
        let folds = args
            .folds
            .iter()
            .map(|folder| format!("six halves and their features in {}", folder.display()));
        let list: Vec<String> = written.list().into_iter().chain(folds).collect();
        if !list.is_empty() {
            progress.say(&format!("wrote {}", list.join(", ")));
        }
    }
    if let (Some(path), Some(made)) = (&args.report, &made) {
        write_text(path, &made.report().to_json())?;
    }
    warn_of_doubt(&error);
    written.end()
}

/// Checks what can be checked before the film is read. The pictures to write.
fn check(args: &DevelopArgs) -> Result<Vec<PathBuf>, Failure> {
    let denoises = args.denoise.denoise || args.denoised.is_some();
    let outputs = with_denoised(&args.output, denoises)?;
    let mut files = Files::default();
    files.reads("the film", &args.film)?;
    if let Some(path) = &args.scene {
        files.reads("the scene", path)?;
    }
    for path in &outputs {
        Format::from_path(path).map_err(Failure::Input)?;
        files.writes("--output", path)?;
    }
    if let Some(path) = &args.report {
        if !denoises {
            let message = "--report tells of a denoised picture: add --denoise or --denoised";
            return Err(Failure::Input(message.into()));
        }
        files.writes_text("--report", path)?;
    }
    layers::check(&args.pictures, &outputs, None)?;
    if denoises {
        denoise::check(&args.pictures)?;
    }
    Ok(outputs)
}

/// What the film is a picture of.
fn view(args: &DevelopArgs, provenance: &Provenance) -> Result<View, Failure> {
    let path = args.scene.as_deref().unwrap_or(&args.film);
    View::of_film(provenance, path).map_err(|why| match why {
        NoScene::Invalid(diagnostics) => Failure::Scene(diagnostics),
        NoScene::Other => FileError::content(path, why.to_string()).into(),
    })
}
