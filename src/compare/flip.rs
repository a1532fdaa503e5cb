//! FLIP: the difference per pixel that an observer sees who flips between two pictures, from 0 (none) to 1 (largest)
//! \[Andersson2020\].
//!
//! Implemented here because the only crate for it wraps a C++ library, so that building this program would need a C++
//! compiler. The tests compare it with the authors' implementation.

use std::f64::consts::PI;

/// Pixels for a degree of the observer's sight: the paper's, a 0.7 m wide screen of 3840 pixels seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.020_64;

/// Rec. 709 primaries and white D65: linear RGB to XYZ.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [
        10_135_552.0 / 24_577_794.0,
        8_788_810.0 / 24_577_794.0,
        4_435_075.0 / 24_577_794.0,
    ],
    [
        2_613_072.0 / 12_288_897.0,
        8_788_810.0 / 12_288_897.0,
        887_015.0 / 12_288_897.0,
    ],
    [
        1_425_312.0 / 73_733_382.0,
        8_788_810.0 / 73_733_382.0,
        70_074_185.0 / 73_733_382.0,
    ],
];

/// Exponent of colour differences.
const COLOUR_EXPONENT: f64 = 0.7;
/// Colour differences up to this share of the largest one...
const COLOUR_KNEE: f64 = 0.4;
/// ...take this share of the scale.
const COLOUR_SHARE: f64 = 0.95;
/// Width of the feature detectors in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of feature differences.
const FEATURE_EXPONENT: f64 = 0.5;
/// The contrast sensitivity functions of lightness, red-green and blue-yellow: sums of Gaussians, each with
/// its amplitude and its width in degrees squared.
const SENSITIVITY: [[[f64; 2]; 2]; 3] = [
    [[1.0, 0.0047], [0.0, 1e-5]],
    [[1.0, 0.0053], [0.0, 1e-5]],
    [[34.1, 0.04], [13.5, 0.025]],
];
/// The widest of them.
const WIDEST: f64 = 0.04;

/// FLIP of two pictures in linear RGB, row by row. Both are clamped to 0..=1, as screens do.
pub fn flip(size: [u32; 2], a: &[[f64; 3]], b: &[[f64; 3]], pixels_per_degree: f64) -> Vec<f32> {
    let [a, b] = [a, b].map(|p| Seen::new(size, p, pixels_per_degree));
    let most = lab_distance(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOUR_EXPONENT);
    let knee = COLOUR_KNEE * most;
    (0..a.colour.len())
        .map(|i| {
            let colour = lab_distance(a.colour[i], b.colour[i]).powf(COLOUR_EXPONENT);
            let colour = if colour < knee {
                colour * COLOUR_SHARE / knee
            } else {
                COLOUR_SHARE + (colour - knee) / (most - knee) * (1.0 - COLOUR_SHARE)
            };
            let edges = (a.edges[i] - b.edges[i]).abs();
            let points = (a.points[i] - b.points[i]).abs();
            let feature = (edges.max(points) / 2f64.sqrt()).powf(FEATURE_EXPONENT);
            colour.powf(1.0 - feature) as f32
        })
        .collect()
}

