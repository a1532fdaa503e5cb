//! Where a film comes from: enough to render it again, and to check which films can be merged with it.

pub mod hash;

use crate::engine::{Counters, DeviceInfo};
use crate::film::Film;
use crate::film::error::RelativeError;

use crate::scene::{Canonical, Scene};
use crate::settings::{Integrator, LightParts, Settings};
use hash::hash_of;
use serde::{Deserialize, Serialize, Serializer};

/// Incremented whenever a change to the program changes the value of any sample.
pub const SAMPLER_VERSION: u32 = 13;

/// The scene, program and devices that a film was rendered with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The program's name.
    pub software: String,
    /// Its version.
    pub version: String,
    /// [`SAMPLER_VERSION`] of the program.
    pub sampler_version: u32,
    /// The scene's title.
    pub scene_title: Option<String>,
    /// [`scene_hash`](hash::scene_hash) of scene and settings.
    pub scene_hash: String,
    /// The scene file's own text; of a scene that a program has rendered, the scene written out.
    pub scene_text: String,
    /// The settings, which together with the scene determine the samples.
    pub settings: Settings,
    /// The sample numbers that were asked for, where they are a slice of a picture's: the first, and one more than the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slice: Option<[u64; 2]>,
    /// Samples of a covered pixel on average.
    #[serde(serialize_with = "count_or_mean")]
    pub samples: f64,
    /// Independent replicates behind the error of the covered pixel that has the fewest.
    pub replicates: u32,
    /// What it was rendered on, in order of first use.
    pub devices: Vec<DeviceUse>,
    /// Rendering time over all runs.
    pub seconds: f64,
    /// Counts over all runs.
    pub counters: Counters,
    /// The picture's [relative error](Film::relative_error), where it is known.
    pub relative_error: Option<f64>,
    /// Its standard error.
    #[serde(default)]
    pub relative_error_uncertainty: Option<f64>,
    /// Why the true error may be far larger, in words.
    #[serde(default)]
    pub relative_error_doubt: Option<String>,
    /// Whether the picture is black by construction ([`Settings::is_black`]).
    #[serde(default)]
    pub black: bool,
}

/// A device's share of the work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeviceUse {
    /// Which device.
    pub device: DeviceInfo,
    /// Camera paths made there: samples times pixels.
    pub samples: u64,
    /// Rendering time there.
    pub seconds: f64,
}

impl Provenance {
    /// For a new film of `scene`, whose file reads `scene_text`.
    pub fn new(scene: &Scene, scene_text: impl Into<String>, settings: &Settings) -> Self {
        Self::of(&Canonical::new(scene), scene_text, settings)
    }

    /// The same of a scene that was put in order.
    pub fn of(scene: &Canonical, scene_text: impl Into<String>, settings: &Settings) -> Self {
        Self {
            software: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
            sampler_version: SAMPLER_VERSION,
            scene_title: scene.scene().title.clone(),
            scene_hash: hash_of(scene, settings),
            scene_text: scene_text.into(),
            settings: settings.clone(),
            slice: None,
            samples: 0.0,
            replicates: 0,
            devices: Vec::new(),
            seconds: 0.0,
            counters: Counters::default(),
            relative_error: None,
            relative_error_uncertainty: None,
            relative_error_doubt: None,
            black: settings.is_black(scene.scene()),
        }
    }

    /// Adds work done on `device`.
    pub fn add_work(&mut self, device: &DeviceInfo, counters: Counters, seconds: f64) {
        self.add_use(DeviceUse {
            device: device.clone(),
            samples: counters.paths,
            seconds,
        });
        self.counters += counters;
        self.seconds += seconds;
    }

    /// Takes samples, replicates and relative error from the film as it now stands. Returns that error, which takes a while to compute
    /// for a large picture.
    pub fn describe(&mut self, film: &Film) -> RelativeError {
        self.samples = film.coverage.mean();
        self.replicates = film.replicates().0;
        let error = self.error(film);
        self.relative_error = error.value;
        self.relative_error_uncertainty = error.uncertainty;
        self.relative_error_doubt = error.doubt.map(|d| d.to_string());
        error
    }

    /// The relative error of its film: zero if the picture is black, and is so by construction.
    pub fn error(&self, film: &Film) -> RelativeError {
        film.relative_error().of_black(self.black)
    }

