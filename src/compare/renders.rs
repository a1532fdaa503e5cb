//! Several independent renders as one picture: their spread is its noise.

use super::picture::{Noise, Side, Unit};
use crate::files::FileError;
use crate::stats::luminance;
use std::path::{Path, PathBuf};

impl Side {
    /// One picture, or the mean of several independent renders of the same scene, which states its error by their spread. `samples` is
    /// as for [`Side::read_sampled`].
    pub fn read_renders(paths: &[PathBuf], samples: Option<u64>) -> Result<Self, FileError> {
        let (first, others) = paths.split_first().expect("at least one path");
        if others.is_empty() {
            return Self::read_sampled(first, samples);
        }
        let mut sum = Self::read(first)?;
        // The renders less the first one: their mean and squares don't lose digits.
        let base = sum.rgb.clone();
        let pixels = base.len();
        let mut moved = vec![[[0.0; 2]; 4]; pixels];
        for path in others {
            let next = Self::read(path)?;
            check(path, &sum, &next)?;
            sum.clipped |= next.clipped;
            for (i, moved) in moved.iter_mut().enumerate() {
                let d = [0, 1, 2].map(|c| next.rgb[i][c] - base[i][c]);
                for (moved, d) in moved.iter_mut().zip([d[0], d[1], d[2], luminance(d)]) {
                    moved[0] += d;
                    moved[1] += d * d;
                }
            }
            if next.rgb == base {
                let why = format!(
                    "every pixel is that of {}; renders must be independent, with seeds of their own",
                    first.display()
                );
                return Err(FileError::content(path, why));
            }
        }
        let n = paths.len() as f64;
        let mut error = vec![[0.0; 4]; pixels];
        for (i, moved) in moved.iter().enumerate() {
            for c in 0..4 {
                let [s, q] = moved[c];
                if c < 3 {
                    sum.rgb[i][c] = base[i][c] + s / n;
                }
                error[i][c] = ((q - s * s / n).max(0.0) / (n * (n - 1.0))).sqrt();
            }
        }
        sum.name = format!("{} and {} more", first.display(), others.len());
        sum.noise = Some(Noise {
            error,
            luminance_alone: false,
            samples: vec![paths.len() as u64; pixels],
            unit: Unit::Render,
            replicates: paths.len() as u32,
        });
        // What only the first one says of itself is not said of all.
        sum.origin.clear();
        Ok(sum)
    }
}

/// Refuses a render of another size, or of other regions.
fn check(path: &Path, first: &Side, next: &Side) -> Result<(), FileError> {
    let why = if next.size != first.size {
        let ([w, h], [x, y]) = (next.size, first.size);
        format!("it has {w} x {h} pixels, but {} has {x} x {y}", first.name)
    } else if next.covered != first.covered {
        format!("other pixels have samples in it than in {}", first.name)
    } else {
        return Ok(());
    };
    Err(FileError::content(path, why))
}
