//! Disk lights with closed forms, as functions and as pictures of a floor or a wall beside them.

use super::Case;
use super::backend::{Backend, Numbers, Trouble};
use super::build::{Build, grey, plane, v};
use super::measure::{Measure, Tolerance};
use crate::reference::light;
use crate::world::WorldLight;
use glam::DVec3;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        row: "20",
        name: "parallel_receiver",
        what: "a receiver parallel to a disk light",
        run: parallel_receiver,
    },
    Case {
        row: "21",
        name: "receiver_across",
        what: "a receiver at right angles to a disk light: its horizon",
        run: receiver_across,
    },
    Case {
        row: "22",
        name: "receiver_in_the_light_s_plane",
        what: "a receiver in the plane of a light: 0/0",
        run: receiver_in_plane,
    },
    Case {
        row: "23",
        name: "receiver_close_to_the_light",
        what: "a receiver 10⁻⁴ r under the light: 1/r²",
        run: close_receiver,
    },
    Case {
        row: "36",
        name: "tiny_bright_light",
        what: "a light of radius 10⁻⁴ and radiance 10⁸ beside one of radiance 1: range",
        run: tiny_bright_light,
    },
];

/// Form factors of a disk of radius `r` at height `h`, `a` off its axis: for a receiver parallel to it, and for one that
/// faces its axis.
pub fn form_factors(a: f64, h: f64, r: f64) -> [f64; 2] {
    let s = a * a + h * h - r * r;
    let q = (s * s + 4.0 * h * h * r * r).sqrt();
    let cap = if s > 0.0 {
        2.0 * h * r * r / (q + s)
    } else {
        (q - s) / (2.0 * h)
    };
    let across = 2.0 * h * r * r * a / (q * (a * a + h * h + r * r + q));
    [h * cap / q, across]
}

/// The light in the plane y = 0, shining up.
fn upward(radius: f64) -> WorldLight {
    WorldLight {
        center: DVec3::ZERO,
        normal: DVec3::Y,
        offset: 0.0,
        radius,
        radiance: DVec3::ONE,
        emitted: DVec3::ONE,
        face: 0,
        medium: Some(0),
        line: 0,
    }
}

const LIGHT: &str = "
    let light = DiskLight(vec3f(0.0), x[4], vec3f(0.0, 1.0, 0.0), 0.0, vec3f(1.0), 0u);
    let cap = cap_of(light, vec3f(x[2], x[3], 0.0));
    let s = sample_cap(light, cap, vec2f(x[0], x[1]));
    y[0] = select(0.0, 1.0 / s.inverse_pdf, s.inverse_pdf > 0.0);
    y[1] = s.d.x;
    y[2] = s.d.y;
    y[3] = s.d.z;
    y[4] = cap_pdf(light, cap, s.d);
";

/// Samples of the light of radius `r` from height `h`, `a` off its axis: density, direction, density again.
fn samples(b: &Backend, points: &[[f64; 2]], [a, h, r]: [f64; 3]) -> Result<Vec<Numbers>, Trouble> {
    let inputs: Vec<Numbers> = points
        .iter()
        .map(|u| {
            let mut x = [0.0; 16];
            x[..5].copy_from_slice(&[u[0], u[1], a, h, r]);
            x
        })
        .collect();
    let twin = |x: &Numbers| {
        let (light, point) = (upward(x[4]), v(x[2], x[3], 0.0));
        let mut y = [0.0; 16];
        if let Some((d, pdf)) = light::sample(&light, point, [x[0], x[1]]) {
            y[..5].copy_from_slice(&[pdf, d.x, d.y, d.z, light::pdf(&light, point, d)]);
        }
        y
    };
    b.evaluate(LIGHT, twin, &inputs)
}

/// An even spread of points in the unit square (Hammersley).
pub fn even_points(count: u32) -> Vec<[f64; 2]> {
    let inverse = |i: u32| f64::from(i.reverse_bits()) * (-32f64).exp2();
    (0..count)
        .map(|i| [(f64::from(i) + 0.5) / f64::from(count), inverse(i)])
        .collect()
}

/// Mean of cos θ / (π pdf), which is a form factor, and the relative variance of its terms.
fn sampled_factor(out: &[Numbers], normal: DVec3) -> (f64, f64) {
    let terms = out.iter().map(|y| {
        let cosine = normal.dot(v(y[1], y[2], y[3])).max(0.0);
        if y[0] > 0.0 {
            cosine / (PI * y[0])
        } else {
            0.0
        }
    });
    let (sum, squares) = terms.fold((0.0, 0.0), |(s, q), t| (s + t, q + t * t));
    let n = out.len() as f64;
    let mean = sum / n;
    (mean, (squares / n - mean * mean) / (mean * mean))
}

const COUNT: u32 = 1 << 17;

fn place(p: [f64; 3]) -> String {
    format!("(a, h, r) = ({}, {}, {})", p[0], p[1], p[2])
}

