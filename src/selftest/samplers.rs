//! Every sampler with its smallest and largest random numbers.

use super::Case;
use super::backend::{Backend, Numbers, Trouble};
use super::build::{Build, grey, plane, v};
use super::measure::Measure;
use super::rays::Range;
use crate::kernel::Access;
use crate::reference::{diffuse, light, phong::Phong};
use crate::world::WorldLight;
use glam::DVec3;

pub const CASES: &[Case] = &[Case {
    row: "39",
    name: "sampler_end_points",
    what: "every sampler at the random numbers 0, 2⁻²⁴ and 1 - 2⁻²⁴: end points",
    run: end_points,
}];

/// The smallest and the largest random numbers of a kernel.
fn ends() -> [f64; 3] {
    [0.0, (-24f64).exp2(), 1.0 - (-24f64).exp2()]
}

/// Inputs whose first two numbers are all pairs of ends, followed by each of `rest`.
fn inputs(rest: &[Vec<f64>]) -> Vec<Numbers> {
    let mut all = Vec::new();
    for u in ends() {
        for w in ends() {
            for more in rest {
                let mut x = [0.0; 16];
                (x[0], x[1]) = (u, w);
                x[2..2 + more.len()].copy_from_slice(more);
                all.push(x);
            }
        }
    }
    all
}

/// A sample is right if all of it is finite and its density, the first number, is positive, or 0: no sample.
fn wrong(out: &[Numbers]) -> usize {
    let right = |y: &&Numbers| y.iter().all(|y| y.is_finite()) && y[0] >= 0.0;
    out.len() - out.iter().filter(right).count()
}

fn measure(name: &str, out: &[Numbers]) -> Measure {
    Measure::none(format!("{name}: wrong of {}", out.len()), wrong(out))
}

/// Density and what else a twin has made; zeros for no sample.
fn numbers(values: Option<Vec<f64>>) -> Numbers {
    let mut y = [0.0; 16];
    for (y, value) in y.iter_mut().zip(values.unwrap_or_default()) {
        *y = value;
    }
    y
}

fn end_points(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    Ok(vec![
        uniform(b)?,
        cosine(b)?,
        lobe(b)?,
        cap(b)?,
        choice(b, "choice among lights, baked", Access::Baked)?,
        choice(b, "choice among lights, in buffers", Access::Buffers)?,
    ])
}

/// The largest random number is below 1.
fn uniform(b: &Backend) -> Result<Measure, Trouble> {
    let body = "
        let u = unit_float(vec4u(0u, 255u, 0xffffff00u, 0xffffffffu));
        y[0] = select(-1.0, 1.0, all(u >= vec4f(0.0)) && all(u < vec4f(1.0)));";
    let out = b.evaluate(body, |_| numbers(Some(vec![1.0])), &[[0.0; 16]])?;
    Ok(measure("random numbers below 1", &out))
}

/// What a body does not set reads 0.
const CLEAR: &str = "
        for (var i = 0; i < 16; i++) {
            y[i] = 0.0;
        }";

fn normals() -> [DVec3; 4] {
    [DVec3::Z, -DVec3::Z, DVec3::X, v(0.48, -0.6, -0.64)]
}

fn cosine(b: &Backend) -> Result<Measure, Trouble> {
    let body = format!(
        "{CLEAR}
        let n = vec3f(x[2], x[3], x[4]);
        let d = sample_cosine(n, vec2f(x[0], x[1]));
        y[0] = dot(d, n) / 3.1415927;
        y[1] = d.x;
        y[2] = d.y;
        y[3] = d.z;"
    );
    let twin = |x: &Numbers| {
        let n = v(x[2], x[3], x[4]);
        let d = diffuse::sample(n, [x[0], x[1]]);
        numbers(Some(vec![diffuse::pdf(n, d), d.x, d.y, d.z]))
    };
    let rest: Vec<_> = normals().iter().map(|n| n.to_array().to_vec()).collect();
    Ok(measure(
        "cosine-distributed direction",
        &b.evaluate(&body, twin, &inputs(&rest))?,
    ))
}

