//! Glass whose transmission is known, as pictures and as functions.

use super::Case;
use super::backend::{Backend, Numbers, Trouble};
use super::build::{AIR_IN_GLASS, Build, GLASS, cylinder, sphere, v};
use super::measure::{Measure, Tolerance};
use crate::scene::{Bsdf, Shape};
use crate::world::trace::dielectric;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "10",
        name: "glass_slab",
        what: "a light through a glass slab: the Fresnel series",
        run: slab,
    },
    Case {
        row: "11",
        name: "thin_glass_shell",
        what: "a light through a glass shell 10⁻⁴ thick: hits close together",
        run: shell,
    },
    Case {
        row: "12",
        name: "glass_rod",
        what: "a glass rod lit through its end, across a gap: total internal reflection, so its side is dark",
        run: rod,
    },
    Case {
        row: "13",
        name: "critical_angle",
        what: "Fresnel within 10⁻⁶ of the critical angle: a square root near 0",
        run: critical_angle,
    },
    Case {
        row: "14",
        name: "normal_incidence",
        what: "Fresnel at normal incidence",
        run: normal_incidence,
    },
    Case {
        row: "15",
        name: "grazing_incidence",
        what: "transmission at cosine 10⁻⁶: cancellation in 1 - F",
        run: grazing_incidence,
    },
];

/// A light that fills a narrow view, and what stands before it.
fn through(things: &[(Shape, Bsdf)]) -> Build {
    Build::new(v(0.0, 0.0, 5.0), DVec3::ZERO, 0.2)
        .add_all(things)
        .light(v(0.0, 0.0, -3.0), DVec3::Z, 2.0, 1.0)
}

fn transmission(
    b: &Backend,
    things: &[(Shape, Bsdf)],
    expected: f64,
    tolerance: f64,
) -> Result<Vec<Measure>, Trouble> {
    let build = through(things);
    let picture = b.picture_to(&build, &build.settings(), tolerance / 3.0 * expected)?;
    Ok(vec![Measure::sampled(
        "transmission",
        picture.mean(),
        expected,
        Tolerance::Relative(tolerance),
    )])
}

fn slab(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let slab = cylinder(v(0.0, 0.0, -0.5), v(0.0, 0.0, 0.5), 1.0);
    transmission(b, &[(slab, GLASS)], 0.918_318, 5e-4)
}

fn shell(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let shell = [
        (sphere(DVec3::ZERO, 1.0), GLASS),
        (sphere(DVec3::ZERO, 1.0 - 1e-4), AIR_IN_GLASS),
    ];
    transmission(b, &shell, 0.848_97, 1e-3)
}

fn rod(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let rod = |eye: DVec3, vfov: f64| {
        Build::new(eye, DVec3::ZERO, vfov)
            .add(cylinder(v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0), 0.5), GLASS)
            .light(v(-1.2, 0.0, 0.0), DVec3::X, 0.3, 100.0)
    };
    // For n² >= 2 whatever enters through the end is totally reflected by the side.
    let side = rod(v(0.0, 0.0, 4.0), 12.0);
    let side = b.picture(&side, &side.settings(), 256)?;
    let end = rod(v(4.0, 0.0, 0.0), 0.2);
    let end = b.picture(&end, &end.settings(), 256)?;
    Ok(vec![
        Measure::none("lit pixels of the side", side.lit_pixels()),
        Measure::sampled(
            "radiance of the far end",
            end.mean(),
            100.0 * 0.918_318,
            Tolerance::Relative(5e-3),
        ),
    ])
}

/// Transmission at cosine `x[0]` for an index ahead over behind of `x[1]`.
fn fresnel(b: &Backend, inputs: &[Numbers]) -> Result<Vec<f64>, Trouble> {
    let twin = |x: &Numbers| {
        let mut y = [0.0; 16];
        y[0] = dielectric::fresnel(x[0], x[1]).transmittance;
        y
    };
    let body = "y[0] = refraction(x[0], x[1]).transmitted;";
    let out = b.evaluate(body, twin, inputs)?;
    Ok(out.iter().map(|y| y[0]).collect())
}

fn input(cosine: f64, eta: f64) -> Numbers {
    let mut x = [0.0; 16];
    (x[0], x[1]) = (cosine, eta);
    x
}

/// Reflectance by the textbook, in f64: the mean of the squared amplitudes.
fn textbook(cosine: f64, eta: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).sqrt() / eta;
    if sine >= 1.0 {
        return 1.0;
    }
    let beyond = (1.0 - sine * sine).sqrt();
    let across = (cosine - eta * beyond) / (cosine + eta * beyond);
    let along = (eta * cosine - beyond) / (eta * cosine + beyond);
    (across * across + along * along) / 2.0
}

fn critical_angle(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // Numbers that both f32 and f64 have.
    let eta = f64::from((1.0f64 / 1.52) as f32);
    let critical = eta.asin();
    let inputs: Vec<Numbers> = [1e-6, 2e-6, 5e-6, 1e-5, 1e-4]
        .into_iter()
        .flat_map(|off| [critical - off, critical + off])
        .map(|angle| input(f64::from(angle.cos() as f32), eta))
        .collect();
    let (mut worst, mut outside) = (0.0f64, 0);
    for (x, transmitted) in inputs.iter().zip(fresnel(b, &inputs)?) {
        let f = 1.0 - transmitted;
        outside += usize::from(!(0.0..=1.0).contains(&f));
        worst = worst.max((f - textbook(x[0], x[1])).abs());
    }
    Ok(vec![
        Measure::new("largest error of F", worst, 0.0, Tolerance::Absolute(1e-3)),
        Measure::none("values outside 0..1", outside),
    ])
}

fn normal_incidence(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let out = fresnel(b, &[input(1.0, 1.52), input(1.0, 1.0 / 1.52)])?;
    let of = |side: &str, t: f64| {
        Measure::new(
            format!("F from {side}"),
            1.0 - t,
            0.042_580_0,
            Tolerance::Absolute(1e-6),
        )
    };
    Ok(vec![of("outside", out[0]), of("inside", out[1])])
}

fn grazing_incidence(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let out = fresnel(b, &[input(1e-6, 1.52)])?;
    Ok(vec![Measure::new(
        "T",
        out[0],
        5.784e-6,
        Tolerance::Relative(0.01),
    )])
}