    /// Adds the work of a film that is merged into this one. Call [`describe`](Self::describe) for the sum afterwards.
    pub fn absorb(&mut self, other: &Self) {
        // The sum is a slice no longer.
        self.slice = None;
        for used in &other.devices {
            self.add_use(used.clone());
        }
        self.counters += other.counters;
        self.seconds += other.seconds;
    }

    fn add_use(&mut self, new: DeviceUse) {
        match self.devices.iter_mut().find(|u| u.device == new.device) {
            Some(used) => {
                used.samples += new.samples;
                used.seconds += new.seconds;
            }
            None => self.devices.push(new),
        }
    }

    /// Whether sample k of a pixel has the same value in both, so that one film can be resumed as the other, and disjoint
    /// samples of both can be merged. The error lists all differences, with the value of `self` first.
    pub fn same_samples(&self, other: &Self) -> Result<(), String> {
        let (a, b) = (&self.settings, &other.settings);
        let mut differ = Vec::new();
        let mut check = |what: &str, a: String, b: String| {
            if a != b {
                differ.push(format!("{what} is {a} and {b}"));
            }
        };
        let size = |s: &Settings| format!("{}x{}", s.size[0], s.size[1]);
        check("size", size(a), size(b));
        check(
            "max_depth",
            a.max_depth.to_string(),
            b.max_depth.to_string(),
        );
        check("light", light_name(a.light), light_name(b.light));
        check(
            "integrator",
            integrator_name(a.integrator).into(),
            integrator_name(b.integrator).into(),
        );
        check("strata", a.strata.to_string(), b.strata.to_string());
        check(
            "shadow_rays",
            a.shadow_rays.to_string(),
            b.shadow_rays.to_string(),
        );
        let paths = |s: &Settings| if s.light_paths { "traced" } else { "off" }.to_owned();
        check("light_paths", paths(a), paths(b));
        check("seed", a.seed.to_string(), b.seed.to_string());
        let sampler = |p: &Self| format!("{} (of version {})", p.sampler_version, p.version);
        if self.sampler_version != other.sampler_version {
            check("sampler", sampler(self), sampler(other));
        }
        let same_expected_settings = (a.size, a.max_depth, a.light, a.integrator)
            == (b.size, b.max_depth, b.light, b.integrator);
        // The hash covers those settings too. If one of them differs, the hash differs even for the same scene.
        if same_expected_settings {
            let scene = |p: &Self| {
                let title = p.scene_title.as_deref().unwrap_or("untitled");
                let hash: String = p.scene_hash.chars().take(12).collect();
                format!("{title:?} ({hash})")
            };
            if self.scene_hash != other.scene_hash {
                check("scene", scene(self), scene(other));
            }
        }
        if differ.is_empty() {
            Ok(())
        } else {
            Err(differ.join("; "))
        }
    }

    /// The names of all adapters used; empty when nothing was rendered.
    pub fn adapters(&self) -> String {
        self.join(|d| &d.name)
    }

    /// The drivers of all adapters used, in the same order.
    pub fn drivers(&self) -> String {
        self.join(|d| &d.driver)
    }

    fn join(&self, of: impl Fn(&DeviceInfo) -> &str) -> String {
        let all: Vec<&str> = self.devices.iter().map(|u| of(&u.device)).collect();
        all.join("; ")
    }
}

/// A mean of counts for JSON: 256 where it is whole, not 256.0.
pub(crate) fn count_or_mean<S: Serializer>(mean: &f64, to: S) -> Result<S::Ok, S::Error> {
    if mean.fract() == 0.0 && (0.0..=u32::MAX.into()).contains(mean) {
        to.serialize_u64(*mean as u64)
    } else {
        to.serialize_f64(*mean)
    }
}

/// The parts of `emitted,direct,indirect` that are kept, in the format of `--light`.
pub fn light_name(light: LightParts) -> String {
    let parts = [
        (light.emitted, "emitted"),
        (light.direct, "direct"),
        (light.indirect, "indirect"),
    ];
    let kept: Vec<&str> = parts.iter().filter(|p| p.0).map(|p| p.1).collect();
    kept.join(",")
}

