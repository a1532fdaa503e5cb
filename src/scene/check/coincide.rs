//! Surfaces that coincide. The format defines which one a ray meets first, so the picture is well
//! defined. But unless one object rests on another, coinciding surfaces are rarely intended.

use super::{COINCIDENT, Warnings, called, is_dielectric};
use crate::scene::{Place, Scene, Shape};
use glam::DVec3;

/// In the order in which coincident surfaces are met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Light,
    Disk,
    Cap,
    Plane,
    Curved,
}

/// A planar surface.
struct Face {
    rank: Rank,
    center: DVec3,
    /// Outward for caps.
    normal: DVec3,
    /// Infinite for planes.
    radius: f64,
}

/// A primitive or light.
struct Thing {
    kind: &'static str,
    place: Place,
    /// None for lights.
    shape: Option<Shape>,
    material: Option<usize>,
    dielectric: bool,
    faces: Vec<Face>,
}

/// One warning for every pair of things with suspect coincident surfaces.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let things = things(scene);
    let mut warnings = Warnings::default();
    for (i, a) in things.iter().enumerate() {
        for b in &things[i + 1..] {
            if let Some((rank_a, rank_b)) = suspect(a, b) {
                // `a` is a light, or before `b` among the primitives; the file's order decides
                // between surfaces of equal rank.
                let a_first = (rank_a, a.place.line) <= (rank_b, b.place.line);
                let (first, second) = if a_first { (a, b) } else { (b, a) };
                warnings.add(second.place, || {
                    format!(
                        "{} coincides with {}, which rays meet first from both sides",
                        called(second.kind, second.place.line),
                        called(first.kind, first.place.line),
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
            center: l.center,
            normal: l.normal,
            radius: l.radius,
        }],
    });
    let primitives = scene.primitives.iter().map(|p| Thing {
        kind: p.shape.kind(),
        place: p.place(),
        shape: Some(p.shape),
        material: Some(p.material),
        dielectric: is_dielectric(scene, p),
        faces: faces(&p.shape),
    });
    lights.chain(primitives).collect()
}

fn faces(shape: &Shape) -> Vec<Face> {
    let face = |rank, center, normal, radius| Face {
        rank,
        center,
        normal,
        radius,
    };
    match *shape {
        Shape::Sphere { .. } => Vec::new(),
        Shape::Plane { point, normal } => vec![face(Rank::Plane, point, normal, f64::INFINITY)],
        Shape::Disk {
            center,
            normal,
            radius,
        } => vec![face(Rank::Disk, center, normal, radius)],
        Shape::Cylinder { base, top, radius } => {
            let axis = (top - base).normalize();
            vec![
                face(Rank::Cap, base, -axis, radius),
                face(Rank::Cap, top, axis, radius),
            ]
        }
    }
}

/// Whether shapes of one kind have surfaces that may be in one place, by a generous measure: then their order in the
/// file decides what is met.
pub(in crate::scene) fn may_coincide(a: &Shape, b: &Shape) -> bool {
    // Two surfaces may coincide through a third.
    const SLACK: f64 = 4.0 * COINCIDENT;
    let flat = |f: &Face| faces(b).iter().any(|g| coplanar(f, g, SLACK));
    curved_surfaces_coincide(a, b, SLACK) || faces(a).iter().any(flat)
}

/// The ranks of two surfaces that coincide and should not.
fn suspect(a: &Thing, b: &Thing) -> Option<(Rank, Rank)> {
    let both_opaque = !a.dielectric && !b.dielectric;
    let alike = both_opaque && a.material.is_some() && a.material == b.material;
    if let (Some(s), Some(t)) = (&a.shape, &b.shape)
        && curved_surfaces_coincide(s, t, COINCIDENT)
        // Overlapping parts of one opaque material look the same.
        && (!alike || same_size(s, t))
    {
        return Some((Rank::Curved, Rank::Curved));
    }
    for f in &a.faces {
        for g in &b.faces {
            if !coplanar(f, g, COINCIDENT) {
                continue;
            }
            let opposite = f.normal.dot(g.normal) < 0.0;
            let ordinary = match (f.rank.min(g.rank), f.rank.max(g.rank)) {
                (Rank::Light, Rank::Light) | (Rank::Plane, Rank::Plane) => false,
                (Rank::Disk, Rank::Disk) => alike && !same_disk(f, g),
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

fn both_but_one_opaque(a: &Thing, b: &Thing) -> bool {
    a.dielectric != b.dielectric
}

/// Whether two faces lie in one plane, and over each other, `within` this fraction of their size.
fn coplanar(f: &Face, g: &Face, within: f64) -> bool {
    if f.normal.cross(g.normal).length() > within {
        return false;
    }
    let (small, large) = if f.radius <= g.radius { (f, g) } else { (g, f) };
    let between = small.center - large.center;
    let size = if small.radius.is_finite() {
        small.radius
    } else {
        // Two planes: what they are distant from the file's origin is their only size.
        let offset = |f: &Face| f.normal.dot(f.center).abs();
        offset(f).max(offset(g))
    };
    let apart = large.normal.dot(between);
    let aside = (between - large.normal * apart).length();
    let touching = f.radius + g.radius - within * size;
    apart.abs() <= within * size && (aside < touching || large.radius.is_infinite())
}

fn same_disk(f: &Face, g: &Face) -> bool {
    let near = COINCIDENT * f.radius;
    (f.radius - g.radius).abs() <= near && f.center.distance(g.center) <= near
}

/// Whether two cylinders that coincide are as long as each other, so that one is never met; spheres
/// always are.
fn same_size(s: &Shape, t: &Shape) -> bool {
    let length = |shape: &Shape| match *shape {
        Shape::Cylinder { base, top, .. } => base.distance(top),
        _ => 0.0,
    };
    (length(s) - length(t)).abs() <= COINCIDENT * length(s)
}

/// Spheres, or sides of cylinders, in one place.
fn curved_surfaces_coincide(s: &Shape, t: &Shape, within: f64) -> bool {
    match (*s, *t) {
        (
            Shape::Sphere { center, radius },
            Shape::Sphere {
                center: other,
                radius: r,
            },
        ) => center.distance(other) + (radius - r).abs() <= within * radius,
        (
            Shape::Cylinder { base, top, radius },
            Shape::Cylinder {
                base: b,
                top: t,
                radius: r,
            },
        ) => {
            let near = within * radius;
            let length = base.distance(top);
            let axis = (top - base) / length;
            let along = |p: DVec3| axis.dot(p - base);
            let beside = |p: DVec3| (p - base - axis * along(p)).length();
            let (low, high) = (along(b).min(along(t)), along(b).max(along(t)));
            (radius - r).abs() <= near
                && beside(b) <= near
                && beside(t) <= near
                && low < length - near
                && high > near
        }
        _ => false,
    }
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
