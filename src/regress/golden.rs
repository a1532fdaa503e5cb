//! Golden pictures: rendered with just enough samples, and read back with their settings.

use super::{Case, MakeEngine, Trouble, render, text};
use crate::compare::{Picture, verdict::verdict};
use crate::files::FileError;
use crate::film::Film;
use crate::film::REPLICATES;
use crate::film::coverage::Rect;
use crate::output::{ExrChannels, write_exr};
use crate::provenance::{Provenance, integrator_name, light_name};
use crate::scene::{Scene, parse};
use crate::settings::{Integrator, LightParts, Overrides, Settings};
use crate::world::World;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::AtomicBool;

/// Goldens are this wide unless a size is asked for.
const WIDTH: u32 = 64;

/// Samples at which the noise is looked at first.
const FIRST_LOOK: u64 = 64;

/// The change of brightness that comparisons with goldens detect, unless another is asked for.
const POWER: f64 = 0.01;

/// Most samples per pixel of a golden, unless another number is asked for.
const MOST_SAMPLES: u64 = 4096;

/// How to make goldens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Width and height; by default the scene's, scaled to 64 pixels wide.
    pub size: Option<[u32; 2]>,
    /// The relative change of the whole picture's brightness that a comparison shall detect with 95 % probability; by default 1 %.
    pub power: Option<f64>,
    /// Most samples per pixel; by default 4096.
    pub most_samples: Option<u64>,
    /// The false-alarm rate of that comparison.
    pub alpha: f64,
}

impl Wanted {
    fn power(&self) -> f64 {
        self.power.unwrap_or(POWER)
    }

    /// Whether a golden is as asked for; without a wish it is.
    pub(super) fn met_by(&self, golden: &Picture) -> bool {
        let samples = golden.noise.as_ref().map_or(0, |n| n.samples[0]);
        self.size.is_none_or(|size| size == golden.size)
            && self.most_samples.is_none_or(|most| samples <= most)
            && self
                .power
                .is_none_or(|power| smallest_change(golden, self.alpha) <= power)
    }
}

/// The properties of a golden.
#[derive(Debug, Clone, PartialEq)]
pub struct Bless {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub samples: u64,
    /// The relative change of the whole picture's brightness that a comparison detects.
    pub power: f64,
    /// Whether that is less than was wanted, for the samples ran out.
    pub short: bool,
    /// Bytes of the file.
    pub bytes: u64,
    /// Why the golden that was there before was not kept.
    pub replaced: Option<String>,
}

impl fmt::Display for Bless {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [w, h] = self.size;
        let (samples, bytes, power) = (self.samples, self.bytes, 100.0 * self.power);
        let s = if samples == 1 { "" } else { "s" };
        write!(f, "{w}x{h}, {samples} sample{s} per pixel, {bytes} bytes; ")?;
        if self.power >= 1.0 {
            f.write_str("too noisy to detect a change of the whole picture's brightness")?;
        } else {
            write!(
                f,
                "detects a change of the whole picture's brightness by {power:.2} %"
            )?;
        }
        match &self.replaced {
            Some(why) => write!(f, "; the golden before it: {why}"),
            None => Ok(()),
        }
    }
}

impl Bless {
    /// A warning if comparisons detect only larger changes than `wanted`.
    pub fn warning(&self, wanted: &Wanted) -> Option<String> {
        self.short.then(|| {
            format!(
                "comparisons with this golden will detect a change of the whole picture's brightness by {:.2} % or more, but \
                 --power asks for {:.2} %; raise --max-spp",
                100.0 * self.power,
                100.0 * wanted.power()
            )
        })
    }
}

