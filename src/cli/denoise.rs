//! `--denoise`, `--folds` and `--denoised`: denoised pictures that state their error.

use super::args::{DenoiseArgs, PictureArgs};
use super::failure::Failure;
use super::files::Written;
use super::progress::Progress;
use crate::denoise::oidn::Oidn;
use crate::denoise::{Task, folder};
use crate::files::FileError;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::film::replicates::NoReplicates;
use crate::layers::View;
use crate::output::{DenoisedReport, ExrChannels, Extra, Format, Value, write_png_of};
use crate::provenance::Provenance;
use crate::stats::denoised::{Denoised, PAIRS, Rgb};
use std::path::{Path, PathBuf};

/// What stands before `.png` in the name of a denoised picture.
const MARK: &str = ".denoised";

/// Who denoises.
pub enum Denoiser<'a> {
    /// Open Image Denoise.
    Oidn(Box<Oidn>),
    /// Whoever has written pictures into this folder.
    Folder(&'a Path),
}

/// The denoised picture of a film.
pub struct Made {
    denoised: Denoised,
    denoiser: String,
    lamp_pixels: usize,
    size: Rect,
    bounds: Rect,
}

impl DenoiseArgs {
    /// Loads the denoiser that the flags ask for.
    pub fn denoiser(&self, threads: Option<u16>) -> Result<Option<Denoiser<'static>>, Failure> {
        if !self.denoise {
            return Ok(None);
        }
        let oidn = Oidn::load(self.oidn.as_deref(), threads).map_err(Failure::Device)?;
        Ok(Some(Denoiser::Oidn(Box::new(oidn))))
    }
}

/// The pictures to write: with each `NAME.png` there is a `NAME.denoised.png`, unless one such name is given.
pub fn with_denoised(outputs: &[PathBuf], denoises: bool) -> Result<Vec<PathBuf>, Failure> {
    let mut all = outputs.to_vec();
    let named = all.iter().find(|p| is_denoised(p));
    match (denoises, named) {
        (false, Some(path)) => Err(Failure::Input(format!(
            "{}: a name that ends in {MARK}.png is for a denoised picture; add --denoise or give another name",
            path.display()
        ))),
        (true, None) => {
            let pngs = outputs
                .iter()
                .filter(|p| Format::from_path(p) == Ok(Format::Png));
            all.extend(pngs.map(|p| p.with_extension(format!("{}.png", &MARK[1..]))));
            Ok(all)
        }
        _ => Ok(all),
    }
}

/// Refuses flags with which nobody would see the denoised picture.
pub fn check(args: &PictureArgs) -> Result<(), Failure> {
    if args.exr == ExrChannels::All {
        return Ok(());
    }
    let message = "a denoised picture is a layer, which --exr rgb and rgb-half leave out";
    Err(Failure::Input(message.into()))
}

fn is_denoised(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    Format::from_path(path) == Ok(Format::Png) && stem.ends_with(MARK)
}

/// Prepares a film for a denoiser.
pub fn prepare(
    film: &Film,
    provenance: &Provenance,
    view: &View,
    progress: &mut Progress,
) -> Result<Task, NoReplicates> {
    let rows = film.bounds.height() as usize;
    Task::new(film, provenance, view, |done| {
        progress.step(done as usize, rows, "features");
    })
}

impl Made {
    /// Has the film denoised.
    pub fn new(
        by: &Denoiser,
        task: &Task,
        film: &Film,
        provenance: &Provenance,
        progress: &mut Progress,
    ) -> Result<Self, Failure> {
        let (folds, denoiser) = match by {
            Denoiser::Oidn(oidn) => {
                let mut folds: [Rgb; PAIRS.len()] = Default::default();
                let features = &task.features;
                for (pair, fold) in folds.iter_mut().enumerate() {
                    progress.step(pair, PAIRS.len(), "denoising");
                    let half = task.half(pair);
                    *fold = oidn
                        .denoise(
                            &half,
                            &features.albedo,
                            &features.normal,
                            task.replicates.size,
                        )
                        .map_err(Failure::Device)?;
                    task.restore(pair, fold);
                }
                (folds, oidn.name())
            }
            Denoiser::Folder(folder) => {
                let mut done = 0;
                let folds = folder::read(folder, task, provenance, |name| {
                    progress.step(done, PAIRS.len(), name);
                    done += 1;
                })?;
                (folds, "another program".to_owned())
            }
        };
        progress.step(PAIRS.len(), PAIRS.len(), "the error");
        Ok(Self {
            denoised: task.judge(&folds),
            denoiser,
            lamp_pixels: task.lamp_pixels(),
            size: Rect::whole(film.size),
            bounds: film.bounds,
        })
    }

