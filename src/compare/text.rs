//! A comparison in words.

use super::verdict::{Finding, Sensitivity, Verdict};
use super::{Comparison, Metrics};
use std::fmt::Write as _;

pub(super) const CHANNELS: [&str; 4] = ["red", "green", "blue", "Y"];

impl Comparison {
    /// The verdict in one sentence, and what the limits say besides.
    pub fn sentence(&self) -> String {
        let of_light = self.sentence_of_light();
        if self.layers.is_empty() {
            return of_light;
        }
        format!(
            "different: {}; the light: {of_light}",
            self.layers.join("; ")
        )
    }

    /// The same of the light alone, without layers.
    fn sentence_of_light(&self) -> String {
        let exceeded = self.exceeded.join("; ");
        match &self.verdict {
            Some(v) if self.identical && v.same() => "bit-identical".into(),
            Some(v) if self.same_samples && v.same() && exceeded.is_empty() => {
                "the same samples, equal but for the rounding of files: no evidence that two renders are equal".into()
            }
            Some(v) if exceeded.is_empty() => verdict_sentence(v),
            Some(v) if v.same() => format!(
                "different by the given limits ({exceeded}), which count noise as a difference; without them: {}",
                verdict_sentence(v)
            ),
            Some(v) => format!("{}; also different by the given limits ({exceeded})", verdict_sentence(v)),
            None if self.identical => "bit-identical".into(),
            None if exceeded.is_empty() => {
                "within the limits (not a statistical test, since the pictures do not state their noise)".into()
            }
            None => format!("different: {exceeded}"),
        }
    }

    /// A table of where the difference is; empty when there is none.
    pub fn findings_text(&self) -> String {
        let Some(v) = self.verdict.as_ref().filter(|v| !v.findings.is_empty()) else {
            return String::new();
        };
        let [a, b] = self.labels;
        let head = ["where", "channel", a, b, "change", "z"];
        let mut text = row(head.map(str::to_owned));
        for f in &v.findings {
            let [a, b] = f.means;
            text += &row([
                place(f),
                CHANNELS[f.channel].into(),
                format!("{a:.4}"),
                format!("{b:.4}"),
                change(a, b),
                format!("{:.1}", f.z),
            ]);
        }
        text
    }

    /// The sentence, where the difference is, the metrics, and notes: lines of text.
    pub fn report(&self) -> String {
        let mut text = self.sentence() + "\n";
        for line in self.findings_text().lines() {
            let _ = write!(text, "\n  {line}");
        }
        if !text.ends_with('\n') {
            text.push('\n');
        }
        text.push('\n');
        text += &metrics(&self.metrics, self.labels);
        for note in &self.notes {
            let _ = writeln!(text, "\nnote: {note}");
        }
        text
    }
}

fn verdict_sentence(v: &Verdict) -> String {
    let alpha = brief(v.alpha);
    if v.same() {
        let mut text = format!("equal up to noise (false-alarm rate {alpha})");
        let told: Vec<String> = v.sensitivity.iter().filter_map(seen).take(3).collect();
        match told.split_last() {
            Some((last, [])) => text += &format!("; would have detected {last}"),
            Some((last, rest)) => {
                text += &format!("; would have detected {} or {last}", rest.join(", "));
            }
            None => text += "; but too noisy to detect most changes",
        }
        text
    } else {
        // The whole picture comes first if it differs, with its own probability.
        let first = v.findings.first();
        let p = match first.map_or(v.p, |f| f.p) {
            p if p < 1e-15 => "below 1e-15".into(),
            p => format!("{p:.0e}"),
        };
        let first = first.map(place).unwrap_or_default();
        format!("different {first}: the probability for equal pictures is {p} (limit {alpha})")
    }
}

/// A probability, without hundreds of digits.
pub(super) fn brief(p: f64) -> String {
    if p < 1e-4 {
        format!("{p:e}")
    } else {
        p.to_string()
    }
}

/// What would have been seen, in words; nothing for blocks of which half could double in brightness unseen.
fn seen(s: &Sensitivity) -> Option<String> {
    let change = percent(Some(s.change).filter(|c| *c < 1.0)?);
    Some(match s.side {
        0 => format!("a change of the whole picture's brightness by {change}"),
        side => format!("of {side}x{side} pixels by {change}"),
    })
}

pub(super) fn place(f: &Finding) -> String {
    if f.whole {
        return "in the whole picture".into();
    }
    let r = &f.rect;
    match (r.width(), r.height()) {
        (1, 1) => format!("at pixel ({}, {})", r.x0, r.y0),
        (w, h) => format!("in {w}x{h} pixels at ({}, {})", r.x0, r.y0),
    }
}

fn row([place, channel, a, b, change, z]: [String; 6]) -> String {
    format!("{place:<30} {channel:<7} {a:>9} {b:>9} {change:>10} {z:>7}\n")
}

pub(super) fn change(a: f64, b: f64) -> String {
    if a == 0.0 {
        "-".into()
    } else {
        format!("{:+.2} %", 100.0 * (b - a) / a)
    }
}

/// Names and values of the metrics.
pub(super) fn metric_values(m: &Metrics, labels: [&str; 2]) -> [(String, String); 6] {
    let rgb = |c: [f64; 3]| format!("{:.5} {:.5} {:.5}", c[0], c[1], c[2]);
    [
        (format!("mean of {}", labels[0]), rgb(m.means[0])),
        (format!("mean of {}", labels[1]), rgb(m.means[1])),
        ("RMSE".into(), format!("{:.5}", m.rmse)),
        ("relative RMSE".into(), percent(m.relative_rmse())),
        ("PSNR".into(), format!("{:.2} dB", m.psnr)),
        ("mean FLIP".into(), format!("{:.4}", m.flip)),
    ]
}

fn metrics(m: &Metrics, labels: [&str; 2]) -> String {
    let line = |(key, value)| format!("  {key:<16} {value}\n");
    metric_values(m, labels).into_iter().map(line).collect()
}

/// With three digits that count.
pub(super) fn percent(x: f64) -> String {
    let p = 100.0 * x;
    let digits = if p >= 10.0 {
        0
    } else if p >= 1.0 {
        1
    } else {
        2
    };
    format!("{p:.digits$} %")
}
