//! The report of a run: JSON for scripts.

use crate::engine::{Counters, DeviceInfo};
use crate::files::FileError;
use crate::files::atomic;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::provenance::{Provenance, count_or_mean};
use crate::stats::denoised::{Rms, Statement, Why};
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;

/// A run summary. Unknown numbers are null, never NaN.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// The scene file's name.
    pub scene: String,
    /// Hash of scene and settings.
    pub scene_hash: String,
    /// The device.
    pub adapter: Adapter,
    /// Width and height of the whole picture.
    pub resolution: [u32; 2],
    /// Pixel rectangles x0, y0, x1, y1 that were asked for; empty for the whole picture.
    pub regions: Vec<[u32; 4]>,
    /// Seed.
    pub seed: u32,
    /// Mean samples per pixel over the pixels that have samples, including samples of earlier runs.
    #[serde(serialize_with = "count_or_mean")]
    pub spp: f64,
    /// Which condition ended the run.
    pub stop_reason: String,
    /// Where the time went.
    pub seconds: Seconds,
    /// Camera paths of this run.
    pub paths: u64,
    /// Light paths of this run, from lights by way of mirrors and glass; 0 where there are none.
    pub light_paths: u64,
    /// Rays of this run, shadow rays and those of light paths included.
    pub rays: u64,
    /// Over the rendering time.
    pub paths_per_second: Option<f64>,
    /// Over the rendering time.
    pub rays_per_second: Option<f64>,
    /// Of the picture; null while nothing is known.
    pub relative_error: Option<f64>,
    /// Standard error of `relative_error`.
    pub relative_error_uncertainty: Option<f64>,
    /// Why the true error may be far above `relative_error`, in words; null if there is no reason.
    pub relative_error_doubt: Option<String>,
    /// Of the pixels that have samples; null if it is not finite.
    pub mean_luminance: f64,
    /// Paths of this run cut at max_depth.
    pub truncated_paths: u64,
    /// Samples of this run left out because they were NaN or infinite.
    pub nonfinite_samples: u64,
    /// What this run has done.
    pub run: Work,
    /// What is in the picture: the work of this run and of all before.
    pub film: Work,
    /// How wrong the denoised picture is; only there if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoised: Option<DenoisedReport>,
}

/// Key `denoised`, and the report of `etendue develop`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DenoisedReport {
    /// What has denoised it.
    pub denoiser: String,
    /// Of the unbiased picture.
    pub raw: RmsReport,
    /// Of the mean of six denoised pictures.
    pub mean: RmsReport,
    /// Of their mixture with the unbiased one, which is the denoised picture.
    pub mixture: RmsReport,
    /// Change of the mean luminance by the denoiser, as a share.
    pub mean_light: f64,
    /// The same for the mixture.
    pub mixture_light: f64,
    /// Pixels of lamps, which keep the values of the unbiased picture.
    pub lamp_pixels: usize,
}

/// A root mean square error of luminance over the mean luminance; null if it is not known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RmsReport {
    /// The error.
    pub rms_error: Option<f64>,
    /// Its standard error.
    pub uncertainty: Option<f64>,
    /// Why it is not known, in words.
    pub not_known: Option<String>,
}

impl RmsReport {
    fn new(rms: &Rms) -> Self {
        Self {
            rms_error: rms.value(),
            uncertainty: rms.error(),
            not_known: rms.why().map(Why::to_string),
        }
    }
}

impl DenoisedReport {
    /// Of what `denoiser` has made, with so many pixels of lamps.
    pub fn new(denoiser: &str, statement: &Statement, lamp_pixels: usize) -> Self {
        Self {
            denoiser: denoiser.into(),
            raw: RmsReport::new(&statement.raw),
            mean: RmsReport::new(&statement.mean),
            mixture: RmsReport::new(&statement.mixture),
            mean_light: statement.light,
            mixture_light: statement.mixture_light,
            lamp_pixels,
        }
    }

    /// Indented JSON and a line break.
    pub fn to_json(&self) -> String {
        let mut json = serde_json::to_string_pretty(self).expect("plain data");
        json.push('\n');
        json
    }
}

/// Keys `run` and `film`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Work {
    /// Mean samples per pixel over the pixels that have samples.
    #[serde(serialize_with = "count_or_mean")]
    pub spp: f64,
    /// Camera paths.
    pub paths: u64,
    /// Rendering.
    pub seconds: f64,
}

/// Key `adapter`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "see DeviceInfo")]
pub struct Adapter {
    pub name: String,
    pub driver: String,
    pub backend: String,
}

/// Key `seconds`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seconds {
    /// Making the kernel.
    pub compile: f64,
    /// Rendering.
    pub render: f64,
    /// The whole run.
    pub total: f64,
}

/// The facts about a run that are not in the film.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    /// The scene file's name as it was given.
    pub scene: String,
    /// What it ran on.
    pub device: &'a DeviceInfo,
    /// What `--region` asked for; empty for the whole picture.
    pub regions: &'a [Rect],
    /// Which condition ended it.
    pub stop_reason: String,
    /// Where the time went.
    pub seconds: Seconds,
    /// Its counts.
    pub counters: Counters,
}

