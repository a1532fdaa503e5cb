//! Reads OpenEXR pictures, written by this or another program.

use super::exr_stated::Moments;
use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use exr::error::Error;
use exr::image::{AnyChannel, AnyChannels, FlatSamples, Layer};
use exr::meta::MetaData;
use exr::prelude::{AttributeValue, LayerAttributes, ReadChannels, ReadLayers, SampleType, Text};
use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

/// How many bytes one byte of a chunk can become: deflate's limit (RFC 1951: 258 bytes from two bits),
/// and more than the other lossless codecs reach.
const MOST_EXPANSION: u64 = 1032;

/// Pictures up to this many bytes are read whatever the size of the file: black ones in lossy codecs
/// can be smaller still, and this much memory does no harm.
const HARMLESS: u64 = 64 << 20;

/// Pixels per side: the scene format's limit.
const MAX_SIDE: usize = 65536;

/// A picture, row by row from the top left. Every value is finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width and height in pixels, of the data window.
    pub size: [u32; 2],
    /// Linear RGB.
    pub rgb: Vec<[f32; 3]>,
    /// 1 where the picture has samples, 0 where it has none; all 1 when the file has no such channel.
    pub alpha: Vec<f32>,
    /// Standard errors of R, G, B and of the luminance, >= 0, if the file has them.
    pub error: Option<Vec<[f32; 4]>>,
    /// Samples of each pixel, if the file has them.
    pub samples: Option<Vec<u32>>,
    /// What other renderers state in place of errors.
    pub moments: Option<Moments>,
    /// Header attributes that are text or a number, as text.
    pub attributes: BTreeMap<String, String>,
}

/// Reads an EXR of one part with at least the channels `R`, `G` and `B`, in any of the types and any of the
/// compressions that the exr crate knows. Values that are NaN or infinite and negative errors make
/// the content wrong, as do damaged files; a missing or unreadable file is another error.
pub fn read_exr(path: &Path) -> Result<Picture, FileError> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|e| FileError::io(path, "cannot read", &e))?;
    // From memory: a damaged offset then can't make the system call fail, as if access were at fault.
    decode(Cursor::new(bytes.as_slice())).map_err(|e| failure(path, e))
}

/// A layer of an EXR file.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrLayer {
    /// Pixels of a row.
    pub width: usize,
    /// Its channels by name, in the order of their names: all that begin with the layer's name and a dot.
    pub channels: Vec<(String, Vec<f32>)>,
}

/// Reads the layers with these names, in their order. A file that lacks one, or has a value in it that is not finite, has the wrong content.
pub fn read_exr_layers(path: &Path, names: &[String]) -> Result<Vec<ExrLayer>, FileError> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|e| FileError::io(path, "cannot read", &e))?;
    let layer = layer(Cursor::new(bytes.as_slice())).map_err(|e| failure(path, e))?;
    let size = [layer.size.0 as u32, layer.size.1 as u32];
    let of_name = |name: &String| {
        let start = format!("{name}.");
        let all = layer.channel_data.list.iter();
        let channels = all.filter(|c| utf8(&c.name).starts_with(&start)).map(|c| {
            let values = interleave([c], size, f32::NEG_INFINITY)?;
            Ok((utf8(&c.name), values.into_iter().map(|[v]| v).collect()))
        });
        let channels: exr::error::Result<Vec<_>> = channels.collect();
        let channels = channels.map_err(|e| failure(path, e))?;
        if channels.is_empty() {
            return Err(FileError::content(path, format!("it has no layer {name}")));
        }
        Ok(ExrLayer {
            width: layer.size.0,
            channels,
        })
    };
    names.iter().map(of_name).collect()
}

fn failure(path: &Path, e: Error) -> FileError {
    let error = match e {
        Error::Io(e) => FileError::reading(path, &e),
        Error::Invalid(what) => FileError::content(path, format!("invalid EXR: {what}")),
        Error::NotSupported(what) => FileError::content(path, format!("unsupported EXR: {what}")),
        Error::Aborted => FileError::content(path, "reading was aborted"),
    };
    kind::explain(error, "an EXR picture", Some(FileKind::Exr))
}

