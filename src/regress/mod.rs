//! Image regression tests: compares the scenes of a folder with their golden pictures, and offers the same test as an
//! assertion.
//!
//! Renders `DIR/NAME.toml` and compares it with `DIR/golden/NAME.exr`, with as many samples as the golden has (the
//! test is exact then) and another seed. A failure leaves its film `NAME.actual.npz` and its report
//! `NAME.report.html` beside the golden.

mod assertion;
mod candidate;
mod golden;
mod layers;
#[doc(hidden)]
pub mod report;
mod summary;

pub use assertion::{BLESS, assert_golden};
#[doc(hidden)]
pub use candidate::{Candidate, left_films};
#[doc(hidden)]
pub use golden::{Bless, Wanted};

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

/// Why a case could not be compared.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// The scene or the golden can't be used; why.
    Input(String),
    /// There is no engine, or it failed; why.
    Device(String),
}

impl From<String> for Trouble {
    fn from(why: String) -> Self {
        Self::Input(why)
    }
}

impl From<Trouble> for Outcome {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Input(why) => Outcome::Unusable(why),
            Trouble::Device(why) => Outcome::NoDevice(why),
        }
    }
}

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

/// The result of a case.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The same up to its noise.
    Passed(Box<Comparison>),
    /// Different.
    Failed {
        /// What differs.
        comparison: Box<Comparison>,
        /// Why the evidence, a film and a page, could not be saved.
        unsaved: Option<String>,
    },
    /// A scene without a golden.
    New,
    /// A golden without a scene.
    Orphaned,
    /// The scene or the golden can't be used; why.
    Unusable(String),
    /// Nothing could be rendered; why.
    NoDevice(String),
    /// A golden was written.
    Blessed(Bless),
    /// A golden was left as it is, because the scene still passes.
    Kept(Box<Comparison>),
}

impl Outcome {
    /// Its word in lists.
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Passed(_) => "passed",
            Outcome::Failed { .. } => "FAILED",
            Outcome::New => "new",
            Outcome::Orphaned => "orphaned",
            Outcome::Unusable(_) => "unusable",
            Outcome::NoDevice(_) => "no device",
            Outcome::Blessed(_) => "blessed",
            Outcome::Kept(_) => "kept",
        }
    }

    /// Whether all is well.
    pub fn good(&self) -> bool {
        matches!(
            self,
            Outcome::Passed(_) | Outcome::Blessed(_) | Outcome::Kept(_)
        )
    }

    /// The result in one line.
    pub fn detail(&self, case: &Case) -> String {
        match self {
            Outcome::Passed(c) | Outcome::Failed { comparison: c, .. } => c.sentence(),
            Outcome::New => format!(
                "{} does not exist; create it with --bless",
                case.golden_path().display()
            ),
            Outcome::Orphaned => format!(
                "{} does not exist; remove the golden if this is intended",
                case.scene_path().display()
            ),
            Outcome::Unusable(why) | Outcome::NoDevice(why) => why.clone(),
            Outcome::Blessed(b) => b.to_string(),
            Outcome::Kept(c) => format!("the golden still passes: {}", c.sentence()),
        }
    }
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

    /// The flags that re-create its golden, for a shell.
    pub fn hint(&self) -> String {
        let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        let name = &self.name;
        if name.chars().all(plain) {
            format!("--bless --scene {name}")
        } else {
            format!("--bless --scene '{}'", name.replace('\'', "'\\''"))
        }
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
                    Err(e) => Outcome::Unusable(text(e)),
                };
                return Some((outcome, None));
            }
            _ => {}
        }
        let judged = match self.judge(engine, limits, layers, stop) {
            Ok(judged) => judged?,
            Err(trouble) => return Some((trouble.into(), None)),
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
        let replaced = match self.golden.then(|| Side::read(&self.golden_path())) {
            None => None,
            Some(Err(e)) => Some(text(e)),
            Some(Ok(golden)) if !wanted.met_by(&golden) => {
                Some("it has another size, or other samples than asked for".into())
            }
            Some(Ok(_)) if !wanted.has_layers(&self.golden_path()) => {
                Some("it lacks layers that were asked for".into())
            }
            Some(Ok(_)) => match self.judge(engine, limits, &wanted.layers, stop) {
                Ok(None) => return None,
                Ok(Some(judged)) if judged.comparison.same() => {
                    self.clear();
                    let outcome = Outcome::Kept(Box::new(judged.comparison));
                    return Some((outcome, Some(judged.pictures)));
                }
                Ok(Some(judged)) => Some(judged.comparison.sentence()),
                Err(Trouble::Input(why)) => Some(why),
                Err(trouble) => return Some((trouble.into(), None)),
            },
        };
        let made = match Candidate::render(self, engine, wanted, stop) {
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

    /// Makes the film that a failed run left the golden, without rendering.
    pub fn accept(&self, film: &Path, wanted: &Wanted) -> Outcome {
        let made = Candidate::left(self, film, wanted);
        made.and_then(|candidate| candidate.put(self, wanted))
            .map_or_else(Outcome::from, Outcome::Blessed)
    }

    fn judge(
        &self,
        engine: &MakeEngine,
        limits: &Limits,
        layers: &[Layer],
        stop: &AtomicBool,
    ) -> Result<Option<Judged>, Trouble> {
        let golden = Side::read(&self.golden_path()).map_err(text)?;
        let facts = golden::Facts::read(&golden)?;
        let source = parse::read_text(&self.scene_path()).map_err(text)?;
        let scene = parse::parse_str(&self.scene_path(), &source)
            .map_err(|e| parse::ReadError::Invalid(e).to_string())?;
        let hint = self.hint();
        let remedy = format!("if the change is intended, re-create the golden with {hint}");
        facts.check_settings(&scene, "the golden", &remedy)?;
        let settings = facts.settings(&scene);
        let mut provenance = Provenance::new(&scene, source, &settings);
        let layers = layers::differing(&self.golden_path(), &scene, &settings, layers);
        if provenance.scene_hash != facts.scene_hash {
            let seen = match layers {
                Ok(changes) if changes.is_empty() => String::new(),
                Ok(changes) => format!("; {}", changes.join("; ")),
                Err(why) => format!("; {why}"),
            };
            return Err(format!(
                "{} is of another scene than {} (hash {} and {}){seen}; {remedy}",
                self.golden_path().display(),
                self.scene_path().display(),
                short(&facts.scene_hash),
                short(&provenance.scene_hash)
            )
            .into());
        }
        let layers = layers?;
        golden::check_evidence(&golden, limits.alpha, provenance.black)?;
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
