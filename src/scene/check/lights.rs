//! Lights that contribute nothing to the picture.

use super::coincide::ROUNDING;
use super::geometry::{disk_of, hit, points_on_disk, reach, signed_distance};
use super::{Warnings, called, is_dielectric};
use crate::coincidence::{COINCIDENT, in_plane, slack};
use crate::implicit::DiskPlace;
use crate::scene::{Light, Primitive, Scene, Shape};
use glam::DVec3;

/// Something in front of a light covers it if it is nearer than this, in radii of the light.
const COVER: f64 = 1e-3;
/// The number of points on a light from which to look for a cover.
const POINTS: usize = 64;

/// Lights that emit nothing.
pub(super) fn black(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for l in scene.lights.iter().filter(|l| l.radiance == DVec3::ZERO) {
        let light = called("light", l.line);
        warnings.add(l.place(), || {
            format!("{light} has radiance 0, so it is a black disk")
        });
    }
    warnings
}

/// Lights with something opaque directly in front of at least half of their face.
pub(super) fn covered(scene: &Scene) -> Warnings {
    let opaque = scene.primitives.iter().filter(|p| !is_dielectric(scene, p));
    let primitives = opaque.map(|p| (p.shape.clone(), p.shape.kind(), p.line));
    let lights = scene.lights.iter().map(|l| (disk_of(l), "light", l.line));
    let covers: Vec<(Shape, &str, usize)> = primitives.chain(lights).collect();

    let mut warnings = Warnings::default();
    for l in &scene.lights {
        // Start in front of the light itself and of what it is flush on. Distance does not say whether a flush surface is in front
        // or behind.
        let start = 2.0 * slack(l.radius);
        // What is beyond the eye covers nothing, however large the light is.
        let eye = l.normal.dot(scene.camera.eye - l.center);
        let reach = COVER * l.radius;
        let reach = if eye > 0.0 { reach.min(eye) } else { reach };
        let is_covered = |shape: &Shape| {
            if signed_distance(shape, l.center).abs() > l.radius + reach {
                return false;
            }
            let points = points_on_disk(l.center, l.normal, l.radius, POINTS);
            let before = points.filter(|&p| {
                let t = hit(shape, p + l.normal * start, l.normal);
                t.is_some_and(|t| t + start <= reach)
            });
            2 * before.count() >= POINTS
        };
        if let Some((_, kind, line)) = covers.iter().find(|c| is_covered(&c.0)) {
            let light = called("light", l.line);
            let cover = called(kind, *line);
            warnings.add(l.place(), || {
                format!(
                    "{light} is covered: {cover} is in front of it, closer than {COVER} of its radius"
                )
            });
        }
    }
    warnings
}

/// Light that ends within this share of what the camera sees, from top to bottom where it looks, lights nothing but a spot: that of a lamp
/// that faces a wall from a hundredth of it.
const NEAR: f64 = 0.1;
/// Rays of a light, of which so many may go farther: 1 %.
const RAYS: usize = 300;
const FAR_RAYS: usize = 3;

