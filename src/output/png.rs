//! PNG pictures: 8 bits per channel, sRGB.

use super::metadata::{Value, entries};
use super::pixels::Pixels;
use crate::files::FileError;
use crate::files::atomic;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::provenance::Provenance;
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::io::{self, Write};
use std::path::Path;

/// The key of the exposure in stops, which only PNG pictures have.
const EXPOSURE: &str = "exposure";

/// Writes the whole picture, brightened by `exposure_stops` powers of two. Where pixels lack samples
/// there is an alpha channel, 0 for them and 255 for the others.
///
/// Values round to the nearest of the 256 levels; what is brighter than 1 is 255.
pub fn write_png(
    path: &Path,
    film: &Film,
    provenance: &Provenance,
    exposure_stops: f64,
) -> Result<(), FileError> {
    let pixels = Pixels::new(film);
    let exposure = (EXPOSURE, Value::Number(exposure_stops));
    let drawing = Drawing {
        size: film.size,
        opaque: pixels.complete(),
        gain: exposure_stops.exp2(),
        entries: entries(provenance).into_iter().chain([exposure]).collect(),
    };
    drawing.write(path, |x, y| pixels.at(x, y).map(|e| e.mean))
}

/// Writes another picture of the pixels `bounds` of a film of `size`, row by row; `more` goes into its text chunks.
pub fn write_png_of(
    path: &Path,
    [size, bounds]: [Rect; 2],
    rgb: &[[f32; 3]],
    provenance: &Provenance,
    more: &[(&'static str, Value)],
    exposure_stops: f64,
) -> Result<(), FileError> {
    let drawing = Drawing {
        size: [size.width(), size.height()],
        opaque: size == bounds,
        gain: exposure_stops.exp2(),
        entries: entries(provenance)
            .into_iter()
            .chain(more.iter().cloned())
            .chain([(EXPOSURE, Value::Number(exposure_stops))])
            .collect(),
    };
    let width = bounds.width() as usize;
    drawing.write(path, |x, y| {
        bounds.contains(x, y).then(|| {
            let i = (y - bounds.y0) as usize * width + (x - bounds.x0) as usize;
            rgb[i].map(f64::from)
        })
    })
}

/// All of a PNG but its pixels.
struct Drawing {
    size: [u32; 2],
    /// Whether no pixel is missing.
    opaque: bool,
    gain: f64,
    entries: Vec<(&'static str, Value)>,
}

impl Drawing {
    fn write(
        self,
        path: &Path,
        pixel: impl Fn(u32, u32) -> Option<[f64; 3]>,
    ) -> Result<(), FileError> {
        atomic::replace(path, |file| {
            self.encode(file, pixel).map_err(|e| match e {
                EncodingError::IoError(e) => e,
                other => io::Error::other(other),
            })
        })
    }

    fn encode(
        self,
        file: impl Write,
        pixel: impl Fn(u32, u32) -> Option<[f64; 3]>,
    ) -> Result<(), EncodingError> {
        let [width, height] = self.size;
        let mut encoder = Encoder::new(file, width, height);
        encoder.set_color(if self.opaque {
            ColorType::Rgb
        } else {
            ColorType::Rgba
        });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
        for (key, value) in self.entries {
            let text = match value {
                Value::Text(text) => text.replace('\0', "\u{fffd}"),
                Value::Number(x) => x.to_string(),
            };
            let keyword = keyword(key).into();
            if text.is_ascii() {
                encoder.add_text_chunk(keyword, text)?;
            } else {
                encoder.add_itxt_chunk(keyword, text)?;
            }
        }
        let mut writer = encoder.write_header()?;
        let mut rows = writer.stream_writer()?;
        let mut row = Vec::new();
        for y in 0..height {
            row.clear();
            for x in 0..width {
                match pixel(x, y) {
                    Some(rgb) => {
                        row.extend(rgb.map(|v| encode_srgb(v * self.gain)));
                        row.extend((!self.opaque).then_some(255));
                    }
                    None => row.extend([0; 4]),
                }
            }
            rows.write_all(&row)?;
        }
        rows.finish()?;
        writer.finish()
    }
}

/// Keys for which the PNG specification has a keyword of its own (11.3.3.1), and the keyword.
const KEYWORDS: [(&str, &str); 2] = [("software", "Software"), ("scene", "Title")];

/// The keyword of a key.
fn keyword(key: &'static str) -> &'static str {
    let own = KEYWORDS.into_iter().find(|(ours, _)| *ours == key);
    own.map_or(key, |(_, keyword)| keyword)
}

/// The key of a keyword, which is that of other pictures too.
pub(super) fn key(keyword: &str) -> &str {
    let own = KEYWORDS.into_iter().find(|(_, theirs)| *theirs == keyword);
    own.map_or(keyword, |(key, _)| key)
}

/// Level 0..=255 of a linear value: IEC 61966-2-1, both pieces of its curve. NaN is 0.
fn encode_srgb(linear: f64) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let encoded = if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * encoded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_levels_are_the_standard_s() {
        // Decoding each level and encoding it again gives the level back.
        for level in 0..=255u8 {
            let v = f64::from(level) / 255.0;
            let linear = if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            };
            assert_eq!(encode_srgb(linear), level);
        }
        // Mid grey, and a value on the straight piece: 0.002 * 12.92 * 255 = 6.59.
        assert_eq!(encode_srgb(0.18), 118);
        assert_eq!(encode_srgb(0.002), 7);
        for (out_of_range, level) in [
            (-1.0, 0),
            (f64::NAN, 0),
            (1.01, 255),
            (f64::INFINITY, 255),
            (-0.0, 0),
        ] {
            assert_eq!(encode_srgb(out_of_range), level);
        }
    }
}
