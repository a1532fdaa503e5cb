//! Reads PNG pictures, written by this or another program.

use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use png::{ColorType, DecodingError, Info, Reader, Transformations};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A picture, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct Png {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB; grey is taken for R = G = B.
    pub rgb: Vec<[f64; 3]>,
    /// Whether alpha is more than 0.
    pub covered: Vec<bool>,
    /// The text chunks: those that other pictures have too by the key that these have, others by keyword.
    pub texts: Vec<(String, String)>,
}

/// What a PNG file says of itself before its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct PngHeader {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The channels with their bits, such as `RGB (8 bits)`.
    pub channels: String,
    /// The text chunks, likewise.
    pub texts: Vec<(String, String)>,
}

/// Reads the chunks before the pixels.
pub fn read_png_header(path: &Path) -> Result<PngHeader, FileError> {
    let reader = begin(path, Transformations::IDENTITY)?;
    let info = reader.info();
    let channels = match info.color_type {
        ColorType::Grayscale => "grey",
        ColorType::GrayscaleAlpha => "grey, alpha",
        ColorType::Indexed => "palette",
        ColorType::Rgb => "RGB",
        ColorType::Rgba => "RGBA",
    };
    Ok(PngHeader {
        size: [info.width, info.height],
        channels: format!("{channels} ({} bits)", info.bit_depth as u8),
        texts: texts(info),
    })
}

/// Reads a picture of 8 or 16 bits per channel.
pub fn read_png(path: &Path) -> Result<Png, FileError> {
    let mut reader = begin(path, Transformations::normalize_to_color8())?;
    let bytes = reader
        .output_buffer_size()
        .ok_or_else(|| FileError::content(path, "the picture is too large"))?;
    let mut data = vec![0; bytes];
    let frame = reader.next_frame(&mut data).map_err(|e| failure(path, e))?;
    reader.finish().map_err(|e| failure(path, e))?;
    let channels = frame.color_type.samples();
    let pixels = data[..frame.buffer_size()].chunks_exact(channels);
    let rgb = pixels.clone().map(|p| match channels {
        1 | 2 => [p[0]; 3],
        _ => [p[0], p[1], p[2]],
    });
    Ok(Png {
        size: [frame.width, frame.height],
        rgb: rgb
            .map(|p| p.map(|level| decode_srgb(f64::from(level) / 255.0)))
            .collect(),
        covered: pixels
            .map(|p| !matches!(channels, 2 | 4) || p[channels - 1] > 0)
            .collect(),
        texts: texts(reader.info()),
    })
}

fn begin(
    path: &Path,
    transformations: Transformations,
) -> Result<Reader<BufReader<File>>, FileError> {
    let mut decoder = png::Decoder::new(BufReader::new(open(path)?));
    decoder.set_transformations(transformations);
    decoder.read_info().map_err(|e| failure(path, e))
}

fn failure(path: &Path, e: DecodingError) -> FileError {
    let error = match e {
        DecodingError::IoError(e) => FileError::reading(path, &e),
        other => FileError::content(path, format!("invalid PNG: {other}")),
    };
    kind::explain(error, "a PNG picture", Some(FileKind::Png))
}

fn texts(info: &Info) -> Vec<(String, String)> {
    let latin1 = info.uncompressed_latin1_text.iter();
    let latin1 = latin1.map(|t| (t.keyword.clone(), t.text.clone()));
    let utf8 = info.utf8_text.iter();
    let utf8 = utf8.filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    let all = latin1.chain(utf8);
    all.map(|(keyword, text)| (super::png::key(&keyword).to_owned(), text))
        .collect()
}

/// Linear value of an sRGB value from 0 to 1: IEC 61966-2-1, both pieces of its curve.
pub(super) fn decode_srgb(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}
