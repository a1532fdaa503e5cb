//! The reference picture of a benchmark: given by the user, cached by an earlier run, or rendered.

use super::engines::Contender;
use super::errors::Truth;
use crate::compare::Side;
use crate::files::FileError;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::output::store;
use crate::provenance::Provenance;
use crate::run::{CALL, Job, Run, StopReason, Tally};
use crate::scene::Scene;
use crate::settings::Settings;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// The seed of references. No measured picture has it: with shared samples, both would have the same noise, and it would not
/// be measured.
pub const SEED: u32 = 0x5245_4621;

/// A reference picture.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The picture.
    pub truth: Truth,
    /// Its origin, as text.
    pub about: String,
    /// Samples per pixel; `None` when the picture does not say.
    pub samples: Option<u64>,
    /// Its seed, if it says.
    pub seed: Option<u32>,
    /// Where it lies, if it is kept.
    pub path: Option<PathBuf>,
    /// Whether all its samples were there already.
    pub cached: bool,
    /// A problem with the cache, which does not affect the picture.
    pub warning: Option<String>,
}

/// Reads a picture given by the user. It must have the scene's size. If it states its scene and settings, they must match.
pub fn given(path: &Path, scene_hash: &str, size: [u32; 2]) -> Result<Reference, FileError> {
    let picture = Side::read(path)?;
    let wrong = |why: String| FileError::content(path, why);
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"))
    {
        return Err(wrong(
            "a reference needs more than 8 bits per channel; use an .exr or a film".into(),
        ));
    }
    if picture.size != size {
        return Err(wrong(format!(
            "the reference has {} x {} pixels, but the picture has {} x {}",
            picture.size[0], picture.size[1], size[0], size[1]
        )));
    }
    if let Some(hash) = picture.origin("scene_hash")
        && hash != scene_hash
    {
        return Err(wrong(
            "the reference is of another scene or has other settings (its hash differs)".into(),
        ));
    }
    let samples = picture.noise.as_ref().map(|n| n.samples.iter().min());
    Ok(Reference {
        truth: Truth::new(&picture).map_err(wrong)?,
        about: path.display().to_string(),
        samples: samples.flatten().copied(),
        seed: picture.origin("seed").and_then(|s| s.parse().ok()),
        path: Some(path.to_owned()),
        cached: false,
        warning: None,
    })
}

/// Renders a reference with `samples` samples per pixel, or resumes the one in `cache`. `None` if `stop` was set; the samples
/// so far are then saved in the cache. `contender` is prepared for scene and settings, with any seed.
pub fn make(
    contender: &mut Contender,
    scene: &Scene,
    settings: &Settings,
    samples: u64,
    cache: Option<&Path>,
    stop: &AtomicBool,
    mut meanwhile: impl FnMut(&Tally),
) -> Result<Option<Reference>, String> {
    let settings = Settings {
        seed: SEED,
        ..settings.clone()
    };
    let whole = Rect::whole(settings.size);
    let mut provenance = Provenance::new(scene, "", &settings);
    let path = cache.map(|dir| dir.join(file_name(&provenance, &contender.identity())));
    let mut warning = None;
    let mut film = Film::new(settings.size, whole, settings.strata);
    if let Some(path) = path.as_ref().filter(|p| p.exists()) {
        match kept(path, &provenance) {
            Ok(old) => (film, provenance) = old,
            Err(why) => warning = Some(format!("{why}; the reference is rendered again")),
        }
    }
    let before = film.coverage.samples().0;
    let cached = before >= samples;
    if !cached {
        contender.reseed(SEED);
        let job = Job {
            tiles: contender.tiles.clone(),
            samples: 0..samples,
            round: settings.round(),
            time: None,
            error: None,
            black: false,
            call: CALL,
            adaptive: None,
        };
        let mut run = Run::new(&job, contender.engine_mut(), &mut film, stop);
        let ended = run.go(|_, tally| {
            meanwhile(tally);
            Ok::<(), crate::engine::EngineError>(())
        });
        let tally = run.tally;
        provenance.add_work(contender.device(), tally.counters, tally.seconds);
        provenance.describe(&film);
        if let Some(path) = &path
            && tally.counters.paths > 0
            && let Err(e) = keep(path, &film, &provenance)
        {
            warning = Some(format!("{e}; the reference is not cached"));
        }
        if ended.map_err(|e| e.to_string())? == StopReason::Interrupted {
            return Ok(None);
        }
    }
    let samples = film.coverage.samples().0;
    let picture = Side::from_film("reference".into(), &film, &provenance)?;
    Ok(Some(Reference {
        truth: Truth::new(&picture)?,
        about: contender.identity(),
        samples: Some(samples),
        seed: Some(SEED),
        path,
        cached,
        warning,
    }))
}

/// The name of the cached film. It contains everything that determines the expected picture and the samples.
fn file_name(provenance: &Provenance, identity: &str) -> String {
    let s = &provenance.settings;
    let made_with = format!(
        "{} {} {} {} {} {identity}",
        provenance.version, provenance.sampler_version, s.strata, s.shadow_rays, s.seed
    );
    let hash = Sha256::digest(made_with);
    let hash: String = hash[..8].iter().map(|b| format!("{b:02x}")).collect();
    let scene: String = provenance.scene_hash.chars().take(16).collect();
    format!("{scene}-{hash}.npz")
}

fn kept(path: &Path, wanted: &Provenance) -> Result<(Film, Provenance), String> {
    let (film, provenance) = store::load(path).map_err(|e| e.to_string())?;
    provenance
        .same_samples(wanted)
        .map_err(|why| format!("{}: {why}", path.display()))?;
    if film.bounds != Rect::whole(film.size) {
        return Err(format!("{}: not the whole picture", path.display()));
    }
    Ok((film, provenance))
}

fn keep(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), FileError> {
    if let Some(dir) = path.parent() {
        fs::create_dir_all(dir).map_err(|e| FileError::io(dir, "cannot create the folder", &e))?;
    }
    store::save(path, film, provenance)
}

/// The default folder for references: `etendue` in the user's cache folder. `None` if the user has no home.
pub fn default_cache() -> Option<PathBuf> {
    let set = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|p| p.is_absolute())
    };
    let base = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))?;
    Some(base.join("etendue"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::tests::example;

    #[test]
    fn the_cache_name_contains_everything_that_changes_the_reference() {
        let a = example([4, 3]);
        let name = file_name(&a, "gpu-baked; llvmpipe; Mesa 1; 00");
        assert_eq!(file_name(&a, "gpu-baked; llvmpipe; Mesa 1; 00"), name);
        assert!(name.starts_with("0123456789abcdef-") && name.ends_with(".npz"));
        assert_ne!(file_name(&a, "gpu-baked; llvmpipe; Mesa 2; 00"), name);
        type Edit = fn(&mut Provenance);
        let edits: [Edit; 6] = [
            |p| p.scene_hash.replace_range(0..1, "f"),
            |p| p.version += "1",
            |p| p.sampler_version += 1,
            |p| p.settings.strata += 1,
            |p| p.settings.shadow_rays += 1,
            |p| p.settings.seed -= 1,
        ];
        for (i, edit) in edits.into_iter().enumerate() {
            let mut b = a.clone();
            edit(&mut b);
            let other = file_name(&b, "gpu-baked; llvmpipe; Mesa 1; 00");
            assert_ne!(other, name, "edit {i}");
        }
    }
}