/// Lights whose light ends at matt surfaces right before them, such as a lamp under a ceiling that faces up. Those that are `covered` have
/// another warning.
pub(super) fn shut_in(scene: &Scene, covered: &Warnings) -> Warnings {
    let matt = |p: &&Primitive| !scene.materials[p.material].bsdf.kind().is_specular();
    let walls: Vec<&Primitive> = scene.primitives.iter().filter(matt).collect();
    let near = NEAR * seen(scene, &walls);
    let mut warnings = Warnings::default();
    for l in scene.lights.iter().filter(|l| l.radiance != DVec3::ZERO) {
        let is_covered = covered.first.iter().any(|(place, _)| *place == l.place());
        if is_covered || hidden(scene, l).is_some() {
            continue;
        }
        let start = l.normal * (2.0 * slack(l.radius));
        let meets = |o: DVec3, d: DVec3| {
            let hits = walls
                .iter()
                .filter_map(|p| Some((hit(&p.shape, o + start, d)?, *p)));
            let hits = hits.filter(|(t, _)| *t <= near);
            hits.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let mut far = 0;
        let all_near = cosine_rays(l).all(|(o, d)| {
            far += usize::from(meets(o, d).is_none());
            far <= FAR_RAYS
        });
        let Some((distance, wall)) = meets(l.center, l.normal).filter(|_| all_near) else {
            continue;
        };
        let light = called("light", l.line);
        let wall = called(wall.shape.kind(), wall.line);
        warnings.add(l.place(), || {
            format!(
                "{light} faces {wall}, {distance:.3} away: hardly any of its light goes farther; its normal points to the side that shines"
            )
        });
    }
    warnings
}

/// How much the camera sees from top to bottom where it looks. `look_at` may be far beyond what is there.
fn seen(scene: &Scene, walls: &[&Primitive]) -> f64 {
    let camera = &scene.camera;
    let ahead = camera.look_at - camera.eye;
    let hits = walls
        .iter()
        .filter_map(|p| hit(&p.shape, camera.eye, ahead.normalize()));
    let view = hits.fold(ahead.length(), f64::min);
    view.min(2.0 * view * (0.5 * camera.vfov.to_radians()).tan())
}

/// Rays as a light sends them: from points that are even over it, and most along its normal.
fn cosine_rays(l: &Light) -> impl Iterator<Item = (DVec3, DVec3)> {
    /// Has no divisor in common with their number: each point gets another direction.
    const STRIDE: usize = 109;
    let normal = l.normal;
    let points = points_on_disk(l.center, normal, l.radius, RAYS);
    let across = points_on_disk(DVec3::ZERO, normal, 1.0, RAYS);
    let across: Vec<DVec3> = across.collect();
    points.enumerate().map(move |(i, point)| {
        // Malley: points that are even over a disk are cosines over the hemisphere above.
        let d = across[i * STRIDE % RAYS];
        let up = (1.0 - d.length_squared()).max(0.0).sqrt();
        (point, d + normal * up)
    })
}

/// Lights on the other side of an opaque plane than the eye, and lights inside an opaque solid that the eye is outside of.
pub(super) fn unseen(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for l in &scene.lights {
        if let Some((p, how)) = hidden(scene, l) {
            let light = called("light", l.line);
            let wall = called(p.shape.kind(), p.line);
            warnings.add(l.place(), || {
                format!("{light} {how} {wall}, which is opaque: none of its light reaches the eye")
            });
        }
    }
    warnings
}

/// Lights with nothing in front of them, but for those that have another warning.
pub(super) fn turned_away(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    let shining = scene.lights.iter().filter(|l| l.radiance != DVec3::ZERO);
    for l in shining.filter(|l| faces_nothing(scene, l) && hidden(scene, l).is_none()) {
        let light = called("light", l.line);
        warnings.add(l.place(), || {
            format!(
                "{light} faces away from everything: neither the eye nor any surface is in front of it, so none of its light \
                 reaches the eye"
            )
        });
    }
    warnings
}

/// What certainly hides all light of `l` from the eye, and how.
fn hidden<'s>(scene: &'s Scene, l: &Light) -> Option<(&'s Primitive, &'static str)> {
    let mut walls = scene.primitives.iter().filter(|p| !is_dielectric(scene, p));
    walls.find_map(|p| Some((p, hidden_by(&p.shape, l, scene.camera.eye)?)))
}

/// Whether the eye and all surfaces are behind the light.
fn faces_nothing(scene: &Scene, l: &Light) -> bool {
    let slack = ROUNDING * l.radius;
    l.normal.dot(scene.camera.eye - l.center) <= slack
        && scene
            .primitives
            .iter()
            .all(|p| reach(&p.shape, l.center, l.normal) <= slack)
}

/// How an opaque shape certainly hides all light of `l` from the eye, in words that precede the shape's name.
fn hidden_by(shape: &Shape, l: &Light, eye: DVec3) -> Option<&'static str> {
    let slack = slack(l.radius);
    match *shape {
        Shape::Plane { point, normal } => {
            let side = normal.dot(eye - point).signum();
            let normal = normal * side;
            let height = normal.dot(l.center - point);
            let tilt = normal.cross(l.normal).length();
            if height + l.radius * tilt < -slack {
                Some("is hidden from the eye behind")
            } else if height <= ROUNDING * l.radius
                && flush(normal, l, height)
                && normal.dot(l.normal) < 0.0
            {
                Some("lies on and faces into")
            } else {
                None
            }
        }
        Shape::Sphere { .. } | Shape::Cylinder { .. } => {
            if signed_distance(shape, eye) < 0.0 {
                return None;
            }
            // Solids are convex: they contain the disk if they contain its rim.
            let (x, y) = l.normal.any_orthonormal_pair();
            let mut rim = (0..POINTS).map(|k| {
                let turn = k as f64 / POINTS as f64 * std::f64::consts::TAU;
                l.center + (x * turn.cos() + y * turn.sin()) * l.radius
            });
            if rim.all(|p| signed_distance(shape, p) < -slack) {
                return Some("is inside");
            }
            faces_into_cap(shape, l, slack).then_some("lies on and faces into")
        }
        Shape::Implicit(ref solid) => {
            let place = || solid.place_of_disk(l.center, l.normal, l.radius);
            let hides = solid.closed && !solid.holds(eye) && place() == DiskPlace::Inside;
            hides.then_some("is inside")
        }
        Shape::Disk { .. } => None,
    }
}

