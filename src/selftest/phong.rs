//! The modified Phong model under an even sky, and exchanged directions.

use super::Case;
use super::backend::{Backend, Numbers, Trouble};
use super::build::{Build, plane, v};
use super::lights::even_points;
use super::measure::{Measure, Tolerance};
use super::rays::Dice;
use crate::reference::phong::Phong;
use crate::scene::Bsdf;
use glam::DVec3;
use statrs::function::gamma::ln_gamma;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        row: "33",
        name: "phong_furnace",
        what: "albedo for ks = 1 under a uniform sky, n = 0 to 1000: pow(0, 0), truncated lobes",
        run: furnace,
    },
    Case {
        row: "34",
        name: "phong_of_exponent_1e5",
        what: "albedo for n = 10⁵: pow's error",
        run: sharp,
    },
    Case {
        row: "35",
        name: "phong_reciprocity",
        what: "f(ωi, ωo) compared with f(ωo, ωi): asymmetric rounding",
        run: reciprocity,
    },
];

/// Albedo at 0, 30, 60 and 85 degrees, from quadrature; for n = 0 it is (1 + cos θ)/2.
const ALBEDO: [(f64, [f64; 4]); 5] = [
    (0.0, [1.0, 0.933_013, 0.75, 0.543_578]),
    (1.0, [1.0, 0.880_84, 0.609_00, 0.363_10]),
    (10.0, [1.0, 0.866_03, 0.504_74, 0.171_27]),
    (50.0, [1.0, 0.866_03, 0.500_00, 0.110_06]),
    (1000.0, [1.0, 0.866_03, 0.500_00, 0.087_18]),
];

/// A floor of exponent `n` under a light that fills the sky but for 10⁻⁴ rad, seen at `degrees`.
fn floor(n: f64, degrees: f64) -> Build {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let gloss = Bsdf::Phong {
        diffuse: DVec3::ZERO,
        specular: DVec3::ONE,
        exponent: n,
    };
    Build::new(v(sin, cos, 0.0) * 0.5, DVec3::ZERO, 0.05)
        .size(32, 24)
        .add(plane(DVec3::ZERO, DVec3::Y), gloss)
        .light(v(0.0, 1.0, 0.0), -DVec3::Y, 1e4, 1.0)
}

fn furnace(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for (n, row) in ALBEDO {
        for (degrees, expected) in [0.0, 30.0, 60.0, 85.0].into_iter().zip(row) {
            let build = floor(n, degrees);
            let picture = b.picture_to(&build, &build.depth(2), 0.95e-3 * expected)?;
            measures.push(Measure::sampled(
                format!("n = {n}, {degrees}°"),
                picture.mean(),
                expected,
                Tolerance::Sigmas { comparisons: 1 },
            ));
        }
        measures.push(grazing(b, n)?);
    }
    Ok(measures)
}

/// Albedo at 90 degrees, where there is no picture, by an even spread of samples.
fn grazing(b: &Backend, n: f64) -> Result<Measure, Trouble> {
    let inputs: Vec<Numbers> = even_points(1 << 16)
        .iter()
        .map(|u| {
            let mut x = [0.0; 16];
            x[..3].copy_from_slice(&[u[0], u[1], n]);
            x
        })
        .collect();
    let body = "
        let lobe = sample_lobe(vec3f(1.0, 0.0, 0.0), x[2], vec2f(x[0], x[1]));
        y[0] = (x[2] + 2.0) / (x[2] + 1.0) * max(lobe.d.z, 0.0);";
    let twin = |x: &Numbers| {
        let gloss = gloss(0.0, 1.0, x[2]);
        let sample = gloss.sample(DVec3::Z, -DVec3::X, [0.0, x[0], x[1]]);
        let mut y = [0.0; 16];
        y[0] = sample.map_or(0.0, |(_, weight, _)| weight.x);
        y
    };
    let out = b.evaluate(body, twin, &inputs)?;
    let mean = out.iter().map(|y| y[0]).sum::<f64>() / out.len() as f64;
    let ratio = (ln_gamma((n + 1.0) / 2.0) - ln_gamma(n / 2.0 + 2.0)).exp();
    let expected = (n + 2.0) / (4.0 * PI.sqrt()) * ratio;
    Ok(Measure::new(
        format!("n = {n}, 90°"),
        mean,
        expected,
        Tolerance::Relative(1e-3),
    ))
}

fn gloss(kd: f64, ks: f64, exponent: f64) -> Phong {
    Phong {
        diffuse: DVec3::splat(kd),
        specular: DVec3::splat(ks),
        exponent,
    }
}

fn sharp(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let build = floor(1e5, 0.0);
    let picture = b.picture_to(&build, &build.depth(2), 6e-4)?;
    Ok(vec![Measure::sampled(
        "n = 100000, 0°",
        picture.mean(),
        1.0,
        Tolerance::Relative(2e-3),
    )])
}

fn reciprocity(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let body = "
        let wo = vec3f(x[0], x[1], x[2]);
        let wi = vec3f(x[3], x[4], x[5]);
        let n = vec3f(0.0, 0.0, 1.0);
        let there = phong_power(wi, mirrored(-wo, n), x[6]);
        let back = phong_power(wo, mirrored(-wi, n), x[6]);
        y[0] = phong_value(vec3f(0.0), vec3f(1.0), x[6], 1.0, there).f_cos.x;
        y[1] = phong_value(vec3f(0.0), vec3f(1.0), x[6], 1.0, back).f_cos.x;";
    let twin = |x: &Numbers| {
        let (wo, wi) = (v(x[0], x[1], x[2]), v(x[3], x[4], x[5]));
        let gloss = gloss(0.0, 1.0, x[6]);
        let mut y = [0.0; 16];
        y[0] = gloss.evaluate(DVec3::Z, wo, wi).x;
        y[1] = gloss.evaluate(DVec3::Z, wi, wo).x;
        y
    };
    let mut measures = Vec::new();
    for (n, tolerance) in [
        (1.0, 1e-5),
        (10.0, 1e-5),
        (50.0, 1e-5),
        (1e3, 1e-3),
        (1e5, 1e-3),
    ] {
        let mut dice = Dice::new(35);
        let mut inputs = Vec::new();
        while inputs.len() < 50_000 {
            // About the mirror direction, where the lobe is above a thousandth of its peak, and no nearer to its edge
            // than f32 directions can tell: the cosine of the angle is known to 10⁻⁷, so there to 2·10⁻⁶ of itself.
            let cosine = dice.between(1e-3, 1.0);
            let wo = dice.around(DVec3::Z, cosine);
            let cos_alpha = f64::powf(dice.between(1e-3, 1.0), 1.0 / n).max(0.05);
            let wi = dice.around(v(-wo.x, -wo.y, wo.z), cos_alpha);
            if wi.z > 1e-3 {
                let mut x = [0.0; 16];
                x[..3].copy_from_slice(&wo.to_array());
                x[3..6].copy_from_slice(&wi.to_array());
                x[6] = n;
                inputs.push(x);
            }
        }
        let out = b.evaluate(body, twin, &inputs)?;
        let asymmetry = |y: &Numbers| (y[0] - y[1]).abs() / y[0].max(y[1]);
        // A maximum would pass over what is not a number.
        let worst =
            out.iter().map(asymmetry).fold(
                0.0,
                |a: f64, x| {
                    if x.is_nan() { f64::INFINITY } else { a.max(x) }
                },
            );
        measures.push(Measure::new(
            format!("n = {n}: largest relative difference"),
            worst,
            0.0,
            Tolerance::Absolute(tolerance),
        ));
    }
    Ok(measures)
}
