//! A sphere closed by a disk light. With F = half the height of the cap behind the light, over the radius, every point of
//! the wall has L = ρ Le F / (1 - ρ (1 - F)), which is Le for ρ = 1: an object that loses no energy is then invisible.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, GLASS, MIRROR, cylinder, grey, plane, sphere, v};
use super::measure::{Measure, Tolerance};
use crate::film::coverage::Rect;
use crate::film::{BLOCK, Film};
use crate::reference::Estimator;
use crate::scene::{Bsdf, Shape};
use crate::settings::Settings;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "8",
        name: "glass_sphere_in_dome",
        what: "a glass ball in the white dome: energy",
        run: glass_ball,
    },
    Case {
        row: "L3",
        name: "light_paths_in_dome",
        what: "glass in the white dome, and the eye in it, with light paths: energy, and radiance that grows by n²",
        run: light_paths,
    },
    Case {
        row: "9",
        name: "eye_in_glass_in_dome",
        what: "an eye in a glass ball, closer to its centre than R/n: radiance grows by n²",
        run: eye_in_glass,
    },
    Case {
        row: "16",
        name: "touching_glass_in_dome",
        what: "two touching glass balls, and a ball touching a plane: coinciding surfaces",
        run: touching_glass,
    },
    Case {
        row: "17",
        name: "opaque_things_in_dome",
        what: "a white ball, a mirror ball, a white rod in the white dome: rays that leave surfaces",
        run: opaque_things,
    },
    Case {
        row: "18",
        name: "furnace_chord",
        what: "light on a chord at 0.6 R, walls of 0.5: the light's rim",
        run: chord,
    },
    Case {
        row: "19",
        name: "furnace_of_long_paths",
        what: "walls of reflectance 0.999, and a light that fills 1 % of their view: roulette and depth limit",
        run: long_paths,
    },
    Case {
        row: "32",
        name: "touching_mirrors_in_dome",
        what: "two touching mirror balls in the white dome: chaotic paths",
        run: touching_mirrors,
    },
];

/// The white upper half of a sphere of radius 1 over a light of radiance 1.
fn dome(eye: DVec3, look_at: DVec3, vfov: f64, things: &[(Shape, Bsdf)]) -> Build {
    Build::new(eye, look_at, vfov)
        .add(sphere(DVec3::ZERO, 1.0), grey(1.0))
        .add_all(things)
        .light(DVec3::ZERO, DVec3::Y, 1.0, 1.0)
}

const EYE: DVec3 = DVec3::new(0.0, 0.3, 0.9);
const MIDDLE: DVec3 = DVec3::new(0.0, 0.4, 0.0);

/// The whole picture within 10⁻³ of `expected`, and no part of it far off.
fn all_of_it(
    b: &Backend,
    what: &str,
    build: &Build,
    expected: f64,
) -> Result<Vec<Measure>, Trouble> {
    let picture = b.picture_to(build, &build.settings(), 3.3e-4 * expected)?;
    Ok(vec![
        Measure::sampled(
            format!("{what}: mean"),
            picture.mean(),
            expected,
            Tolerance::Relative(1e-3),
        ),
        picture.even(&format!("{what}: blocks"), 6, expected),
    ])
}

fn glass_ball(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let build = dome(EYE, MIDDLE, 40.0, &[(sphere(MIDDLE, 0.25), GLASS)]);
    all_of_it(b, "radiance", &build, 1.0)
}

/// The two cases around this one, with light paths where the backend has them.
fn light_paths(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let ball = |eye, look_at, vfov| dome(eye, look_at, vfov, &[(sphere(MIDDLE, 0.25), GLASS)]);
    let outside = ball(EYE, MIDDLE, 40.0);
    let inside = ball(v(0.05, 0.45, 0.05), v(0.0, 0.35, 0.0), 60.0);
    let mean = |build: &Build| -> Result<(f64, bool), Trouble> {
        let settings = Settings {
            light_paths: true,
            ..build.settings()
        };
        let mut engine = b.engine(build, &settings)?;
        let traced = engine.light_paths().is_some();
        let rect = Rect::whole(settings.size);
        let mut film = Film::new(settings.size, rect, settings.strata);
        // Sixteen blocks where light paths are tested; a few samples of the reference, which has none.
        for block in 0..if traced { 16 } else { 1 } {
            let most = if traced { BLOCK } else { 32 };
            let samples = block * BLOCK..block * BLOCK + most;
            engine.render(&mut film, rect, samples, &b.stop_flag())?;
        }
        Ok((film.mean_luminance(), traced))
    };
    let mut measures = Vec::new();
    for (what, build, expected) in [
        ("eye outside", outside, 1.0),
        ("eye inside", inside, 1.52 * 1.52),
    ] {
        let (mean, traced) = mean(&build)?;
        let tolerance = Tolerance::Relative(if traced { 1e-3 } else { 1e-2 });
        measures.push(Measure::new(what, mean, expected, tolerance));
    }
    Ok(measures)
}

