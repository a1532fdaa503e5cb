//! Golden pictures: rendered with just enough samples, and read back with their settings.

use super::layers;
use crate::compare::{Side, verdict::verdict};
use crate::files::{FileError, kind};
use crate::film::{Film, REPLICATES};
use crate::layers::Layer;
use crate::output::{ExrChannels, Extra, Value, write_exr_with};
use crate::provenance::{Provenance, integrator_name, light_name};
use crate::scene::Scene;
use crate::settings::{Integrator, LightParts, Overrides, Settings};
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// The change of brightness that comparisons with goldens detect, unless another is asked for.
const POWER: f64 = 0.01;

/// Most samples per pixel of a golden, unless another number is asked for.
pub(super) const MOST_SAMPLES: u64 = 4096;

/// How to make goldens.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Width and height; by default the scene's, scaled to 64 pixels wide.
    pub size: Option<[u32; 2]>,
    /// The relative change of the whole picture's brightness that a comparison shall detect with 95 % probability; by default 1 %.
    pub power: Option<f64>,
    /// Most samples per pixel; by default 4096.
    pub most_samples: Option<u64>,
    /// The false-alarm rate of that comparison.
    pub alpha: f64,
    /// Layers that they hold, beside those that the goldens before them held.
    pub layers: Vec<Layer>,
}

impl Wanted {
    pub(super) fn power(&self) -> f64 {
        self.power.unwrap_or(POWER)
    }

    /// Whether a golden is as asked for; without a wish it is.
    pub(super) fn met_by(&self, golden: &Side) -> bool {
        let samples = golden.noise.as_ref().map_or(0, |n| n.samples[0]);
        self.size.is_none_or(|size| size == golden.size)
            && self.most_samples.is_none_or(|most| samples <= most)
            && self
                .power
                .is_none_or(|power| smallest_change(golden, self.alpha) <= power)
    }

    /// Whether the golden in a file has the layers.
    pub(super) fn has_layers(&self, golden: &Path) -> bool {
        let held = layers::held(golden);
        self.layers.iter().all(|l| held.contains(l))
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
    /// Why its stated error may be far from the true one.
    pub doubt: Option<String>,
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
        if let Some(doubt) = &self.doubt {
            write!(f, "; its stated error is in doubt: {doubt}")?;
        }
        match &self.replaced {
            Some(why) => write!(f, "; the golden before it: {why}"),
            None => Ok(()),
        }
    }
}

impl Bless {
    /// Warnings: comparisons detect only larger changes than `wanted`; its error is in doubt.
    pub fn warnings(&self, wanted: &Wanted) -> Vec<String> {
        let short = self.short.then(|| {
            format!(
                "comparisons with this golden will detect a change of the whole picture's brightness by {:.2} % or more, but \
                 --power asks for {:.2} %; raise --max-spp",
                100.0 * self.power,
                100.0 * wanted.power()
            )
        });
        let doubt = self.doubt.as_ref().map(|doubt| {
            format!(
                "the stated error of this golden is in doubt: {doubt}; more samples help (a smaller --power, a larger --max-spp)"
            )
        });
        short.into_iter().chain(doubt).collect()
    }
}

/// Longest text of a scene, in bytes, that a golden keeps: goldens stay small.
const KEPT_TEXT: usize = 1 << 16;

/// The attribute that has it.
pub(super) const SCENE_TEXT: &str = "scene_text";

/// Refuses to replace a golden that git-lfs has not fetched: nobody has seen whether it still passes.
pub(super) fn check_fetched(path: &Path) -> Result<(), FileError> {
    if kind::is_lfs_pointer(path) {
        let why = "a git-lfs pointer, not the golden itself; run `git lfs pull` first";
        return Err(FileError::content(path, why));
    }
    Ok(())
}

/// Writes a golden, with the text of its scene. The time that it took is left out, so that the same picture is the same file.
pub(super) fn write(
    path: &Path,
    film: &Film,
    provenance: &Provenance,
    mut beside: Extra,
) -> Result<(), FileError> {
    let untimed = Provenance {
        seconds: 0.0,
        ..provenance.clone()
    };
    check_fetched(path)?;
    if provenance.scene_text.len() <= KEPT_TEXT {
        let text = Value::Text(provenance.scene_text.clone());
        beside.entries.push((SCENE_TEXT, text));
    }
    write_exr_with(path, film, &untimed, ExrChannels::All, &beside)
}

