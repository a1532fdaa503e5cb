//! Surfaces that coincide. The format defines which one a ray meets first, so the picture is well
//! defined. But unless one object rests on another, coinciding surfaces are rarely intended.

use super::{Warnings, called, is_dielectric};
use crate::coincidence::{COINCIDENT, Flat};
use crate::scene::{Place, Scene, Shape};
use glam::DVec3;

/// Kinds of surface, in the order in which surfaces that coincide are met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Light,
    Disk,
    Cap,
    Plane,
    Curved,
}

/// A flat surface.
struct Face {
    rank: Rank,
    flat: Flat,
}

/// A primitive or light.
struct Thing {
    kind: &'static str,
    place: Place,
    /// `None` for lights.
    shape: Option<Shape>,
    material: Option<usize>,
    dielectric: bool,
    faces: Vec<Face>,
}

/// Faces closer than this, relative to the size of the smaller, were meant to be in one plane.
pub(super) const ROUNDING: f64 = 1e-9;

/// One warning for every pair of things with suspect coincident surfaces.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let things = things(scene);
    let mut warnings = Warnings::default();
    for (i, a) in things.iter().enumerate() {
        for b in &things[i + 1..] {
            if let Some((rank_a, rank_b)) = suspect(a, b) {
                // `a` is a light, or before `b` among the primitives. The order of the file decides between surfaces of
                // equal rank.
                let a_first = (rank_a, a.place.line) <= (rank_b, b.place.line);
                let (first, second) = if a_first { (a, b) } else { (b, a) };
                warnings.add(second.place, || {
                    format!(
                        "{} coincides with {}, which rays meet first from both sides",
                        called(second.kind, second.place.line),
                        called(first.kind, first.place.line),
                    )
                });
            } else if let Some(gap) = around_eye(a, b, scene.camera.eye) {
                let [one, other] = [a, b].map(|t| called(t.kind, t.place.line));
                // A light is `a`.
                let place = if a.shape.is_none() { a.place } else { b.place };
                let so = if a.shape.is_none() {
                    format!("none of the light reaches the {}", b.kind)
                } else {
                    "a ray that leaves one does not meet the other".to_owned()
                };
                warnings.add(place, || {
                    format!(
                        "{other} and {one} count as one surface, because they are {gap} apart, less than a millionth of the \
                         smaller one's radius: {so}, though the eye is between them"
                    )
                });
            }
        }
    }
    warnings
}

fn things(scene: &Scene) -> Vec<Thing> {
    let lights = scene.lights.iter().map(|l| Thing {
        kind: "light",
        place: l.place(),
        shape: None,
        material: None,
        dielectric: false,
        faces: vec![Face {
            rank: Rank::Light,
            flat: l.flat(),
        }],
    });
    let primitives = scene.primitives.iter().map(|p| Thing {
        kind: p.shape.kind(),
        place: p.place(),
        shape: Some(p.shape.clone()),
        material: Some(p.material),
        dielectric: is_dielectric(scene, p),
        faces: faces(&p.shape),
    });
    lights.chain(primitives).collect()
}

fn faces(shape: &Shape) -> Vec<Face> {
    let rank = match shape {
        Shape::Sphere { .. } | Shape::Implicit(_) => Rank::Curved,
        Shape::Plane { .. } => Rank::Plane,
        Shape::Disk { .. } => Rank::Disk,
        Shape::Cylinder { .. } => Rank::Cap,
    };
    let flats = shape.flats().into_iter();
    flats.map(|flat| Face { rank, flat }).collect()
}

/// The ranks of two surfaces that coincide and should not; `None` if there are none.
fn suspect(a: &Thing, b: &Thing) -> Option<(Rank, Rank)> {
    let both_opaque = !a.dielectric && !b.dielectric;
    let alike = both_opaque && a.material.is_some() && a.material == b.material;
    if let (Some(s), Some(t)) = (&a.shape, &b.shape)
        && s.curved_coincides(t, COINCIDENT)
        // Overlapping parts of one opaque material look the same.
        && (!alike || same_length(s, t))
    {
        return Some((Rank::Curved, Rank::Curved));
    }
    for f in &a.faces {
        for g in &b.faces {
            if !f.flat.coincides(&g.flat, COINCIDENT) {
                continue;
            }
            let opposite = f.flat.normal.dot(g.flat.normal) < 0.0;
            let ordinary = match (f.rank.min(g.rank), f.rank.max(g.rank)) {
                (Rank::Light, Rank::Light) | (Rank::Plane, Rank::Plane) => false,
                (Rank::Disk, Rank::Disk) => alike && !f.flat.same_disk(&g.flat),
                // Flush on an opaque wall.
                (Rank::Light | Rank::Disk, _) => both_opaque,
                // One stands on the other, or they are parts of one object.
                (Rank::Cap, Rank::Cap) => {
                    let touch = opposite && !(a.dielectric && b.dielectric);
                    touch || alike
                }
                // A plane with something on it, or a half-space that something rests on.
                (Rank::Cap, Rank::Plane) => {
                    let plane = if f.rank == Rank::Plane { a } else { b };
                    !plane.dielectric || (opposite && both_but_one_opaque(a, b))
                }
                _ => true,
            };
            if !ordinary {
                return Some((f.rank, g.rank));
            }
        }
    }
    None
}