fn decode(from: Cursor<&[u8]>) -> exr::error::Result<Picture> {
    picture(layer(from)?)
}

/// All channels of the first part.
fn layer(mut from: Cursor<&[u8]>) -> exr::error::Result<Layer<AnyChannels<FlatSamples>>> {
    let length = from.get_ref().len() as u64;
    let meta = MetaData::read_from_buffered(&mut from, false)?;
    for header in &meta.headers {
        let size = header.layer_size;
        if size.0 > MAX_SIDE || size.1 > MAX_SIDE {
            return Err(invalid(format!(
                "it has {} x {} pixels, but a side has at most {MAX_SIDE}",
                size.0, size.1
            )));
        }
        let most = length.saturating_mul(MOST_EXPANSION).max(HARMLESS);
        let bytes = (size.area() as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
        if bytes > most {
            return Err(invalid(format!(
                "it claims {} x {} pixels, but has only {length} bytes",
                size.0, size.1
            )));
        }
    }
    from.set_position(0);
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        // A panic on another thread could not be told from a crash, and this is fast enough.
        .non_parallel()
        .from_buffered(from)?;
    Ok(image.layer_data)
}

fn invalid(message: String) -> Error {
    Error::Invalid(message.into())
}

fn picture(layer: Layer<AnyChannels<FlatSamples>>) -> exr::error::Result<Picture> {
    let size = [layer.size.0 as u32, layer.size.1 as u32];
    let channels = &layer.channel_data.list;
    let find = |name: &str| {
        channels
            .iter()
            .find(|c| c.name.as_slice() == name.as_bytes())
    };
    let need = |name: &str| {
        find(name).ok_or_else(|| {
            let all: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
            invalid(format!("no channel {name}; it has {}", all.join(", ")))
        })
    };
    let rgb = interleave(
        [need("R")?, need("G")?, need("B")?],
        size,
        f32::NEG_INFINITY,
    )?;
    let alpha = match find("A") {
        Some(a) => interleave([a], size, 0.0)?
            .into_iter()
            .map(|[a]| a)
            .collect(),
        None => vec![1.0; rgb.len()],
    };
    let layers = ["error.R", "error.G", "error.B", "error.Y"].map(find);
    let error = match layers {
        [Some(r), Some(g), Some(b), Some(y)] => Some(interleave([r, g, b, y], size, 0.0)?),
        [None, None, None, None] => None,
        _ => return Err(invalid("it has only some of the error channels".into())),
    };
    let samples = match find("samples").map(|c| &c.sample_data) {
        Some(FlatSamples::U32(counts)) if counts.len() == rgb.len() => Some(counts.clone()),
        Some(FlatSamples::F32(counts))
            if counts.len() == rgb.len() && counts.iter().all(is_count) =>
        {
            Some(counts.iter().map(|n| *n as u32).collect())
        }
        Some(_) => {
            let what = "channel samples does not have a whole number for each pixel";
            return Err(invalid(what.into()));
        }
        None => None,
    };
    let moments = moments(channels, size)?;
    let attributes = texts(&layer.attributes);
    Ok(Picture {
        size,
        rgb,
        alpha,
        error,
        samples,
        moments,
        attributes,
    })
}

/// The spread of the luminance that Mitsuba or pbrt states, if one of them has written the picture.
fn moments(
    channels: &[AnyChannel<FlatSamples>],
    size: [u32; 2],
) -> exr::error::Result<Option<Moments>> {
    let find = |name: &str| {
        channels
            .iter()
            .find(|c| c.name.as_slice() == name.as_bytes())
    };
    let plane = |channel: &AnyChannel<FlatSamples>| -> exr::error::Result<Vec<f32>> {
        let values = interleave([channel], size, f32::NEG_INFINITY)?;
        Ok(values.into_iter().map(|[v]| v).collect())
    };
    if let [Some(_), Some(green), Some(_)] = ["Variance.R", "Variance.G", "Variance.B"].map(find) {
        return Ok(Some(Moments::from_variance(&plane(green)?)));
    }
    // The integrator inside has a name of the user's.
    for square in channels {
        let name = utf8(&square.name);
        let inner = name.strip_prefix("m2_").and_then(|n| n.strip_suffix(".Y"));
        if let Some(inner) = inner
            && let Some(mean) = find(&format!("{inner}.Y"))
        {
            let moments = Moments::from_means(&plane(mean)?, &plane(square)?);
            return Ok(Some(moments));
        }
    }
    Ok(None)
}

/// The attributes that are text or a number, as text.
fn texts(attributes: &LayerAttributes) -> BTreeMap<String, String> {
    let software = attributes.software_name.iter();
    let software = software.map(|s| ("software".to_owned(), utf8(s)));
    let others = attributes.other.iter().filter_map(|(name, value)| {
        let value = match value {
            AttributeValue::Text(text) => utf8(text),
            AttributeValue::F64(x) => x.to_string(),
            AttributeValue::F32(x) => x.to_string(),
            AttributeValue::I32(x) => x.to_string(),
            _ => return None,
        };
        Some((utf8(name), value))
    });
    software.chain(others).collect()
}

/// What an EXR file says of itself before its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrHeader {
    /// Width and height in pixels, of the data window.
    pub size: [u32; 2],
    /// Names and types of all channels.
    pub channels: Vec<String>,
    /// Attributes that are text or a number, as text.
    pub attributes: BTreeMap<String, String>,
}

