//! Formulas without a value somewhere, and formulas and volumes without a surface within their bounds, or with one that the bounds cut.

use super::geometry::directions;
use super::{Warnings, called};
use crate::implicit::Plateaus;
use crate::implicit::arithmetic::Strict;
use crate::implicit::{Clip, Grid, Implicit};
use crate::scene::source::quoted;
use crate::scene::{Primitive, Scene, Shape};
use glam::DVec3;

/// Points along each side of the grid of points at which a formula is looked at.
const SIDE: usize = 24;

/// Beyond this, steps on the way to a value may leave f32.
const LARGEST: f64 = 1e25;

/// Points on the bounds.
const ON_BOUNDS: usize = 4000;

/// The most boxes that are searched for a surface.
const MOST_BOXES: usize = 100_000;

fn all(scene: &Scene) -> impl Iterator<Item = (&Primitive, &Implicit)> {
    scene.primitives.iter().filter_map(|p| match &p.shape {
        Shape::Implicit(implicit) => Some((p, implicit.as_ref())),
        _ => None,
    })
}

/// Parameters that formulas do not use.
pub(super) fn idle(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for (p, implicit) in all(scene) {
        for parameter in implicit.idle_parameters() {
            warnings.add(p.place(), || {
                let name = called(p.shape.kind(), p.line);
                format!("parameter {} of {name} is not used", quoted(parameter))
            });
        }
    }
    warnings
}

/// Formulas that have no value somewhere, and those that do not reach their level.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for (p, implicit) in all(scene) {
        let name = || called(p.shape.kind(), p.line);
        if let Some(grid) = implicit.grid() {
            let [low, high] = grid.volume.range();
            let level = implicit.level;
            // What only touches the level has no inside.
            if (low..=high).contains(&level) {
                let found = grid.volume.plateaus(level);
                if found.cells > 0 {
                    warnings.add(p.place(), || on_plateaus(&name(), grid, level, found));
                }
                continue;
            }
            let what = match (level < low) == grid.above && implicit.closed {
                true => "the solid is the whole of it",
                false => "there is no surface",
            };
            warnings.add(p.place(), || {
                format!(
                    "the numbers of {} run from {low} to {high}, so its level {level} is never reached: {what}",
                    name()
                )
            });
            continue;
        }
        let Some(formula) = implicit.formula() else {
            continue;
        };
        let inside: Vec<DVec3> = grid(implicit).collect();
        let undefined = |q: &&DVec3| {
            let value = formula.evaluate(q.to_array().map(Strict));
            !value.0.is_finite()
        };
        if let Some(q) = inside.iter().find(undefined) {
            let share = inside.iter().filter(undefined).count() as f64 / inside.len() as f64;
            warnings.add(p.place(), || {
                format!(
                    "the formula of {} has no value at {} % of the points within its bounds, such as [{:.4}, {:.4}, {:.4}]: there the \
                     root of a negative number counts as 0, a logarithm as that of 1e-30, and a quotient as one by 1e-30",
                    name(),
                    ((100.0 * share).ceil()),
                    q.x,
                    q.y,
                    q.z
                )
            });
        }
        let largest = inside.iter().map(|q| implicit.height(*q).abs());
        let largest = largest.fold(0.0, f64::max);
        if largest > LARGEST {
            warnings.add(p.place(), || {
                format!(
                    "the formula of {} reaches {largest:.1e} within its bounds, which is near the end of f32 or beyond it: roots may be lost \
                     there; narrower bounds or a factor help",
                    name()
                )
            });
        }
        let below = inside.iter().filter(|q| implicit.height(**q) < 0.0).count();
        if (below == 0 || below == inside.len()) && !may_have_root(implicit) {
            let level = implicit.level;
            let what = match (below == 0, implicit.closed) {
                (true, _) => {
                    format!("above {level} everywhere within its bounds: there is no surface")
                }
                (false, true) => {
                    format!(
                        "below {level} everywhere within its bounds: the solid is the whole of them"
                    )
                }
                (false, false) => {
                    format!("below {level} everywhere within its bounds: there is no surface")
                }
            };
            warnings.add(p.place(), || format!("the formula of {} is {what}", name()));
        }
    }
    warnings
}

/// What to say of a volume that equals its level in whole cells.
fn on_plateaus(name: &str, grid: &Grid, level: f64, found: Plateaus) -> String {
    // Numbers that equal the level are not inside now. So it is with a level on the other side of them.
    let sides = if grid.above {
        [found.above, found.below]
    } else {
        [found.below, found.above]
    };
    let next = sides.into_iter().flatten().next();
    let between = next.map(|n| level + 0.5 * (n - level));
    let between = between.filter(|b| *b != level && Some(*b) != next);
    format!(
        "{} of the numbers of {name} equal its level {level}, and {} of its cells have nothing else: the surface has no place there{}",
        found.numbers,
        found.cells,
        between.map_or_else(String::new, |b| format!(
            "; a level between the numbers, such as {b}, gives it one"
        ))
    )
}

/// Surfaces that their bounds cut.
pub(super) fn cut(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for (p, implicit) in all(scene) {
        let (middle, half) = implicit.clip.extent();
        let (mut below, mut above) = (0, 0);
        for d in directions(ON_BOUNDS) {
            let out = match implicit.clip {
                Clip::Box { .. } => d / d.abs().max_element(),
                Clip::Ball { .. } => d,
            };
            if implicit.height(middle + half * out) < 0.0 {
                below += 1;
            } else {
                above += 1;
            }
        }
        if below > 0 && above > 0 {
            let end = if implicit.closed { "closed" } else { "open" };
            warnings.add(p.place(), || {
                format!(
                    "the bounds of {} cut its surface, which is {end} there (at {:.1} % of the bounds the {} is {} its level)",
                    called(p.shape.kind(), p.line),
                    100.0 * f64::from(below) / ON_BOUNDS as f64,
                    if implicit.grid().is_some() { "volume" } else { "formula" },
                    if implicit.grid().is_some_and(|g| g.above) { "above" } else { "below" },
                )
            });
        }
    }
    warnings
}

