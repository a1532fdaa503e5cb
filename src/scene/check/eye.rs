//! An eye in a solid, on a surface, or on a light.

use super::geometry::{disk_of, signed_distance, size};
use super::{Warnings, called};
use crate::coincidence;
use crate::scene::{Bsdf, Place, Scene, Shape};

/// How far in front of a light the point is, in radii of the light, that decides which solid it shines in.
const BEFORE: f64 = 1e-3;

/// Warnings about the place of the eye.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let eye = scene.camera.eye;
    let view = eye.distance(scene.camera.look_at);
    let touches =
        |shape: &Shape| coincidence::touches(signed_distance(shape, eye), size(shape).min(view));
    let mut warnings = Warnings::default();
    for l in scene.lights.iter().filter(|l| touches(&disk_of(l))) {
        warnings.add(l.place(), || {
            format!("the eye is on {}", called("light", l.line))
        });
    }
    for p in &scene.primitives {
        let name = called(p.shape.kind(), p.line);
        let is_solid = !matches!(p.shape, Shape::Plane { .. });
        if touches(&p.shape) {
            warnings.add(p.place(), || {
                format!("the eye is on the surface of {name}: rounding decides which side it is on")
            });
        } else if signed_distance(&p.shape, eye) >= 0.0 {
            continue;
        } else if let Bsdf::Dielectric { ior, .. } = scene.materials[p.material].bsdf {
            warnings.add(p.place(), || {
                format!(
                    "the eye is inside {name}: light from outside appears {:.4} times as bright \
                 (ior squared)",
                    ior * ior
                )
            });
        } else if is_solid && !holds_light(scene, &p.shape) {
            warnings.add(p.place(), || {
                format!(
                    "the eye is inside {name}, which is opaque and contains no light: the picture is black"
                )
            });
        }
    }
    warnings
}

/// A field of view in degrees that is below this could be one in radians.
const RADIANS: f64 = 3.0;

/// A hint where the field of view may be meant in radians.
pub(super) fn narrow(scene: &Scene) -> Warnings {
    let vfov = scene.camera.vfov;
    let mut warnings = Warnings::default();
    if vfov < RADIANS {
        warnings.add(Place::default(), || {
            format!(
                "vfov is {vfov}, and vfov is in degrees: the picture shows very little; if it is in radians, write {:.1}",
                vfov.to_degrees()
            )
        });
    }
    warnings
}

/// Whether any light shines inside the solid.
fn holds_light(scene: &Scene, solid: &Shape) -> bool {
    scene.lights.iter().any(|l| {
        let before = l.center + l.normal * (BEFORE * l.radius);
        signed_distance(solid, before) < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, warned};

    // The test scene's eye is at [0,1,4], and looks at [0,1,0]; its light is at [0,4,0].
    fn found(text: &str) -> bool {
        !super::warnings(&scene(text)).first.is_empty()
    }

    fn ball(radius: f64, material: &str) -> String {
        format!("[[sphere]]\ncenter = [0,1,5]\nradius = {radius}\nmaterial = '{material}'\n")
    }

    #[test]
    fn a_field_of_view_in_radians() {
        let mut scene = scene(&ball(0.5, "white"));
        assert!(super::narrow(&scene).first.is_empty());
        scene.camera.vfov = 0.7;
        let found = super::narrow(&scene).first;
        assert!(found[0].1.contains("vfov is in degrees") && found[0].1.ends_with("write 40.1"));
    }

    #[test]
    fn eye_in_a_solid() {
        assert!(warned(&ball(2.0, "white"), "the picture is black"));
        assert!(!found(&ball(0.5, "white")), "outside");
        assert!(!found(&ball(50.0, "white")), "a room with the light in it");
        assert!(warned(&ball(2.0, "glass"), "2.3104 times as bright"));
        assert!(warned(&ball(50.0, "glass"), "2.3104 times as bright"));
        assert!(!found(&ball(0.5, "glass")));
        let behind = "[[plane]]\npoint = [0,0,0]\nnormal = [0,-1,0]\nmaterial = 'white'\n";
        assert!(!found(behind), "opaque planes are two-sided walls");
        let between = behind
            .replace("[0,0,0]", "[0,2,0]")
            .replace("-1,0]", "1,0]");
        assert!(!found(&between), "so is one before the light");
        assert!(
            found(&behind.replace("white", "glass")),
            "half-spaces of glass are solid"
        );
    }

    #[test]
    fn a_light_flush_on_the_inside_lights_the_room() {
        let room = "[[cylinder]]\nbase = [0,0,0]\ntop = [0,4,0]\nradius = 9\nmaterial = 'white'\n";
        assert!(!found(room));
        assert!(found(&room.replace("[0,4,0]", "[0,3,0]")));
    }

    #[test]
    fn eye_on_a_surface() {
        assert!(warned(
            &ball(1.0, "white"),
            "the eye is on the surface of the sphere at line"
        ));
        assert!(!found(&ball(0.9999, "white")));
        let wall = "[[plane]]\npoint = [0,0,4]\nnormal = [0,0,1]\nmaterial = 'white'\n";
        assert!(found(wall));
        assert!(!found(&wall.replace("0,4]", "0,4.0001]")));
    }

    #[test]
    fn eye_on_a_light() {
        let lamp =
            "[[light]]\ncenter = [0.2,1,4]\nnormal = [0,0,-1]\nradius = 0.5\nradiance = [1,1,1]\n";
        assert!(warned(
            &format!("{}{lamp}", ball(0.5, "white")),
            "the eye is on the light at line"
        ));
        let beside = lamp.replace("[0.2,", "[0.6,");
        assert!(!found(&format!("{}{beside}", ball(0.5, "white"))));
    }
}
