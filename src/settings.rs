//! The render settings: flags override the scene file, which overrides the defaults.

use crate::film::splats;
use crate::scene::{DEFAULT_MAX_DEPTH, DEFAULT_STRATA, Primitive, Scene};
use serde::{Deserialize, Serialize};

/// How light travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// The full rendering equation.
    Path,
    /// Mirrors and glass are followed, other surfaces take direct light only.
    Whitted,
}

/// Which light is kept, by the number of scatterings between the lamp and the eye.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct LightParts {
    /// Scattered nowhere.
    pub emitted: bool,
    /// Scattered exactly once.
    pub direct: bool,
    /// Scattered twice or more.
    pub indirect: bool,
}

impl LightParts {
    /// The whole picture.
    pub const ALL: Self = Self {
        emitted: true,
        direct: true,
        indirect: true,
    };

    /// Whether light that has been scattered `times` times belongs to them.
    pub fn keeps(&self, times: u32) -> bool {
        match times {
            0 => self.emitted,
            1 => self.direct,
            _ => self.indirect,
        }
    }
}

/// Flags that override the scene's hints; `None` leaves the choice to scene or default.
#[derive(Debug, Clone, Copy, Default)]
pub struct Overrides {
    /// `--size`: width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// `--max-depth`.
    pub max_depth: Option<u32>,
    /// `--strata`.
    pub strata: Option<u32>,
    /// `--seed`.
    pub seed: Option<u32>,
    /// `--shadow-rays`.
    pub shadow_rays: Option<u32>,
    /// `--light`.
    pub light: Option<LightParts>,
    /// `--integrator`.
    pub integrator: Option<Integrator>,
    /// `--light-paths`.
    pub light_paths: Option<bool>,
}

impl Overrides {
    /// These, and for what they leave open those of `held`, but for what `changed` has: values that a scene file has got since.
    pub fn or_held(&self, held: &Settings, changed: &Changed) -> Self {
        let unless = |changed: bool, value: u32| (!changed).then_some(value);
        let size = (!changed.size).then_some(held.size);
        Self {
            size: self.size.or(size),
            max_depth: self.max_depth.or(unless(changed.max_depth, held.max_depth)),
            strata: self.strata.or(unless(changed.strata, held.strata)),
            seed: self.seed.or(unless(changed.seed, held.seed)),
            shadow_rays: self.shadow_rays.or(Some(held.shadow_rays)),
            light: self.light.or(Some(held.light)),
            integrator: self.integrator.or(Some(held.integrator)),
            light_paths: self.light_paths.or(Some(held.light_paths)),
        }
    }

    /// The flags whose values differ from `held`.
    pub fn against(&self, held: &Settings) -> Vec<&'static str> {
        let all = [
            ("--size", self.size.is_some_and(|x| x != held.size)),
            (
                "--max-depth",
                self.max_depth.is_some_and(|x| x != held.max_depth),
            ),
            ("--strata", self.strata.is_some_and(|x| x != held.strata)),
            ("--seed", self.seed.is_some_and(|x| x != held.seed)),
            (
                "--shadow-rays",
                self.shadow_rays.is_some_and(|x| x != held.shadow_rays),
            ),
            ("--light", self.light.is_some_and(|x| x != held.light)),
            (
                "--integrator",
                self.integrator.is_some_and(|x| x != held.integrator),
            ),
            (
                "--light-paths",
                self.light_paths.is_some_and(|x| x != held.light_paths),
            ),
        ];
        all.into_iter().filter(|f| f.1).map(|f| f.0).collect()
    }

    /// The flags to add so that `resolved` becomes `held`, where the scene file has got other values since.
    pub fn to_add(&self, held: &Settings, resolved: &Settings) -> Vec<String> {
        let ([w, h], [depth, strata, seed]) = (held.size, [held.max_depth, held.strata, held.seed]);
        let all = [
            (
                self.size.is_none() && resolved.size != held.size,
                format!("--size {w}x{h}"),
            ),
            (
                self.max_depth.is_none() && resolved.max_depth != depth,
                format!("--max-depth {depth}"),
            ),
            (
                self.strata.is_none() && resolved.strata != strata,
                format!("--strata {strata}"),
            ),
            (
                self.seed.is_none() && resolved.seed != seed,
                format!("--seed {seed}"),
            ),
        ];
        all.into_iter().filter(|f| f.0).map(|f| f.1).collect()
    }
}

