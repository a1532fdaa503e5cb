//! Where a mirror ball shows a light.

use super::{Numbers, probe_with, vector};
use etendue::gpu::probe::{Uniform, Values};
use etendue::kernel::ProbeFeatures;
use glam::DVec3;
use std::f64::consts::PI;

/// A point of a light is found where a mirror ball shows it, and the density is the inverse of how the image grows: both
/// against a ray in f64 that is reflected, and its neighbours.
#[test]
fn images_in_mirror_balls() {
    let mut r = Numbers(Uniform(11));
    let inputs: Vec<Values> = (0..200_000)
        .map(|_| {
            let mut x = [0.0; 16];
            let away = |r: &mut Numbers, least: f32, most: f32| {
                let distance = 1.0 + least * (most / least).powf(r.next());
                (r.direction() * f64::from(distance)).as_vec3().to_array()
            };
            x[0..3].copy_from_slice(&away(&mut r, 1e-4, 1e3));
            let light = away(&mut r, 1e-1, 1e3);
            x[3..6].copy_from_slice(&light);
            x[6..9].copy_from_slice(&r.direction().as_vec3().to_array());
            let distance = DVec3::from(light.map(f64::from)).length() - 1.0;
            x[9] = r.between(0.05, 0.5) * distance as f32;
            (x[10], x[11]) = (r.next(), r.next());
            x
        })
        .collect();
    // A ball of radius 2, so that its radius is not the unit.
    let body = "
        let light = DiskLight(2.0 * vec3f(x[3], x[4], x[5]), 2.0 * x[9], vec3f(x[6], x[7], x[8]), 0.0, vec3f(1.0), 1u);
        let image = sample_image(2.0 * vec3f(x[0], x[1], x[2]), Sphere(vec3f(0.0), 2.0), light, vec2f(x[10], x[11]));
        y[0] = image.inverse_pdf;
        y[1] = image.d.x;
        y[2] = image.d.y;
        y[3] = image.d.z;";
    // Where a ray from `o` is reflected to in the light's plane, and at which cosines.
    let reflected = |o: DVec3, d: DVec3, center: DVec3, normal: DVec3| {
        let b = -o.dot(d);
        let across = o + d * b;
        let t = b - (1.0 - across.length_squared()).sqrt();
        let m = (o + d * t).normalize();
        let cos = -d.dot(m);
        let out = d + 2.0 * cos * m;
        let cos_light = out.dot(normal);
        (
            m + out * ((center - m).dot(normal) / cos_light),
            cos,
            cos_light.abs(),
        )
    };
    let features = ProbeFeatures {
        images: true,
        ..ProbeFeatures::default()
    };
    let mut found = 0;
    for (x, y) in inputs.iter().zip(probe_with(&features, body, &inputs)) {
        assert!(y[0].is_finite() && y[0] >= 0.0, "{x:?} {y:?}");
        let (o, d) = (vector(x, 0), vector(&y, 1).normalize());
        let (center, normal, radius) = (vector(x, 3), vector(x, 6), f64::from(x[9]));
        let (place, cos, cos_light) = reflected(o, d, center, normal);
        if y[0] == 0.0 || cos < 0.25 || cos.is_nan() {
            continue;
        }
        found += 1;
        // What rounds: the direction, which matters the more the farther away the ball is, and the place on the ball, which
        // does the nearer it is; seen from the side, a light magnifies both.
        let (before, after) = (o.length() - 1.0, (place - d).length());
        let slack =
            1e-6 * (1.0 + before) * (1.0 + before.recip()) * (1.0 + after) / (cos * cos_light);
        let off = place.distance(center);
        assert!(
            off <= radius * 1.0011 + slack,
            "{off} {radius} {slack}: {x:?}"
        );
        let step = 1e-5 * cos / (1.0 + before);
        let (e, f) = d.any_orthonormal_pair();
        let area = [e, f].map(|e| {
            let at = |s: f64| reflected(o, (d + e * (s * step)).normalize(), center, normal).0;
            (at(1.0) - at(-1.0)) / (2.0 * step)
        });
        let density = area[0].cross(area[1]).length() / (PI * (radius * 1.001).powi(2));
        let ratio = density * f64::from(y[0]);
        assert!(
            (ratio - 1.0).abs() < 2e-3 + 20.0 * slack,
            "{ratio} {slack}: {x:?}"
        );
    }
    assert!(found > 50_000, "{found}");
}
