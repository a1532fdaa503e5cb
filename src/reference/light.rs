//! Disk lights: choosing one, and sampling directions to it.
//!
//! Take the sphere through the light's rim and the shading point. Seen from the point, the disk covers exactly a cap of that
//! sphere, of height H. By the theorem of the inscribed angle, points spread evenly over the cap give directions that are
//! cosine-distributed about the sphere's normal at the shading point. So the density has no spike, neither near the light nor near
//! its rim.

use super::frame::Frame;
use crate::world::WorldLight;
use glam::DVec3;
use std::f64::consts::PI;

/// A light seen from a point.
struct View {
    /// Height of the point over the light's plane, > 0.
    h: f64,
    /// The part of (point - centre) that lies in the light's plane. Its length is a, the distance from the axis.
    along: DVec3,
    /// a² + h² - r². It is positive outside the sphere that has the light's rim as a great circle.
    s: f64,
    /// Height of the cap, > 0.
    cap: f64,
}

/// `None` on and behind the light's plane, where its front is not seen.
fn view(light: &WorldLight, point: DVec3) -> Option<View> {
    let h = light.normal.dot(point) - light.offset;
    if h <= 0.0 {
        return None;
    }
    let r = light.radius;
    let along = point - light.center - light.normal * light.normal.dot(point - light.center);
    let s = along.length_squared() + h * h - r * r;
    let q = s.hypot(2.0 * h * r);
    let cap = if s > 0.0 {
        2.0 * h * r * r / (q + s)
    } else {
        (q - s) / (2.0 * h)
    };
    Some(View { h, along, s, cap })
}

/// How much a light may matter at `point`, in no particular unit: its radiance times about the solid angle that it would have if it
/// faced the point. It is 0 only where the front cannot be seen, or for a dark light.
fn importance(light: &WorldLight, point: DVec3) -> f64 {
    if light.normal.dot(point) - light.offset <= 0.0 {
        return 0.0;
    }
    let r2 = light.radius * light.radius;
    light.emitted.element_sum() * r2 / (r2 + point.distance_squared(light.center))
}

fn total_importance(lights: &[WorldLight], point: DVec3) -> f64 {
    lights.iter().map(|l| importance(l, point)).sum()
}

/// The light that `u` in [0, 1) chooses, and the probability of that choice. `None` where no light can be seen.
pub fn choose(lights: &[WorldLight], point: DVec3, u: f64) -> Option<(usize, f64)> {
    let total = total_importance(lights, point);
    let mut chosen = None;
    let mut rest = u * total;
    for (i, light) in lights.iter().enumerate() {
        let share = importance(light, point);
        if share > 0.0 {
            chosen = Some((i, share / total));
            rest -= share;
            if rest < 0.0 {
                break;
            }
        }
    }
    chosen
}

/// Probability that [`choose`] takes light `index`.
pub fn choice_probability(lights: &[WorldLight], index: usize, point: DVec3) -> f64 {
    let share = importance(&lights[index], point);
    if share == 0.0 {
        0.0
    } else {
        share / total_importance(lights, point)
    }
}

/// A direction from `point` to the light, and its density per solid angle. `None` where the light is not seen.
pub fn sample(light: &WorldLight, point: DVec3, u: [f64; 2]) -> Option<(DVec3, f64)> {
    let view = view(light, point)?;
    let r = light.radius;
    let rho = (u[0] * r * r + u[0] * (1.0 - u[0]) * view.cap * view.cap).sqrt();
    let (sin_phi, cos_phi) = (2.0 * PI * u[1]).sin_cos();
    // The cap is symmetric about the light's axis, so any frame will do. `along` would not do for one: on the axis it is rounding
    // noise.
    let on_cap = DVec3::new(rho * cos_phi, rho * sin_phi, -(1.0 - u[0]) * view.cap);
    let to = Frame::around(light.normal).to_world(on_cap) - view.along - light.normal * view.h;
    let length = to.length();
    let direction = to / length;
    let pdf = length / (PI * view.cap);
    (direction.is_finite() && pdf.is_finite() && pdf > 0.0).then_some((direction, pdf))
}