/// What an observer makes of a picture.
struct Seen {
    /// Hunt-adjusted L*a*b* of what contrast sensitivity leaves.
    colour: Vec<[f64; 3]>,
    /// Strength of edges, and of points.
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(size: [u32; 2], rgb: &[[f64; 3]], ppd: f64) -> Self {
        let opponent: Vec<[f64; 3]> = rgb.iter().map(|p| opponent(p.map(on_screen))).collect();
        let plane = |c: usize| opponent.iter().map(|p| p[c]).collect::<Vec<f64>>();
        let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
        let filtered = [0, 1, 2].map(|c| {
            let mut sum = vec![0.0; rgb.len()];
            let mut weights = 0.0;
            for [amplitude, width] in SENSITIVITY[c] {
                let kernel = kernel(radius, |x| (-(PI * x / ppd).powi(2) / width).exp());
                let weight = amplitude * (PI / width).sqrt() * kernel.iter().sum::<f64>().powi(2);
                let smooth = separable(size, &plane(c), &normalised(&kernel), &normalised(&kernel));
                for (s, x) in sum.iter_mut().zip(smooth) {
                    *s += weight * x;
                }
                weights += weight;
            }
            sum.iter_mut().for_each(|s| *s /= weights);
            sum
        });
        let colour = (0..rgb.len())
            .map(|i| {
                hunt(
                    rgb_from_opponent([0, 1, 2].map(|c| filtered[c][i])).map(|v| v.clamp(0.0, 1.0)),
                )
            })
            .collect();
        let light: Vec<f64> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let deviation = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * deviation).ceil() as i64;
        let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let smooth = normalised(&kernel(radius, gauss));
        let strength = |f: &dyn Fn(f64) -> f64| {
            let across = normalised(&kernel(radius, |x| f(x) * gauss(x)));
            let x = separable(size, &light, &across, &smooth);
            let y = separable(size, &light, &smooth, &across);
            x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect()
        };
        Self {
            colour,
            edges: strength(&|x| -x),
            points: strength(&|x| (x / deviation).powi(2) - 1.0),
        }
    }
}

/// Values of `f` at -radius..=radius.
fn kernel(radius: i64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (-radius..=radius).map(|x| f(x as f64)).collect()
}

/// Scaled so that what is positive adds up to 1, and what is negative to -1.
fn normalised(kernel: &[f64]) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|k| **k < 0.0).sum::<f64>();
    let scale = |k: &f64| if *k > 0.0 { k / positive } else { k / negative };
    kernel
        .iter()
        .map(|k| if *k == 0.0 { 0.0 } else { scale(k) })
        .collect()
}

/// The picture correlated with `across` in rows and `down` in columns; the edge pixels are repeated.
fn separable(size: [u32; 2], picture: &[f64], across: &[f64], down: &[f64]) -> Vec<f64> {
    let [width, height] = size.map(|n| n as usize);
    let pass = |from: &[f64], kernel: &[f64], count: usize, step: usize, at: usize| -> f64 {
        let radius = kernel.len() / 2;
        let place = at / step % count;
        let first = at - place * step;
        let tap = |(k, w): (usize, &f64)| {
            let to = (place + k).saturating_sub(radius).min(count - 1);
            w * from[first + to * step]
        };
        kernel.iter().enumerate().map(tap).sum()
    };
    let rows: Vec<f64> = (0..picture.len())
        .map(|i| pass(picture, across, width, 1, i))
        .collect();
    (0..picture.len())
        .map(|i| pass(&rows, down, height, width, i))
        .collect()
}

fn on_screen(v: f64) -> f64 {
    if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }
}

/// Linear to sRGB, clamped: IEC 61966-2-1.
pub(super) fn encode_srgb(linear: f64) -> f64 {
    let v = on_screen(linear);
    if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// XYZ over that of white.
fn relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    XYZ_FROM_RGB.map(|row| {
        let white: f64 = row.iter().sum();
        row.iter().zip(rgb).map(|(m, v)| m * v).sum::<f64>() / white
    })
}

/// L*a*b* without its cube roots: light and contrast add up linearly in it.
fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_opponent([l, a, b]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let relative = [y + a / 500.0, y, y - b / 200.0];
    let m = glam::DMat3::from_cols_array_2d(&XYZ_FROM_RGB).transpose();
    let white = m * glam::DVec3::ONE;
    (m.inverse() * (glam::DVec3::from(relative) * white)).to_array()
}

/// L*a*b* of a colour, its chroma less the darker it is (the Hunt effect).
fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| {
        if t > DELTA.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let [x, y, z] = relative_xyz(rgb).map(f);
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// City-block in lightness, Euclidean in chroma.
fn lab_distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}
