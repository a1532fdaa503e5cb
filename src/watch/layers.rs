//! The values of a film's pixels as the page and tev get them.

use crate::film::coverage::Rect;
use crate::film::{Estimate, Film};
use crate::output::pixels::{Pixels, finite};
use crate::stats::luminance;

/// The share of the picture's mean luminance that is added to a pixel's own, as in the picture's relative error.
const FLOOR: f64 = 0.1;

/// Values of the pixels of a film's bounds, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Width and height of the whole picture.
    pub size: [u32; 2],
    /// The part that the film holds.
    pub bounds: Rect,
    /// Mean radiance; NaN where there are no samples.
    pub mean: Vec<[f32; 3]>,
    /// Standard errors of R, G, B, and of the luminance.
    pub error: Vec<[f32; 4]>,
    /// Samples; 0 where there are none.
    pub samples: Vec<f32>,
    /// Mean luminance of the pixels that have samples.
    pub luminance: f64,
}

/// Which values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// Mean radiance.
    Picture,
    /// The standard error of the luminance Y over √(Y² + (0.1 Ȳ)²), Ȳ being the picture's mean luminance.
    Error,
    /// Samples.
    Samples,
}

/// Pixels of a picture, k x k of which become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct View {
    /// The pixels.
    pub rect: Rect,
    /// Pixels of the picture along one of the view.
    pub k: u32,
}

impl View {
    /// Width and height in pixels of the view.
    pub fn size(&self) -> [u32; 2] {
        [self.rect.width(), self.rect.height()].map(|n| n.div_ceil(self.k))
    }
}

impl Layers {
    /// Looks at every pixel.
    pub fn new(film: &Film) -> Self {
        let pixels = Pixels::new(film);
        let count = film.bounds.area() as usize;
        let mut layers = Self {
            size: film.size,
            bounds: film.bounds,
            mean: Vec::with_capacity(count),
            error: Vec::with_capacity(count),
            samples: Vec::with_capacity(count),
            luminance: 0.0,
        };
        let mut covered = 0u64;
        for y in film.bounds.y0..film.bounds.y1 {
            for x in film.bounds.x0..film.bounds.x1 {
                match pixels.at(x, y) {
                    Some(e) => {
                        layers.mean.push(e.mean.map(finite));
                        layers.error.push(e.error.map(finite));
                        layers.samples.push(e.samples as f32);
                        layers.luminance += luminance(e.mean);
                        covered += 1;
                    }
                    None => {
                        layers.mean.push([f32::NAN; 3]);
                        layers.error.push([f32::NAN; 4]);
                        layers.samples.push(0.0);
                    }
                }
            }
        }
        layers.luminance /= covered.max(1) as f64;
        layers
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        let b = self.bounds;
        b.contains(x, y)
            .then(|| (y - b.y0) as usize * b.width() as usize + (x - b.x0) as usize)
    }

    /// The estimate of pixel (x, y) of the picture, in the precision of an EXR file; `None` where there are no samples.
    pub fn at(&self, x: u32, y: u32) -> Option<Estimate> {
        let i = self.index(x, y).filter(|&i| self.samples[i] > 0.0)?;
        Some(Estimate {
            mean: self.mean[i].map(f64::from),
            error: self.error[i].map(f64::from),
            samples: self.samples[i] as u64,
            replicates: 0,
        })
    }

    /// [`Layer::Error`] of a pixel with samples.
    pub fn relative_error(&self, e: &Estimate) -> f64 {
        let scale = luminance(e.mean).hypot(FLOOR * self.luminance);
        if e.error[3] > 0.0 {
            e.error[3] / scale
        } else {
            0.0
        }
    }

