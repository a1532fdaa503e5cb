//! `etendue plot`: convergence curves of runs, from their logs.

use super::args::PlotArgs;
use super::failure::Failure;
use super::files::{Files, Written};
use super::say;
use crate::log::{self, Log};
use crate::plot::{self, Curve, ErrorPanel, Format, Level, Panel};
use crate::stats::percent;
use std::path::Path;

/// Points of a curve. More would hide its line under their marks.
const MOST_POINTS: usize = 32;

/// Draws the logs.
pub fn plot(args: &PlotArgs) -> Result<(), Failure> {
    let mut files = Files::default();
    for path in &args.logs {
        files.reads("a log", path)?;
    }
    let formats: Vec<Format> = args
        .output
        .iter()
        .map(|path| Format::from_path(path).map_err(Failure::Input))
        .collect::<Result<_, _>>()?;
    for path in &args.output {
        files.writes("--output", path)?;
    }
    let logs = args.logs.iter().map(|path| log::read(path));
    let logs: Vec<Log> = logs.collect::<Result<_, _>>()?;
    let mut curves = Vec::new();
    for (path, log) in args.logs.iter().zip(&logs) {
        if log.errors.is_empty() {
            say!("warning: {}: no relative error in this log", path.display());
            continue;
        }
        curves.push(Curve {
            name: name(path, args),
            points: thin(&log.errors),
        });
    }
    if curves.is_empty() {
        let message = "there is nothing to draw: no log has a relative error above 0";
        return Err(Failure::Input(message.into()));
    }
    let panels = [Panel::Error(ErrorPanel {
        title: title(&logs),
        curves,
        level: target(&logs),
    })];
    let mut written = Written::default();
    for (path, format) in args.output.iter().zip(formats) {
        written.note(path, plot::write(path, format, &panels));
    }
    if let Some(list) = written.list().filter(|_| !args.quiet) {
        say!("wrote {list}");
    }
    written.end()
}

/// The log's name without extension, with its folder where another log has the same.
fn name(path: &Path, args: &PlotArgs) -> String {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let same = args.logs.iter().filter(|p| stem(p) == stem(path)).count();
    match stem(path) {
        Some(stem) if same == 1 => stem,
        _ => path.display().to_string(),
    }
}

/// The scenes, where they are few.
fn title(logs: &[Log]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for start in logs.iter().filter_map(|l| l.start.as_ref()) {
        let file = start.scene.strip_suffix(".toml").unwrap_or(&start.scene);
        let name = start.title.as_deref().unwrap_or(file);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    match names[..] {
        [] => "log".into(),
        [one] => one.into(),
        [a, b] => format!("{a}, {b}"),
        _ => format!("{} scenes", names.len()),
    }
}

/// What `--error` has asked for, if it was the same in all.
fn target(logs: &[Log]) -> Option<Level> {
    let of = |l: &Log| l.start.as_ref()?.target.relative_error;
    let error = of(logs.first()?)?;
    logs.iter().all(|l| of(l) == Some(error)).then(|| Level {
        name: format!("--error {}", percent(error)),
        error,
    })
}

/// At most [`MOST_POINTS`] of the points, evenly spread over the logarithm of time, first and last among them.
fn thin(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let [Some(first), Some(last)] = [points.first(), points.last()] else {
        return Vec::new();
    };
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let step = (last[0] / first[0]).ln() / (MOST_POINTS - 1) as f64;
    let mut kept: Vec<[f64; 3]> = Vec::new();
    for point in &points[..points.len() - 1] {
        let far = |from: &[f64; 3]| (point[0] / from[0]).ln() >= step;
        if kept.last().is_none_or(far) {
            kept.push(*point);
        }
    }
    // Two marks at the end would be one.
    if kept.len() > 1
        && kept
            .last()
            .is_some_and(|k| (last[0] / k[0]).ln() < 0.5 * step)
    {
        kept.pop();
    }
    kept.push(*last);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_is_thinned_evenly() {
        let points: Vec<[f64; 3]> = (1..2000).map(|n| [f64::from(n), 0.1, 0.0]).collect();
        let thin = thin(&points);
        assert!((16..=MOST_POINTS).contains(&thin.len()), "{}", thin.len());
        assert_eq!((thin[0], thin[thin.len() - 1]), (points[0], points[1998]));
        assert_eq!(super::thin(&points[..20]), points[..20]);
        assert!(super::thin(&[]).is_empty());
    }
}