/// Density per solid angle with which [`sample`] takes `direction`, which meets the front of the light.
pub fn pdf(light: &WorldLight, point: DVec3, direction: DVec3) -> f64 {
    let Some(view) = view(light, point) else {
        return 0.0;
    };
    // The sphere's centre lies at height s/2h. The chord is twice the projection of the way there on the direction.
    let to_centre = light.normal * (view.s / (2.0 * view.h) - view.h) - view.along;
    let pdf = 2.0 * to_centre.dot(direction) / (PI * view.cap);
    if pdf.is_finite() { pdf.max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::chi_square::{assert_agrees, mean_and_error};
    use crate::reference::radiosity::form_factor;
    use crate::reference::sampler::Sampler;
    use crate::world::trace::{Ray, disk};

    fn light(center: DVec3, normal: DVec3, radius: f64, emitted: f64) -> WorldLight {
        WorldLight {
            center,
            normal,
            offset: normal.dot(center),
            radius,
            radiance: DVec3::splat(emitted),
            emitted: DVec3::splat(emitted),
            face: 1,
            medium: Some(0),
            line: 0,
        }
    }

    fn unit_light() -> WorldLight {
        light(DVec3::ZERO, -DVec3::Y, 1.0, 1.0)
    }

    fn hits(light: &WorldLight, point: DVec3, direction: DVec3) -> bool {
        let ray = Ray {
            origin: point,
            direction,
            medium: 0,
            face: 0,
        };
        let (c, n, o, r) = (light.center, light.normal, light.offset, light.radius);
        disk::intersect(c, n, o, r, light.face, &ray).is_some()
    }

    #[test]
    fn closed_forms_have_the_tabulated_values() {
        // These values were checked against quadrature.
        for (a, h, expected) in [
            (0.5, 1.0, 0.437983),
            (2.0, 1.0, 0.0527864),
            (1.0, 0.2, 0.450248),
        ] {
            assert!((form_factor::disk(a, h, 1.0)[0] - expected).abs() < 1e-6);
        }
        assert!((form_factor::disk(2.0, 1.0, 1.0)[1] - 0.0854102).abs() < 1e-7);
        assert!((form_factor::disk(3.0, 0.5, 0.7)[1] - 0.00902827).abs() < 1e-8);
    }

    #[test]
    fn sampled_irradiance_is_the_closed_form() {
        let light = unit_light();
        // The light has radius 1. The last point is a ten-thousandth of the radius under it.
        for (a, h) in [
            (0.5, 1.0),
            (2.0, 1.0),
            (1.0, 0.2),
            (0.0, 0.7),
            (30.0, 4.0),
            (0.3, 1e-4),
        ] {
            let point = DVec3::new(a, -h, 0.0);
            let expected = form_factor::disk(a, h, 1.0);
            for (receiver, expected) in [DVec3::Y, -DVec3::X].into_iter().zip(expected) {
                let mut rng = Sampler::new(1, 0, 0);
                let (mean, error) = mean_and_error(20_000, || {
                    let (d, pdf) = sample(&light, point, [rng.uniform(), rng.uniform()]).unwrap();
                    // What is below the receiver's horizon counts as negative, because the closed form for a
                    // receiver that faces the axis knows no horizon.
                    d.dot(receiver) / (PI * pdf)
                });
                assert!(
                    (mean - expected).abs() <= 4.0 * error + 1e-12,
                    "({a}, {h}), {receiver}: {mean} ± {error}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn close_to_the_light_cap_samples_hardly_vary() {
        let light = unit_light();
        for (a, h, bound) in [(0.3, 1e-4, 0.01), (0.0, 1.0, 1e-20), (0.99, 0.01, 1.5)] {
            let mut rng = Sampler::new(1, 0, 0);
            let point = DVec3::new(a, -h, 0.0);
            let n = 20_000.0f64;
            let (mean, error) = mean_and_error(n as usize, || {
                let (d, pdf) = sample(&light, point, [rng.uniform(), rng.uniform()]).unwrap();
                d.y / (PI * pdf)
            });
            let relative_variance = n * (error / mean).powi(2);
            assert!(relative_variance < bound, "({a}, {h}): {relative_variance}");
        }
    }

    #[test]
    fn samples_hit_the_disk_with_the_density_stated() {
        let normal = DVec3::new(0.3, -0.8, 0.2).normalize();
        let center = DVec3::new(1.0, 2.0, -0.5);
        let light = light(center, normal, 0.7, 1.0);
        let x = Frame::around(normal).to_world(DVec3::X);
        for (a, h) in [(0.0, 0.5), (0.6, 0.1), (1.0, 0.6), (0.2, 2.0)] {
            let point = center + x * a + normal * h;
            let mut rng = Sampler::new(2, 0, 0);
            for _ in 0..2000 {
                let (d, p) = sample(&light, point, [rng.uniform(), rng.uniform()]).unwrap();
                assert!(hits(&light, point, d), "({a}, {h}) {d}");
                let stated = pdf(&light, point, d);
                assert!((p - stated).abs() < 1e-9 * p, "({a}, {h}): {p} {stated}");
            }
            assert_spread_over_the_disk(&light, point);
        }
    }

    /// χ² over bins of the disk, where the density has no edges: per area it is pdf cos θ/distance².
    fn assert_spread_over_the_disk(light: &WorldLight, point: DVec3) {
        const BINS: usize = 12;
        const CELLS: usize = 40;
        let count = 200_000;
        let frame = Frame::around(light.normal);
        let mut rng = Sampler::new(5, 0, 0);
        let mut observed = vec![0.0; BINS * BINS];
        for _ in 0..count {
            let (d, _) = sample(light, point, [rng.uniform(), rng.uniform()]).unwrap();
            let t = (light.offset - light.normal.dot(point)) / light.normal.dot(d);
            let y = frame.to_local(point + d * t - light.center) / light.radius;
            let ring = y.length_squared() * BINS as f64;
            let sector = (y.y.atan2(y.x) / (2.0 * PI) + 0.5) * BINS as f64;
            observed[(ring as usize).min(BINS - 1) * BINS + (sector as usize).min(BINS - 1)] += 1.0;
        }
        let mut expected = vec![0.0; BINS * BINS];
        let n = BINS * CELLS;
        for i in 0..n {
            for j in 0..n {
                let rho = light.radius * ((i as f64 + 0.5) / n as f64).sqrt();
                let (sin, cos) = (2.0 * PI * ((j as f64 + 0.5) / n as f64 - 0.5)).sin_cos();
                let y = light.center + frame.to_world(DVec3::new(rho * cos, rho * sin, 0.0));
                let d = (y - point).normalize();
                let per_area =
                    pdf(light, point, d) * light.normal.dot(d).abs() / point.distance_squared(y);
                let area = PI * light.radius * light.radius / (n * n) as f64;
                expected[i / CELLS * BINS + j / CELLS] += f64::from(count) * per_area * area;
            }
        }
        let total: f64 = expected.iter().sum();
        assert!(
            (total / f64::from(count) - 1.0).abs() < 1e-3,
            "{total} of {count}"
        );
        assert_agrees("cap", &observed, &expected);
    }

    #[test]
    fn end_points_of_the_sampler_are_finite() {
        let light = unit_light();
        let ends = [
            0.0,
            (-24f64).exp2(),
            1.0 - (-24f64).exp2(),
            1.0 - (-53f64).exp2(),
        ];
        for h in [1e-300, 1e-9, 1.0, 1e9] {
            for a in [0.0, 0.5, 1.0, 1e9] {
                for u in ends {
                    for v in ends {
                        if let Some((d, p)) = sample(&light, DVec3::new(a, -h, 0.0), [u, v]) {
                            assert!(
                                d.is_finite() && p > 0.0 && p.is_finite(),
                                "({a}, {h}) {u} {v}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_is_sampled_in_or_behind_the_light_s_plane() {
        let light = unit_light();
        for y in [0.0, 1e-9, 3.0] {
            let point = DVec3::new(0.2, y, 0.0);
            assert_eq!(sample(&light, point, [0.5, 0.5]), None);
            assert_eq!(choose(&[light], point, 0.5), None);
            assert_eq!(pdf(&light, point, -DVec3::Y), 0.0);
        }
    }

    #[test]
    fn lights_are_chosen_as_often_as_stated() {
        let lights = [
            light(DVec3::new(0.0, 3.0, 0.0), -DVec3::Y, 0.5, 4.0),
            light(DVec3::new(0.0, -3.0, 0.0), -DVec3::Y, 0.5, 100.0),
            light(DVec3::new(4.0, 1.0, 0.0), -DVec3::X, 1.5, 1.0),
            light(DVec3::new(4.0, 1.0, 2.0), -DVec3::X, 1.5, 0.0),
        ];
        let point = DVec3::new(0.5, 0.0, 0.3);
        let mut rng = Sampler::new(3, 0, 0);
        let mut counts = [0.0; 4];
        let n = 100_000;
        for _ in 0..n {
            let (i, p) = choose(&lights, point, rng.uniform()).unwrap();
            assert_eq!(p, choice_probability(&lights, i, point));
            counts[i] += 1.0;
        }
        let expected: Vec<f64> = (0..4)
            .map(|i| f64::from(n) * choice_probability(&lights, i, point))
            .collect();
        assert_eq!(expected[1], 0.0, "faces away");
        assert_eq!(expected[3], 0.0, "dark");
        // Two outcomes are left: a χ² of one degree of freedom is a z-test; 4.5 standard errors.
        let sigma = (expected[0] * expected[2] / f64::from(n)).sqrt();
        assert!(
            (counts[0] - expected[0]).abs() < 4.5 * sigma,
            "{counts:?} {expected:?}"
        );
    }
}
