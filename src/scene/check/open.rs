//! Open scenes: rays can leave them.

use super::geometry::{directions, disk_of, hit};
use super::{Warnings, is_dielectric};
use crate::scene::{Place, Scene, Shape};

/// The number of rays, spread evenly over all directions.
const RAYS: usize = 1000;
/// The largest number of intersections to calculate. Large scenes get fewer rays, but at least [`MIN_RAYS`].
const MAX_WORK: usize = 20_000_000;
/// Enough rays to find a half-open sky.
const MIN_RAYS: usize = 20;

/// Warns if rays from the eye leave the scene. Rays pass straight through dielectrics.
pub(super) fn warnings(scene: &Scene) -> Warnings {
    let opaque = scene.primitives.iter().filter(|p| !is_dielectric(scene, p));
    let lights = scene.lights.iter().map(disk_of);
    let mut shapes: Vec<Shape> = opaque.map(|p| p.shape.clone()).chain(lights).collect();
    // Walls come first, because they stop most rays.
    shapes.sort_by_key(|s| !matches!(s, Shape::Plane { .. }));

    let rays = (MAX_WORK / shapes.len().max(1)).clamp(MIN_RAYS, RAYS);
    let eye = scene.camera.eye;
    let leaving = directions(rays)
        .filter(|&d| shapes.iter().all(|s| hit(s, eye, d).is_none()))
        .count();
    let mut warnings = Warnings::default();
    if leaving > 0 {
        warnings.add(Place::default(), || {
            format!(
                "the scene is open: {leaving} of {rays} rays from the eye in all directions leave \
                 it and carry no light"
            )
        });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, warned};

    const FLOOR: &str = "[[plane]]\npoint = [0,0,0]\nnormal = [0,1,0]\nmaterial = 'white'\n";

    #[test]
    fn a_floor_alone_is_open() {
        let found = super::warnings(&scene(FLOOR)).first;
        let message = &found.first().expect("open").1;
        let leaving = message.split(' ').find_map(|word| word.parse::<f64>().ok());
        // Half of all directions go up, and the light hides two in a thousand.
        assert!(
            leaving.is_some_and(|n| (n - 498.0).abs() <= 3.0),
            "{message}"
        );
        let ceiling = FLOOR.replace("[0,0,0]", "[0,5,0]");
        let both = FLOOR.to_owned() + &ceiling;
        assert!(!warned(&both, "open"), "only level rays miss both");
        assert!(
            warned(&both.replace("white", "glass"), "open"),
            "glass is looked through"
        );
    }

    #[test]
    fn a_dome_is_closed() {
        let dome = "[[sphere]]\ncenter = [0,0,0]\nradius = 50\nmaterial = 'white'\n";
        assert!(!warned(dome, "open"));
        assert!(warned(&dome.replace("50", "0.5"), "open"));
    }
}