/// Which hints of a scene file differ from those of an older version of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[expect(missing_docs, reason = "the fields are the hints")]
pub struct Changed {
    pub size: bool,
    pub max_depth: bool,
    pub strata: bool,
    pub seed: bool,
}

impl Changed {
    /// From `old` to `new`.
    pub fn between(old: &Scene, new: &Scene) -> Self {
        Self {
            size: old.camera.resolution != new.camera.resolution,
            max_depth: old.render.max_depth != new.render.max_depth,
            strata: old.render.strata != new.render.strata,
            seed: old.render.seed != new.render.seed,
        }
    }
}

/// The resolved choices. Together with the scene they fix every sample's value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// Width and height of the whole picture in pixels.
    pub size: [u32; 2],
    /// Path vertices after the eye, >= 1.
    pub max_depth: u32,
    /// Whether `max_depth` is the default: truncated paths are then worth a warning.
    pub max_depth_is_default: bool,
    /// Pixel cells per side, >= 1.
    pub strata: u32,
    /// Seed of every random number.
    pub seed: u32,
    /// Light samples at every vertex, over all lights together, >= 1.
    pub shadow_rays: u32,
    /// Which light is kept.
    pub light: LightParts,
    /// How light travels.
    pub integrator: Integrator,
    /// Whether light paths are traced where the scene has a use for them; in a film, whether they were.
    #[serde(default)]
    pub light_paths: bool,
}

impl Settings {
    /// Flags first, then the scene's hints, then the defaults.
    pub fn resolve(scene: &Scene, flags: &Overrides) -> Self {
        let hints = &scene.render;
        let max_depth = flags.max_depth.or(hints.max_depth);
        Self {
            size: flags.size.unwrap_or(scene.camera.resolution),
            max_depth: max_depth.unwrap_or(DEFAULT_MAX_DEPTH),
            max_depth_is_default: max_depth.is_none(),
            strata: flags.strata.or(hints.strata).unwrap_or(DEFAULT_STRATA),
            seed: flags.seed.or(hints.seed).unwrap_or(0),
            shadow_rays: flags.shadow_rays.unwrap_or(1),
            light: flags.light.unwrap_or(LightParts::ALL),
            integrator: flags.integrator.unwrap_or(Integrator::Path),
            light_paths: flags.light_paths.unwrap_or(true),
        }
    }

    /// Whether paths go on from surfaces to look for light. Otherwise all light but that of lamps, mirrors and glass comes from
    /// light samples.
    pub fn finds_light_by_chance(&self) -> bool {
        self.integrator == Integrator::Path && self.light.indirect && self.max_depth > 2
    }

    /// Whether light paths are traced where a scene has a use for them.
    pub(crate) fn allows_light_paths(&self) -> bool {
        let pixels = self.size.map(u64::from).iter().product::<u64>();
        self.light_paths && self.finds_light_by_chance() && pixels <= splats::MAX_PIXELS
    }

    /// Whether light paths may be traced in a picture of `scene`: something must be specular.
    pub(crate) fn may_trace_light(&self, scene: &Scene) -> bool {
        let specular = |p: &Primitive| scene.materials[p.material].bsdf.kind().is_specular();
        self.allows_light_paths() && scene.primitives.iter().any(specular)
    }

    /// Whether light can arrive that has been scattered by a surface.
    fn keeps_scattered(&self) -> bool {
        (self.light.direct && self.max_depth > 1) || (self.light.indirect && self.max_depth > 2)
    }

    /// Whether a picture of `scene` is black by construction: no light shines, or none of the light to be kept can arrive.
    pub fn is_black(&self, scene: &Scene) -> bool {
        let shines = scene.lights.iter().any(|l| l.radiance.max_element() > 0.0);
        let scatters = |p: &Primitive| {
            let bsdf = scene.materials[p.material].bsdf;
            bsdf.is_dielectric() || bsdf.colors().iter().any(|c| c.max_element() > 0.0)
        };
        let scattered = self.keeps_scattered() && scene.primitives.iter().any(scatters);
        !shines || !(self.light.emitted || scattered)
    }

    /// Samples in one round, which visits every stratum once.
    pub fn round(&self) -> u64 {
        u64::from(self.strata) * u64::from(self.strata)
    }
}