/// Reads the header of any EXR file; of its first part, if it has several.
pub fn read_exr_header(path: &Path) -> Result<ExrHeader, FileError> {
    let mut file = BufReader::new(open(path)?);
    let meta = MetaData::read_from_buffered(&mut file, false).map_err(|e| failure(path, e))?;
    let header = &meta.headers[0];
    let channels = header.channels.list.iter().map(|channel| {
        let kind = match channel.sample_type {
            SampleType::F16 => "half",
            SampleType::F32 => "float",
            SampleType::U32 => "uint",
        };
        format!("{} ({kind})", utf8(&channel.name))
    });
    Ok(ExrHeader {
        size: [header.layer_size.0 as u32, header.layer_size.1 as u32],
        channels: channels.collect(),
        attributes: texts(&header.own_attributes),
    })
}

/// Whether it can be a number of samples.
fn is_count(n: &f32) -> bool {
    n.fract() == 0.0 && (0.0..=u32::MAX as f32).contains(n)
}

fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// The channels side by side; every value must be finite and at least `least`.
fn interleave<const N: usize>(
    channels: [&AnyChannel<FlatSamples>; N],
    size: [u32; 2],
    least: f32,
) -> exr::error::Result<Vec<[f32; N]>> {
    let pixels = size[0] as usize * size[1] as usize;
    let mut out = vec![[0.0; N]; pixels];
    for (c, channel) in channels.iter().enumerate() {
        if channel.sample_data.len() != pixels {
            return Err(invalid(format!("channel {} is subsampled", channel.name)));
        }
        if matches!(channel.sample_data, FlatSamples::U32(_)) {
            return Err(invalid(format!(
                "channel {} has integer values",
                channel.name
            )));
        }
        let values = channel.sample_data.values_as_f32();
        for (i, (pixel, value)) in out.iter_mut().zip(values).enumerate() {
            if !value.is_finite() || value < least {
                let (x, y) = (i % size[0] as usize, i / size[0] as usize);
                return Err(invalid(format!(
                    "channel {} is {value} at pixel ({x}, {y})",
                    channel.name
                )));
            }
            pixel[c] = value;
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;
    use crate::film::coverage::Rect;
    use crate::output::{ExrChannels, write_exr};
    use crate::provenance::tests::example;

    /// A small picture of several chunks.
    fn bytes() -> Vec<u8> {
        let size = [5, 40];
        let rect = Rect::whole(size);
        let mut film = Film::new(size, rect, 1);
        let pixel = |i: u32| [0, 1, 2, 3].map(|r| [1, 2, 3, 4].map(|c| f64::from(i * c + r)));
        film.put_samples(rect, 0..8, (0..200).map(pixel).collect());
        let path = tempfile::NamedTempFile::new().unwrap();
        write_exr(path.path(), &film, &example(size), ExrChannels::All).unwrap();
        std::fs::read(path.path()).unwrap()
    }

    #[test]
    fn damaged_files_never_panic_and_are_nearly_always_refused() {
        let good = bytes();
        let expected = decode(Cursor::new(&good)).unwrap();
        let mut unseen = 0;
        for bit in 0..8 * good.len() {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            if let Ok(found) = decode(Cursor::new(&bytes)) {
                let pixels = |p: &Picture| (p.rgb.clone(), p.error.clone());
                unseen += usize::from(pixels(&found) != pixels(&expected));
            }
        }
        // Pixels are protected by zlib's Adler-32, which for a few hundred bytes is weak.
        let share = unseen as f64 / (8 * good.len()) as f64;
        assert!(
            share < 1e-3,
            "{unseen} flipped bits changed the picture unseen"
        );
        for end in 0..good.len() {
            assert!(decode(Cursor::new(&good[..end])).is_err(), "cut at {end}");
        }
    }

    /// A picture of one row of two pixels as another program could write it; channels by name.
    fn foreign(channels: &[(&str, FlatSamples)]) -> exr::error::Result<Picture> {
        use exr::prelude::{Encoding, Image, LayerAttributes, WritableImage};
        let list = channels
            .iter()
            .map(|(name, samples)| AnyChannel::new(*name, samples.clone()))
            .collect();
        let layer = Layer::new(
            (2, 1),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(list),
        );
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes)?;
        decode(Cursor::new(bytes.get_ref()))
    }

    #[test]
    fn foreign_pictures_are_read_or_refused_by_name() {
        let floats = |x: f32| FlatSamples::F32(vec![0.5, x]);
        let rgb = |x: f32| vec![("R", floats(x)), ("G", floats(1.0)), ("B", floats(2.0))];
        let plain = foreign(&rgb(0.25)).unwrap();
        assert_eq!(plain.rgb, [[0.5; 3], [0.25, 1.0, 2.0]]);
        assert_eq!((plain.alpha, plain.error), (vec![1.0; 2], None));
        let half = FlatSamples::F16(vec![exr::prelude::f16::from_f32(0.5); 2]);
        let half = [("R", half.clone()), ("G", half.clone()), ("B", half)];
        assert_eq!(foreign(&half).unwrap().rgb, [[0.5; 3]; 2]);

        let errors = |names: &[&'static str], x: f32| {
            let mut all = rgb(1.0);
            all.extend(names.iter().map(|n| (*n, floats(x))));
            all
        };
        let all = ["error.R", "error.G", "error.B", "error.Y"];
        assert!(foreign(&errors(&all, 0.0)).unwrap().error.is_some());
        let integers = FlatSamples::U32(vec![1, 2]);
        let mut counted = rgb(1.0);
        counted.push(("samples", integers.clone()));
        assert_eq!(foreign(&counted).unwrap().samples, Some(vec![1, 2]));
        counted.pop();
        counted.push(("samples", FlatSamples::F32(vec![3.0, 4.0])));
        assert_eq!(foreign(&counted).unwrap().samples, Some(vec![3, 4]));
        for (channels, expected) in [
            (rgb(f32::NAN), "channel R is NaN at pixel (1, 0)"),
            (rgb(f32::INFINITY), "channel R is inf at pixel (1, 0)"),
            (
                errors(&all, -0.5),
                "channel error.R is -0.5 at pixel (1, 0)",
            ),
            (errors(&all[1..], 0.5), "only some of the error channels"),
            (
                errors(&["samples"], 0.5),
                "channel samples does not have a whole number",
            ),
            (vec![("Y", floats(1.0))], "no channel R; it has Y"),
            (
                vec![("R", integers), ("G", floats(1.0)), ("B", floats(1.0))],
                "channel R has integer values",
            ),
        ] {
            let error = foreign(&channels).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn random_bytes_never_panic() {
        let good = bytes();
        let mut state = 1u32;
        // xorshift32
        let mut random = move |n: usize| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as usize % n
        };
        for _ in 0..5000 {
            let mut bytes = good.clone();
            for _ in 0..1 + random(8) {
                bytes[random(good.len())] = [0, 0xff, 0x7f, 0x80, 1][random(5)];
            }
            // Either answer will do, as long as it is one.
            let _ = decode(Cursor::new(&bytes));
        }
    }
}
