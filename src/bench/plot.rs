//! Error against seconds on log axes, a panel for each scene, as SVG or PNG.

use super::summary::Point;
use super::{EngineKind, Results};
use crate::output::{FileError, atomic};
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::chart::{ChartBuilder, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{Circle, Cross, PathElement, TriangleMarker};
use plotters::prelude::{Color, DrawingBackend, IntoLogRange, RGBColor, ShapeStyle};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontStyle, IntoFont, TextStyle, WHITE, register_font};
use std::io::{self, Write};
use std::path::Path;

/// Width and height of a panel, in units of a picture seen at its own size.
const PANEL: [u32; 2] = [560, 440];

/// Pixels of a PNG for a unit, so that print is sharp.
const PIXELS: u32 = 2;

/// Each of them is the mean of so many squared: polygons and text are drawn without smoothing otherwise.
const SMOOTHING: u32 = 2;

/// Told apart by colour-blind eyes too [Okabe and Ito, 2008].
const COLOURS: [RGBColor; 4] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
];

/// The name in an SVG, for the viewer's own letters; in a PNG ours stand for it.
const FONT: &str = "sans-serif";

const GREY: RGBColor = RGBColor(120, 120, 120);

/// Picture formats of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `.svg`
    Svg,
    /// `.png`
    Png,
}

impl Format {
    /// The format that the extension of `path` names, in any case. The error states the rule.
    pub fn from_path(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(format!(
                "{}: a plot's name ends in .svg or .png",
                path.display()
            )),
        }
    }
}

/// What is drawn of one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// A line for each engine.
    pub curves: Vec<Curve>,
    /// Relative error of the reference itself.
    pub floor: Option<f64>,
}

/// One engine's errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Whose.
    pub engine: EngineKind,
    /// Seconds, relative error, and its standard deviation over seeds; all but the last above 0.
    pub points: Vec<[f64; 3]>,
}

impl Panel {
    /// What there is to draw of these results.
    pub fn new(results: &Results) -> Self {
        let points = results.points();
        let curve = |engine: EngineKind| {
            let drawn = |p: &Point| {
                let error = p.true_relative_error?;
                Some([p.seconds.mean, error.mean, error.sd.unwrap_or(0.0)])
            };
            Curve {
                engine,
                points: points
                    .iter()
                    .filter(|p| p.engine == engine)
                    .filter_map(drawn)
                    .filter(|p| p[0] > 0.0 && p[1] > 0.0)
                    .collect(),
            }
        };
        let name = Path::new(&results.scene).file_stem();
        Self {
            title: name.map_or(results.scene.clone(), |n| n.to_string_lossy().into()),
            curves: results.engines().into_iter().map(curve).collect(),
            floor: results.reference.truth.noise_floor().filter(|&f| f > 0.0),
        }
    }

    /// Least and greatest seconds and errors, widened to leave room; 1 around nothing.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let x = range(points().map(|p| p[0]), [0.7, 1.4]);
        let ends = |p: &[f64; 3]| [p[1] + p[2], (p[1] - p[2]).max(0.5 * p[1])];
        let y = range(points().flat_map(ends).chain(self.floor), [0.8, 1.6]);
        [x, y]
    }
}

impl Panel {
    /// Where the legend hides fewer points: errors fall to the right, so two corners are mostly free.
    fn free_corner(&self) -> SeriesLabelPosition {
        let [x, y] = self.ranges();
        let share = |v: f64, [a, b]: [f64; 2]| (v / a).ln() / (b / a).ln();
        let (mut left, mut right) = (0, 0);
        for p in self.curves.iter().flat_map(|c| &c.points) {
            let (x, y) = (share(p[0], x), share(p[1], y));
            left += u32::from(x < 0.4 && y < 0.4);
            right += u32::from(x > 0.6 && y > 0.6);
        }
        if right < left {
            SeriesLabelPosition::UpperRight
        } else {
            SeriesLabelPosition::LowerLeft
        }
    }
}

fn range(values: impl Iterator<Item = f64>, room: [f64; 2]) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return [0.1, 10.0];
    }
    [low * room[0], high * room[1]]
}

/// Writes a picture of the panels, side by side.
pub fn write(path: &Path, format: Format, panels: &[Panel]) -> Result<(), FileError> {
    let bytes = match format {
        Format::Svg => svg(panels),
        Format::Png => png(panels),
    };
    atomic::replace(path, |f| f.write_all(&bytes?))
}