fn lobe(b: &Backend) -> Result<Measure, Trouble> {
    // As the path loop has it: density and weight of a sample of the lobe among a diffuse part of kd.
    let body = format!(
        "{CLEAR}
        let n = vec3f(0.0, 0.0, 1.0);
        let r = vec3f(x[4], 0.0, x[5]);
        let kd = vec3f(x[3]);
        let ks = vec3f(0.5);
        let lobe = sample_lobe(r, x[2], vec2f(x[0], x[1]));
        let cos = dot(n, lobe.d);
        let value = phong_value(kd, ks, x[2], cos, lobe.power);
        if cos > 0.0 {{
            y[0] = value.pdf;
            y[1] = lobe.d.x;
            y[2] = lobe.d.y;
            y[3] = lobe.d.z;
            y[4] = value.f_cos.x / max(value.pdf, TINY);
        }}"
    );
    let twin = |x: &Numbers| {
        let gloss = Phong {
            diffuse: DVec3::splat(x[3]),
            specular: DVec3::splat(0.5),
            exponent: x[2],
        };
        // The first number chooses the lobe.
        let sample = gloss.sample(DVec3::Z, v(-x[4], 0.0, x[5]), [0.0, x[0], x[1]]);
        numbers(sample.map(|(d, weight, pdf)| vec![pdf, d.x, d.y, d.z, weight.x]))
    };
    let mut rest = Vec::new();
    for exponent in [0.0, 1.0, 60.0, 1e5, 1e6] {
        for kd in [0.0, 0.5] {
            for (x, z) in [(0.0, 1.0), (0.6, 0.8), (1.0, 0.0)] {
                rest.push(vec![exponent, kd, x, z]);
            }
        }
    }
    Ok(measure(
        "direction in a lobe",
        &b.evaluate(&body, twin, &inputs(&rest))?,
    ))
}

fn cap(b: &Backend) -> Result<Measure, Trouble> {
    let body = format!(
        "{CLEAR}
        let light = DiskLight(vec3f(0.0), x[4], vec3f(0.0, 1.0, 0.0), 0.0, vec3f(1.0), 0u);
        let cap = cap_of(light, vec3f(x[2], x[3], 0.0));
        let s = sample_cap(light, cap, vec2f(x[0], x[1]));
        y[0] = select(0.0, 1.0 / s.inverse_pdf, s.inverse_pdf > 0.0);
        y[1] = s.d.x;
        y[2] = s.d.y;
        y[3] = s.d.z;
        y[4] = s.distance;
        y[5] = cap_pdf(light, cap, s.d);"
    );
    let twin = |x: &Numbers| {
        let light = WorldLight {
            center: DVec3::ZERO,
            normal: DVec3::Y,
            offset: 0.0,
            radius: x[4],
            radiance: DVec3::ONE,
            emitted: DVec3::ONE,
            face: 0,
            medium: Some(0),
            line: 0,
        };
        let point = v(x[2], x[3], 0.0);
        let sample = light::sample(&light, point, [x[0], x[1]]);
        numbers(sample.map(|(d, pdf)| vec![pdf, d.x, d.y, d.z, light::pdf(&light, point, d)]))
    };
    let mut rest = Vec::new();
    for radius in [1e-6, 1.0, 1e6] {
        for a in [0.0, 0.5, 1.0, 2.0, 1e3] {
            for h in [-1.0, 0.0, 1e-6, 1.0, 1e3] {
                rest.push(vec![a * radius, h * radius, radius]);
            }
        }
    }
    Ok(measure(
        "point on a light",
        &b.evaluate(&body, twin, &inputs(&rest))?,
    ))
}

/// Among lights of which some are not to be seen, the last among them.
fn choice(b: &Backend, name: &str, access: Access) -> Result<Measure, Trouble> {
    let build = Build::new(v(0.0, 1.0, 5.0), DVec3::ZERO, 40.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.5))
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 0.5, 1.0)
        .light(v(0.0, 3.0, 0.0), DVec3::Y, 0.5, 1e6)
        .light(v(1.0, 2.0, 0.0), -DVec3::Y, 1e-4, 1e-6)
        .light(v(9.0, 3.0, 0.0), DVec3::Y, 0.5, 1.0);
    let body = format!(
        "{CLEAR}
        let chosen = choose_light(vec3f(x[2], x[3], 0.0), Receiver(vec3f(0.0, 1.0, 0.0)), vec2f(x[0], 0.0));
        let p = select(0.0, 1.0 / chosen.inverse_probability, chosen.inverse_probability > 0.0);
        y[0] = select(-1.0, p, chosen.index < 4u && p <= 1.000001);
        y[1] = chosen.weights;"
    );
    let twin = |world: &crate::world::World, x: &Numbers| {
        let chosen = light::choose(&world.lights, v(x[2], x[3], 0.0), x[0]);
        numbers(chosen.map(|(index, probability)| {
            vec![if index < 4 && probability <= 1.0 {
                probability
            } else {
                -1.0
            }]
        }))
    };
    // In front of some, and (at height 2) of none.
    let rest: Vec<_> = [0.0, 1.0, 5.0]
        .into_iter()
        .flat_map(|x| [0.0, 1.0, 2.0].map(|y| vec![x, y]))
        .collect();
    let range = Range::new(b, &build, Some(access));
    Ok(measure(name, &range.evaluate(&body, twin, &inputs(&rest))?))
}
