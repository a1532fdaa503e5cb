//! What keeps the world's numbers within f32: its origin, its unit of length, and another form for spheres that are very large.

use super::{Geometry, WorldLight, WorldPrimitive};
use crate::scene::{Scene, Shape};
use glam::DVec3;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The origin of the world, in coordinates of the file.
///
/// It is the file's own origin, whose zeros make for simpler arithmetic, unless f32 coordinates are too coarse there: rounding would
/// move something by more than 10⁻⁴ of its radius. Then it is the middle of the eye, the lights and the things of ordinary size.
pub(super) fn choose_origin(scene: &Scene) -> DVec3 {
    let mut sized: Vec<(DVec3, f64)> = scene.lights.iter().map(|l| (l.center, l.radius)).collect();
    for p in &scene.primitives {
        match p.shape {
            Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
                sized.push((center, radius));
            }
            Shape::Cylinder { base, top, radius } => {
                sized.push((base, radius));
                sized.push((top, radius));
            }
            Shape::Implicit(ref implicit) => sized.push(implicit.ball()),
            Shape::Plane { .. } => {}
        }
    }
    let ulp = f64::from(f32::EPSILON) / 2.0;
    if !sized.iter().any(|(c, r)| c.length() * ulp > 1e-4 * r) {
        return DVec3::ZERO;
    }
    sized.sort_by(|a, b| a.1.total_cmp(&b.1));
    let median = sized[sized.len() / 2].1;
    // Huge spheres that serve as walls are left out, because their centres are far away.
    let ordinary = sized
        .iter()
        .filter(|(_, r)| *r <= 10.0 * median)
        .map(|(c, _)| *c);
    let middle: Vec<DVec3> = ordinary.chain([scene.camera.eye]).collect();
    middle.iter().sum::<DVec3>() / middle.len() as f64
}

/// Lengths whose fourth powers are well within f32. A compiler may form such products on the way to a number that has no unit.
const ORDINARY_LENGTHS: RangeInclusive<f64> = 1e-8..=1e8;

/// The unit of length. It is 1, unless some radius or distance from the origin is outside [`ORDINARY_LENGTHS`]. Then it is a power of
/// two, near the middle of the smallest and the largest length on a logarithmic scale. Division by it rounds nothing.
pub(super) fn choose_unit(scene: &Scene, origin: DVec3) -> f64 {
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0f64);
    let mut reach = |distance: f64| largest = largest.max(distance);
    reach(scene.camera.eye.distance(origin));
    let mut sized = |center: DVec3, radius: f64| {
        smallest = smallest.min(radius);
        reach(center.distance(origin) + radius);
    };
    for l in &scene.lights {
        sized(l.center, l.radius);
    }
    for p in &scene.primitives {
        match p.shape {
            Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
                sized(center, radius);
            }
            Shape::Cylinder { base, top, radius } => {
                sized(base, radius);
                sized(top, radius);
            }
            Shape::Implicit(ref implicit) => {
                let (center, radius) = implicit.ball();
                sized(center, radius);
            }
            Shape::Plane { .. } => {}
        }
    }
    for p in &scene.primitives {
        if let Shape::Plane { point, normal } = p.shape {
            largest = largest.max(normal.dot(point - origin).abs());
        }
    }
    if smallest > largest
        || [smallest, largest]
            .iter()
            .all(|x| ORDINARY_LENGTHS.contains(x))
    {
        return 1.0;
    }
    (0.5 * (smallest.log2() + largest.log2())).round().exp2()
}

/// The scene with every length divided by `unit`.
pub(super) fn in_units(scene: &Scene, unit: f64) -> Scene {
    let mut s = scene.clone();
    s.camera.eye /= unit;
    s.camera.look_at /= unit;
    for l in &mut s.lights {
        l.center /= unit;
        l.radius /= unit;
    }
    for p in &mut s.primitives {
        match &mut p.shape {
            Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
                *center /= unit;
                *radius /= unit;
            }
            Shape::Cylinder { base, top, radius } => {
                *base /= unit;
                *top /= unit;
                *radius /= unit;
            }
            Shape::Implicit(implicit) => {
                let implicit = Arc::make_mut(implicit);
                implicit.center /= unit;
                implicit.scale /= unit;
            }
            Shape::Plane { point, .. } => *point /= unit,
        }
    }
    s
}