/// Without a font of our own, text in a PNG would depend on what fonts the system has.
fn use_own_font() -> io::Result<()> {
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    register_font("sans-serif", FontStyle::Normal, font)
        .map_err(|_| io::Error::other("the plot's font is damaged"))
}

/// Columns and rows of panels.
fn grid(panels: usize) -> [u32; 2] {
    let columns = panels.clamp(1, 3);
    [columns as u32, panels.div_ceil(columns).max(1) as u32]
}

fn svg(panels: &[Panel]) -> io::Result<Vec<u8>> {
    use_own_font()?;
    let [columns, rows] = grid(panels.len());
    let mut text = String::new();
    {
        let backend = SVGBackend::with_string(&mut text, (columns * PANEL[0], rows * PANEL[1]));
        draw(&backend.into_drawing_area(), panels, 1).map_err(other)?;
    }
    Ok(text.into_bytes())
}

fn png(panels: &[Panel]) -> io::Result<Vec<u8>> {
    use_own_font()?;
    let [columns, rows] = grid(panels.len());
    let size = [columns * PANEL[0] * PIXELS, rows * PANEL[1] * PIXELS];
    let [w, h] = size.map(|n| (n * SMOOTHING) as usize);
    let mut fine = vec![0u8; w * h * 3];
    {
        let backend = BitMapBackend::with_buffer(&mut fine, (w as u32, h as u32));
        draw(&backend.into_drawing_area(), panels, PIXELS * SMOOTHING).map_err(other)?;
    }
    let s = SMOOTHING as usize;
    let mut bytes = Vec::with_capacity((size[0] * size[1] * 3) as usize);
    for y in 0..size[1] as usize {
        for x in 0..size[0] as usize {
            for c in 0..3 {
                let sum: usize = (0..s * s)
                    .map(|k| ((y * s + k / s) * w + x * s + k % s) * 3 + c)
                    .map(|at| usize::from(fine[at]))
                    .sum();
                bytes.push((sum / (s * s)) as u8);
            }
        }
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(other)?;
    writer.write_image_data(&bytes).map_err(other)?;
    writer.finish().map_err(other)?;
    Ok(file)
}

fn other(e: impl std::fmt::Display) -> io::Error {
    io::Error::other(e.to_string())
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Draws all panels, every length times `scale`.
fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    panels: &[Panel],
    scale: u32,
) -> Drawn<DB> {
    // Without a font of our own, text in a PNG would depend on what fonts the system has. It is read once more each
    // time; that it can be read, the tests have seen.
    let _ = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    area.fill(&WHITE)?;
    let [columns, rows] = grid(panels.len());
    let cells = area.split_evenly((rows as usize, columns as usize));
    for (panel, cell) in panels.iter().zip(&cells) {
        draw_panel(cell, panel, scale)?;
    }
    area.present()
}

fn draw_panel<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    panel: &Panel,
    scale: u32,
) -> Drawn<DB> {
    let px = |units: f64| units * f64::from(scale);
    let font = |size: f64| (FONT, px(size)).into_font();
    let line = |colour: RGBColor, width: f64| ShapeStyle {
        color: colour.to_rgba(),
        filled: true,
        stroke_width: px(width).round() as u32,
    };
    let [[x0, x1], [y0, y1]] = panel.ranges();
    let mut chart = ChartBuilder::on(area)
        .margin(px(14.0) as u32)
        .caption(&panel.title, font(17.0))
        .x_label_area_size(px(48.0) as u32)
        .y_label_area_size(px(62.0) as u32)
        .build_cartesian_2d(
            (x0..x1).log_scale().with_key_points(ticks(x0, x1)),
            (y0..y1).log_scale().with_key_points(ticks(y0, y1)),
        )?;
    chart
        .configure_mesh()
        .x_desc("seconds")
        .y_desc("relative error")
        .x_label_formatter(&|x| plain(*x))
        .y_label_formatter(&|y| format!("{} %", plain(*y * 100.0)))
        .label_style(font(14.0))
        .axis_desc_style(font(15.0))
        .axis_style(line(BLACK, 1.0))
        .bold_line_style(line(RGBColor(215, 215, 215), 0.7))
        .set_all_tick_mark_size(px(4.0) as u32)
        .draw()?;

    // The guide lies below the end of the first curve, where costs besides the samples matter least.
    let last = panel.curves.iter().find_map(|c| c.points.last());
    if let Some([x, y, _]) = last {
        let low = 0.7 * y;
        let guide = |t: f64| (t, low * (t / x).powf(-0.5));
        // What leaves the chart is not cut off but bent along its edge.
        let at = |error: f64| x * (low / error).powi(2);
        let ends = [x0.max(at(y1)), x1.min(at(y0))].map(guide);
        let dashes = DashedLineSeries::new(ends, px(6.0) as u32, px(4.0) as u32, line(GREY, 1.2));
        chart
            .draw_series(dashes)?
            .label("slope -1/2")
            .legend(move |(x, y)| {
                let half = px(8.0) as i32;
                PathElement::new(
                    [(x - half, y - half / 2), (x + half, y + half / 2)],
                    line(GREY, 1.2),
                )
            });
    }
    if let Some(floor) = panel.floor {
        let dots = DashedLineSeries::new(
            [(x0, floor), (x1, floor)],
            px(2.0) as u32,
            px(3.0) as u32,
            line(GREY, 1.2),
        );
        chart
            .draw_series(dots)?
            .label("noise of the reference")
            .legend(move |(x, y)| {
                let half = px(8.0) as i32;
                PathElement::new([(x - half, y), (x + half, y)], line(GREY, 1.2))
            });
    }
    for (i, curve) in panel.curves.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let style = line(colour, 1.8);
        let half = px(4.5) as i32;
        chart.draw_series(curve.points.iter().map(|&[x, y, sd]| {
            PathElement::new([(x, (y - sd).max(0.5 * y)), (x, y + sd)], line(colour, 1.2))
        }))?;
        let name = curve.engine.name();
        let points = || curve.points.iter().map(|p| (p[0], p[1]));
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
    }
    chart
        .configure_series_labels()
        .position(panel.free_corner())
        .margin(px(8.0) as i32)
        .legend_area_size(px(18.0) as u32)
        .label_font(TextStyle::from(font(14.0)).pos(Pos::new(HPos::Left, VPos::Top)))
        .background_style(WHITE.mix(0.85))
        .draw()
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

