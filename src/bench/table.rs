//! Results as text.

use super::figure9::{Cell, RAYS};
use super::summary::{Spread, millions, slope};
use super::{EngineKind, Point, Results};

/// Columns that fit a terminal or a page. Wider tables are for those who ask for all columns.
#[cfg(test)]
pub(super) const NARROW: usize = 100;

/// Columns of text. The first one and `on` are aligned left, the others right.
pub(super) struct Columns(Vec<Vec<String>>);

impl Columns {
    pub(super) fn new(head: &[&str]) -> Self {
        Self(vec![head.iter().map(|&s| s.into()).collect()])
    }

    pub(super) fn push(&mut self, row: Vec<String>) {
        self.0.push(row);
    }

    pub(super) fn text(&self) -> String {
        let width = |c: usize| {
            let cells = self.0.iter().filter_map(|row| row.get(c));
            cells.map(|s| s.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.0[0].len()).map(width).collect();
        let mut text = String::new();
        for row in &self.0 {
            let mut line = String::new();
            for (c, (cell, &w)) in row.iter().zip(&widths).enumerate() {
                line += &match c {
                    0 => format!("{cell:w$}"),
                    _ if self.0[0][c] == "on" => format!("  {cell}"),
                    _ => format!("  {cell:>w$}"),
                };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

/// The results of one scene: the most important columns, or all of them. Spreads are standard deviations of a single seed.
pub fn text(results: &Results, wide: bool) -> String {
    let [width, height] = results.settings.size;
    let mut text = format!(
        "{}: {width}x{height}, mean path length {:.1}\n",
        results.scene, results.mean_path_length
    );
    text += &reference(results, wide);
    if results.measurements.is_empty() {
        return text + "nothing measured\n";
    }
    let points = results.points();
    text += &format!("\n{}", engines(results, wide));
    text += &format!("\n{}", speed(&points));
    text += &format!("\n{}", errors(&points, wide));
    text + &reference_note(results, &points)
}

fn reference(results: &Results, wide: bool) -> String {
    let r = &results.reference;
    // The engine, and after it the device and the kernel.
    let about = r.about.split(';').next().filter(|_| !wide);
    let about = about.unwrap_or(&r.about);
    let samples = r
        .samples
        .map_or(String::new(), |n| format!(", {n} samples per pixel"));
    let noise = match r.truth.noise_floor() {
        Some(error) => format!(
            ", relative error {} (subtracted from squared errors{})",
            percent(error),
            if wide { ", not from FLIP" } else { "" }
        ),
        None => ", states no noise, so its noise counts as error".into(),
    };
    let kept = match &r.path {
        Some(path) if r.cached => format!("cached in {}\n", path.display()),
        _ => String::new(),
    };
    format!("reference: {about}{samples}{noise}\n{kept}")
}

/// A reference whose stated relative error is more than this share of a picture's error is called short.
const SHORT: f64 = 0.5;

/// A warning if the error of a picture is close to that of the reference. The reference's noise is subtracted, but relative
/// errors also depend on its luminances, and FLIP has no correction.
fn reference_note(results: &Results, points: &[Point]) -> String {
    let errors = points.iter().filter_map(|p| p.true_relative_error);
    let least = errors.map(|e| e.mean).fold(f64::INFINITY, f64::min);
    match results.reference.truth.noise_floor() {
        Some(noise) if noise > SHORT * least => format!(
            "note: the relative error of the reference, {}, is close to the smallest one here, {}; raise --reference-spp for better \
             results\n",
            percent(noise),
            percent(least)
        ),
        _ => String::new(),
    }
}

fn engines(results: &Results, wide: bool) -> String {
    let mut columns = Columns::new(&["engine", "compile, s", "warm-up, s", "slope", "on"]);
    for e in &results.entrants {
        let slope = slope(e.kind, &results.measurements);
        columns.push(vec![
            e.kind.name().into(),
            format!("{:.2}", e.compile_seconds),
            format!("{:.2}", e.warm_up_seconds),
            slope.map_or("-".into(), |s| match s.sd {
                Some(sd) => format!("{:.2} ± {sd:.2}", s.mean),
                None => format!("{:.2}", s.mean),
            }),
            if wide {
                format!("{} ({})", e.device.name, e.device.driver)
            } else {
                e.device.brief()
            },
        ]);
    }
    columns.text()
}

fn speed(points: &[Point]) -> String {
    let mut columns = Columns::new(&[
        "engine",
        "samples",
        "seconds",
        "reading back, s",
        "million paths/s",
        "million rays/s",
        "rays/path",
    ]);
    for p in points {
        columns.push(vec![
            p.engine.name().into(),
            p.samples.to_string(),
            cell(p.seconds),
            number(p.read_back.mean),
            cell(millions(p.paths_per_second)),
            cell(millions(p.rays_per_second)),
            number(p.rays_per_path.mean),
        ]);
    }
    columns.text()
}

fn errors(points: &[Point], wide: bool) -> String {
    // The uncertainty that the pictures state, not the spread between them.
    let claimed = |p: &Point| match (p.claimed_relative_error, p.claimed_uncertainty) {
        (Some(error), Some(by)) => format!("{} \u{b1} {}", percent(error.mean), percent(by.mean)),
        (error, _) => error.map_or("-".into(), |e| percent(e.mean)),
    };
    let share = |s: Option<Spread>| s.map_or("-".into(), |s| with_spread(percent(s.mean), s));
    // Each column, and whether only a wide table has it.
    type Cell<'a> = &'a dyn Fn(&Point) -> String;
    let all: [(&str, bool, Cell); 11] = [
        ("engine", false, &|p| p.engine.name().into()),
        ("samples", false, &|p| p.samples.to_string()),
        ("MSE", false, &|p| cell(p.mse)),
        ("claimed MSE", true, &|p| {
            p.claimed_mse.map_or("-".into(), cell)
        }),
        ("relative MSE", true, &|p| cell(p.relative_mse)),
        ("trimmed", true, &|p| cell(p.trimmed_relative_mse)),
        ("FLIP", true, &|p| cell(p.flip)),
        ("error", false, &|p| share(p.true_relative_error)),
        ("claimed error", false, &claimed),
        ("efficiency", false, &|p| {
            p.efficiency.map_or("-".into(), cell)
        }),
        ("ratio", false, &|p| p.ratio.map_or("-".into(), cell)),
    ];
    let shown: Vec<_> = all.iter().filter(|c| wide || !c.1).collect();
    let head: Vec<&str> = shown.iter().map(|c| c.0).collect();
    let mut columns = Columns::new(&head);
    for p in points {
        columns.push(shown.iter().map(|c| c.2(p)).collect());
    }
    columns.text()
}

/// The report's Figure 9, for one engine: seconds by setting and rays.
pub fn figure9(engine: EngineKind, cells: &[Cell]) -> String {
    let mut head = vec!["seconds, by rays per pixel-sample".to_owned()];
    head.extend(RAYS.map(|r| r.to_string()));
    let mut columns = Columns(vec![head]);
    let mine = || cells.iter().filter(|c| c.engine == engine.name());
    let mut settings: Vec<&str> = mine().map(|c| c.setting).collect();
    settings.dedup();
    for setting in settings {
        let mut row = vec![setting.to_owned()];
        for rays in RAYS {
            let cell = mine().find(|c| c.setting == setting && c.rays == rays);
            let seconds = cell.and_then(|c| c.seconds);
            row.push(seconds.map_or(String::new(), number));
        }
        columns.push(row);
    }
    columns.text()
}

/// `0.142 ±3%`: a mean, and the standard deviation over it.
fn cell(s: Spread) -> String {
    with_spread(number(s.mean), s)
}

fn with_spread(text: String, s: Spread) -> String {
    match s.relative() {
        Some(r) => format!("{text} ±{}%", two_digits(r * 100.0)),
        None => text,
    }
}

fn two_digits(x: f64) -> String {
    if x < 9.95 {
        format!("{x:.1}")
    } else {
        format!("{x:.0}")
    }
}

/// Three digits, with an exponent where that is shorter.
pub(super) fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let magnitude = x.abs().log10().floor();
    if !(-3.0..6.0).contains(&magnitude) {
        return format!("{x:.2e}");
    }
    let digits = (2.0 - magnitude).clamp(0.0, 6.0) as usize;
    format!("{x:.digits$}")
}

fn percent(share: f64) -> String {
    format!("{}%", number(share * 100.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.142_3, "0.142"),
            (12.34, "12.3"),
            (1234.5, "1234"),
            (0.000_123_4, "1.23e-4"),
            (12_345_678.0, "1.23e7"),
            (-0.5, "-0.500"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(x), text);
        }
        let s = Spread {
            mean: 2.0,
            sd: Some(0.05),
        };
        assert_eq!(cell(s), "2.00 ±2.5%");
        assert_eq!(cell(Spread { sd: None, ..s }), "2.00");
        assert_eq!(percent(0.0213), "2.13%");
    }

    /// With numbers as long as they get.
    #[test]
    fn tables_fit_unless_they_are_wide() {
        let long = Spread {
            mean: 1.2345e-3,
            sd: Some(1.5e-3),
        };
        let point = Point {
            engine: EngineKind::GpuBuffers,
            samples: 1 << 20,
            seeds: 4,
            seconds: long,
            read_back: long,
            paths_per_second: long,
            rays_per_second: long,
            rays_per_path: long,
            mse: long,
            claimed_mse: Some(long),
            relative_mse: long,
            trimmed_relative_mse: long,
            flip: long,
            true_relative_error: Some(long),
            claimed_relative_error: Some(long),
            claimed_uncertainty: Some(long),
            efficiency: Some(long),
            ratio: Some(long),
        };
        let widest = |text: &str| text.lines().map(|l| l.chars().count()).max().unwrap();
        let points = [point];
        let (speed, narrow) = (speed(&points), errors(&points, false));
        assert!(widest(&speed) <= NARROW, "{speed}");
        assert!(
            widest(&narrow) <= NARROW && !narrow.contains("FLIP"),
            "{narrow}"
        );
        let wide = errors(&points, true);
        assert!(widest(&wide) > NARROW && wide.contains("FLIP"), "{wide}");
    }

    #[test]
    fn columns_are_aligned_with_their_names() {
        let mut c = Columns::new(&["engine", "x"]);
        c.push(vec!["cpu".into(), "±10".into()]);
        assert_eq!(c.text(), "engine    x\ncpu     ±10\n");
    }
}
