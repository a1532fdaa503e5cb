//! Seconds per path against the number of objects.

use super::Drawn;
use super::chart::{Axes, Dashes, Pen, Sample, plain, range};
use crate::bench::scaling::Scaling;
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::prelude::DrawingBackend;

/// What is drawn of one series.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingPanel {
    /// Above it.
    title: String,
    /// Below it: what is counted.
    things: &'static str,
    /// Names of engines, counts, and nanoseconds per path.
    curves: Vec<(&'static str, Vec<(f64, f64)>)>,
    /// Counts at which the renderer's default changes, with their labels.
    marks: Vec<(f64, String)>,
}

impl ScalingPanel {
    /// The data to draw from this series.
    pub fn new(scaling: &Scaling) -> Self {
        let [width, height] = scaling.size;
        let device = scaling
            .engines
            .iter()
            .find_map(|(_, device)| device.as_ref());
        let on = device.map_or(String::new(), |d| format!(", {}", d.name));
        let curve = |&(engine, _): &(_, _)| {
            let costs = scaling.costs(engine).into_iter();
            (
                engine.name(),
                costs.map(|(n, s)| (n as f64, s * 1e9)).collect(),
            )
        };
        let baked = scaling
            .baked_up_to()
            .map(|n| (n as f64, format!("gpu-baked by default up to {n}")));
        let looked_at = scaling
            .looked_at_up_to()
            .map(|n| (n as f64, format!("no light tree up to {n}")));
        Self {
            title: format!("{}, {width}x{height}{on}", scaling.series.name()),
            things: scaling.series.things(),
            curves: scaling.engines.iter().map(curve).collect(),
            marks: baked.into_iter().chain(looked_at).collect(),
        }
    }

    /// Draws it.
    pub(super) fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        pen: Pen,
    ) -> Drawn<DB> {
        let points = || self.curves.iter().flat_map(|(_, points)| points);
        let x = range(points().map(|p| p.0), [0.8, 1.3]);
        let y = range(points().map(|p| p.1), [0.7, 1.4]);
        // Beyond the chart a mark would be drawn along its edge.
        let dashes = [Dashes::LONG, Dashes::SHORT];
        let marks = self.marks.iter().zip(dashes);
        let marks: Vec<_> = marks
            .filter(|((at, _), _)| (x[0]..x[1]).contains(at))
            .collect();
        let curves = self.curves.iter().enumerate();
        let curves = curves.map(|(i, (name, _))| (Sample::Curve(i), (*name).to_owned()));
        let named = marks
            .iter()
            .map(|((_, what), dashes)| (Sample::Dashes(*dashes), what.clone()));
        let legend: Vec<_> = curves.chain(named).collect();
        let area = pen.legend(area, &legend)?;
        let mut chart = pen.axes(
            &area,
            &Axes {
                title: &self.title,
                names: [self.things, "nanoseconds per path"],
                ranges: [x, y],
                y_label: plain,
            },
        )?;
        for ((at, _), dashes) in marks {
            pen.dashes(&mut chart, [(*at, y[0]), (*at, y[1])], dashes)?;
        }
        for (i, (_, points)) in self.curves.iter().enumerate() {
            pen.curve(&mut chart, i, points)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Format, Panel, write};
    use super::*;
    use crate::bench::scaling::tests::scaling;

    /// With `ETENDUE_KEEP_PLOTS` a folder, the pictures stay there to be looked at.
    #[test]
    fn a_series_is_drawn_with_the_limit_of_the_rule() {
        let temporary = tempfile::tempdir().unwrap();
        let kept = std::env::var_os("ETENDUE_KEEP_PLOTS");
        let dir = kept.map_or(temporary.path().to_owned(), Into::into);
        let panels = [ScalingPanel::new(&scaling())].map(Panel::Scaling);
        let svg = dir.join("scaling.svg");
        write(&svg, Format::Svg, &panels).unwrap();
        let text = std::fs::read_to_string(&svg).unwrap();
        for word in [
            "gpu-baked",
            "gpu-tree",
            "nanoseconds per path",
            "gpu-baked by default up to 53",
            "spheres, 512x384",
        ] {
            assert!(text.contains(word), "no {word}");
        }
        assert!(!text.contains("light tree"));
        write(&dir.join("scaling.png"), Format::Png, &panels).unwrap();
    }
}