/// A golden is no evidence if comparisons with it do not detect a change of the whole picture's brightness by so much: it holds
/// next to no light beside its noise.
pub(super) const NO_EVIDENCE: f64 = 1.0;

/// The smallest change of the whole picture's brightness that a comparison with a similar picture detects.
pub(super) fn smallest_change(picture: &Side, alpha: f64) -> f64 {
    let seen = verdict(picture, picture, alpha).sensitivity;
    seen.first().map_or(f64::INFINITY, |s| s.change)
}

pub(super) fn no_evidence(name: &str) -> String {
    format!(
        "{name}: the picture holds next to no light beside its noise: a golden of it is no evidence, since even a doubling of its \
         brightness would pass; it needs more samples (--max-spp)"
    )
}

/// Refuses a golden that is no evidence. A picture that is `black` by construction is.
pub(super) fn check_evidence(golden: &Side, alpha: f64, black: bool) -> Result<(), String> {
    if black || smallest_change(golden, alpha) < NO_EVIDENCE {
        return Ok(());
    }
    Err(no_evidence(&golden.name))
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
    pub fn read(golden: &Side) -> Result<Self, String> {
        let (name, find) = (&golden.name, |key| golden.origin(key));
        let lacks = |key: &str| format!("{name}: its header has no {key}");
        let noise = golden.noise.as_ref().ok_or_else(|| {
            format!(
                "{name}: it has no error layers, no sample counts, or fewer than two replicates"
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
        let strata: u32 = number(golden, "strata").ok_or_else(|| lacks("strata"))?;
        check_strata(name, strata, samples, noise.replicates)?;
        Ok(Self {
            scene_hash: named("scene_hash")?.into(),
            samples,
            size: golden.size,
            seed: number(golden, "seed").ok_or_else(|| lacks("seed"))?,
            strata,
            max_depth: number(golden, "max_depth").ok_or_else(|| lacks("max_depth"))?,
            shadow_rays: number(golden, "shadow_rays").ok_or_else(|| lacks("shadow_rays"))?,
            light,
            integrator,
        })
    }

    /// Refuses a picture of paths of another length than the scene's: its light differs. Size, strata and seed do not change the light,
    /// and are the picture's. `what` names it.
    pub fn check_settings(&self, scene: &Scene, what: &str) -> Result<(), String> {
        let now = Settings::resolve(scene, &Overrides::default()).max_depth;
        if now == self.max_depth {
            return Ok(());
        }
        Err(format!(
            "{what} has max_depth {}, but the scene has {now}",
            self.max_depth
        ))
    }

    /// The golden's settings with another seed: with the same seed both would have the same noise.
    pub fn settings(&self, scene: &Scene) -> Settings {
        let overrides = Overrides {
            size: Some(self.size),
            max_depth: Some(self.max_depth),
            strata: Some(self.strata),
            seed: Some(other_than(self.seed)),
            shadow_rays: Some(self.shadow_rays),
            light: Some(self.light),
            integrator: Some(self.integrator),
            light_paths: None,
        };
        Settings::resolve(scene, &overrides)
    }
}

/// The seed of pictures that are compared with a golden of this seed.
fn other_than(seed: u32) -> u32 {
    seed.wrapping_add(1)
}

/// The same for a golden that may not say its own.
pub(super) fn other_seed(golden: &Side) -> Option<u32> {
    number(golden, "seed").map(other_than)
}

/// Refuses strata that don't fit the samples: a golden has whole rounds of strata², which take turns among its replicates.
fn check_strata(name: &str, strata: u32, samples: u64, replicates: u32) -> Result<(), String> {
    let round = u64::from(strata) * u64::from(strata);
    let whole = round > 0 && samples.is_multiple_of(round);
    let wrong = if !whole {
        format!("{samples} samples per pixel are no whole rounds of {strata} x {strata} strata")
    } else if samples / round < REPLICATES as u64 && samples / round != u64::from(replicates) {
        let rounds = samples / round;
        format!(
            "{samples} samples per pixel are {rounds} rounds of {strata} x {strata} strata, but it has {replicates} replicates"
        )
    } else {
        return Ok(());
    };
    Err(format!("{name}: damaged header: {wrong}"))
}

fn number<T: FromStr>(golden: &Side, key: &str) -> Option<T> {
    golden.origin(key)?.parse().ok()
}