/// Points spread over the bounds.
fn grid(implicit: &Implicit) -> impl Iterator<Item = DVec3> {
    let (middle, half) = implicit.clip.extent();
    let clip = implicit.clip;
    (0..SIDE.pow(3)).filter_map(move |k| {
        let at = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE];
        let at = at.map(|n| 2.0 * (n as f64 + 0.5) / SIDE as f64 - 1.0);
        let q = middle + half * DVec3::from_array(at);
        clip.holds(q).then_some(q)
    })
}

/// Whether intervals leave room for a root within the bounds.
fn may_have_root(implicit: &Implicit) -> bool {
    let (middle, half) = implicit.clip.extent();
    let mut boxes = vec![(middle, half)];
    let mut left = MOST_BOXES;
    while let Some((q, reach)) = boxes.pop() {
        if !implicit.heights(q, reach).holds(0.0) {
            continue;
        }
        if left == 0 {
            return true;
        }
        left -= 1;
        for k in 0..8 {
            let side = DVec3::from_array([1, 2, 4].map(|bit| if k & bit > 0 { 0.5 } else { -0.5 }));
            boxes.push((q + reach * side, 0.5 * reach));
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::super::tests::warned;
    use crate::files::npy::Numbers;
    use crate::implicit::volume::Volume;
    use crate::implicit::{Grid, Implicit};
    use crate::scene::Scene;

    fn with(f: &str, keys: &str) -> String {
        format!("[[implicit]]\nf = '{f}'\nbounds = {{ radius = 1 }}\nmaterial = 'white'\n{keys}\n")
    }

    #[test]
    fn formulas_without_a_value_or_a_surface() {
        assert!(warned(&with("sqrt(x) - 0.5", ""), "has no value at 50 %"));
        assert!(warned(&with("x / 0 - y", ""), "has no value at 100 %"));
        assert!(!warned(&with("sqrt(x + 1.01) - 1", ""), "no value"));
        assert!(warned(
            &with("x^2 + y^2 + 0.1", ""),
            "is above 0 everywhere"
        ));
        assert!(warned(
            &with("x^2 + y^2", "level = 3"),
            "the solid is the whole"
        ));
        assert!(!warned(&with("x^2 + y^2 - 0.000001", ""), "everywhere"));
        assert!(warned(
            &with("1e15 (1e14 x - 1)", ""),
            "near the end of f32"
        ));
    }

    #[test]
    fn parameters_that_are_not_used() {
        let keys = "parameters = { a = 2, exp_ = 1, r = 0.5 }";
        let text = with("2a x^2 + y^2 + z^2 - 0.5 exp_", keys);
        assert!(warned(&text, "parameter \"r\" of the implicit at line"));
        assert!(!warned(&text, "parameter \"a\"") && !warned(&text, "\"exp_\""));
    }

    #[test]
    fn volumes_that_are_level_where_they_have_their_level() {
        // A block of 3 among 0, and one point of 7.
        let mut numbers = vec![0u8; 6 * 6 * 6];
        for z in 1..4 {
            for y in 1..4 {
                for x in 1..4 {
                    numbers[x + 6 * (y + 6 * z)] = 3;
                }
            }
        }
        numbers[5 + 6 * (5 + 6 * 5)] = 7;
        let volume = Volume::new([6; 3], Numbers::U8(numbers)).expect("a volume");
        let of = |level: f64, above: bool| {
            let mut grid = Grid::new(volume.clone(), glam::DVec3::ONE);
            grid.above = above;
            let scene = Scene::builder()
                .camera([9.0, 8.0, 30.0], [2.0, 2.0, 2.0], 40.0, [8, 8])
                .diffuse("white", [0.5; 3])
                .isosurface(&Implicit::of_volume(grid, level), "white")
                .light([0.0, 40.0, 0.0], [0.0, -1.0, 0.0], 1.0, [1.0; 3])
                .build();
            let scene = scene.unwrap_or_else(|e| panic!("{e}"));
            let all = super::warnings(&scene).first;
            all.into_iter()
                .map(|(_, message)| message)
                .collect::<Vec<_>>()
        };
        let said = of(3.0, true);
        assert!(
            said.len() == 1
                && said[0].starts_with("27 of the numbers of the isosurface")
                && said[0].contains("equal its level 3, and 8 of its cells have nothing else")
                && said[0].contains("such as 5, gives it one"),
            "{said:?}"
        );
        assert!(of(3.0, false)[0].contains("such as 1.5, gives"));
        assert!(of(0.0, true)[0].contains("such as 1.5, gives"));
        // Nothing is below 0.
        assert!(of(0.0, false)[0].contains("such as 1.5, gives"));
        assert!(of(2.5, true).is_empty() && of(7.0, true).is_empty());
    }

    #[test]
    fn bounds_that_cut() {
        assert!(warned(
            &with("x - 0.1", ""),
            "cut its surface, which is closed there"
        ));
        assert!(warned(
            &with("x - 0.1", "closed = false"),
            "which is open there"
        ));
        assert!(!warned(
            &with("x^2 + y^2 + z^2 - 0.5", ""),
            "cut its surface"
        ));
    }
}
