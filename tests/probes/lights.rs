//! Points of disk lights: where they lie, with which density, and one of two by what a lobe scatters.

use super::{Numbers, probe, probe_with, vector};
use etendue::gpu::probe::{Uniform, Values};
use etendue::kernel::ProbeFeatures;
use etendue::reference::light;
use etendue::world::WorldLight;
use glam::DVec3;

fn test_light() -> WorldLight {
    let normal = DVec3::new(0.3, -0.9, 0.2).normalize();
    let center = DVec3::new(0.1, 1.2, -0.3);
    WorldLight {
        center,
        normal,
        offset: normal.dot(center),
        radius: 0.4,
        radiance: DVec3::ONE,
        emitted: DVec3::ONE,
        face: 0,
        medium: Some(0),
        line: 0,
    }
}

fn light_text() -> String {
    let l = test_light();
    format!(
        "let light = DiskLight(vec3f({:?}, {:?}, {:?}), {:?}, vec3f({:?}, {:?}, {:?}), {:?}, vec3f(1.0), 0u);\n",
        l.center.x, l.center.y, l.center.z, l.radius, l.normal.x, l.normal.y, l.normal.z, l.offset
    )
}

#[test]
fn cap_samples_lie_on_the_disk_with_the_density_they_state() {
    let mut r = Numbers(Uniform(5));
    let l = test_light();
    let inputs: Vec<Values> = (0..100_000)
        .map(|_| {
            let mut x = [0.0; 16];
            let p = l.center
                + l.normal * f64::from(10f32.powf(r.between(-3.0, 1.0)))
                + r.direction() * f64::from(r.between(0.0, 2.0));
            for k in 0..3 {
                x[k] = p[k] as f32;
            }
            (x[3], x[4]) = (r.next(), r.next());
            x
        })
        .collect();
    let body = format!(
        "{} let p = vec3f(x[0], x[1], x[2]); let cap = cap_of(light, p); let s = sample_cap(light, cap, vec2f(x[3], x[4]));
         y[0] = select(0.0, 1.0 / s.inverse_pdf, s.inverse_pdf > 0.0); y[1] = s.distance; y[2] = s.d.x; y[3] = s.d.y; y[4] = s.d.z; y[5] = cap_pdf(light, cap, s.d);",
        light_text()
    );
    let mut compared = 0;
    for (x, y) in inputs.iter().zip(probe(&body, &inputs)) {
        let (p, d) = (vector(x, 0), vector(&y, 2));
        let height = l.normal.dot(p) - l.offset;
        if height < 1e-4 {
            // In the light's plane or behind it: no sample. Within rounding of the plane either will do.
            assert!(height > -1e-6 || y[0] == 0.0, "{x:?} {y:?}");
            continue;
        }
        compared += 1;
        assert!((d.length() - 1.0).abs() < 1e-5);
        let hit = p + d * f64::from(y[1]) - l.center;
        let scale = p.distance(l.center) + l.radius;
        assert!(
            hit.dot(l.normal).abs() < 1e-5 * scale,
            "off the plane: {x:?} {y:?}"
        );
        assert!(
            hit.length() < l.radius + 1e-5 * scale,
            "off the disk: {x:?} {y:?}"
        );
        let twin = light::pdf(&l, p, d.normalize());
        // Low over the plane the density turns quickly with the direction.
        let tolerance = 1e-3 + 1e-5 * scale / height;
        assert!(
            (f64::from(y[0]) / twin - 1.0).abs() < tolerance,
            "{x:?}: {} instead of {twin}",
            y[0]
        );
        assert!(
            (f64::from(y[5]) / twin - 1.0).abs() < tolerance,
            "{x:?}: {} for {twin}",
            y[5]
        );
    }
    assert!(compared > 50_000);
}

/// Over a grid of random numbers, sums of light that the cap's own samples and the suited ones make: whole, seen by a lobe, and in
/// a direction.
#[test]
fn suited_samples_make_the_integrals_of_all_samples() {
    const CELLS: usize = 24;
    let mut r = Numbers(Uniform(21));
    let l = test_light();
    let n = l.normal;
    let places: Vec<Values> = (0..60)
        .map(|i| {
            let mut x = [0.0; 16];
            let aside = r.direction();
            let p = l.center + n * f64::from(r.between(0.1, 2.0)) + aside * 0.08;
            // A receiver that faces the light, more or less, and mirrors the eye anywhere.
            let normal = (r.direction() * 0.9 - n).normalize();
            let mirrored = (r.direction() * f64::from(r.between(0.0, 1.0)) - n).normalize();
            for k in 0..3 {
                (x[k], x[3 + k], x[6 + k]) = (p[k] as f32, normal[k] as f32, mirrored[k] as f32);
            }
            let exponent = 10f32.powf(r.between(0.0, 2.0));
            x[9] = [0.2, 0.5, 1.0][i % 3];
            (x[10], x[11]) = ((1.0 - x[9]) * (0.5 * exponent + 1.0), 0.125 * exponent);
            x
        })
        .collect();
    let mut inputs: Vec<Values> = Vec::new();
    for place in &places {
        for cell in 0..CELLS * CELLS {
            let mut x = *place;
            [x[12], x[13]] = [cell / CELLS, cell % CELLS].map(|i| (i as f32 + 0.5) / CELLS as f32);
            x[14] = r.next();
            inputs.push(x);
        }
    }
    let body = format!(
        "{} let p = vec3f(x[0], x[1], x[2]); let cap = cap_of(light, p); let u = vec2f(x[12], x[13]);
         let at = Receiver(vec3f(x[3], x[4], x[5]), vec3f(x[6], x[7], x[8]), x[9], x[10], x[11]);
         let plain = sample_cap(light, cap, u);
         let f = vec3f(1.0, scattered(at, plain.d, 1.0, 0.0), plain.distance) * fmax(dot(at.n, plain.d), 0.0) * plain.inverse_pdf;
         var g = vec3f(0.0);
         var second = 0.0;
         for (var i = 0u; i < 64u; i++) {{
             let s = sample_light(light, cap, at, u, (f32(i) + x[14]) / 64.0);
             g += vec3f(1.0, scattered(at, s.d, 1.0, 0.0), s.distance) * fmax(dot(at.n, s.d), 0.0) * (s.inverse_pdf * s.worth / 64.0);
             second += select(0.0, 1.0, dot(s.d, plain.d) < 0.999999);
         }}
         y[0] = f.x; y[1] = f.y; y[2] = f.z; y[3] = g.x; y[4] = g.y; y[5] = g.z; y[6] = second;",
        light_text()
    );
    let glossy = ProbeFeatures {
        glossy: true,
        ..ProbeFeatures::default()
    };
    let out = probe_with(&glossy, &body, &inputs);
    let mut others = 0.0;
    for (place, cells) in places.iter().zip(out.chunks(CELLS * CELLS)) {
        let sum = |k: usize| -> f64 { cells.iter().map(|y| f64::from(y[k])).sum() };
        others += sum(6);
        for k in 0..3 {
            let (plain, suited) = (sum(k), sum(3 + k));
            // 64 choices in each of 576 cells: their own noise is a few thousandths, and a factor of 0.51 for 0.5 is 2 %.
            assert!(
                (suited / plain - 1.0).abs() < 0.01,
                "integral {k} at {place:?}: {suited} instead of {plain}"
            );
        }
    }
    let share = others / (inputs.len() * 64) as f64;
    assert!(
        (0.3..0.7).contains(&share),
        "the second point in {share} of all"
    );
}