/// Whether the light lies in the plane with this normal, over which its centre is at this height.
fn flush(normal: DVec3, l: &Light, height: f64) -> bool {
    in_plane([normal, l.normal], height, l.radius, COINCIDENT)
}

/// Whether the light lies on a cap of the cylinder and faces its inside.
fn faces_into_cap(shape: &Shape, l: &Light, slack: f64) -> bool {
    let Shape::Cylinder { base, top, radius } = *shape else {
        return false;
    };
    let axis = (top - base).normalize();
    [(base, -axis), (top, axis)].iter().any(|&(cap, outward)| {
        let between = l.center - cap;
        let apart = outward.dot(between);
        let aside = (between - outward * apart).length();
        flush(outward, l, apart)
            && outward.dot(l.normal) < 0.0
            && aside + l.radius <= radius + slack
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, warned};
    use super::Warnings;
    use crate::scene::Scene;

    // The test scene's eye is at [0,1,4], and its light at [0,4,0] shines down.
    const BALL: &str = "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'white'\n";

    fn found(lint: fn(&Scene) -> Warnings, text: &str) -> bool {
        !lint(&scene(text)).first.is_empty()
    }

    fn light(center: &str, normal: &str, radiance: &str) -> String {
        format!(
            "{BALL}[[light]]\ncenter = {center}\nnormal = {normal}\nradius = 0.5\nradiance = {radiance}\n"
        )
    }

    fn plane(point: &str, normal: &str, material: &str) -> String {
        format!("[[plane]]\npoint = {point}\nnormal = {normal}\nmaterial = '{material}'\n")
    }

    #[test]
    fn black_lights() {
        let dark = light("[0,2,0]", "[0,1,0]", "[0,0.0,0]");
        assert!(found(super::black, &dark));
        assert!(!found(super::black, &dark.replace("0.0", "0.1")));
        assert!(warned(&dark, "has radiance 0"));
    }

    #[test]
    fn covered_lights() {
        let lid = |y: f64, x: f64, radius: f64| {
            format!(
                "[[disk]]\ncenter = [{x},{y},0]\nnormal = [0,1,0]\nradius = {radius}\nmaterial = 'red'\n"
            )
        };
        assert!(found(super::covered, &lid(3.9998, 0.0, 1.0)));
        assert!(warned(
            &lid(3.9998, 0.0, 1.0),
            "is covered: the disk at line"
        ));
        assert!(!found(super::covered, &lid(4.0002, 0.0, 1.0)), "behind it");
        assert!(
            !found(super::covered, &lid(3.99, 0.0, 1.0)),
            "a shade at a distance"
        );
        assert!(
            !found(super::covered, &lid(3.9998, 0.0, 0.2)),
            "a small lid"
        );
        assert!(!found(super::covered, &lid(4.0, 0.0, 1.0)), "flush");
        let ceiling = plane("[0,3.9998,0]", "[0,1,0]", "white");
        assert!(found(super::covered, &ceiling));
        assert!(!found(super::covered, &ceiling.replace("white", "glass")));
        let lamp = light("[0,3.9998,0]", "[0,1,0]", "[1,1,1]");
        assert!(found(super::covered, &lamp), "two lights face to face");
        let far = light("[0,5,0]", "[0,-1,0]", "[1,1,1]").replace("radius = 0.5", "radius = 9e3");
        let floor = plane("[0,0,0]", "[0,1,0]", "white");
        assert!(
            !found(super::covered, &(far + &floor)),
            "the eye is between"
        );
        let slab =
            "[[cylinder]]\nbase = [0,3,0]\ntop = [0,3.9998,0]\nradius = 2\nmaterial = 'red'\n";
        assert!(found(super::covered, slab));
    }

    /// The camera sees 2.9 from top to bottom.
    #[test]
    fn lights_that_face_what_is_right_before_them() {
        let told = |text: &str| {
            let scene = scene(text);
            let covered = super::covered(&scene);
            !super::shut_in(&scene, &covered).first.is_empty()
        };
        let ceiling = |y: f64, material: &str| plane(&format!("[0,{y},0]"), "[0,-1,0]", material);
        let up = |y: f64| light(&format!("[0,{y},0]"), "[0,1,0]", "[1,1,1]");
        let lamp = |y: f64| up(3.0) + &ceiling(3.0 + y, "white");
        assert!(warned(&lamp(0.02), "hardly any of its light goes farther"));
        assert!(told(&lamp(0.001)) && !told(&lamp(0.1)), "an uplight");
        assert!(!told(&lamp(0.0004)), "that is a cover");
        assert!(!told(&(up(3.0) + &ceiling(3.004, "glass"))));
        assert!(!told(&lamp(0.004).replace("[0,1,0]", "[0,-1,0]")));
        let sideways = lamp(0.004).replace("[0,1,0]", "[0,0,1]");
        assert!(!told(&sideways), "half of it goes down");
        let dark = lamp(0.004).replace("[1,1,1]", "[0,0,0]");
        assert!(!told(&dark), "it emits nothing");
        // A lid that is as wide as the lamp lets light pass beside it; a much wider one does not.
        let lid = |radius: f64| {
            let at = "[[disk]]\ncenter = [0,3.02,0]\nnormal = [0,1,0]";
            up(3.0) + &format!("{at}\nradius = {radius}\nmaterial = 'white'\n")
        };
        assert!(!told(&lid(0.5)) && told(&lid(3.0)));
    }

    #[test]
    fn lights_that_face_nothing() {
        // The ball reaches up to 1, and the eye is at 1.
        let away = |y: f64| light(&format!("[0,{y},0]"), "[0,1,0]", "[1,1,1]");
        let told = |text: &str| found(super::turned_away, text);
        assert!(warned(&away(1.5), "faces away from everything"));
        assert!(!told(&away(0.9)), "the ball's top, and the eye");
        assert!(!told(&away(1.5).replace("[0,1,0]", "[0,-1,0]")));
        let ceiling = |y: f64| away(1.5) + &plane(&format!("[0,{y},0]"), "[0,-1,0]", "white");
        assert!(!told(&ceiling(3.0)));
        assert!(!told(&ceiling(1.5)), "it faces into what it lies on");
        let wall = away(1.5) + &plane("[0,0,-3]", "[0,0,1]", "white");
        assert!(!told(&wall), "walls have no end");
        let dark = away(1.5).replace("[1,1,1]", "[0,0,0]");
        assert!(!told(&dark), "it emits nothing");
        let wide = away(1.5).replace("[0,1,0]", "[0,-1,0]");
        let wide = wide.replace("radius = 0.5", "radius = 1e7");
        assert!(!told(&wide), "a ceiling of light");
    }

    #[test]
    fn lights_beyond_a_plane() {
        // A wall between the eye and the light, and one that touches the light's rim.
        assert!(found(super::unseen, &plane("[0,0,2]", "[0,0,-1]", "white")));
        assert!(found(super::unseen, &plane("[0,0,2]", "[0,0,1]", "white")));
        assert!(!found(super::unseen, &plane("[0,0,2]", "[0,0,1]", "glass")));
        assert!(!found(
            super::unseen,
            &plane("[0,0,0.4]", "[0,0,1]", "white")
        ));
        assert!(!found(super::unseen, &plane("[0,0,5]", "[0,0,1]", "white")));
        let hidden = plane("[0,0,2]", "[0,0,1]", "white");
        assert!(warned(
            &hidden,
            "is hidden from the eye behind the plane at line"
        ));
    }

    #[test]
    fn lights_that_face_into_what_they_lie_on() {
        let floor = plane("[0,0,0]", "[0,1,0]", "white");
        let on_floor = |normal| floor.clone() + &light("[5,0,0]", normal, "[1,1,1]");
        assert!(found(super::unseen, &on_floor("[0,-1,0]")));
        assert!(!found(super::unseen, &on_floor("[0,1,0]")));
        let drum = "[[cylinder]]\nbase = [5,0,0]\ntop = [5,1,0]\nradius = 0.6\nmaterial = 'red'\n";
        let on_drum = |normal| drum.to_owned() + &light("[5,1,0]", normal, "[1,1,1]");
        assert!(found(super::unseen, &on_drum("[0,-1,0]")));
        assert!(!found(super::unseen, &on_drum("[0,1,0]")));
        let wide = on_drum("[0,-1,0]").replace("radius = 0.6", "radius = 0.4");
        assert!(!found(super::unseen, &wide), "it looks past the rim");
    }

    #[test]
    fn lights_in_opaque_solids() {
        let inside = light("[0,0.3,0]", "[0,1,0]", "[1,1,1]");
        assert!(found(super::unseen, &inside));
        assert!(
            !found(super::unseen, &inside.replace("0.3", "0.9")),
            "its rim sticks out"
        );
        assert!(!found(super::unseen, &inside.replace("'white'", "'glass'")));
        let room = inside.replace("radius = 1\n", "radius = 30\n");
        assert!(!found(super::unseen, &room), "with the eye");
    }
}
