//! Image regression tests: compares the scenes of a folder with their golden pictures, and offers the same test as an
//! assertion.
//!
//! Renders `DIR/NAME.toml` and compares it with `DIR/golden/NAME.exr`, with as many samples as the golden has (the
//! test is exact then) and another seed. A failure leaves its film `NAME.actual.npz` and its report
//! `NAME.report.html` beside the golden.

mod assertion;
mod candidate;
mod changes;
mod golden;
mod layers;
mod outcome;
#[doc(hidden)]
pub mod report;
mod summary;

pub use assertion::{BLESS, assert_golden};
#[doc(hidden)]
pub use candidate::{Candidate, left_films};
#[doc(hidden)]
pub use golden::{Bless, Wanted};
#[doc(hidden)]
pub use outcome::{Outcome, Trouble};

use crate::compare::{Comparison, Limits, Side, compare, html};
use crate::engine::Engine;
use crate::files::{FileError, atomic};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::layers::Layer;
use crate::output::store;
use crate::provenance::Provenance;
use crate::run::{self, Job, Run, StopReason};
use crate::scene::parse;
use crate::settings::Settings;
use crate::world::World;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Makes an engine for a scene, and returns the most pixels per call.
#[doc(hidden)]
pub type MakeEngine<'a> =
    dyn Fn(&World, &Settings) -> Result<(Box<dyn Engine>, u64), Trouble> + Sync + 'a;

/// Why a golden is not kept that is not as asked for.
const OTHER_SAMPLES: &str = "it has another size, or other samples than asked for";

/// What pages call the two pictures.
#[doc(hidden)]
pub const LABELS: [&str; 2] = ["golden", "now"];

/// A scene's picture beside its golden.
struct Judged {
    /// Golden and actual picture.
    pictures: [Side; 2],
    comparison: Comparison,
    film: Film,
    provenance: Provenance,
}

/// A scene, a golden picture, or both, under one name.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// The files' stem.
    pub name: String,
    /// The folder that holds the scene.
    pub dir: PathBuf,
    /// Whether the scene is there.
    pub scene: bool,
    /// Whether the golden is there.
    pub golden: bool,
}

impl Case {
    /// The scene file.
    pub fn scene_path(&self) -> PathBuf {
        self.dir.join(format!("{}.toml", self.name))
    }

    /// The golden picture.
    pub fn golden_path(&self) -> PathBuf {
        self.beside("exr")
    }

    /// The film that a failure leaves.
    pub fn actual_path(&self) -> PathBuf {
        self.beside(candidate::ACTUAL)
    }

    /// The page that a failure leaves.
    pub fn report_path(&self) -> PathBuf {
        self.beside("report.html")
    }

    /// The command that re-creates its golden, for a shell.
    pub fn bless_command(&self) -> String {
        format!(
            "etendue regress {} --bless --scene {}",
            quoted(&self.dir.display().to_string()),
            quoted(&self.name)
        )
    }

    fn beside(&self, ending: &str) -> PathBuf {
        self.dir
            .join("golden")
            .join(format!("{}.{ending}", self.name))
    }

    /// Renders and compares, the golden's `layers` too. `None` when `stop` was set.
    pub fn run(
        &self,
        engine: &MakeEngine,
        limits: &Limits,
        layers: &[Layer],
        stop: &AtomicBool,
    ) -> Option<(Outcome, Option<[Side; 2]>)> {
        match (self.scene, self.golden) {
            (false, _) => return Some((Outcome::Orphaned, None)),
            (_, false) => {
                let outcome = match parse::read(&self.scene_path()) {
                    Ok(_) => Outcome::New,
                    Err(e) => Trouble::from(e).into(),
                };
                return Some((outcome, None));
            }
            _ => {}
        }
        let judged = match self.judge(engine, limits, layers, stop) {
            Ok(judged) => judged?,
            Err(trouble) => return Some((trouble.advised(self).into(), None)),
        };
        let outcome = if judged.comparison.same() {
            self.clear();
            Outcome::Passed(Box::new(judged.comparison))
        } else {
            Outcome::Failed {
                unsaved: self.leave(&judged).err().map(text),
                comparison: Box::new(judged.comparison),
            }
        };
        Some((outcome, Some(judged.pictures)))
    }

