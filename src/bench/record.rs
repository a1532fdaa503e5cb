//! JSON lines: what was measured, for scripts. Each line is an object whose key `type` says which.
//!
//! | type | one for each |
//! |---|---|
//! | `reference` | scene |
//! | `engine` | scene and engine: seconds to compile and warm up, the slope |
//! | `picture` | scene, engine, sample count and seed |
//! | `point` | scene, engine and sample count: means over the seeds, each with its standard deviation |
//! | `report_table` | cell of the report's Figure 9 |
//!
//! Numbers that are not known are null, never NaN.

use super::figure9::Cell;
use super::summary::{Spread, slope};
use super::{Entrant, Measurement, Point, Reference, Results};
use serde::Serialize;

/// A line. Keys are the fields' names.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[expect(missing_docs, reason = "see the types that they are taken from")]
pub enum Record<'a> {
    Reference {
        scene: &'a str,
        scene_hash: &'a str,
        made_by: &'a str,
        file: Option<String>,
        cached: bool,
        samples: Option<u64>,
        seed: Option<u32>,
        relative_error: Option<f64>,
    },
    Engine {
        scene: &'a str,
        scene_hash: &'a str,
        engine: &'static str,
        adapter: &'a str,
        driver: &'a str,
        resolution: [u32; 2],
        mean_path_length: f64,
        seconds: Ready,
        slope: Option<Spread>,
    },
    Picture {
        scene: &'a str,
        scene_hash: &'a str,
        engine: &'static str,
        samples: u64,
        seed: u32,
        seconds: Rendering<f64>,
        paths: u64,
        rays: u64,
        mse: f64,
        relative_mse: f64,
        trimmed_relative_mse: f64,
        flip: f64,
        claimed_mse: Option<f64>,
        claimed_relative_error: Option<f64>,
    },
    Point(Box<PointRecord<'a>>),
    ReportTable(&'a Cell),
}

/// A line of type `point`.
#[derive(Debug, Serialize)]
#[expect(missing_docs, reason = "see Point")]
pub struct PointRecord<'a> {
    pub scene: &'a str,
    pub scene_hash: &'a str,
    pub engine: &'static str,
    pub samples: u64,
    pub seeds: usize,
    pub seconds: Rendering<Spread>,
    pub paths_per_second: Spread,
    pub rays_per_second: Spread,
    pub rays_per_path: Spread,
    pub mean_path_length: f64,
    pub mse: Spread,
    pub claimed_mse: Option<Spread>,
    pub relative_mse: Spread,
    pub trimmed_relative_mse: Spread,
    pub flip: Spread,
    pub true_relative_error: Option<Spread>,
    pub claimed_relative_error: Option<Spread>,
    pub efficiency: Option<Spread>,
    pub ratio: Option<Spread>,
}

/// Seconds before the first picture that counts.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Ready {
    /// Making and compiling the kernel.
    pub compile: f64,
    /// The first sample of every pixel.
    pub warm_up: f64,
}

/// Seconds of a picture.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Rendering<T> {
    /// In the engine, reading back included: what rates and efficiency are over.
    pub render: T,
    /// The part of it that is reading back.
    pub read_back: T,
}

/// The lines about one scene.
pub fn lines(results: &Results) -> String {
    let mut text = line(&reference(results, &results.reference));
    for entrant in &results.entrants {
        text += &line(&engine(results, entrant));
    }
    for m in &results.measurements {
        text += &line(&picture(results, m));
    }
    for p in results.points() {
        text += &line(&point(results, &p));
    }
    text
}

/// A record and a line break.
pub fn line(record: &Record) -> String {
    // Strings, numbers and fixed keys: nothing that could fail. serde_json writes what is not finite as null.
    serde_json::to_string(record).expect("a record is plain data") + "\n"
}

fn reference<'a>(r: &'a Results, reference: &'a Reference) -> Record<'a> {
    Record::Reference {
        scene: &r.scene,
        scene_hash: &r.scene_hash,
        made_by: &reference.about,
        file: reference.path.as_ref().map(|p| p.display().to_string()),
        cached: reference.cached,
        samples: reference.samples,
        seed: reference.seed,
        relative_error: reference.truth.noise_floor(),
    }
}

fn engine<'a>(r: &'a Results, entrant: &'a Entrant) -> Record<'a> {
    Record::Engine {
        scene: &r.scene,
        scene_hash: &r.scene_hash,
        engine: entrant.kind.name(),
        adapter: &entrant.device.name,
        driver: &entrant.device.driver,
        resolution: r.settings.size,
        mean_path_length: r.mean_path_length,
        seconds: Ready {
            compile: entrant.compile_seconds,
            warm_up: entrant.warm_up_seconds,
        },
        slope: slope(entrant.kind, &r.measurements),
    }
}

fn picture<'a>(r: &'a Results, m: &Measurement) -> Record<'a> {
    Record::Picture {
        scene: &r.scene,
        scene_hash: &r.scene_hash,
        engine: m.engine.name(),
        samples: m.samples,
        seed: m.seed,
        seconds: Rendering {
            render: m.seconds,
            read_back: m.read_back_seconds,
        },
        paths: m.counters.paths,
        rays: m.counters.rays,
        mse: m.errors.mse,
        relative_mse: m.errors.relative_mse,
        trimmed_relative_mse: m.errors.trimmed_relative_mse,
        flip: m.errors.flip,
        claimed_mse: m.errors.claimed_mse,
        claimed_relative_error: m.errors.claimed_relative_error,
    }
}

fn point<'a>(r: &'a Results, p: &Point) -> Record<'a> {
    Record::Point(Box::new(PointRecord {
        scene: &r.scene,
        scene_hash: &r.scene_hash,
        engine: p.engine.name(),
        samples: p.samples,
        seeds: p.seeds,
        seconds: Rendering {
            render: p.seconds,
            read_back: p.read_back,
        },
        paths_per_second: p.paths_per_second,
        rays_per_second: p.rays_per_second,
        rays_per_path: p.rays_per_path,
        mean_path_length: r.mean_path_length,
        mse: p.mse,
        claimed_mse: p.claimed_mse,
        relative_mse: p.relative_mse,
        trimmed_relative_mse: p.trimmed_relative_mse,
        flip: p.flip,
        true_relative_error: p.true_relative_error,
        claimed_relative_error: p.claimed_relative_error,
        efficiency: p.efficiency,
        ratio: p.ratio,
    }))
}
