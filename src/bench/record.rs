//! The results as JSON lines. Each line is an object whose key `type` names its kind.
//!
//! | type | one for each |
//! |---|---|
//! | `reference` | scene |
//! | `engine` | scene and engine: seconds to compile and warm up, the slope |
//! | `picture` | scene, engine, sample count and seed |
//! | `point` | scene, engine and sample count: means over the seeds, each with its standard deviation |
//! | `report_table` | cell of the report's Figure 9 |
//! | `scaling` | series, engine and count |
//! | `crossover` | series and engine that looks at every surface: where the one with trees costs the same |
//!
//! Numbers that are not known are null, never NaN.

use super::figure9::Cell;
use super::scaling::{Crossing, Scaling, Timing};
use super::summary::{Spread, slope};
use super::{EngineKind, Entrant, Measurement, Point, Reference, Results};
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
        claimed_uncertainty: Option<f64>,
    },
    Point(Box<PointRecord<'a>>),
    ReportTable(&'a Cell),
    Scaling {
        series: &'static str,
        count: usize,
        surfaces: usize,
        engine: &'static str,
        adapter: Option<&'a str>,
        driver: Option<&'a str>,
        resolution: [u32; 2],
        samples: f64,
        seconds: Timed,
        paths: u64,
        rays: u64,
        seconds_per_path: f64,
        paths_per_second: f64,
    },
    Crossover {
        series: &'static str,
        engines: [&'static str; 2],
        /// Where both cost the same; null if that is nowhere among the counts of both.
        even_at: Option<f64>,
        /// The engine that costs less at all of those.
        always_cheaper: Option<&'static str>,
        baked_up_to: Option<usize>,
        lights_looked_at_up_to: Option<usize>,
    },
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
    pub claimed_uncertainty: Option<Spread>,
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

/// Seconds of one count of a series.
#[derive(Debug, Clone, Copy, Serialize)]
#[expect(missing_docs, reason = "see Ready and Rendering")]
pub struct Timed {
    pub compile: f64,
    pub warm_up: f64,
    pub render: f64,
    pub read_back: f64,
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

/// The lines about one series.
pub fn scaling_lines(scaling: &Scaling) -> String {
    let timings = scaling.timings.iter().map(|t| timing(scaling, t));
    let crossings = scaling.crossings();
    let crossings = crossings.iter().map(|(e, c)| crossover(scaling, *e, *c));
    timings.chain(crossings).map(|r| line(&r)).collect()
}

/// A record and a line break.
pub fn line(record: &Record) -> String {
    // This can't fail: a record has only strings, numbers and fixed keys. serde_json writes numbers that are not finite as
    // null.
    serde_json::to_string(record).expect("a record is plain data") + "\n"
}

fn timing<'a>(s: &'a Scaling, t: &Timing) -> Record<'a> {
    let device = s.engines.iter().find(|(kind, _)| *kind == t.engine);
    let device = device.and_then(|(_, device)| device.as_ref());
    Record::Scaling {
        series: s.series.name(),
        count: t.count,
        surfaces: t.surfaces,
        engine: t.engine.name(),
        adapter: device.map(|d| d.name.as_str()),
        driver: device.map(|d| d.driver.as_str()),
        resolution: s.size,
        samples: t.samples,
        seconds: Timed {
            compile: t.compile_seconds,
            warm_up: t.warm_up_seconds,
            render: t.seconds,
            read_back: t.read_back_seconds,
        },
        paths: t.counters.paths,
        rays: t.counters.rays,
        seconds_per_path: t.seconds_per_path(),
        paths_per_second: 1.0 / t.seconds_per_path(),
    }
}

fn crossover(s: &Scaling, engine: EngineKind, crossing: Crossing) -> Record<'static> {
    let engines = [engine.name(), EngineKind::GpuTree.name()];
    let (even_at, always_cheaper) = match crossing {
        Crossing::At(n) => (Some(n), None),
        Crossing::Beyond(_) => (None, Some(engines[0])),
        Crossing::Before(_) => (None, Some(engines[1])),
    };
    Record::Crossover {
        series: s.series.name(),
        engines,
        even_at,
        always_cheaper,
        baked_up_to: s.baked_up_to(),
        lights_looked_at_up_to: s.looked_at_up_to(),
    }
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
        claimed_uncertainty: m.errors.claimed_uncertainty,
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
        claimed_uncertainty: p.claimed_uncertainty,
        efficiency: p.efficiency,
        ratio: p.ratio,
    }))
}

#[cfg(test)]
mod tests {
    use super::super::scaling;
    use super::*;
    use serde_json::Value;

    #[test]
    fn a_series_has_a_line_for_each_count_and_one_for_each_crossing() {
        let text = scaling_lines(&scaling::tests::scaling());
        let lines: Vec<Value> = text
            .lines()
            .map(|l| serde_json::from_str(l).expect("JSON"))
            .collect();
        assert_eq!(lines.len(), 9 + 12 + 1);
        assert_eq!(lines[0]["type"], "scaling");
        assert_eq!(lines[0]["seconds_per_path"], 10e-9);
        let last = &lines[21];
        assert_eq!(last["type"], "crossover");
        assert!((last["even_at"].as_f64().expect("a number") - 50.0).abs() < 1e-9);
        assert_eq!(last["baked_up_to"], 53);
        assert!(last["lights_looked_at_up_to"].is_null());
    }
}