/// Renders the case's scene with just enough samples, and writes it as the golden. `None` if `stop` was set.
pub(super) fn bless(
    case: &Case,
    engine: &MakeEngine,
    wanted: &Wanted,
    stop: &AtomicBool,
) -> Result<Option<Bless>, Trouble> {
    let path = case.scene_path();
    let source = parse::read_text(&path).map_err(text)?;
    let scene =
        parse::parse_str(&path, &source).map_err(|e| parse::ReadError::Invalid(e).to_string())?;
    let [w, h] = scene.camera.resolution;
    let small = |w: u32, h: u32| {
        let height = (f64::from(WIDTH) * f64::from(h) / f64::from(w)).round();
        [WIDTH, (height as u32).max(1)]
    };
    let size = wanted
        .size
        .unwrap_or(if w > WIDTH { small(w, h) } else { [w, h] });
    let overrides = Overrides {
        size: Some(size),
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
    let power = loop {
        if !render(
            engine.as_mut(),
            tile,
            &mut film,
            &mut provenance,
            samples,
            stop,
        )? {
            return Ok(None);
        }
        let picture = Picture::from_film(path.display().to_string(), &film, &provenance)?;
        let power = smallest_change(&picture, wanted.alpha);
        if power <= wanted.power() || samples >= most {
            break power;
        }
        // Noise falls with the square root of the samples; a first look may be far off.
        let factor = (1.05 * (power / wanted.power()).powi(2)).clamp(1.1, 8.0);
        samples = whole_rounds(samples as f64 * factor);
    };
    if power >= NO_EVIDENCE && !provenance.black {
        return Err(no_evidence(&path.display().to_string(), "raise --max-spp").into());
    }
    let golden = case.golden_path();
    let folder = case.dir.join("golden");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    write(&golden, &film, &provenance).map_err(text)?;
    case.clear();
    let bytes = std::fs::metadata(&golden).map_err(|e| format!("{}: {e}", golden.display()))?;
    Ok(Some(Bless {
        size,
        samples,
        power,
        short: power > wanted.power(),
        bytes: bytes.len(),
        replaced: None,
    }))
}

/// Writes a golden. The time that it took is left out, so that the same picture is the same file.
pub(super) fn write(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), FileError> {
    let untimed = Provenance {
        seconds: 0.0,
        ..provenance.clone()
    };
    write_exr(path, film, &untimed, ExrChannels::All)
}

/// A golden is no evidence if comparisons with it do not detect a change of the whole picture's brightness by so much: it holds
/// next to no light beside its noise.
const NO_EVIDENCE: f64 = 1.0;

/// The smallest change of the whole picture's brightness that a comparison with a similar picture detects.
fn smallest_change(picture: &Picture, alpha: f64) -> f64 {
    let seen = verdict(picture, picture, alpha).sensitivity;
    seen.first().map_or(f64::INFINITY, |s| s.change)
}

fn no_evidence(name: &str, remedy: &str) -> String {
    format!(
        "{name}: the picture holds next to no light beside its noise: a golden of it is no evidence, since even a doubling of its \
         brightness would pass; {remedy}"
    )
}

/// Refuses a golden that is no evidence. A picture that is `black` by construction is.
pub(super) fn check_evidence(golden: &Picture, alpha: f64, black: bool) -> Result<(), String> {
    if black || smallest_change(golden, alpha) < NO_EVIDENCE {
        return Ok(());
    }
    Err(no_evidence(
        &golden.name,
        "re-create it with --bless and a higher --max-spp",
    ))
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

/// The settings in a golden's header, with which it can be rendered again.
pub(super) struct Facts {
    pub scene_hash: String,
    pub samples: u64,
    size: [u32; 2],
    seed: u32,
    strata: u32,
    max_depth: u32,
    shadow_rays: u32,
    light: LightParts,
    integrator: Integrator,
}

impl Facts {
    pub fn read(golden: &Picture) -> Result<Self, String> {
        let (name, find) = (&golden.name, |key| golden.origin(key));
        let lacks =
            |key: &str| format!("{name}: its header has no {key}; re-create it with --bless");
        let noise = golden.noise.as_ref().ok_or_else(|| {
            format!(
                "{name}: it has no error layers, no sample counts, or fewer than two replicates; re-create it with --bless"
            )
        })?;
        let samples = noise.samples[0];
        if noise.samples.iter().any(|n| *n != samples) {
            return Err(format!(
                "{name}: its pixels have different numbers of samples"
            ));
        }
        let named = |key| find(key).ok_or_else(|| lacks(key));
        let kept = named("light")?;
        let part = |name| kept.split(',').any(|p| p == name);
        let light = LightParts {
            emitted: part("emitted"),
            direct: part("direct"),
            indirect: part("indirect"),
        };
        let known = [Integrator::Path, Integrator::Whitted];
        let integrator = named("integrator")?;
        let integrator = known
            .into_iter()
            .find(|i| integrator_name(*i) == integrator)
            .filter(|_| light_name(light) == kept)
            .ok_or_else(|| format!("{name}: unknown light or integrator in its header"))?;
        Ok(Self {
            scene_hash: named("scene_hash")?.into(),
            samples,
            size: golden.size,
            seed: number(golden, "seed").ok_or_else(|| lacks("seed"))?,
            strata: number(golden, "strata").ok_or_else(|| lacks("strata"))?,
            max_depth: number(golden, "max_depth").ok_or_else(|| lacks("max_depth"))?,
            shadow_rays: number(golden, "shadow_rays").ok_or_else(|| lacks("shadow_rays"))?,
            light,
            integrator,
        })
    }

    /// Refuses a golden of paths of another length than the scene's: its light differs. Size, strata and seed do not change the light,
    /// and are the golden's.
    pub fn check_settings(&self, scene: &Scene, hint: &str) -> Result<(), String> {
        let now = Settings::resolve(scene, &Overrides::default()).max_depth;
        if now == self.max_depth {
            return Ok(());
        }
        Err(format!(
            "the golden has max_depth {}, but the scene has {now}; if the change is intended, re-create the golden with {hint}",
            self.max_depth
        ))
    }

    /// The golden's settings with another seed: with the same seed both would have the same noise.
    pub fn settings(&self, scene: &Scene) -> Settings {
        let overrides = Overrides {
            size: Some(self.size),
            max_depth: Some(self.max_depth),
            strata: Some(self.strata),
            seed: Some(self.seed.wrapping_add(1)),
            shadow_rays: Some(self.shadow_rays),
            light: Some(self.light),
            integrator: Some(self.integrator),
            light_paths: None,
        };
        Settings::resolve(scene, &overrides)
    }
}

fn number<T: FromStr>(golden: &Picture, key: &str) -> Option<T> {
    golden.origin(key)?.parse().ok()
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
