//! Smooth boundaries of dielectrics: the unpolarised Fresnel equations and Snell's law.

use super::mirror::reflect;
use crate::world::WorldPrimitive;
use glam::DVec3;

/// What a boundary does with light at one angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fresnel {
    /// Fraction of the power that is transmitted, in 0..=1. The rest is reflected.
    pub transmittance: f64,
    /// Cosine of the angle between the refracted ray and the normal; 0 at and beyond the critical angle.
    pub cos_transmitted: f64,
}

/// The boundary of a dielectric solid, seen from the side that a ray comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boundary {
    /// Index of refraction beyond the boundary, divided by the index on the ray's side.
    pub eta: f64,
    /// The medium beyond.
    pub beyond: u32,
}

impl Boundary {
    /// The boundary of `solid`, whose index is `ior` times that of what surrounds it, for a ray in `medium`.
    pub fn new(solid: &WorldPrimitive, ior: f64, medium: u32) -> Self {
        if medium == solid.solid {
            Self {
                eta: 1.0 / ior,
                beyond: solid.parent,
            }
        } else {
            Self {
                eta: ior,
                beyond: solid.solid,
            }
        }
    }
}

/// Fresnel's equations. `cosine`, in 0..=1, is that of the angle of incidence. `eta` is the index beyond the boundary, divided by
/// the index on this side. The transmittance is computed directly, because near grazing incidence 1 - F would lose its digits.
pub fn fresnel(cosine: f64, eta: f64) -> Fresnel {
    // Snell: 1 - (1 - cos²)/eta².
    let cos2_transmitted = (eta * eta - 1.0 + cosine * cosine) / (eta * eta);
    if cos2_transmitted <= 0.0 {
        return Fresnel {
            transmittance: 0.0,
            cos_transmitted: 0.0,
        };
    }
    let ct = cos2_transmitted.sqrt();
    let across = 4.0 * cosine * eta * ct / (cosine + eta * ct).powi(2);
    let along = 4.0 * eta * cosine * ct / (eta * cosine + ct).powi(2);
    Fresnel {
        transmittance: (across + along) / 2.0,
        cos_transmitted: ct,
    }
}

/// The new direction of a ray that meets a boundary, and whether it has crossed the boundary. `normal` points to the side that the
/// ray comes from. The ray crosses if `u`, in 0..=1, is below the transmittance. With a random `u` the weight of either way is 1.
pub fn sample(direction: DVec3, normal: DVec3, eta: f64, u: f64) -> (DVec3, bool) {
    let cosine = (-normal.dot(direction)).clamp(0.0, 1.0);
    let fresnel = fresnel(cosine, eta);
    if u < fresnel.transmittance {
        let refracted = direction / eta + normal * (cosine / eta - fresnel.cos_transmitted);
        (refracted.normalize(), true)
    } else {
        (reflect(direction, normal), false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: f64 = 1.52;

    fn reflectance(degrees: f64, eta: f64) -> f64 {
        1.0 - fresnel(degrees.to_radians().cos(), eta).transmittance
    }

    /// Fresnel's sine and tangent laws, another form of the same equations.
    fn by_angles(degrees: f64, eta: f64) -> f64 {
        let i = degrees.to_radians();
        let t = (i.sin() / eta).asin();
        let s = ((i - t).sin() / (i + t).sin()).powi(2);
        let p = ((i - t).tan() / (i + t).tan()).powi(2);
        (s + p) / 2.0
    }

    #[test]
    fn normal_incidence() {
        for eta in [GLASS, 1.0 / GLASS] {
            assert!((reflectance(0.0, eta) - 0.042_580_0).abs() < 1e-7);
        }
    }

    #[test]
    fn all_angles_agree_with_the_sine_and_tangent_laws() {
        for degrees in [1.0, 10.0, 30.0, 45.0, 56.0, 70.0, 85.0, 89.0] {
            let (a, b) = (reflectance(degrees, GLASS), by_angles(degrees, GLASS));
            assert!((a - b).abs() < 1e-12, "{degrees}: {a} {b}");
        }
        for degrees in [1.0, 20.0, 33.0, 40.0, 41.0] {
            let (a, b) = (
                reflectance(degrees, 1.0 / GLASS),
                by_angles(degrees, 1.0 / GLASS),
            );
            assert!((a - b).abs() < 1e-12, "{degrees}: {a} {b}");
        }
    }

    #[test]
    fn at_brewster_s_angle_only_light_polarised_across_is_reflected() {
        let brewster = GLASS.atan();
        assert!((brewster.to_degrees() - 56.6593).abs() < 1e-4);
        let s = ((GLASS * GLASS - 1.0) / (GLASS * GLASS + 1.0)).powi(2);
        assert!((reflectance(brewster.to_degrees(), GLASS) - s / 2.0).abs() < 1e-14);
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let critical = (1.0 / GLASS).asin();
        assert!((critical.to_degrees() - 41.1395).abs() < 1e-4);
        let beyond = fresnel((critical + 1e-6).cos(), 1.0 / GLASS);
        assert_eq!(beyond.transmittance, 0.0);
        let before = fresnel((critical - 1e-6).cos(), 1.0 / GLASS);
        // T goes as the square root of the distance: cos θt = √(2·10⁻⁶ cot θc).
        assert!((before.cos_transmitted - (2e-6 / critical.tan()).sqrt()).abs() < 1e-6);
        assert!(before.transmittance > 0.0 && before.transmittance < 0.02);
    }

    #[test]
    fn grazing_light_is_transmitted_in_proportion_to_its_cosine() {
        let t = fresnel(1e-6, GLASS).transmittance;
        assert!((t / 5.784e-6 - 1.0).abs() < 1e-3, "{t}");
        assert_eq!(fresnel(0.0, GLASS).transmittance, 0.0);
        assert_eq!(fresnel(0.0, 1.0).transmittance, 0.0);
        assert_eq!(fresnel(0.3, 1.0).transmittance, 1.0, "no boundary at all");
    }

    #[test]
    fn both_sides_transmit_alike() {
        for cosine in [0.05, 0.3, 0.7, 0.99] {
            let out = fresnel(cosine, GLASS);
            let back = fresnel(out.cos_transmitted, 1.0 / GLASS);
            assert!((out.transmittance - back.transmittance).abs() < 1e-13);
            assert!((back.cos_transmitted - cosine).abs() < 1e-13);
        }
    }

    #[test]
    fn refracted_rays_obey_snell_s_law_and_cross() {
        let normal = DVec3::new(0.0, 0.6, 0.8);
        for eta in [GLASS, 1.0 / GLASS] {
            let d = (DVec3::new(0.3, -0.2, 0.1) - normal).normalize();
            let (t, crossed) = sample(d, normal, eta, 0.0);
            assert!(crossed && t.dot(normal) < 0.0);
            assert!((t.cross(normal) * eta - d.cross(normal)).length() < 1e-14);
            let (r, crossed) = sample(d, normal, eta, 1.0 - 1e-9);
            assert!(!crossed && (r - reflect(d, normal)).length() < 1e-15);
        }
    }
}