/// Gives a sphere the form of [`Geometry::HugeSphere`] if it is more than 50 times as large as everything smaller, and its centre is
/// far away. In f32 the ordinary form places a surface only to 10⁻⁷ of the radius.
pub(super) fn find_huge_spheres(
    primitives: &mut [WorldPrimitive],
    lights: &[WorldLight],
    eye: DVec3,
) {
    let mut extent = eye.length();
    for l in lights {
        extent = extent.max(l.center.length() + l.radius);
    }
    let mut spheres = Vec::new();
    for (i, p) in primitives.iter().enumerate() {
        match p.geometry {
            Geometry::Disk { center, radius, .. } => extent = extent.max(center.length() + radius),
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let top = base + axis * (offsets[1] - offsets[0]);
                extent = extent.max(base.length().max(top.length()) + radius);
            }
            Geometry::Implicit(ref implicit) => {
                let (center, radius) = implicit.ball();
                extent = extent.max(center.length() + radius);
            }
            Geometry::Sphere { center, radius } => spheres.push((radius, center, i)),
            Geometry::Plane { .. } | Geometry::HugeSphere { .. } => {}
        }
    }
    spheres.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (radius, center, i) in spheres {
        let distance = center.length();
        if radius > 50.0 * extent && distance > 0.5 * radius {
            // The point of the surface nearest the origin lies on the line from the origin to the centre.
            let normal = -center / distance;
            primitives[i].geometry = Geometry::HugeSphere {
                pole: center + normal * radius,
                normal,
                radius,
            };
        } else if radius <= 50.0 * extent {
            extent = extent.max(distance + radius);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use crate::scene::parse::parse_str;
    use crate::world::World;

    /// A ball, a tube and a disk on a floor under a lamp, with lengths times `scale`.
    fn still_life(scale: f64) -> Scene {
        let l = |x: f64| x * scale;
        let text = format!(
            "[camera]\neye = [{}, {}, {}]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [8, 6]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
             [[plane]]\npoint = [0, {}, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
             [[sphere]]\ncenter = [{}, 0, 0]\nradius = {}\nmaterial = 'white'\n\
             [[disk]]\ncenter = [0, {}, 0]\nnormal = [0, 1, 0]\nradius = {}\nmaterial = 'white'\n\
             [[cylinder]]\nbase = [{}, 0, 0]\ntop = [{}, {}, 0]\nradius = {}\nmaterial = 'white'\n\
             [[light]]\ncenter = [0, {}, 0]\nnormal = [0, -1, 0]\nradius = {}\nradiance = [1, 1, 1]\n",
            l(0.5),
            l(1.0),
            l(6.0),
            l(-1.0),
            l(0.75),
            l(0.5),
            l(-0.5),
            l(0.25),
            l(-1.5),
            l(-1.5),
            l(0.5),
            l(0.25),
            l(4.0),
            l(0.125)
        );
        parse_str("still.toml".as_ref(), &text).expect("a scene")
    }

    #[test]
    fn a_scene_of_any_size_is_the_same_world_in_its_unit() {
        let plain = World::new(&still_life(1.0), [8, 6]);
        assert_eq!(plain.unit, 1.0);
        for exponent in [-46, -40, 40, 46] {
            let scale = f64::from(exponent).exp2();
            let world = World::new(&still_life(scale), [8, 6]);
            // The smallest length is an eighth, and the largest about six and a half.
            assert_eq!(world.unit, scale, "2^{exponent}");
            assert_eq!(world.camera, plain.camera);
            assert_eq!(world.lights, plain.lights);
            assert_eq!(world.primitives, plain.primitives);
        }
    }

    #[test]
    fn the_unit_lies_between_the_smallest_and_the_largest_length() {
        let mut scene = still_life(1.0);
        scene.lights[0].radius = 2e-14;
        scene.camera.eye.z = 300.0;
        let world = World::new(&scene, [8, 6]);
        // The power of two nearest to √(2·10⁻¹⁴ · 300).
        assert_eq!(world.unit, (-19f64).exp2());
        assert_eq!(world.lights[0].radius * world.unit, 2e-14);
    }
}