/// The distance between two faces that count as one, though the eye is between them.
fn around_eye(a: &Thing, b: &Thing, eye: DVec3) -> Option<f64> {
    let pairs = a
        .faces
        .iter()
        .flat_map(|f| b.faces.iter().map(move |g| (&f.flat, &g.flat)));
    let mut gaps = pairs.filter_map(|(f, g)| {
        // The plane of a disk may be tilted a little against an infinite plane, whose centre is far away.
        let (small, large) = if f.radius <= g.radius { (f, g) } else { (g, f) };
        let heights = [small.center, eye].map(|p| large.normal.dot(p - large.center));
        let share = heights[1] / heights[0];
        let apart = heights[0].abs() > ROUNDING * small.radius && 0.0 < share && share < 1.0;
        (apart && f.coincides(g, COINCIDENT)).then_some(heights[0].abs())
    });
    gaps.next()
}

fn both_but_one_opaque(a: &Thing, b: &Thing) -> bool {
    a.dielectric != b.dielectric
}

/// Whether two shapes whose curved surfaces coincide are as long as each other, so that a ray never meets one of them. Spheres
/// always are.
fn same_length(s: &Shape, t: &Shape) -> bool {
    let tubes = s.tube().zip(t.tube());
    tubes.is_none_or(|(a, b)| a.same_length(&b))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, warned, with};
    use crate::scene::Place;

    const FLOOR: &str = "[[plane]]\npoint = [0,0,0]\nnormal = [0,1,0]\nmaterial = 'white'\n";

    fn suspect(text: &str) -> bool {
        let found = super::warnings(&scene(text)).first;
        assert!(found.len() <= 1, "{found:?}");
        !found.is_empty()
    }

    fn disk(center: &str, normal: &str, radius: f64, material: &str) -> String {
        format!(
            "[[disk]]\ncenter = {center}\nnormal = {normal}\nradius = {radius}\nmaterial = '{material}'\n"
        )
    }

    fn cylinder(base: &str, top: &str, radius: f64, material: &str) -> String {
        format!(
            "[[cylinder]]\nbase = {base}\ntop = {top}\nradius = {radius}\nmaterial = '{material}'\n"
        )
    }

    #[test]
    fn the_message_names_both_and_their_order() {
        let text =
            format!("{FLOOR}[[plane]]\npoint = [3,1e-9,0]\nnormal = [0,-2,0]\nmaterial = 'red'\n");
        assert!(
            !suspect(&text),
            "1e-9 apart, at no distance from the origin"
        );
        let text = text.replace("1e-9", "0");
        let found = super::warnings(&scene(&text)).first;
        let first = with("").lines().count() + 1;
        let expected = format!(
            "the plane at line {} coincides with the plane at line {first}, which rays meet first from both sides",
            first + 4
        );
        let place = Place {
            line: first + 4,
            column: 1,
        };
        assert_eq!(found, [(place, expected)]);
        assert!(warned(&text, "coincides with"));
    }

    #[test]
    fn flush_and_standing_objects_give_no_warning() {
        assert!(!suspect(FLOOR));
        for material in ["white", "red", "glass"] {
            let standing = cylinder("[0,0,0]", "[0,1,0]", 0.5, material);
            assert!(!suspect(&format!("{FLOOR}{standing}")), "{material}");
        }
        let flush = disk("[0,0,0]", "[0,-1,0]", 0.5, "red");
        assert!(!suspect(&format!("{FLOOR}{flush}")));
        // The test scene's own light, at [0,4,0].
        let ceiling = FLOOR.replace("[0,0,0]", "[0,4,0]");
        assert!(!suspect(&ceiling));
        assert!(suspect(&ceiling.replace("white", "glass")));
    }

    /// The eye is at a height of 1.
    #[test]
    fn a_ceiling_of_light_that_counts_as_part_of_the_floor() {
        let ceiling = |radius: f64| {
            format!(
                "{FLOOR}[[light]]\ncenter = [0,10,0]\nnormal = [0,-1,0]\nradius = {radius}\nradiance = [1,1,1]\n"
            )
        };
        let line = with("").lines().count() + 1;
        let expected = format!(
            "the plane at line {line} and the light at line {} count as one surface, because they are 10 apart",
            line + 4
        );
        assert!(warned(&ceiling(1.1e7), &expected));
        assert!(warned(
            &ceiling(1.1e7),
            "none of the light reaches the plane, though the eye is between them"
        ));
        assert!(!suspect(&ceiling(0.9e7)));
        let below = ceiling(1.1e7).replace("[0,10,0]", "[0,0.5,0]");
        assert!(!suspect(&below), "the eye is above both");
        let lid = format!("{FLOOR}{}", disk("[0,10,0]", "[0,1,0]", 1.1e7, "red"));
        assert!(warned(
            &lid,
            "a ray that leaves one does not meet the other"
        ));
        let ground = ceiling(1.1e7).replace(FLOOR, &disk("[0,0,0]", "[0,1,0]", 1.2e7, "white"));
        assert!(suspect(&ground));
    }

    #[test]
    fn lights_in_one_place() {
        let light =
            "[[light]]\ncenter = [0.1,4,0]\nnormal = [0,1,0]\nradius = 0.2\nradiance = [1,1,1]\n";
        assert!(suspect(&format!("{FLOOR}{light}")), "back to back");
        assert!(!suspect(&format!(
            "{FLOOR}{}",
            light.replace("4,0]", "4.001,0]")
        )));
        assert!(
            !suspect(&format!("{FLOOR}{}", light.replace("0.1,4", "2,4"))),
            "side by side"
        );
    }

    #[test]
    fn disks_in_one_place() {
        let first = disk("[0,1,0]", "[0,0,1]", 1.0, "red");
        let second = |material| disk("[0.5,1,0]", "[0,0,-1]", 1.0, material);
        assert!(suspect(&(first.clone() + &second("white"))));
        assert!(
            !suspect(&(first.clone() + &second("red"))),
            "parts of one red thing"
        );
        assert!(
            suspect(&(first.clone() + &first)),
            "one of them is never met"
        );
        let tilted = disk("[0.5,1,0]", "[0,1e-5,1]", 1.0, "white");
        assert!(!suspect(&(first + &tilted)));
    }

    #[test]
    fn cylinders_in_one_place() {
        let low = cylinder("[0,0,0]", "[0,1,0]", 0.5, "red");
        let stacked = |material| cylinder("[0,1,0]", "[0,2,0]", 0.4, material);
        assert!(!suspect(&(low.clone() + &stacked("white"))), "stacked");
        assert!(!suspect(&(low.clone() + &stacked("glass"))), "stacked");
        let glass = low.replace("red", "glass");
        assert!(
            suspect(&(glass.clone() + &stacked("glass"))),
            "two interfaces and no gap"
        );
        let sheath = cylinder("[0,0.5,0]", "[0,2,0]", 0.5, "white");
        assert!(suspect(&(low.clone() + &sheath)), "sides coincide");
        assert!(
            !suspect(&(low.clone() + &sheath.replace("white", "red"))),
            "one red thing"
        );
        let band = cylinder("[0,0.2,0]", "[0,0.8,0]", 0.5, "white");
        assert!(suspect(&(low.clone() + &band)), "sides coincide");
        let below = cylinder("[0,-2,0]", "[0,-1,0]", 0.5, "white");
        assert!(!suspect(&(low.clone() + &below)), "one above the other");
        let above = cylinder("[0,2,0]", "[0,3,0]", 0.5, "white");
        assert!(!suspect(&(low.clone() + &above)), "one above the other");
        let inlay = cylinder("[0,0.5,0]", "[0,1,0]", 0.2, "white");
        assert!(suspect(&(low + &inlay)), "caps flush");
        assert!(
            suspect(&(FLOOR.replace("white", "glass") + &glass)),
            "glass on glass"
        );
    }

    #[test]
    fn spheres_in_one_place() {
        let ball = "[[sphere]]\ncenter = [0,1,0]\nradius = 1\nmaterial = 'red'\n";
        assert!(suspect(&format!("{ball}{}", ball.replace("red", "white"))));
        assert!(!suspect(&format!(
            "{ball}{}",
            ball.replace("= 1\n", "= 0.999\n")
        )));
        assert!(!suspect(&format!("{FLOOR}{ball}")), "it touches the floor");
    }
}
