//! OpenEXR pictures: linear 32-bit floats with error layers.

use super::metadata::{Value, entries};
use super::pixels::Pixels;
use crate::files::FileError;
use crate::files::atomic;
use crate::film::{Estimate, Film};
use crate::provenance::Provenance;
use exr::prelude::{
    AttributeValue, Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder,
    SpecificChannels, Text, Vec2, WritableImage,
};
use std::io::{self, BufRead as _, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Writes the whole picture: channels `R G B A`, `error.R error.G error.B error.Y` (standard errors of the mean, `Y` of the
/// luminance) and `samples`, as 32-bit floats in ZIP-compressed scan lines, which every reader knows. Counts of samples are
/// exact up to 2^24. Equal pictures are equal files.
///
/// Pixels without samples are 0 in every channel, alpha included; alpha is 1 elsewhere. No value is infinite
/// or NaN: what overflows a float stands as the largest float.
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
        .with_channel::<f32>("samples")
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
                samples as f32,
            ),
            None => (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(film.size[0] as usize, film.size[1] as usize);
    let layer = Layer::new(size, attributes(provenance), encoding, channels);
    let image = Image::from_layer(layer);
    atomic::replace(path, |file| {
        let written = image.write().to_buffered(&mut *file);
        written.map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => io::Error::other(other.to_string()),
        })?;
        file.flush()?;
        sort_attributes(file.get_mut())
    })
}

/// Sorts the attributes of a file's header by their names. The exr crate writes them in the order of a hash table, which differs
/// from run to run.
fn sort_attributes(mut file: impl Read + Write + Seek) -> io::Result<()> {
    /// Magic number and version.
    const START: u64 = 8;
    let mut from = BufReader::new(&mut file);
    from.seek(SeekFrom::Start(START))?;
    let mut attributes = Vec::new();
    loop {
        // Name and type end with 0, then come the value's length and the value. An empty name ends the header.
        let mut bytes = Vec::new();
        let name = from.read_until(0, &mut bytes)?;
        if name <= 1 {
            break;
        }
        from.read_until(0, &mut bytes)?;
        let mut length = [0; 4];
        from.read_exact(&mut length)?;
        bytes.extend(length);
        (&mut from)
            .take(u32::from_le_bytes(length).into())
            .read_to_end(&mut bytes)?;
        attributes.push((bytes[..name].to_vec(), bytes));
    }
    attributes.sort();
    let sorted: Vec<u8> = attributes
        .into_iter()
        .flat_map(|(_, bytes)| bytes)
        .collect();
    file.seek(SeekFrom::Start(START))?;
    file.write_all(&sorted)?;
    file.seek(SeekFrom::End(0))?;
    Ok(())
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
                // Not every reader knows doubles.
                let value = if x.fract() != 0.0 {
                    AttributeValue::F32(x as f32)
                } else if x.abs() <= f64::from(i32::MAX) {
                    AttributeValue::I32(x as i32)
                } else {
                    AttributeValue::Text(text(&x.to_string()))
                };
                attributes.other.insert(text(key), value);
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
