//! A comparison as a self-contained HTML page.

use super::flip::encode_srgb;
use super::text::{self, CHANNELS};
use super::verdict::scores;
use super::{Comparison, Side};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write as _;

const TEMPLATE: &str = include_str!("page.html");

/// Scores beyond this are drawn as this.
const SCORE_RANGE: f64 = 6.0;

/// Darker, equal, brighter: blue, near black, orange; told apart by colour-blind eyes too.
const DIVERGING: [[f64; 3]; 5] = [
    [0.55, 0.85, 1.0],
    [0.10, 0.40, 0.85],
    [0.05, 0.05, 0.06],
    [0.85, 0.35, 0.05],
    [1.0, 0.88, 0.45],
];

/// From nothing to much.
const SEQUENTIAL: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.02],
    [0.32, 0.07, 0.48],
    [0.72, 0.22, 0.47],
    [0.99, 0.54, 0.38],
    [0.99, 0.99, 0.75],
];

/// The page about a comparison of `a` and `b`, and what it calls them.
pub fn page(a: &Side, b: &Side, labels: [&str; 2], comparison: &Comparison) -> String {
    let difference = format!("{} - {}", labels[1], labels[0]);
    let scores = comparison.verdict.as_ref().map(|_| scores(a, b));
    let differences: Vec<f64> = a
        .rgb
        .iter()
        .zip(&b.rgb)
        .map(|(p, q)| (0..3).map(|c| q[c] - p[c]).sum::<f64>() / 3.0)
        .collect();
    let range = quantile(&differences, 0.99);
    let signed = |values: &[f64], range: f64| {
        uri(
            a.size,
            values
                .iter()
                .map(|v| ramp(&DIVERGING, 0.5 + 0.5 * v / range)),
        )
    };
    let (histogram_title, histogram) = match &scores {
        Some(scores) => (
            "Differences over their noise".to_owned(),
            histogram(&covered(scores, a), SCORE_RANGE, true),
        ),
        None => (
            format!("Differences {difference}"),
            histogram(&covered(&differences, a), range, false),
        ),
    };
    let score_image = |scores: &Vec<f64>| {
        let source = signed(scores, SCORE_RANGE);
        format!("<img id=\"score\" hidden alt=\"Difference over its noise\" src=\"{source}\">")
    };
    let flip = comparison.metrics.flip_map.iter();
    let values = [
        ("title", escape(&format!("{} and {}", a.name, b.name))),
        (
            "class",
            if comparison.same() { "" } else { "different" }.into(),
        ),
        ("sentence", escape(&capital(&comparison.sentence()))),
        (
            "notes",
            comparison
                .notes
                .iter()
                .map(|n| format!("<p class=\"note\">Note: {}</p>", escape(n)))
                .collect(),
        ),
        (
            "score_choice",
            scores
                .as_ref()
                .map_or("", |_| {
                    "<label><input type=\"radio\" name=\"view\" value=\"score\"> z-score</label>"
                })
                .into(),
        ),
        ("choice_a", capital(labels[0])),
        ("choice_b", capital(labels[1])),
        ("label_a", labels[0].into()),
        ("label_b", labels[1].into()),
        ("signed", difference),
        ("a", picture_uri(a)),
        ("b", picture_uri(b)),
        ("width", a.size[0].to_string()),
        ("height", a.size[1].to_string()),
        ("boxes", boxes(comparison)),
        ("name_a", escape(&a.name)),
        ("name_b", escape(&b.name)),
        ("diverging", gradient(&DIVERGING)),
        ("sequential", gradient(&SEQUENTIAL)),
        ("difference_range", format!("{range:.3}")),
        ("score_range", SCORE_RANGE.to_string()),
        ("difference", signed(&differences, range)),
        (
            "score",
            scores.as_ref().map(score_image).unwrap_or_default(),
        ),
        (
            "flip",
            uri(a.size, flip.map(|v| ramp(&SEQUENTIAL, f64::from(*v)))),
        ),
        ("findings", findings(comparison, labels)),
        (
            "metrics",
            rows(&text::metric_values(&comparison.metrics, labels), "number"),
        ),
        ("histogram_title", histogram_title),
        ("histogram", histogram),
        ("sensitivity", sensitivity(comparison)),
        ("origin", origin(a, b)),
    ];
    fill(TEMPLATE, &values)
}

