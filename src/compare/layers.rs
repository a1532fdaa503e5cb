//! Layers beside two pictures: what is seen in each pixel. They have no noise, so they are held to rounding alone.

use crate::files::FileError;
use crate::output::{ExrLayer, read_exr_layers};
use std::path::Path;

/// Values may differ by this share of the larger one, or of the layer's largest where they are small: rays that graze an edge may round to
/// either side of it, and so change a pixel by a 36th, but nothing else does.
const ROUNDING: f32 = 1e-5;

/// What differs between the layers `names` of two EXR files, in words; nothing if they are the same. A file without one of them is an error.
pub fn differing(a: &Path, b: &Path, names: &[String]) -> Result<Vec<String>, FileError> {
    let b = read_exr_layers(b, names)?;
    differing_from(a, &b, names)
}

/// The same between the layers `names` of an EXR file, and layers that were just made.
pub fn differing_from(
    a: &Path,
    b: &[ExrLayer],
    names: &[String],
) -> Result<Vec<String>, FileError> {
    let a = read_exr_layers(a, names)?;
    let mut all = Vec::new();
    for ((name, a), b) in names.iter().zip(&a).zip(b) {
        let (width, a, b) = (a.width, &a.channels, &b.channels);
        let shape = |channels: &[(String, Vec<f32>)]| -> Vec<(String, usize)> {
            channels.iter().map(|(n, v)| (n.clone(), v.len())).collect()
        };
        if shape(a) != shape(b) {
            all.push(format!("layer {name}: its channels or its size are others"));
            continue;
        }
        let (mut pixels, mut most, mut at) = (std::collections::BTreeSet::new(), 0.0, 0);
        for ((_, a), (_, b)) in a.iter().zip(b) {
            let largest = a.iter().chain(b).fold(0.0f32, |m, v| m.max(v.abs()));
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                let apart = (a - b).abs();
                if apart > ROUNDING * a.abs().max(b.abs()).max(0.1 * largest) {
                    pixels.insert(i);
                    if apart > most {
                        (most, at) = (apart, i);
                    }
                }
            }
        }
        if !pixels.is_empty() {
            let (x, y) = (at % width, at / width);
            let n = pixels.len();
            all.push(format!(
                "layer {name}: differs in {n} pixels, by up to {most} at ({x}, {y})"
            ));
        }
    }
    Ok(all)
}