    /// Makes the golden, but leaves alone one that is as wanted and still passes. `None` when `stop` was set.
    pub fn bless(
        &self,
        engine: &MakeEngine,
        wanted: &Wanted,
        limits: &Limits,
        stop: &AtomicBool,
    ) -> Option<(Outcome, Option<[Side; 2]>)> {
        let replaced = match self.old() {
            Err(trouble) => return Some((trouble.into(), None)),
            Ok(None) => None,
            Ok(Some(Err(why))) => Some(why),
            Ok(Some(Ok(golden))) if !wanted.met_by(&golden) => Some(OTHER_SAMPLES.into()),
            Ok(Some(Ok(_))) if !wanted.has_layers(&self.golden_path()) => {
                Some("it lacks layers that were asked for".into())
            }
            Ok(Some(Ok(_))) => match self.judge(engine, limits, &wanted.layers, stop) {
                Ok(None) => return None,
                Ok(Some(judged)) if judged.comparison.same() => {
                    self.clear();
                    let outcome = Outcome::Kept(Box::new(judged.comparison));
                    return Some((outcome, Some(judged.pictures)));
                }
                Ok(Some(judged)) => Some(judged.comparison.sentence()),
                Err(Trouble::Golden(why) | Trouble::Changed(why)) => Some(why),
                Err(trouble) => return Some((trouble.into(), None)),
            },
        };
        let made = match Candidate::render(self, engine, wanted, None, stop) {
            Ok(made) => made?.put(self, wanted),
            Err(trouble) => Err(trouble),
        };
        let outcome = match made {
            Ok(blessed) => Outcome::Blessed(Bless {
                replaced,
                ..blessed
            }),
            Err(trouble) => trouble.into(),
        };
        Some((outcome, None))
    }

    /// Makes the film that a failed run left the golden, without rendering. Leaves alone a golden that passes beside it.
    pub fn accept(&self, film: &Path, wanted: &Wanted, limits: &Limits) -> Outcome {
        let accept = || {
            let candidate = Candidate::left(self, film, wanted)?;
            let replaced = match self.old()? {
                None => None,
                Some(Err(why)) => Some(why),
                Some(Ok(golden)) => match candidate.against(self, &golden, wanted, limits) {
                    Ok(comparison) if comparison.same() => {
                        return Ok(Outcome::Kept(Box::new(comparison)));
                    }
                    Ok(comparison) => Some(comparison.sentence()),
                    Err(why) => Some(why),
                },
            };
            let blessed = candidate.put(self, wanted)?;
            Ok(Outcome::Blessed(Bless {
                replaced,
                ..blessed
            }))
        };
        accept().unwrap_or_else(|trouble: Trouble| trouble.into())
    }

    /// The golden, or why its content can't be used; `None` without one. Whatever hides a golden that may be good is an error.
    fn old(&self) -> Result<Option<Result<Side, String>>, Trouble> {
        if !self.golden {
            return Ok(None);
        }
        golden::check_fetched(&self.golden_path())?;
        match Side::read(&self.golden_path()) {
            Ok(golden) => Ok(Some(Ok(golden))),
            Err(e) if e.is_content() => Ok(Some(Err(text(e)))),
            Err(e) => Err(e.into()),
        }
    }

    fn judge(
        &self,
        engine: &MakeEngine,
        limits: &Limits,
        layers: &[Layer],
        stop: &AtomicBool,
    ) -> Result<Option<Judged>, Trouble> {
        let golden = Side::read(&self.golden_path())?;
        let facts = golden::Facts::read(&golden).map_err(Trouble::Golden)?;
        let (source, scene) = candidate::read(self)?;
        facts
            .check_settings(&scene, "the golden")
            .map_err(Trouble::Changed)?;
        let settings = facts.settings(&scene);
        let mut provenance = Provenance::new(&scene, source, &settings);
        let layers = layers::differing(&self.golden_path(), &scene, &settings, layers);
        if provenance.scene_hash != facts.scene_hash {
            let seen = match layers {
                Ok(changes) if changes.is_empty() => String::new(),
                Ok(changes) => format!("; {}", changes.join("; ")),
                Err(why) => format!("; {why}"),
            };
            return Err(Trouble::Changed(format!(
                "{} is of another scene than {} (hash {} and {}){seen}",
                self.golden_path().display(),
                self.scene_path().display(),
                short(&facts.scene_hash),
                short(&provenance.scene_hash)
            )));
        }
        let layers = layers.map_err(Trouble::Golden)?;
        golden::check_evidence(&golden, limits.alpha, provenance.black).map_err(Trouble::Golden)?;
        let world = World::new(&scene, settings.size);
        let (mut engine, tile) = engine(&world, &settings)?;
        let rect = Rect::whole(settings.size);
        let mut film = Film::new(settings.size, rect, settings.strata);
        if !render(
            engine.as_mut(),
            tile,
            &mut film,
            &mut provenance,
            facts.samples,
            stop,
        )? {
            return Ok(None);
        }
        let name = self.scene_path().display().to_string();
        let actual = Side::from_film(name, &film, &provenance)?;
        let mut comparison = compare(&golden, &actual, limits).map_err(text)?;
        comparison.labels = LABELS;
        comparison.layers = layers;
        Ok(Some(Judged {
            pictures: [golden, actual],
            comparison,
            film,
            provenance,
        }))
    }

