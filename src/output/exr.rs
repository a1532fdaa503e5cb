//! OpenEXR pictures: linear 32-bit floats with error layers.

use super::atomic;
use super::error::FileError;
use super::metadata::{Value, entries};
use super::pixels::Pixels;
use crate::film::{Estimate, Film};
use crate::provenance::Provenance;
use exr::prelude::{
    AttributeValue, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder,
    SpecificChannels, Text, Vec2, WritableImage,
};
use std::io;
use std::path::Path;

/// Writes the whole picture: channels `R G B A`, `error.R error.G error.B error.Y` (standard errors of
/// the mean, `Y` of the luminance) as floats and `samples` as an unsigned integer, ZIP-compressed.
///
/// Pixels without samples are 0 in every channel, alpha included; alpha is 1 elsewhere. No value is infinite
/// or NaN: what overflows a float stands as the largest float, and samples beyond u32 as the largest u32.
pub fn write_exr(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), FileError> {
    let pixels = Pixels::new(film);
    // exr finds each channel's place in the file by its name; the order here is only the tuple's.
    let channels = SpecificChannels::build()
        .with_channel::<f32>("R")
        .with_channel::<f32>("G")
        .with_channel::<f32>("B")
        .with_channel::<f32>("A")
        .with_channel::<f32>("error.R")
        .with_channel::<f32>("error.G")
        .with_channel::<f32>("error.B")
        .with_channel::<f32>("error.Y")
        .with_channel::<u32>("samples")
        .with_pixel_fn(|Vec2(x, y)| match pixels.at(x as u32, y as u32) {
            Some(Estimate {
                mean: [r, g, b],
                error: [er, eg, eb, ey],
                samples,
                replicates: _,
            }) => (
                float(r),
                float(g),
                float(b),
                1.0,
                float(er),
                float(eg),
                float(eb),
                float(ey),
                u32::try_from(samples).unwrap_or(u32::MAX),
            ),
            None => (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0),
        });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        line_order: LineOrder::Increasing,
        ..Encoding::default()
    };
    let size = Vec2(film.size[0] as usize, film.size[1] as usize);
    let layer = Layer::new(size, attributes(provenance), encoding, channels);
    let image = Image::from_layer(layer);
    atomic::replace(path, |file| {
        image.write().to_buffered(file).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => io::Error::other(other.to_string()),
        })
    })
}

/// The nearest float that is finite. NaN, which only an overflow can have left, counts as one.
fn float(x: f64) -> f32 {
    let largest = f64::from(f32::MAX);
    if x.is_nan() {
        return f32::MAX;
    }
    x.clamp(-largest, largest) as f32
}

fn attributes(provenance: &Provenance) -> LayerAttributes {
    // The exr crate's conversion from str accepts only Latin-1, but OpenEXR uses UTF-8.
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let mut attributes = LayerAttributes::default();
    for (key, value) in entries(provenance) {
        match value {
            // A standard attribute, for which exr has a field.
            Value::Text(software) if key == "software" => {
                attributes.software_name = Some(text(&software));
            }
            Value::Text(s) => {
                let value = AttributeValue::Text(text(&s));
                attributes.other.insert(text(key), value);
            }
            Value::Number(x) => {
                attributes.other.insert(text(key), AttributeValue::F64(x));
            }
        }
    }
    attributes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_too_large_for_f32_become_the_largest_f32() {
        assert_eq!(float(1e300), f32::MAX);
        assert_eq!(float(f64::INFINITY), f32::MAX);
        assert_eq!(float(f64::NAN), f32::MAX);
        assert_eq!(float(-1e39), f32::MIN);
        // Half an ulp above the largest float would round to infinity.
        assert_eq!(float(f64::from(f32::MAX) * (1.0 + 1e-8)), f32::MAX);
        assert_eq!(float(0.1), 0.1);
    }
}