/// The template with every `{{name}}` replaced; values are not looked into.
pub(crate) fn fill(template: &str, values: &[(&str, String)]) -> String {
    let mut out = String::new();
    for (k, part) in template.split("{{").enumerate() {
        match part.split_once("}}") {
            Some((name, rest)) if k > 0 => {
                let value = values.iter().find(|(n, _)| *n == name);
                out += &value
                    .unwrap_or_else(|| panic!("the template's {name} has no value"))
                    .1;
                out += rest;
            }
            _ => out += part,
        }
    }
    out
}

/// A picture as a PNG would show it, as a data URI.
pub(crate) fn picture_uri(picture: &Side) -> String {
    uri(picture.size, picture.rgb.iter().map(|v| v.map(encode_srgb)))
}

/// Text for element content and quoted attributes.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars
        .next()
        .map(|c| c.to_uppercase().chain(chars).collect())
        .unwrap_or_default()
}

/// The values of rendered pixels.
fn covered(values: &[f64], picture: &Side) -> Vec<f64> {
    let pixels = values.iter().zip(&picture.covered);
    pixels.filter(|(_, c)| **c).map(|(v, _)| *v).collect()
}

/// A size that all but few of the values stay below; 1 if they are all 0.
fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let last = sizes.len() - 1;
    let at = sizes[(q * last as f64) as usize];
    [at, sizes[last], 1.0]
        .into_iter()
        .find(|v| *v > 0.0)
        .unwrap_or(1.0)
}

/// A colour of a ramp, 0..=1.
fn ramp(stops: &[[f64; 3]; 5], at: f64) -> [f64; 3] {
    let t = at.clamp(0.0, 1.0) * 4.0;
    let k = (t as usize).min(3);
    let f = t - k as f64;
    [0, 1, 2].map(|c| stops[k][c] + f * (stops[k + 1][c] - stops[k][c]))
}

fn gradient(stops: &[[f64; 3]; 5]) -> String {
    let colours = stops.map(|s| {
        let [r, g, b] = s.map(|v| (255.0 * v) as u8);
        format!("rgb({r} {g} {b})")
    });
    format!("linear-gradient(to right, {})", colours.join(", "))
}

/// A picture of display values, 0..=1, as a data URI.
fn uri(size: [u32; 2], pixels: impl Iterator<Item = [f64; 3]>) -> String {
    let data: Vec<u8> = pixels
        .flat_map(|p| p.map(|v| (255.0 * v).round() as u8))
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    let written = encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&data));
    written.expect("memory takes a picture of its own size");
    format!("data:image/png;base64,{}", STANDARD.encode(bytes))
}

fn boxes(comparison: &Comparison) -> String {
    let mut s = String::new();
    for f in comparison.verdict.iter().flat_map(|v| &v.findings) {
        let r = f.rect;
        if !f.whole {
            let _ = write!(
                s,
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
                r.x0,
                r.y0,
                r.width(),
                r.height()
            );
        }
    }
    s
}

fn findings(comparison: &Comparison, labels: [&str; 2]) -> String {
    let Some(v) = comparison
        .verdict
        .as_ref()
        .filter(|v| !v.findings.is_empty())
    else {
        return String::new();
    };
    let [label_a, label_b] = labels;
    let mut s = format!(
        "<h2>Where they differ</h2><div class=\"scroll\"><table><thead><tr><th scope=\"col\">where</th>\
         <th scope=\"col\">channel</th><th class=\"number\" scope=\"col\">{label_a}</th>\
         <th class=\"number\" scope=\"col\">{label_b}</th><th class=\"number\" scope=\"col\">change</th>\
         <th class=\"number\" scope=\"col\">z</th></tr></thead><tbody>"
    );
    for f in &v.findings {
        let [a, b] = f.means;
        let _ = write!(
            s,
            "<tr><td>{}</td><td>{}</td><td class=\"number\">{a:.4}</td><td class=\"number\">{b:.4}</td>\
             <td class=\"number\">{}</td><td class=\"number\">{:.1}</td></tr>",
            text::place(f),
            CHANNELS[f.channel],
            text::change(a, b),
            f.z
        );
    }
    s + "</tbody></table></div>"
}

fn rows(values: &[(String, String)], class: &str) -> String {
    let row = |(key, value): &(String, String)| {
        format!("<tr><th scope=\"row\">{key}</th><td class=\"{class}\">{value}</td></tr>")
    };
    values.iter().map(row).collect()
}