/// As `--integrator` reads it.
pub fn integrator_name(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::Path => "path",
        Integrator::Whitted => "whitted",
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A provenance for films of 2 x 2 strata, without a scene behind it.
    pub(crate) fn example(size: [u32; 2]) -> Provenance {
        let mut p = Provenance {
            software: "etendue".into(),
            version: "0.1.0".into(),
            sampler_version: SAMPLER_VERSION,
            scene_title: Some("Kästchen – \"one\"".into()),
            scene_hash: "0123456789abcdef".repeat(4),
            scene_text: "title = \"Kästchen\" # text\n".into(),
            settings: Settings {
                size,
                max_depth: 64,
                max_depth_is_default: true,
                strata: 2,
                seed: u32::MAX,
                shadow_rays: 1,
                light: LightParts::ALL,
                integrator: Integrator::Path,
                light_paths: true,
            },
            slice: None,
            samples: 0.0,
            replicates: 0,
            devices: Vec::new(),
            seconds: 0.0,
            counters: Counters::default(),
            relative_error: None,
            relative_error_uncertainty: None,
            relative_error_doubt: None,
            black: false,
        };
        p.add_work(&device("llvmpipe"), counters(12), 1.5);
        p
    }

    pub(crate) fn device(name: &str) -> DeviceInfo {
        DeviceInfo {
            name: name.into(),
            driver: format!("{name} driver 1"),
            backend: "gpu".into(),
            software: true,
        }
    }

    fn counters(paths: u64) -> Counters {
        Counters {
            paths,
            rays: 3 * paths,
            truncated: 1,
            light_paths: paths,
            nonfinite: 1,
            first_nonfinite: Some((1, 2, paths)),
        }
    }

    #[test]
    fn every_setting_that_changes_samples_is_named() {
        let a = Provenance {
            sampler_version: 3,
            ..example([4, 3])
        };
        assert_eq!(a.same_samples(&a), Ok(()));
        type Edit = fn(&mut Provenance);
        let edits: [(&str, Edit); 9] = [
            ("size is 4x3 and 4x4", |p| p.settings.size[1] = 4),
            ("max_depth is 64 and 5", |p| p.settings.max_depth = 5),
            (
                "light is emitted,direct,indirect and emitted,indirect",
                |p| p.settings.light.direct = false,
            ),
            ("integrator is path and whitted", |p| {
                p.settings.integrator = Integrator::Whitted;
            }),
            ("strata is 2 and 3", |p| p.settings.strata = 3),
            ("shadow_rays is 1 and 2", |p| p.settings.shadow_rays = 2),
            ("seed is 4294967295 and 7", |p| p.settings.seed = 7),
            (
                "sampler is 3 (of version 0.1.0) and 9 (of version 9)",
                |p| (p.sampler_version, p.version) = (9, "9".into()),
            ),
            (
                "scene is \"Kästchen – \\\"one\\\"\" (0123456789ab) and \"untitled\" (ff)",
                |p| (p.scene_hash, p.scene_title) = ("ff".into(), None),
            ),
        ];
        for (expected, edit) in edits {
            let mut b = a.clone();
            edit(&mut b);
            assert_eq!(a.same_samples(&b).unwrap_err(), expected);
        }
        let mut other = a.clone();
        (other.version, other.scene_title) = ("0.2.0".into(), None);
        other.add_work(&device("another"), counters(1), 1.0);
        assert_eq!(
            a.same_samples(&other),
            Ok(()),
            "other adapters, titles and versions are allowed"
        );
    }

    #[test]
    fn work_adds_up_by_device() {
        let mut a = example([4, 3]);
        let mut b = example([4, 3]);
        b.add_work(&device("zebra"), counters(5), 0.25);
        a.absorb(&b);
        assert_eq!(a.adapters(), "llvmpipe; zebra");
        let work: Vec<_> = a.devices.iter().map(|d| (d.samples, d.seconds)).collect();
        assert_eq!(work, [(24, 3.0), (5, 0.25)]);
        assert_eq!((a.counters.paths, a.counters.rays), (29, 87));
        assert_eq!(a.counters.first_nonfinite, Some((1, 2, 12)));
        assert_eq!(a.seconds, 3.25);
    }

    #[test]
    fn json_keeps_everything() {
        let mut p = example([4, 3]);
        p.relative_error = Some(0.015625);
        for (samples, written) in [(256.0, "256,"), (255.125, "255.125,"), (0.0, "0,")] {
            p.samples = samples;
            let text = serde_json::to_string(&p).unwrap();
            assert!(
                text.contains(&format!("\"samples\":{written}\"replicates\"")),
                "{text}"
            );
            assert_eq!(serde_json::from_str::<Provenance>(&text).unwrap(), p);
        }
    }
}
