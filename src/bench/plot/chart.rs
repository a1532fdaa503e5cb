//! The parts common to all panels: log axes, curves, dashed lines, a legend.

use super::Drawn;
use plotters::chart::{ChartBuilder, ChartContext, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::element::{Circle, Cross, PathElement, TriangleMarker};
use plotters::prelude::{Color, DrawingBackend, IntoLogRange, RGBColor, ShapeStyle};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontDesc, IntoFont, TextStyle, WHITE};

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

    /// A grey line of dashes, so long and so far apart; `slant` is its direction in the legend.
    pub fn dashes<'a, DB: DrawingBackend + 'a>(
        self,
        chart: &mut Chart<'a, DB>,
        ends: [(f64, f64); 2],
        [dash, gap]: [f64; 2],
        slant: [f64; 2],
        label: &str,
    ) -> Drawn<DB> {
        let style = self.line(GREY, 1.2);
        let series = DashedLineSeries::new(ends, self.px(dash) as u32, self.px(gap) as u32, style);
        let [across, down] = slant.map(|s| (s * self.px(8.0)) as i32);
        chart
            .draw_series(series)?
            .label(label)
            .legend(move |(x, y)| {
                PathElement::new([(x - across, y - down), (x + across, y + down)], style)
            });
        Ok(())
    }

    /// Curve `i`, with a mark at each point.
    pub fn curve<'a, DB: DrawingBackend + 'a>(
        self,
        chart: &mut Chart<'a, DB>,
        i: usize,
        name: &str,
        points: &[(f64, f64)],
    ) -> Drawn<DB> {
        let style = self.line(Self::colour(i), 1.8);
        let half = self.px(4.5) as i32;
        let points = || points.iter().copied();
        // Marks are types of their own, for points of the chart and of the legend.
        macro_rules! curve {
            ($mark:ident, $style:expr) => {{
                let mark = $style;
                chart
                    .draw_series(LineSeries::new(points(), style))?
                    .label(name)
                    .legend(move |at| $mark::new(at, half, mark));
                chart.draw_series(points().map(|at| $mark::new(at, half, mark)))?;
            }};
        }
        match i % 4 {
            0 => curve!(Circle, style),
            1 => curve!(TriangleMarker, style),
            2 => curve!(Cross, style),
            _ => curve!(
                Circle,
                ShapeStyle {
                    filled: false,
                    ..style
                }
            ),
        }
        Ok(())
    }

    /// The names of all curves and lines.
    pub fn legend<'a, DB: DrawingBackend + 'a>(
        self,
        chart: &mut Chart<'a, DB>,
        position: SeriesLabelPosition,
    ) -> Drawn<DB> {
        chart
            .configure_series_labels()
            .position(position)
            .margin(self.px(8.0) as i32)
            .legend_area_size(self.px(18.0) as u32)
            .label_font(TextStyle::from(self.font(14.0)).pos(Pos::new(HPos::Left, VPos::Top)))
            .background_style(WHITE.mix(0.85))
            .draw()
    }
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