/// A number without digits that say nothing.
fn plain(x: f64) -> String {
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

    fn panel(floor: Option<f64>) -> Panel {
        let curve = |engine, cost: f64, error: f64| Curve {
            engine,
            points: (0..7)
                .map(|k| {
                    let n = f64::from(1 << k);
                    [cost * n, error / n.sqrt(), 0.03 * error / n.sqrt()]
                })
                .collect(),
        };
        Panel {
            title: "synthetic".into(),
            curves: vec![
                curve(EngineKind::GpuBaked, 0.05, 0.8),
                curve(EngineKind::GpuBuffers, 0.11, 0.8),
                curve(EngineKind::Cpu, 0.5, 0.78),
                curve(EngineKind::CpuBrute, 0.4, 5.0),
            ],
            floor,
        }
    }

    /// With `ETENDUE_KEEP_PLOTS` a folder, the pictures stay there to be looked at.
    #[test]
    fn plots_are_written_and_say_what_is_in_them() {
        let temporary = tempfile::tempdir().unwrap();
        let kept = std::env::var_os("ETENDUE_KEEP_PLOTS");
        let dir = kept.map_or(temporary.path().to_owned(), Into::into);
        let panels = vec![panel(Some(0.02)), panel(None)];
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
    fn nothing_measured_is_an_empty_plot() {
        let empty = Panel {
            title: "none".into(),
            curves: vec![Curve {
                engine: EngineKind::Cpu,
                points: Vec::new(),
            }],
            floor: None,
        };
        assert!(svg(&[empty]).is_ok());
        assert!(svg(&[]).is_ok());
    }

    #[test]
    fn the_legend_hides_few_points() {
        let corner = |middle: [f64; 3]| {
            let mut p = panel(None);
            p.curves.truncate(1);
            p.curves[0].points = vec![[0.1, 1.0, 0.0], middle, [1.0, 0.1, 0.0]];
            p.free_corner()
        };
        let [fast, slow] = [[0.12, 0.11, 0.0], [0.9, 0.9, 0.0]].map(corner);
        assert!(matches!(fast, SeriesLabelPosition::UpperRight));
        assert!(matches!(slow, SeriesLabelPosition::LowerLeft));
    }

    #[test]
    fn axes_have_neither_few_nor_many_labels() {
        assert_eq!(ticks(0.9, 2000.0), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(ticks(0.9, 30.0), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(2.2, 4.4), [3.0, 4.0], "as narrow as an axis gets");
    }

    #[test]
    fn labels_have_no_idle_digits() {
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
