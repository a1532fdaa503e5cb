//! OpenEXR pictures: linear 32-bit floats with error layers.

use super::ExrChannels;
use super::metadata::{Value, entries};
use super::pixels::{Pixels, finite};
use crate::files::FileError;
use crate::files::atomic;
use crate::film::coverage::Rect;
use crate::film::{Estimate, Film};
use crate::provenance::Provenance;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    Layer, LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage, f16,
};
use std::io::{self, BufRead as _, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// The channels of a picture with errors and samples.
pub const CHANNELS: [&str; 9] = [
    "R", "G", "B", "A", "error.R", "error.G", "error.B", "error.Y", "samples",
];

/// The values of a pixel in [`CHANNELS`]: 0 in all of them where there are no samples.
pub fn channel_values(estimate: Option<Estimate>) -> [f32; CHANNELS.len()] {
    estimate.map_or([0.0; CHANNELS.len()], |e| {
        let ([r, g, b], [er, eg, eb, ey]) = (e.mean.map(finite), e.error.map(finite));
        [r, g, b, 1.0, er, eg, eb, ey, e.samples as f32]
    })
}

/// What a picture holds beside the film's own channels.
#[derive(Debug, Clone, Default)]
pub struct Extra {
    /// Names of channels, and their values for the whole picture, row by row, all finite.
    pub channels: Vec<(&'static str, Vec<f32>)>,
    /// Entries of the header.
    pub entries: Vec<(&'static str, Value)>,
}

/// Writes the whole picture in ZIP-compressed scan lines, which every reader knows. All channels are `R G B A`, `error.R error.G
/// error.B error.Y` (standard errors of the mean, `Y` of the luminance) and `samples`, as 32-bit floats: counts are exact up to
/// 2^24. Readers that trip over layers get `R G B` alone. Equal pictures are equal files.
///
/// Pixels without samples are 0 in every channel, alpha included; alpha is 1 elsewhere. No value is infinite
/// or NaN: what is too large for a float stands as the largest float of its kind.
pub fn write_exr(
    path: &Path,
    film: &Film,
    provenance: &Provenance,
    channels: ExrChannels,
) -> Result<(), FileError> {
    write_exr_with(path, film, provenance, channels, &Extra::default())
}

/// The same with other channels beside.
pub fn write_exr_with(
    path: &Path,
    film: &Film,
    provenance: &Provenance,
    channels: ExrChannels,
    extra: &Extra,
) -> Result<(), FileError> {
    let names: &[&str] = match channels {
        ExrChannels::All => &CHANNELS,
        ExrChannels::Rgb | ExrChannels::RgbHalf => &CHANNELS[..3],
    };
    let mut values = vec![Vec::with_capacity(Rect::whole(film.size).area() as usize); names.len()];
    let pixels = Pixels::new(film);
    for y in 0..film.size[1] {
        for x in 0..film.size[0] {
            let of_pixel = channel_values(pixels.at(x, y));
            for (channel, value) in values.iter_mut().zip(of_pixel) {
                channel.push(value);
            }
        }
    }
    let samples = |values: Vec<f32>| match channels {
        ExrChannels::All | ExrChannels::Rgb => FlatSamples::F32(values),
        ExrChannels::RgbHalf => FlatSamples::F16(values.into_iter().map(half).collect()),
    };
    let own = names.iter().copied().zip(values);
    let all = own.chain(extra.channels.iter().cloned());
    let channels = all.map(|(name, values)| AnyChannel::new(name, samples(values)));
    let more = extra
        .entries
        .iter()
        .map(|(key, value)| (*key, value.clone()));
    let attributes = attributes(entries(provenance).into_iter().chain(more));
    write(path, film.size, channels.collect(), attributes)
}

/// Writes a picture of R, G and B alone, row by row.
pub fn write_exr_rgb(path: &Path, size: [u32; 2], rgb: &[[f32; 3]]) -> Result<(), FileError> {
    let plane = |c: usize| FlatSamples::F32(rgb.iter().map(|p| p[c]).collect());
    let channels = ["R", "G", "B"].iter().enumerate();
    let channels = channels.map(|(c, name)| AnyChannel::new(*name, plane(c)));
    write(path, size, channels.collect(), LayerAttributes::default())
}

fn write(
    path: &Path,
    size: [u32; 2],
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
    attributes: LayerAttributes,
) -> Result<(), FileError> {
    let size = Vec2(size[0] as usize, size[1] as usize);
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels);
    let layer = Layer::new(size, attributes, encoding, channels);
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

/// The nearest half that is finite.
fn half(x: f32) -> f16 {
    f16::from_f32(x.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

fn attributes(entries: impl Iterator<Item = (&'static str, Value)>) -> LayerAttributes {
    // The exr crate's conversion from str accepts only Latin-1, but OpenEXR uses UTF-8.
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let mut attributes = LayerAttributes::default();
    for (key, value) in entries {
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
    fn values_too_large_for_a_half_become_the_largest_half() {
        assert_eq!(half(1e30), f16::MAX);
        assert_eq!(half(f32::MIN), f16::MIN);
        // Half an ulp above the largest half would round to infinity.
        assert_eq!(half(65520.0), f16::MAX);
        assert_eq!(half(0.5).to_f32(), 0.5);
    }
}
