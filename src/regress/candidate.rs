//! Pictures that may become goldens: rendered with just enough samples, or left by a run that failed.

use super::golden::{
    self, Bless, Facts, MOST_SAMPLES, NO_EVIDENCE, Wanted, no_evidence, smallest_change,
};
use super::{Case, LABELS, MakeEngine, Trouble, changes, layers, render, short, text};
use crate::compare::{Comparison, Incomparable, Limits, Side, compare};
use crate::files::FileError;
use crate::film::coverage::Rect;
use crate::film::{Film, REPLICATES};
use crate::output::store;
use crate::provenance::Provenance;
use crate::scene::{Scene, parse};
use crate::settings::{Overrides, Settings};
use crate::world::World;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Goldens are this wide unless a size is asked for.
const WIDTH: u32 = 64;

/// Samples at which the noise is looked at first.
const FIRST_LOOK: u64 = 64;

/// A picture that may become a golden.
pub struct Candidate {
    scene: Scene,
    film: Film,
    provenance: Provenance,
    picture: Side,
    /// Samples per pixel.
    samples: u64,
    /// The relative change of the whole picture's brightness that comparisons with it detect.
    power: f64,
}

impl Candidate {
    /// Renders the case's scene with just enough samples. `None` if `stop` was set. To stand beside the golden `old`, it has another
    /// seed, and the golden's size if the scene still has its shape and no size is wanted.
    pub fn render(
        case: &Case,
        engine: &MakeEngine,
        wanted: &Wanted,
        old: Option<&Side>,
        stop: &AtomicBool,
    ) -> Result<Option<Self>, Trouble> {
        let path = case.scene_path();
        let (source, scene) = read(case)?;
        let [w, h] = scene.camera.resolution;
        let small = |w: u32, h: u32| {
            let height = (f64::from(WIDTH) * f64::from(h) / f64::from(w)).round();
            [WIDTH, (height as u32).max(1)]
        };
        let has_shape = |[gw, gh]: &[u32; 2]| {
            let height = f64::from(*gw) * f64::from(h) / f64::from(w);
            height.round().max(1.0) == f64::from(*gh)
        };
        let olds = old.map(|old| old.size).filter(has_shape);
        let size = wanted
            .size
            .or(olds)
            .unwrap_or(if w > WIDTH { small(w, h) } else { [w, h] });
        let overrides = Overrides {
            size: Some(size),
            seed: old.and_then(golden::other_seed),
            ..Overrides::default()
        };
        let settings = Settings::resolve(&scene, &overrides);
        let mut provenance = Provenance::new(&scene, source, &settings);
        let (step, most) = steps(
            settings.round(),
            wanted.most_samples.unwrap_or(MOST_SAMPLES),
        )?;
        let (mut engine, tile) = engine(&World::new(&scene, size), &settings)?;
        let mut film = Film::new(size, Rect::whole(size), settings.strata);
        let whole_rounds = |n: f64| ((n as u64).div_ceil(step) * step).min(most);
        let mut samples = whole_rounds(FIRST_LOOK as f64);
        let (power, picture) = loop {
            let engine = engine.as_mut();
            if !render(engine, tile, &mut film, &mut provenance, samples, stop)? {
                return Ok(None);
            }
            let picture = Side::from_film(path.display().to_string(), &film, &provenance)?;
            let power = smallest_change(&picture, wanted.alpha);
            if power <= wanted.power() || samples >= most {
                break (power, picture);
            }
            // Noise falls with the square root of the samples; a first look may be far off.
            let factor = (1.05 * (power / wanted.power()).powi(2)).clamp(1.1, 8.0);
            samples = whole_rounds(samples as f64 * factor);
        };
        if power >= NO_EVIDENCE && !provenance.black {
            return Err(no_evidence(&path.display().to_string()).into());
        }
        Ok(Some(Self {
            scene,
            film,
            provenance,
            picture,
            samples,
            power,
        }))
    }

    /// The film that a failed run left. It must be one of the case's scene as it is now.
    pub fn left(case: &Case, path: &Path, wanted: &Wanted) -> Result<Self, Trouble> {
        let (source, scene) = read(case)?;
        let (film, provenance) = store::load(path)?;
        let name = path.display().to_string();
        let picture = Side::from_film(name.clone(), &film, &provenance)?;
        if picture.covered.contains(&false) {
            return Err(format!("{name}: some of its pixels have no samples").into());
        }
        let facts = Facts::read(&picture)?;
        let cause = "it was rendered before the scene was changed";
        facts
            .check_settings(&scene, &name)
            .map_err(|why| format!("{why}; {cause}"))?;
        let now = Provenance::new(&scene, source, &facts.settings(&scene)).scene_hash;
        if now != facts.scene_hash {
            return Err(format!(
                "{name} is of another scene than {} (hash {} and {}): {cause}",
                case.scene_path().display(),
                short(&facts.scene_hash),
                short(&now)
            )
            .into());
        }
        golden::check_evidence(&picture, wanted.alpha, provenance.black)?;
        Ok(Self {
            power: smallest_change(&picture, wanted.alpha),
            samples: facts.samples,
            scene,
            film,
            provenance,
            picture,
        })
    }

    /// What it shows.
    pub fn picture(&self) -> &Side {
        &self.picture
    }

