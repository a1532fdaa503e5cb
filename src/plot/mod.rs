//! Lines on log axes, panels side by side, as SVG or PNG.

mod chart;
mod error;
mod scaling;

pub use error::{Curve, ErrorPanel, Level};
pub use scaling::ScalingPanel;

use crate::files::{FileError, atomic};
use chart::Pen;
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::prelude::DrawingBackend;
use plotters::style::{FontStyle, WHITE, register_font};
use std::io::{self, Write};
use std::path::Path;

/// Width and height of a panel, in units of a picture seen at its own size.
const PANEL: [u32; 2] = [560, 440];

/// Pixels of a PNG for a unit, so that print is sharp.
const PIXELS: u32 = 2;

/// Each pixel is the mean of this number squared of drawn pixels, since polygons and text are drawn without smoothing.
const SMOOTHING: u32 = 2;

/// One of the drawings of a plot.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// Error against seconds.
    Error(ErrorPanel),
    /// Seconds per path against the number of objects.
    Scaling(ScalingPanel),
}

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
                "{}: the name of a plot must end in .svg or .png",
                path.display()
            )),
        }
    }
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
    register_font(chart::FONT, FontStyle::Normal, font)
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
    let _ = register_font(
        chart::FONT,
        FontStyle::Normal,
        epaint_default_fonts::UBUNTU_LIGHT,
    );
    area.fill(&WHITE)?;
    let [columns, rows] = grid(panels.len());
    let cells = area.split_evenly((rows as usize, columns as usize));
    for (panel, cell) in panels.iter().zip(&cells) {
        match panel {
            Panel::Error(panel) => panel.draw(cell, Pen(scale))?,
            Panel::Scaling(panel) => panel.draw(cell, Pen(scale))?,
        }
    }
    area.present()
}
