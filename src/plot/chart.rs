//! The parts common to all panels: log axes, curves, dashed lines, a legend.

use super::Drawn;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::element::{
    Circle, Cross, DashedPathElement, DynElement, IntoDynElement, PathElement, Text, TriangleMarker,
};
use plotters::prelude::{Color, DrawingBackend, IntoLogRange, RGBColor, ShapeStyle};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontDesc, IntoFont, TextStyle};

/// Told apart by colour-blind eyes too [Okabe and Ito, 2008].
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// The font name in an SVG, which uses the viewer's font. A PNG uses our own font.
pub(super) const FONT: &str = "sans-serif";

const GREY: RGBColor = RGBColor(120, 120, 120);

type Log = WithKeyPoints<LogCoord<f64>>;

/// A panel with its axes.
pub(super) type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<Log, Log>>;

/// What is around a panel's curves.
pub(super) struct Axes<'a> {
    /// Above it.
    pub title: &'a str,
    /// Of x and y.
    pub names: [&'a str; 2],
    /// Least and greatest x, and y.
    pub ranges: [[f64; 2]; 2],
    /// A value of y in words.
    pub y_label: fn(f64) -> String,
}

/// Scales all lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen(pub u32);

impl Pen {
    fn px(self, units: f64) -> f64 {
        units * f64::from(self.0)
    }

    fn font(self, size: f64) -> FontDesc<'static> {
        (FONT, self.px(size)).into_font()
    }

    /// The style of a line.
    pub fn line(self, colour: RGBColor, width: f64) -> ShapeStyle {
        ShapeStyle {
            color: colour.to_rgba(),
            filled: true,
            stroke_width: self.px(width).round() as u32,
        }
    }

    /// The colour of curve `i`.
    pub fn colour(i: usize) -> RGBColor {
        COLOURS[i % COLOURS.len()]
    }

    /// A panel without curves.
    pub fn axes<'a, DB: DrawingBackend>(
        self,
        area: &'a DrawingArea<DB, Shift>,
        axes: &Axes,
    ) -> Result<Chart<'a, DB>, DrawingAreaErrorKind<DB::ErrorType>> {
        let axis =
            |[low, high]: [f64; 2]| (low..high).log_scale().with_key_points(ticks(low, high));
        let [x, y] = axes.ranges;
        let mut chart = ChartBuilder::on(area)
            .margin(self.px(14.0) as u32)
            .caption(axes.title, self.font(17.0))
            .x_label_area_size(self.px(48.0) as u32)
            .y_label_area_size(self.px(62.0) as u32)
            .build_cartesian_2d(axis(x), axis(y))?;
        chart
            .configure_mesh()
            .x_desc(axes.names[0])
            .y_desc(axes.names[1])
            .x_label_formatter(&|x| plain(*x))
            .y_label_formatter(&|y| (axes.y_label)(*y))
            .label_style(self.font(14.0))
            .axis_desc_style(self.font(15.0))
            .axis_style(self.line(BLACK, 1.0))
            .bold_line_style(self.line(RGBColor(215, 215, 215), 0.7))
            .set_all_tick_mark_size(self.px(4.0) as u32)
            .draw()?;
        Ok(chart)
    }

    /// A grey line of dashes.
    pub fn dashes<DB: DrawingBackend>(
        self,
        chart: &mut Chart<DB>,
        ends: [(f64, f64); 2],
        dashes: Dashes,
    ) -> Drawn<DB> {
        let [dash, gap] = self.lengths(dashes);
        let series = DashedLineSeries::new(ends, dash, gap, self.line(GREY, 1.2));
        chart.draw_series(series)?;
        Ok(())
    }

    fn lengths(self, dashes: Dashes) -> [u32; 2] {
        dashes.0.map(|length| self.px(length) as u32)
    }

    /// Curve `i`, with a mark at each point.
    pub fn curve<DB: DrawingBackend>(
        self,
        chart: &mut Chart<DB>,
        i: usize,
        points: &[(f64, f64)],
    ) -> Drawn<DB> {
        let line = LineSeries::new(points.iter().copied(), self.line(Self::colour(i), 1.8));
        chart.draw_series(line)?;
        chart.draw_series(points.iter().map(|&at| self.mark(i, at)))?;
        Ok(())
    }

    /// The mark of curve `i`, at a point of a chart or of a legend.
    fn mark<C: Clone + 'static, DB: DrawingBackend>(
        self,
        i: usize,
        at: C,
    ) -> DynElement<'static, DB, C> {
        let style = self.line(Self::colour(i), 1.8);
        let half = self.px(4.5) as i32;
        match i % 4 {
            0 => Circle::new(at, half, style).into_dyn(),
            1 => TriangleMarker::new(at, half, style).into_dyn(),
            2 => Cross::new(at, half, style).into_dyn(),
            _ => {
                let hollow = ShapeStyle {
                    filled: false,
                    ..style
                };
                Circle::new(at, half, hollow).into_dyn()
            }
        }
    }

    /// Draws the legend at the foot of a panel, and returns what is left above it: there the legend covers no line.
    pub fn legend<DB: DrawingBackend>(
        self,
        area: &DrawingArea<DB, Shift>,
        entries: &[(Sample, String)],
    ) -> Result<DrawingArea<DB, Shift>, DrawingAreaErrorKind<DB::ErrorType>> {
        let [row, sample, gap, margin] = [22.0, 34.0, 8.0, 14.0].map(|units| self.px(units) as i32);
        let text = TextStyle::from(self.font(14.0)).pos(Pos::new(HPos::Left, VPos::Center));
        let (width, height) = area.dim_in_pixel();

        // As many entries in a row as it takes.
        let mut places = Vec::new();
        let (mut x, mut rows) = (margin, 1);
        for (_, name) in entries {
            let long = sample + gap + area.estimate_text_size(name, &text)?.0 as i32;
            if x > margin && x + long + margin > width as i32 {
                (x, rows) = (margin, rows + 1);
            }
            places.push((x, rows));
            x += long + 2 * gap;
        }
        let foot = rows * row + gap;
        let (above, below) = area.split_vertically(height as i32 - foot);
        for ((kind, name), (x, rows)) in entries.iter().zip(places) {
            let y = rows * row - row / 2;
            let ends = [(x, y), (x + sample, y)];
            match *kind {
                Sample::Dashes(dashes) => {
                    let [dash, gap] = self.lengths(dashes);
                    let style = self.line(GREY, 1.2);
                    below.draw(&DashedPathElement::new(ends, dash, gap, style))?;
                }
                Sample::Curve(i) => {
                    let style = self.line(Self::colour(i), 1.8);
                    below.draw(&PathElement::new(ends, style))?;
                    below.draw(&self.mark(i, (x + sample / 2, y)))?;
                }
            }
            below.draw(&Text::new(
                name.as_str(),
                (x + sample + gap, y),
                text.clone(),
            ))?;
        }
        Ok(above)
    }
}