    /// Leaves the film and the page of a failure.
    fn leave(&self, judged: &Judged) -> Result<(), FileError> {
        let [golden, actual] = &judged.pictures;
        let page = html::page(golden, actual, LABELS, &judged.comparison);
        store::save(&self.actual_path(), &judged.film, &judged.provenance)?;
        atomic::replace(&self.report_path(), |f| f.write_all(page.as_bytes()))
    }

    /// Removes what an earlier failure left; what can't be removed does no harm.
    fn clear(&self) {
        for path in [self.actual_path(), self.report_path()] {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// A word of a command, for a shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}

/// The first letters of a hash, enough to distinguish two.
fn short(hash: &str) -> String {
    hash.chars().take(12).collect()
}

/// Brings every pixel of the film to `samples` samples; false when `stop` was set.
fn render(
    engine: &mut dyn Engine,
    tile_pixels: u64,
    film: &mut Film,
    provenance: &mut Provenance,
    samples: u64,
    stop: &AtomicBool,
) -> Result<bool, Trouble> {
    let device = engine.device().clone();
    let job = Job {
        tiles: run::tiles(&[film.bounds], tile_pixels),
        samples: 0..samples,
        round: provenance.settings.round(),
        time: None,
        error: None,
        black: false,
        call: run::CALL,
        adaptive: None,
    };
    let mut run = Run::new(&job, engine, film, stop);
    let reason = run.go(|_, _| Ok::<(), crate::engine::EngineError>(()));
    let tally = run.tally;
    provenance.add_work(&device, tally.counters, tally.seconds);
    provenance.describe(film);
    if let Some((x, y, n)) = tally.counters.first_nonfinite {
        return Err(Trouble::Input(format!(
            "{} samples were not finite, the first at pixel {x}, {y}, sample {n}",
            tally.counters.nonfinite
        )));
    }
    let reason = reason.map_err(|e| Trouble::Device(text(e)))?;
    Ok(reason != StopReason::Interrupted)
}

/// The scenes of `dir` and the goldens of `dir/golden`, by name.
#[doc(hidden)]
pub fn cases(dir: &Path) -> Result<Vec<Case>, FileError> {
    let scenes = stems(dir, "toml")?;
    let golden = dir.join("golden");
    let goldens = if golden.exists() {
        stems(&golden, "exr")?
    } else {
        Vec::new()
    };
    let mut names: Vec<&String> = scenes.iter().chain(&goldens).collect();
    names.sort();
    names.dedup();
    Ok(names
        .into_iter()
        .map(|name| Case {
            name: name.clone(),
            dir: dir.into(),
            scene: scenes.contains(name),
            golden: goldens.contains(name),
        })
        .collect())
}

/// Files of `dir` that would be scenes if their extension were in lower case.
#[doc(hidden)]
pub fn almost_scenes(dir: &Path) -> Result<Vec<PathBuf>, FileError> {
    let mut files = files(dir)?;
    files.retain(|path| {
        let extension = path.extension().unwrap_or_default();
        extension != "toml" && extension.eq_ignore_ascii_case("toml")
    });
    Ok(files)
}

/// Names of the files of `dir` with an extension, without it.
fn stems(dir: &Path, extension: &str) -> Result<Vec<String>, FileError> {
    let mut files = files(dir)?;
    files.retain(|path| path.extension().is_some_and(|e| e == extension));
    let stem = |path: &PathBuf| Some(path.file_stem()?.to_string_lossy().into_owned());
    Ok(files.iter().filter_map(stem).collect())
}

/// What is in `dir`, but for folders and hidden files, among them those that macOS puts beside others (`._NAME`).
fn files(dir: &Path) -> Result<Vec<PathBuf>, FileError> {
    let unreadable = |e| FileError::io(dir, "cannot read", &e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let is_hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        let path = entry.path();
        if !is_hidden && !path.is_dir() {
            files.push(path);
        }
    }
    Ok(files)
}