impl Report {
    /// The report of `run`, which produced `film`, as `provenance` describes it.
    pub fn new(run: Run, film: &Film, provenance: &Provenance) -> Self {
        let rate = |count: u64| {
            let seconds = run.seconds.render;
            (seconds > 0.0).then(|| count as f64 / seconds)
        };
        let pixels: u64 = film.coverage.cells().map(|c| c.0.area()).sum();
        Self {
            version: provenance.version.clone(),
            scene: run.scene,
            scene_hash: provenance.scene_hash.clone(),
            adapter: Adapter {
                name: run.device.name.clone(),
                driver: run.device.driver.clone(),
                backend: run.device.backend.clone(),
            },
            resolution: film.size,
            regions: run
                .regions
                .iter()
                .map(|r| [r.x0, r.y0, r.x1, r.y1])
                .collect(),
            seed: provenance.settings.seed,
            spp: film.coverage.mean(),
            stop_reason: run.stop_reason,
            seconds: run.seconds,
            paths: run.counters.paths,
            light_paths: run.counters.light_paths,
            rays: run.counters.rays,
            paths_per_second: rate(run.counters.paths),
            rays_per_second: rate(run.counters.rays),
            relative_error: provenance.relative_error,
            relative_error_uncertainty: provenance.relative_error_uncertainty,
            relative_error_doubt: provenance.relative_error_doubt.clone(),
            mean_luminance: film.mean_luminance(),
            truncated_paths: run.counters.truncated,
            nonfinite_samples: run.counters.nonfinite,
            run: Work {
                spp: run.counters.paths as f64 / pixels.max(1) as f64,
                paths: run.counters.paths,
                seconds: run.seconds.render,
            },
            film: Work {
                spp: film.coverage.mean(),
                paths: provenance.counters.paths,
                seconds: provenance.seconds,
            },
            denoised: None,
        }
    }

    /// Indented JSON and a line break, keys in the order of the fields.
    pub fn to_json(&self) -> String {
        // This can't fail: the report has only strings, numbers, lists and fixed keys. serde_json writes numbers that
        // are not finite as null.
        let mut json = serde_json::to_string_pretty(self).expect("a report is plain data");
        json.push('\n');
        json
    }

    /// Writes it to a file, or to standard output if `path` is `-`.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let json = self.to_json();
        if path == Path::new("-") {
            let mut out = io::stdout().lock();
            return out
                .write_all(json.as_bytes())
                .and_then(|()| out.flush())
                .map_err(|e| FileError::io(Path::new("standard output"), "cannot write", &e));
        }
        atomic::replace(path, |file| file.write_all(json.as_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::tests::{device, example};
    use serde_json::{Value, json};

    fn report(film: &Film, render: f64) -> Value {
        let run = Run {
            scene: "a.toml".into(),
            device: &device("llvmpipe"),
            regions: &[film.bounds],
            stop_reason: "spp".into(),
            seconds: Seconds {
                compile: 0.5,
                render,
                total: 3.0,
            },
            counters: Counters {
                paths: 8,
                rays: 20,
                truncated: 1,
                light_paths: 0,
                nonfinite: 0,
                first_nonfinite: None,
            },
        };
        let mut provenance = example(film.size);
        provenance.describe(film);
        serde_json::from_str(&Report::new(run, film, &provenance).to_json()).unwrap()
    }

    #[test]
    fn keys_are_those_of_the_interface() {
        let rect = Rect::whole([2, 1]);
        let mut film = Film::new([2, 1], rect, 1);
        film.put_samples(rect, 0..4, vec![[[0.5, 0.5, 0.5, 0.25]; 4]; 2]);
        let expected = json!({
            "version": "0.1.0",
            "scene": "a.toml",
            "scene_hash": "0123456789abcdef".repeat(4),
            "adapter": {"name": "llvmpipe", "driver": "llvmpipe driver 1", "backend": "gpu"},
            "resolution": [2, 1],
            "regions": [[0, 0, 2, 1]],
            "seed": u32::MAX,
            "spp": 4,
            "stop_reason": "spp",
            "seconds": {"compile": 0.5, "render": 2.0, "total": 3.0},
            "paths": 8,
            "rays": 20,
            "paths_per_second": 4.0,
            "rays_per_second": 10.0,
            "relative_error": 0.0,
            "relative_error_uncertainty": 0.0,
            "relative_error_doubt": null,
            "light_paths": 0,
            "mean_luminance": 0.5,
            "truncated_paths": 1,
            "nonfinite_samples": 0,
            "run": {"spp": 4, "paths": 8, "seconds": 2.0},
            "film": {"spp": 4, "paths": 12, "seconds": 1.5},
        });
        assert_eq!(report(&film, 2.0), expected);
    }

    #[test]
    fn unknown_values_are_null() {
        let rect = Rect::whole([1, 1]);
        let mut film = Film::new([1, 1], rect, 1);
        film.put_samples(rect, 0..1, vec![[[f64::INFINITY; 4]; 4]]);
        let r = report(&film, 0.0);
        for key in [
            "relative_error",
            "relative_error_uncertainty",
            "mean_luminance",
            "paths_per_second",
            "rays_per_second",
        ] {
            assert_eq!(r[key], Value::Null, "{key}");
        }
    }
}