/// How long the dashes of a line are, and how far apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dashes(pub [f64; 2]);

impl Dashes {
    pub const LONG: Self = Self([6.0, 4.0]);
    pub const SHORT: Self = Self([2.0, 3.0]);
}

/// How a legend shows a line.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sample {
    /// With its dashes.
    Dashes(Dashes),
    /// As curve `i`, with its mark.
    Curve(usize),
}

/// Least and greatest of some values, widened to leave room; 1 around nothing.
pub(super) fn range(values: impl Iterator<Item = f64>, room: [f64; 2]) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return [0.1, 10.0];
    }
    [low * room[0], high * room[1]]
}

/// Where an axis is labelled: powers of ten, with more between them where there would be few.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let steps: &[f64] = match (high / low).log10() {
        decades if decades > 2.5 => &[1.0],
        decades if decades > 1.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0],
    };
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    decades
        .flat_map(|k| steps.iter().map(move |s| s * 10f64.powi(k)))
        .filter(|t| (low..=high).contains(t))
        .collect()
}

/// A number without superfluous digits.
pub(super) fn plain(x: f64) -> String {
    if !(1e-4..1e6).contains(&x) {
        return format!("{x:.0e}");
    }
    let digits = (1.0 - x.log10().floor()).max(0.0) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_neither_few_nor_many_labels() {
        assert_eq!(ticks(0.9, 2000.0), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(ticks(0.9, 30.0), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(2.2, 4.4), [3.0, 4.0], "as narrow as an axis gets");
    }

    #[test]
    fn labels_have_no_superfluous_digits() {
        for (x, text) in [
            (0.1, "0.1"),
            (10.0, "10"),
            (0.02, "0.02"),
            (2000.0, "2000"),
            (0.5, "0.5"),
        ] {
            assert_eq!(plain(x), text);
        }
    }
}
