//! Shadows of a light's back and of a ball.

use super::Case;
use super::backend::{Backend, Trouble};
use super::build::{Build, grey, plane, sphere, v};
use super::lights::{floor_at, form_factors};
use super::measure::{Measure, Tolerance};
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        row: "24",
        name: "behind_a_light",
        what: "the dark side of a light, which also casts shadows: sign",
        run: behind_a_light,
    },
    Case {
        row: "41",
        name: "edges_of_a_shadow",
        what: "umbra and penumbra of a ball under a disk light: visibility",
        run: edges_of_a_shadow,
    },
];

fn behind_a_light(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // Something bright behind the black back, and an invisible primitive, since a scene needs one.
    let facing = |side: f64| {
        Build::new(v(0.0, 0.0, 3.0 * side), DVec3::ZERO, 5.0)
            .add(sphere(v(0.0, 9.0, 0.0), 1.0), grey(0.5))
            .light(DVec3::ZERO, DVec3::Z, 1.0, 7.0)
            .light(v(0.0, 0.0, 4.0), -DVec3::Z, 0.5, 100.0)
    };
    let front = facing(1.0);
    let front = b.picture(&front, &front.settings(), 16)?;
    let back = facing(-1.0);
    let back = b.picture(&back, &back.settings(), 16)?;
    // A floor under a light that shines up, and a bright one above that; all that is seen lies in its shadow.
    let floor = Build::new(v(0.0, 0.9, 2.0), DVec3::ZERO, 30.0)
        .add(plane(DVec3::ZERO, DVec3::Y), grey(1.0))
        .light(v(0.0, 1.0, 0.0), DVec3::Y, 3.0, 1.0)
        .light(v(0.0, 2.0, 0.0), -DVec3::Y, 0.1, 100.0);
    let floor = b.picture(&floor, &floor.depth(2), 64)?;
    Ok(vec![
        Measure::new(
            "its front",
            front.mean().mean,
            7.0,
            Tolerance::Relative(1e-6),
        ),
        Measure::none("lit pixels of its back", back.lit_pixels()),
        Measure::none("lit pixels of the floor in its shadow", floor.lit_pixels()),
    ])
}

fn edges_of_a_shadow(b: &Backend) -> Result<Vec<Measure>, Trouble> {
    // A black ball of radius 0.5 at height 1 between the floor and a light of radius 0.2 at height 3.
    let floor = |x: f64| {
        floor_at(x)
            .add(sphere(v(0.0, 1.0, 0.0), 0.5), grey(0.0))
            .light(v(0.0, 3.0, 0.0), -DVec3::Y, 0.2, 10.0)
    };
    // Where the line from the light's rim at `from` touches the ball and continues to the floor.
    let edge = |from: f64| {
        let misses = |x: f64| {
            let (line, to_ball) = (v(x - from, -3.0, 0.0), v(-from, -2.0, 0.0));
            line.cross(to_ball).length() / line.length() - 0.5
        };
        let (mut inside, mut outside) = (from, 5.0);
        for _ in 0..60 {
            let middle = (inside + outside) / 2.0;
            if misses(middle) < 0.0 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    let (umbra, penumbra) = (edge(0.2), edge(-0.2));
    let mut measures = Vec::new();
    for x in [0.0, 0.5 * umbra, umbra - 1e-3] {
        let build = floor(x);
        let picture = b.picture(&build, &build.depth(2), 256)?;
        measures.push(Measure::none(
            format!("lit pixels of the umbra at {x:.4}"),
            picture.lit_pixels(),
        ));
    }
    for x in [penumbra + 1e-3, 2.0] {
        let build = floor(x);
        let expected = 10.0 * form_factors(x, 3.0, 0.2)[0];
        let picture = b.picture_to(&build, &build.depth(2), 0.9e-3 * expected)?;
        measures.push(Measure::sampled(
            format!("radiance outside at {x:.4}"),
            picture.mean(),
            expected,
            Tolerance::Sigmas { comparisons: 1 },
        ));
    }
    Ok(measures)
}