    /// Who has made it, and how wrong it is.
    pub fn statement(&self) -> String {
        format!("denoised by {}: {}", self.denoiser, self.denoised.statement)
    }

    /// The same for programs.
    pub fn report(&self) -> DenoisedReport {
        DenoisedReport::new(&self.denoiser, &self.denoised.statement, self.lamp_pixels)
    }

    /// Entries of headers.
    fn entries(&self) -> Vec<(&'static str, Value)> {
        let statement = &self.denoised.statement;
        let mut all = vec![
            ("denoised", Value::Text(self.statement())),
            ("denoised_light", Value::Number(statement.mixture_light)),
        ];
        let rms = &statement.mixture;
        for (key, value) in [
            ("denoised_rms_error", rms.value()),
            ("denoised_rms_error_uncertainty", rms.error()),
        ] {
            all.extend(value.map(|v| (key, Value::Number(v))));
        }
        all
    }

    /// Adds its layers to what goes into EXR pictures.
    pub fn add_to(&self, extra: &mut Extra) {
        let width = self.size.width() as usize;
        let d = &self.denoised;
        let mut plane = |name: &'static str, value: &dyn Fn(usize) -> f32| {
            let mut values = vec![0.0; self.size.area() as usize];
            for i in 0..d.weight.len() {
                let row = self.bounds.width() as usize;
                let (x, y) = (
                    self.bounds.x0 as usize + i % row,
                    self.bounds.y0 as usize + i / row,
                );
                values[y * width + x] = value(i);
            }
            extra.channels.push((name, values));
        };
        for (c, name) in ["denoised.R", "denoised.G", "denoised.B"]
            .into_iter()
            .enumerate()
        {
            plane(name, &|i| d.mixture[i][c]);
        }
        for (c, name) in ["denoised.mean.R", "denoised.mean.G", "denoised.mean.B"]
            .into_iter()
            .enumerate()
        {
            plane(name, &|i| d.mean[i][c]);
        }
        plane("denoised.weight", &|i| d.weight[i]);
        plane("denoised.indication.Y", &|i| d.indication[i]);
        extra.entries.extend(self.entries());
    }

    fn write_png(
        &self,
        path: &Path,
        provenance: &Provenance,
        exposure: f64,
    ) -> Result<(), FileError> {
        let rects = [self.size, self.bounds];
        let entries = self.entries();
        write_png_of(
            path,
            rects,
            &self.denoised.mixture,
            provenance,
            &entries,
            exposure,
        )
    }
}

/// Writes all pictures of a film: those whose name says so show the denoised one.
pub fn write_pictures(
    outputs: &[PathBuf],
    (film, provenance): (&Film, &Provenance),
    args: &PictureArgs,
    (extra, made): (&Extra, Option<&Made>),
    written: &mut Written,
    mut next: impl FnMut(usize, &Path),
) -> Result<(), Failure> {
    for (k, path) in outputs.iter().enumerate() {
        next(k, path);
        let result = match made {
            Some(made) if is_denoised(path) => made.write_png(path, provenance, args.exposure),
            // There would be one if nothing had gone wrong.
            None if is_denoised(path) => continue,
            _ => {
                let format = Format::from_path(path).map_err(Failure::Input)?;
                format.write_with(path, film, provenance, &args.options(), extra)
            }
        };
        written.note(path, result);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn denoised_pictures_have_names_that_say_so() {
        let paths = |names: &[&str]| -> Vec<PathBuf> { names.iter().map(PathBuf::from).collect() };
        let all = with_denoised(&paths(&["a/x.exr", "a/x.png", "y.v2.PNG"]), true).unwrap();
        let expected = [
            "a/x.exr",
            "a/x.png",
            "y.v2.PNG",
            "a/x.denoised.png",
            "y.v2.denoised.png",
        ];
        assert_eq!(all, paths(&expected));
        let given = paths(&["x.png", "z.denoised.png"]);
        assert_eq!(with_denoised(&given, true).unwrap(), given);
        let refused = with_denoised(&given, false).unwrap_err();
        assert!(refused.to_string().contains("z.denoised.png"), "{refused}");
        assert_eq!(refused.status(), 2);
    }
}
