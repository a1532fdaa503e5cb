//! Relative error against seconds.

use super::Drawn;
use super::chart::{Axes, Dashes, Pen, Sample, plain, range};
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::element::PathElement;
use plotters::prelude::DrawingBackend;

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorPanel {
    /// Above it.
    pub title: String,
    /// One for each engine, or run.
    pub curves: Vec<Curve>,
    /// A level to compare the curves with.
    pub level: Option<Level>,
}

/// A dashed line across the panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What it is, in the legend.
    pub name: String,
    /// The relative error, above 0.
    pub error: f64,
}

/// How one error falls.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// In the legend.
    pub name: String,
    /// Seconds, relative error, and its standard deviation; all but the last above 0.
    pub points: Vec<[f64; 3]>,
}

impl ErrorPanel {
    /// Least and greatest seconds and errors, widened to leave room; 1 around nothing.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let x = range(points().map(|p| p[0]), [0.7, 1.4]);
        let ends = |p: &[f64; 3]| [p[1] + p[2], (p[1] - p[2]).max(0.5 * p[1])];
        let level = self.level.as_ref().map(|l| l.error);
        let y = range(points().flat_map(ends).chain(level), [0.8, 1.6]);
        [x, y]
    }
}

impl ErrorPanel {
    /// Draws it.
    pub(super) fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        pen: Pen,
    ) -> Drawn<DB> {
        let [x, y] = self.ranges();
        let [[x0, x1], [y0, y1]] = [x, y];
        // The guide lies below the end of the first curve, where costs besides the samples matter least.
        let last = self.curves.iter().find_map(|c| c.points.last());
        let guide = last.map(|_| (Sample::Dashes(Dashes::LONG), "slope -1/2".to_owned()));
        let level = self.level.as_ref();
        let level = level.map(|l| (Sample::Dashes(Dashes::SHORT), l.name.clone()));
        let curves = self.curves.iter().enumerate();
        let curves = curves.map(|(i, c)| (Sample::Curve(i), c.name.clone()));
        let legend: Vec<_> = curves.chain(guide).chain(level).collect();
        let area = pen.legend(area, &legend)?;
        let mut chart = pen.axes(
            &area,
            &Axes {
                title: &self.title,
                names: ["seconds", "relative error"],
                ranges: [x, y],
                y_label: |y| format!("{} %", plain(y * 100.0)),
            },
        )?;
        if let Some([x, y, _]) = last {
            let low = 0.7 * y;
            let guide = |t: f64| (t, low * (t / x).powf(-0.5));
            // The library does not clip lines outside the chart, but bends them along its edge.
            let at = |error: f64| x * (low / error).powi(2);
            let ends = [x0.max(at(y1)), x1.min(at(y0))].map(guide);
            pen.dashes(&mut chart, ends, Dashes::LONG)?;
        }
        if let Some(Level { error, .. }) = self.level {
            pen.dashes(&mut chart, [(x0, error), (x1, error)], Dashes::SHORT)?;
        }
        for (i, curve) in self.curves.iter().enumerate() {
            let thin = pen.line(Pen::colour(i), 1.2);
            chart.draw_series(curve.points.iter().map(|&[x, y, sd]| {
                PathElement::new([(x, (y - sd).max(0.5 * y)), (x, y + sd)], thin)
            }))?;
            let points: Vec<(f64, f64)> = curve.points.iter().map(|p| (p[0], p[1])).collect();
            pen.curve(&mut chart, i, &points)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Format, Panel, svg, write};
    use super::*;
    use std::io;

    fn panel(floor: Option<f64>) -> ErrorPanel {
        let curve = |name: &str, cost: f64, error: f64| Curve {
            name: name.into(),
            points: (0..7)
                .map(|k| {
                    let n = f64::from(1 << k);
                    [cost * n, error / n.sqrt(), 0.03 * error / n.sqrt()]
                })
                .collect(),
        };
        ErrorPanel {
            title: "synthetic".into(),
            curves: vec![
                curve("gpu-baked", 0.05, 0.8),
                curve("gpu-buffers", 0.11, 0.8),
                curve("cpu", 0.5, 0.78),
                curve("cpu-brute", 0.4, 5.0),
            ],
            level: floor.map(|error| Level {
                name: "noise of the reference".into(),
                error,
            }),
        }
    }

    /// With `ETENDUE_KEEP_PLOTS` a folder, the pictures stay there to be looked at.
    #[test]
    fn plots_are_written_and_say_what_is_in_them() {
        let temporary = tempfile::tempdir().unwrap();
        let kept = std::env::var_os("ETENDUE_KEEP_PLOTS");
        let dir = kept.map_or(temporary.path().to_owned(), Into::into);
        let panels = [panel(Some(0.02)), panel(None)].map(Panel::Error);
        let svg = dir.join("plot.svg");
        write(&svg, Format::Svg, &panels).unwrap();
        let text = std::fs::read_to_string(&svg).unwrap();
        for word in [
            "<svg",
            "gpu-baked",
            "cpu-brute",
            "slope -1/2",
            "noise of the reference",
            "seconds",
            "relative error",
            "synthetic",
        ] {
            assert!(text.contains(word), "no {word}");
        }
        let png = dir.join("plot.png");
        write(&png, Format::Png, &panels).unwrap();
        let mut reader = png::Decoder::new(io::BufReader::new(std::fs::File::open(&png).unwrap()))
            .read_info()
            .unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!([info.width, info.height], [2 * 560 * 2, 440 * 2]);
        // Text is there: dark pixels in the strip left of the first panel's axis, where nothing but labels is.
        let dark = |x: usize, y: usize| data[(y * info.width as usize + x) * 3] < 100;
        let labels = (0..120usize).flat_map(|x| (100..700usize).map(move |y| (x, y)));
        assert!(labels.filter(|&(x, y)| dark(x, y)).count() > 500);
    }

    #[test]
    fn a_plot_without_results_is_empty() {
        let empty = ErrorPanel {
            title: "none".into(),
            curves: vec![Curve {
                name: "cpu".into(),
                points: Vec::new(),
            }],
            level: None,
        };
        assert!(svg(&[Panel::Error(empty)]).is_ok());
        assert!(svg(&[]).is_ok());
    }

    /// The samples of the legend are below all that the chart draws, and dashed lines have dashes there.
    #[test]
    fn the_legend_is_below_the_chart_and_shows_dashes() {
        let text = String::from_utf8(svg(&[Panel::Error(panel(Some(0.02)))]).unwrap()).unwrap();
        let number = |element: &str, name: &str| -> f64 {
            let from = element
                .split_once(&format!(" {name}=\""))
                .expect("a number")
                .1;
            from.split('"').next().unwrap().parse().unwrap()
        };
        // A text stands in the line after its element.
        let lines: Vec<&str> = text.lines().collect();
        let place = |name: &str| {
            let at = lines.iter().position(|l| l.trim() == name);
            number(lines[at.unwrap_or_else(|| panic!("no {name}")) - 1], "y")
        };
        let axis = place("seconds");
        for name in [
            "gpu-baked",
            "cpu-brute",
            "slope -1/2",
            "noise of the reference",
        ] {
            assert!(place(name) > axis, "{name} is in the chart");
        }
        let dashes = |width: std::ops::Range<f64>| {
            let short = |l: &&&str| {
                let ends = l
                    .split_once("points=\"")
                    .map(|(_, p)| p.split('"').next().unwrap());
                let all: Vec<f64> = ends
                    .into_iter()
                    .flat_map(|p| p.split([' ', ',']).filter_map(|n| n.parse().ok()))
                    .collect();
                matches!(all[..], [x0, y0, x1, y1] if y0 == y1 && y0 > axis && width.contains(&(x1 - x0)))
            };
            lines
                .iter()
                .filter(|l| l.starts_with("<polyline"))
                .filter(short)
                .count()
        };
        assert!(dashes(4.0..7.0) >= 2 && dashes(0.5..3.0) >= 4, "{text}");
    }
}
