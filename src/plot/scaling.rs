//! Seconds per path against the number of objects.

use super::Drawn;
use super::chart::{Axes, Dashes, Pen, Sample, plain, range};
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::prelude::DrawingBackend;

/// What is drawn of one series.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingPanel {
    /// Above it.
    pub title: String,
    /// Below it: what is counted.
    pub things: &'static str,
    /// Names of engines, counts, and nanoseconds per path.
    pub curves: Vec<(&'static str, Vec<(f64, f64)>)>,
    /// Counts at which the renderer's default changes, with their labels.
    pub marks: Vec<(f64, String)>,
}

impl ScalingPanel {
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