    /// The values of a view, four bytes each, row by row. A picture's are [`rgb9e5`], the others f32, NaN where there are no samples.
    /// Pixels that become one give their mean, and of errors the root of the mean square.
    pub fn bytes(&self, layer: Layer, view: View) -> Vec<u8> {
        let View { rect, k } = view;
        let [width, height] = view.size();
        let mut bytes = Vec::with_capacity(width as usize * height as usize * 4);
        for row in 0..height {
            for column in 0..width {
                let (x0, y0) = (rect.x0 + column * k, rect.y0 + row * k);
                let (x1, y1) = ((x0 + k).min(rect.x1), (y0 + k).min(rect.y1));
                let (mut sum, mut n) = ([0.0; 3], 0u32);
                for y in y0..y1 {
                    for e in (x0..x1).filter_map(|x| self.at(x, y)) {
                        let values = match layer {
                            Layer::Picture => e.mean,
                            Layer::Error => [self.relative_error(&e).powi(2), 0.0, 0.0],
                            Layer::Samples => [e.samples as f64, 0.0, 0.0],
                        };
                        sum = [0, 1, 2].map(|c| sum[c] + values[c]);
                        n += 1;
                    }
                }
                let mean = sum.map(|s| s / f64::from(n));
                let value = match layer {
                    Layer::Picture if n == 0 => ABSENT,
                    Layer::Picture => rgb9e5(mean),
                    Layer::Error => (mean[0].sqrt() as f32).to_bits(),
                    Layer::Samples => (mean[0] as f32).to_bits(),
                };
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes
    }
}

/// What stands for a pixel without samples: no colour has it, as the largest mantissa of another would be larger.
const ABSENT: u32 = u32::MAX << 27;

/// Three channels that share an exponent: nine bits each, lowest red, and 2^(e - 24) in the highest five bits. The format of
/// graphics APIs, and small enough to follow a picture that grows.
fn rgb9e5(rgb: [f64; 3]) -> u32 {
    const LARGEST: f64 = 511.0 * 128.0;
    let rgb = rgb.map(|v| v.clamp(0.0, LARGEST));
    let largest = rgb.into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        return 0;
    }
    // 2^e is above the largest channel, also after rounding to nine bits.
    let mut e = (largest.log2().floor() as i32 + 1).max(-15);
    if (largest / f64::from(e - 9).exp2()).round() >= 512.0 {
        e += 1;
    }
    let unit = f64::from(e - 9).exp2();
    let [r, g, b] = rgb.map(|v| (v / unit).round() as u32);
    r | g << 9 | b << 18 | ((e + 15) as u32) << 27
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bits: u32) -> [f64; 3] {
        let unit = f64::from((bits >> 27) as i32 - 24).exp2();
        [0, 9, 18].map(|shift| f64::from(bits >> shift & 511) * unit)
    }

    #[test]
    fn colours_survive_in_nine_bits() {
        for rgb in [
            [0.0, 0.0, 0.0],
            [1.0, 0.5, 0.25],
            [0.9999, 0.01, 0.0],
            [511.9 / 512.0, 0.3, 0.2],
            [1e-4, 2e-5, 3e-5],
            [60000.0, 1.0, 30000.0],
            [1e-9, 0.0, 0.0],
        ] {
            let back = decode(rgb9e5(rgb));
            let largest = rgb.into_iter().fold(0.0, f64::max);
            for c in 0..3 {
                let off = (back[c] - rgb[c]).abs();
                assert!(off <= largest / 500.0 + 2f64.powi(-25), "{rgb:?} {back:?}");
            }
        }
        assert_eq!(decode(rgb9e5([f64::INFINITY, -1.0, 1.0]))[0], 65408.0);
        assert_ne!(rgb9e5([65408.0; 3]), ABSENT);
        // Black with the largest exponent: no colour is encoded so.
        assert_eq!(decode(ABSENT), [0.0; 3]);
    }

    fn film() -> Film {
        let bounds = Rect {
            x0: 1,
            y0: 0,
            x1: 5,
            y1: 2,
        };
        let mut film = Film::new([6, 2], bounds, 1);
        let half = Rect { x1: 3, ..bounds };
        let pixel = |v: f64| [[v, v, v, v * v]; 4];
        film.put_samples(half, 0..4, [1.0, 2.0, 3.0, 4.0].map(pixel).to_vec());
        film
    }

    #[test]
    fn views_have_means_and_holes() {
        let layers = Layers::new(&film());
        assert_eq!(layers.luminance, 2.5);
        assert_eq!(layers.at(2, 1).unwrap().mean, [4.0; 3]);
        for (x, y) in [(0, 0), (3, 0), (5, 1)] {
            assert_eq!(layers.at(x, y), None);
        }
        let view = View {
            rect: Rect::whole([6, 2]),
            k: 2,
        };
        assert_eq!(view.size(), [3, 1]);
        let words = |layer| -> Vec<u32> {
            let bytes = layers.bytes(layer, view);
            let word = |b: &[u8]| u32::from_le_bytes(b.try_into().unwrap());
            bytes.chunks(4).map(word).collect()
        };
        // Of the first block only the right half has samples.
        let picture = words(Layer::Picture);
        assert_eq!(decode(picture[0]), [2.0; 3]);
        assert_eq!(decode(picture[1]), [3.0; 3]);
        assert_eq!(picture[2], ABSENT);
        let samples: Vec<f32> = words(Layer::Samples)
            .into_iter()
            .map(f32::from_bits)
            .collect();
        assert_eq!(samples[..2], [4.0, 4.0]);
        assert!(samples[2].is_nan());
        let errors: Vec<f32> = words(Layer::Error)
            .into_iter()
            .map(f32::from_bits)
            .collect();
        assert_eq!(errors[..2], [0.0, 0.0], "equal replicates");
    }
}
