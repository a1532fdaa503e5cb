//! Where f32 is fine enough: the world's origin, and spheres too large for the ordinary form.

use super::{Geometry, WorldLight, WorldPrimitive};
use crate::scene::{Scene, Shape};
use glam::DVec3;

/// The middle of eye, lights and things of ordinary size if f32 coordinates about the file's origin would
/// be too coarse for some radius (one part in 10⁴), else the file's own origin, whose zeros make simpler
/// arithmetic.
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
            Shape::Plane { .. } => {}
        }
    }
    let ulp = f64::from(f32::EPSILON) / 2.0;
    if !sized.iter().any(|(c, r)| c.length() * ulp > 1e-4 * r) {
        return DVec3::ZERO;
    }
    sized.sort_by(|a, b| a.1.total_cmp(&b.1));
    let median = sized[sized.len() / 2].1;
    // Walls made of huge spheres have their centres far away.
    let ordinary = sized
        .iter()
        .filter(|(_, r)| *r <= 10.0 * median)
        .map(|(c, _)| *c);
    let middle: Vec<DVec3> = ordinary.chain([scene.camera.eye]).collect();
    middle.iter().sum::<DVec3>() / middle.len() as f64
}

/// Spheres more than 50 times as large as all that is smaller get the curvature form: in f32 the
/// ordinary one would place their surface only to 10⁻⁷ of the radius.
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
            Geometry::Sphere { center, radius } => spheres.push((radius, center, i)),
            Geometry::Plane { .. } | Geometry::HugeSphere { .. } => {}
        }
    }
    spheres.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (radius, center, i) in spheres {
        let distance = center.length();
        if radius > 50.0 * extent && distance > 0.5 * radius {
            // The surface point nearest the origin lies on the line through the centre.
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