/// What a receiver with normal `normal` gets: sampled, and in a picture.
fn receiver(
    b: &Backend,
    p: [f64; 3],
    expected: f64,
    (column, normal): (usize, DVec3),
    picture: &Build,
) -> Result<Vec<Measure>, Trouble> {
    let out = samples(b, &even_points(COUNT), p)?;
    let tolerance = Tolerance::Relative(1e-4);
    let (factor, _) = sampled_factor(&out, normal);
    let mut measures = vec![Measure::new(
        format!("F sampled, {}", place(p)),
        factor,
        expected,
        tolerance,
    )];
    let exact = form_factors(p[0], p[1], p[2])[column];
    let seen = b.picture_to(picture, &picture.depth(2), 0.9e-3 * exact)?;
    measures.push(Measure::sampled(
        format!("radiance, {}", place(p)),
        seen.mean(),
        exact,
        Tolerance::Sigmas { comparisons: 1 },
    ));
    Ok(measures)
}

fn parallel_receiver(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for (p, expected) in [
        ([0.5, 1.0, 1.0], 0.437_983),
        ([2.0, 1.0, 1.0], 0.052_786_4),
        ([1.0, 0.2, 1.0], 0.450_248),
    ] {
        let build = floor_at(p[0]).light(v(0.0, p[1], 0.0), -DVec3::Y, p[2], 1.0);
        measures.extend(receiver(b, p, expected, (0, -DVec3::Y), &build)?);
    }
    Ok(measures)
}

/// Nearly a single point of a white floor, seen from the side.
pub fn floor_at(x: f64) -> Build {
    Build::new(v(x, 0.1, 5.0), v(x, 0.0, 0.0), 1e-4)
        .size(32, 24)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
}

fn receiver_across(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let mut measures = Vec::new();
    for (p, expected) in [
        ([2.0, 1.0, 1.0], 0.085_410_2),
        ([3.0, 0.5, 0.7], 0.009_028_27),
    ] {
        let [a, h, r] = p;
        let build = Build::new(v(0.5, -h, 5.0), v(a, -h, 0.0), 1e-4)
            .size(32, 24)
            .add(plane(v(a, 0.0, 0.0), -DVec3::X), grey(1.0))
            .light(DVec3::ZERO, -DVec3::Y, r, 1.0);
        measures.extend(receiver(b, p, expected, (1, -DVec3::X), &build)?);
    }
    Ok(measures)
}

fn receiver_in_plane(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let points = even_points(64);
    let (mut broken, mut sampled, mut count) = (0, 0, 0);
    for a in [0.0, 1e-6, 0.5, 1.0, 1.0 + 1e-6, 2.0, 1e3, 1e6] {
        for h in [0.0, -1e-30, -1e-6, -1.0] {
            for y in samples(b, &points, [a, h, 1.0])? {
                count += 1;
                broken += usize::from(!y.iter().take(5).all(|y| y.is_finite()));
                sampled += usize::from(y[0] != 0.0);
            }
        }
    }
    // The eye is above a floor that has a light in it, shining up.
    let build = Build::new(v(0.0, 0.5, 5.0), DVec3::ZERO, 20.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
        .light(v(0.0, 0.0, 0.5), DVec3::Y, 1.0, 1.0);
    let settings = build.settings();
    let picture = b.picture(&build, &settings, 64)?;
    let mut between = 0;
    picture.film.for_each(|_, _, e| {
        // Only the light itself is visible: a pixel is at most 1, and its floor part 0.
        between += usize::from(!(0.0..=1.0 + 1e-6).contains(&e.mean[0]));
    });
    let dark = Build::new(v(0.0, 0.5, 5.0), v(4.0, 0.0, 0.0), 20.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
        .light(v(0.0, 0.0, 0.5), DVec3::Y, 1.0, 1.0);
    let dark = b.picture(&dark, &settings, 64)?;
    Ok(vec![
        Measure::none(format!("not finite of {count} samples"), broken),
        Measure::none(format!("not refused of {count} samples"), sampled),
        Measure::none("pixels of a lit floor brighter than the light", between),
        Measure::none("lit pixels of the floor beside it", dark.lit_pixels()),
    ])
}

fn close_receiver(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let out = samples(b, &even_points(COUNT), [0.3, 1e-4, 1.0])?;
    let (factor, variance) = sampled_factor(&out, -DVec3::Y);
    Ok(vec![
        Measure::new("F sampled", factor, 1.0, Tolerance::Absolute(1e-6)),
        Measure::new("relative variance", variance, 0.01, Tolerance::Below),
    ])
}

fn tiny_bright_light(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let build = floor_at(0.0)
        .light(v(0.5, 1.0, 0.0), -DVec3::Y, 1e-4, 1e8)
        .light(v(-1.0, 1.0, 0.0), -DVec3::Y, 0.5, 1.0);
    let expected = 1e8 * form_factors(0.5, 1.0, 1e-4)[0] + form_factors(1.0, 1.0, 0.5)[0];
    let picture = b.picture_to(&build, &build.depth(2), 0.9e-3 * expected)?;
    Ok(vec![
        Measure::sampled(
            "radiance",
            picture.mean(),
            expected,
            Tolerance::Sigmas { comparisons: 1 },
        ),
        Measure::none(
            "samples that are not finite",
            picture.counters.nonfinite as usize,
        ),
    ])
}