fn eye_in_glass(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // Nearer to the centre than R / n nothing is totally reflected.
    let eye = v(0.05, 0.45, 0.05);
    let build = dome(
        eye,
        v(0.0, 0.35, 0.0),
        60.0,
        &[(sphere(MIDDLE, 0.25), GLASS)],
    );
    all_of_it(b, "radiance", &build, 1.52 * 1.52)
}

/// A wide view whose mean is known to four standard errors, and a long lens on the point of contact.
fn contact(
    b: &Backend,
    what: &str,
    at: DVec3,
    things: &[(Shape, Bsdf)],
) -> Result<Vec<Measure>, Trouble> {
    let wide = dome(EYE, MIDDLE, 50.0, things);
    let picture = b.picture_to(&wide, &wide.settings(), 0.9e-3)?;
    let mut measures = vec![Measure::sampled(
        format!("{what}: wide view"),
        picture.mean(),
        1.0,
        Tolerance::Sigmas { comparisons: 1 },
    )];
    let close = dome(EYE, at, 3.0, things);
    measures.extend(all_of_it(b, &format!("{what}: contact"), &close, 1.0)?);
    Ok(measures)
}

fn touching_glass(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let ball = |x: f64| (sphere(v(x, 0.4, 0.0), 0.2), GLASS);
    let mut measures = contact(b, "two balls", MIDDLE, &[ball(-0.2), ball(0.2)])?;
    // The plane cuts the dome: the part with eye and light is a furnace too.
    let wall = (plane(v(-0.25, 0.0, 0.0), DVec3::X), grey(1.0));
    let at = v(-0.25, 0.4, 0.0);
    measures.extend(contact(b, "ball and plane", at, &[wall, ball(-0.05)])?);
    Ok(measures)
}

fn opaque_things(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let things = [
        (sphere(v(-0.35, 0.4, 0.0), 0.2), grey(1.0)),
        (sphere(v(0.1, 0.35, 0.1), 0.18), MIRROR),
        (
            cylinder(v(0.35, 0.2, 0.0), v(0.5, 0.5, -0.1), 0.12),
            grey(1.0),
        ),
    ];
    let build = dome(EYE, MIDDLE, 60.0, &things);
    all_of_it(b, "radiance", &build, 1.0)
}

fn touching_mirrors(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let ball = |x: f64| (sphere(v(x, 0.4, 0.0), 0.2), MIRROR);
    contact(b, "two balls", MIDDLE, &[ball(-0.2), ball(0.2)])
}

/// A sphere of radius 1 and reflectance `rho` over a light on the plane y = -`chord`, its top seen from inside.
fn furnace(rho: f64, chord: f64) -> Build {
    let view = Build::new(v(0.0, -0.2, 0.0), v(0.0, 1.0, 0.01), 90.0);
    in_furnace(view, rho, chord)
}

fn in_furnace(view: Build, rho: f64, chord: f64) -> Build {
    let light = (1.0 - chord * chord).sqrt();
    view.add(sphere(DVec3::ZERO, 1.0), grey(rho))
        .light(v(0.0, -chord, 0.0), DVec3::Y, light, 1.0)
}

fn chord(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let expected = 1.0 / 6.0;
    let mut measures = Vec::new();
    // Every pixel within the tolerance, so few pixels: the upper wall, and a strip of it along the light's rim.
    let rim = Build::new(v(0.0, -0.2, 0.0), v(0.8, -0.52, 0.0), 8.0).size(2, 1);
    for (what, view) in [
        ("above", furnace(0.5, 0.6).size(3, 2)),
        ("by the rim", in_furnace(rim, 0.5, 0.6)),
    ] {
        let pixels = view.0.camera.resolution.iter().product::<u32>();
        let error = 2.9e-4 / f64::from(pixels).sqrt() * expected;
        let picture = b.picture_to(&view, &view.settings(), error)?;
        for (k, pixel) in picture.blocks(1).into_iter().enumerate() {
            measures.push(Measure::sampled(
                format!("wall {what}, pixel {k}"),
                pixel,
                expected,
                Tolerance::Relative(1e-3),
            ));
        }
    }
    Ok(measures)
}

fn long_paths(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    let build = furnace(0.999, 0.98);
    let expected = 0.909_01;
    // A path has a hundred vertices here, so the error only falls to half the tolerance. The reference is too slow for
    // that many light samples. Without light sampling its variance is ten times smaller here, since every path ends on the
    // light.
    let error = 0.98e-3 * expected;
    let (picture, how) = if b.open_gpu().is_some() {
        (b.picture_to(&build, &build.settings(), error)?, "radiance")
    } else {
        let chance = Estimator::NoLightSampling;
        let picture = b.reference_to(&build, &build.settings(), chance, error)?;
        (picture, "radiance without light sampling")
    };
    Ok(vec![
        Measure::sampled(how, picture.mean(), expected, Tolerance::Relative(2e-3)),
        Measure::none(
            "paths truncated at the depth limit",
            picture.counters.truncated as usize,
        ),
    ])
}
