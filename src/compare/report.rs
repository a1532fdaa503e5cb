//! A comparison as JSON, for scripts.

use super::verdict::Verdict;
use super::{Comparison, Metrics};
use serde::Serialize;

/// What a script may ask of a comparison.
#[derive(Serialize)]
struct Report<'a> {
    same: bool,
    identical: bool,
    same_samples: bool,
    /// The verdict in one sentence.
    sentence: String,
    /// Where the difference is, as a table of text; empty without one.
    table: String,
    /// Null if a picture does not state its noise.
    verdict: Option<&'a Verdict>,
    metrics: Distances,
    exceeded: &'a [String],
    layers: &'a [String],
    notes: &'a [String],
}

/// [`Metrics`] without the map of every pixel.
#[derive(Serialize)]
struct Distances {
    /// Mean radiance of A and B: R, G, B.
    means: [[f64; 3]; 2],
    rmse: f64,
    relative_rmse: f64,
    /// In dB; null for equal pictures, whose ratio is infinite.
    psnr: f64,
    flip: f64,
}

impl Distances {
    fn of(metrics: &Metrics) -> Self {
        Self {
            means: metrics.means,
            rmse: metrics.rmse,
            relative_rmse: metrics.relative_rmse(),
            psnr: metrics.psnr,
            flip: metrics.flip,
        }
    }
}

impl Comparison {
    /// Indented JSON and a line break. Numbers that are not finite are null.
    pub fn to_json(&self) -> String {
        let report = Report {
            same: self.same(),
            identical: self.identical,
            same_samples: self.same_samples,
            sentence: self.sentence(),
            table: self.findings_text(),
            verdict: self.verdict.as_ref(),
            metrics: Distances::of(&self.metrics),
            exceeded: &self.exceeded,
            layers: &self.layers,
            notes: &self.notes,
        };
        let mut json = serde_json::to_string_pretty(&report).expect("a report is plain data");
        json.push('\n');
        json
    }
}