    /// What a comparison with the golden says, or why that golden is none of this picture.
    pub(super) fn against(
        &self,
        case: &Case,
        golden: &Side,
        wanted: &Wanted,
        limits: &Limits,
    ) -> Result<Comparison, String> {
        let facts = Facts::read(golden)?;
        if facts.scene_hash != self.provenance.scene_hash {
            return Err("it is of another scene or has other settings".into());
        }
        golden::check_evidence(golden, limits.alpha, self.provenance.black)?;
        let mut comparison = compare(golden, &self.picture, limits).map_err(text)?;
        comparison.labels = LABELS;
        let path = case.golden_path();
        let all = [&wanted.layers[..], &layers::held(&path)].concat();
        comparison.layers = layers::differing(&path, &self.scene, &self.provenance.settings, &all)?;
        Ok(comparison)
    }

    /// What differs from a golden of the scene as it was before: in the pictures, and as notes in the text.
    pub fn changes(&self, old: &Side, limits: &Limits) -> Result<Comparison, Incomparable> {
        let mut comparison = compare(old, &self.picture, limits)?;
        comparison.labels = LABELS;
        comparison.notes = self.changed_text(old);
        Ok(comparison)
    }

    /// What differs in the text of the scene, in lines.
    pub fn changed_text(&self, old: &Side) -> Vec<String> {
        changes::of_text(old.origin(golden::SCENE_TEXT), &self.provenance.scene_text)
    }

    /// Makes it the case's golden.
    pub fn put(&self, case: &Case, wanted: &Wanted) -> Result<Bless, Trouble> {
        let golden = case.golden_path();
        let folder = case.dir.join("golden");
        std::fs::create_dir_all(&folder)
            .map_err(|e| FileError::io(&folder, "cannot create", &e))?;
        // A golden keeps its layers, whoever makes it again.
        let layers = [&wanted.layers[..], &layers::held(&golden)].concat();
        let beside = layers::made(&self.scene, &self.provenance.settings, &layers);
        golden::write(&golden, &self.film, &self.provenance, beside)?;
        case.clear();
        let file =
            std::fs::metadata(&golden).map_err(|e| FileError::io(&golden, "cannot read", &e))?;
        Ok(Bless {
            size: self.picture.size,
            samples: self.samples,
            power: self.power,
            short: self.power > wanted.power(),
            bytes: file.len(),
            doubt: self.provenance.relative_error_doubt.clone(),
            replaced: None,
        })
    }
}

/// The text of the case's scene, and the scene.
pub(super) fn read(case: &Case) -> Result<(String, Scene), Trouble> {
    let path = case.scene_path();
    let source = parse::read_text(&path)?;
    let scene = parse::parse_str(&path, &source).map_err(parse::ReadError::Invalid)?;
    Ok((source, scene))
}

/// The unit of a golden's samples, and the most of them that there may be: whole rounds of all replicates, or of some where
/// `most` samples are fewer. Their error takes two.
fn steps(round: u64, most: u64) -> Result<(u64, u64), String> {
    let period = round * REPLICATES as u64;
    let step = if most >= period { period } else { round };
    let most = most / step * step;
    if most < 2 * round {
        return Err(format!(
            "--max-spp is too low: to estimate its error, a golden of this scene needs at least {} samples per pixel",
            2 * round
        ));
    }
    Ok((step, most))
}

/// The ending of the films that failed runs leave.
pub(super) const ACTUAL: &str = "actual.npz";

/// The films that failed runs left in a folder or below it, by the names of their scenes. `results` may be one such film, too.
pub fn left_films(results: &Path) -> Result<BTreeMap<String, PathBuf>, FileError> {
    let mut films = BTreeMap::new();
    let mut todo = vec![results.to_owned()];
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            let unreadable = |e| FileError::io(&path, "cannot read", &e);
            for entry in std::fs::read_dir(&path).map_err(unreadable)? {
                let entry = entry.map_err(unreadable)?;
                // A link to a folder above would lead round in a ring.
                if !entry.path().is_dir() || entry.file_type().is_ok_and(|t| t.is_dir()) {
                    todo.push(entry.path());
                }
            }
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = name.strip_suffix(ACTUAL).and_then(|n| n.strip_suffix('.'));
        let Some(stem) = stem.filter(|s| !s.is_empty()) else {
            continue;
        };
        if let Some(other) = films.insert(stem.to_owned(), path.clone()) {
            let why = format!(
                "{} is another film of this name; name the folder of one of them",
                other.display()
            );
            return Err(FileError::content(&path, why));
        }
    }
    if films.is_empty() {
        // A name that leads nowhere is another error than an empty folder.
        std::fs::metadata(results).map_err(|e| FileError::io(results, "cannot read", &e))?;
        let why = format!("no films of failed scenes (NAME.{ACTUAL})");
        return Err(FileError::content(results, why));
    }
    Ok(films)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goldens_respect_max_spp() {
        assert_eq!(steps(4, 4096), Ok((16, 4096)));
        assert_eq!(steps(4, 100), Ok((16, 96)));
        assert_eq!(steps(4, 15), Ok((4, 12)));
        assert_eq!(steps(4, 8), Ok((4, 8)));
        assert!(steps(4, 7).is_err_and(|e| e.contains("needs at least 8 samples per pixel")));
    }
}