fn sensitivity(comparison: &Comparison) -> String {
    let Some(v) = &comparison.verdict else {
        return String::new();
    };
    let mut s = format!(
        "<h2>Detectable changes</h2><p class=\"soft\">The relative change of brightness that the tests detect with 95 % \
         probability; for blocks, in half of them. Number of tests: {}; overall false-alarm rate: {}.</p><table>",
        v.tests,
        text::brief(v.alpha)
    );
    for x in &v.sensitivity {
        let what = match x.side {
            0 => "whole picture".into(),
            side => format!("{side} x {side} pixels"),
        };
        let change = if x.change < 1.0 {
            text::percent(x.change)
        } else {
            "none below 100 %".into()
        };
        let _ = write!(
            s,
            "<tr><th scope=\"row\">{what}</th><td class=\"number\">{change}</td></tr>"
        );
    }
    s + "</table>"
}

fn origin(a: &Side, b: &Side) -> String {
    let mut keys: Vec<&str> = Vec::new();
    for (key, _) in a.origin.iter().chain(&b.origin) {
        // The text of a scene is no line of a table.
        if !keys.contains(&key.as_str()) && key != "scene_text" {
            keys.push(key);
        }
    }
    let row = |key: &str| {
        let [x, y] = [a, b].map(|p| p.origin(key).unwrap_or("-"));
        let class = if x == y { "" } else { " class=\"differs\"" };
        format!(
            "<tr{class}><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>",
            escape(key),
            escape(x),
            escape(y)
        )
    };
    keys.into_iter().map(row).collect()
}

/// Bars of counts on a logarithmic scale from -range to range, with the normal curve where it is expected.
fn histogram(values: &[f64], range: f64, normal: bool) -> String {
    const BINS: usize = 48;
    const SIZE: [f64; 2] = [480.0, 180.0];
    let mut counts = [0usize; BINS];
    for v in values {
        let at = (0.5 + 0.5 * v / range).clamp(0.0, 1.0) * BINS as f64;
        counts[(at as usize).min(BINS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    // A count of 1 still stands a little above the ground.
    let height = |n: f64| (SIZE[1] - 20.0) * (0.7 + n).ln().max(0.0) / (0.7 + most).ln();
    let width = SIZE[0] / BINS as f64;
    let mut s = format!(
        "<svg class=\"histogram\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Histogram of {} pixels\">",
        SIZE[0],
        SIZE[1] + 18.0,
        values.len()
    );
    for (k, n) in counts.iter().enumerate().filter(|(_, n)| **n > 0) {
        let h = height(*n as f64);
        let _ = write!(
            s,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{h:.1}\"><title>{n}</title></rect>",
            k as f64 * width,
            SIZE[1] - h,
            width - 1.0
        );
    }
    if normal {
        let step = 2.0 * range / BINS as f64;
        let mut path = String::new();
        for k in 0..=2 * BINS {
            let z = -range + k as f64 * step / 2.0;
            let expected = values.len() as f64 * step * (-0.5 * z * z).exp() / 2.506_628;
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(
                path,
                "{command}{:.1} {:.1}",
                k as f64 * width / 2.0,
                SIZE[1] - height(expected)
            );
        }
        let _ = write!(s, "<path d=\"{path}\"/>");
    }
    let base = SIZE[1];
    let _ = write!(
        s,
        "<line x1=\"0\" x2=\"{}\" y1=\"{base}\" y2=\"{base}\"/>",
        SIZE[0]
    );
    for (x, anchor, value) in [
        (0.0, "start", -range),
        (SIZE[0] / 2.0, "middle", 0.0),
        (SIZE[0], "end", range),
    ] {
        let _ = write!(
            s,
            "<text x=\"{x}\" y=\"{}\" text-anchor=\"{anchor}\">{}</text>",
            base + 14.0,
            tick(value)
        );
    }
    let caption = if normal {
        "counts on a logarithmic scale; the curve is the expected histogram for normal noise"
    } else {
        "counts on a logarithmic scale"
    };
    s + "</svg><p class=\"soft\">Pixels, " + caption + ".</p>"
}

/// A number with three digits that count.
fn tick(value: f64) -> String {
    let digits = if value.abs() >= 10.0 || value.fract() == 0.0 {
        0
    } else if value.abs() >= 1.0 {
        1
    } else {
        3
    };
    format!("{value:.digits$}")
}
