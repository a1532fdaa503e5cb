//! The path loop.
//!
//! Vertices are numbered from 1, the first thing that the eye sees. Light found at vertex k has been scattered k - 1 times. Light
//! sampled from vertex k counts as found at vertex k + 1.

use super::phong::Phong;
use super::sampler::{Sampler, stratum};
use super::tracer::Tracer;
use super::{Estimator, diffuse, light};
use crate::scene::Bsdf;
use crate::settings::Integrator;
use crate::world::WorldPrimitive;
use crate::world::trace::dielectric::{self, Boundary};
use crate::world::trace::{Hit, Met, Ray, camera_ray, mirror};
use glam::DVec3;

/// The first vertex at which roulette may end a path. Short paths are cheap, and roulette adds noise.
const FIRST_ROULETTE: u32 = 5;

/// The largest probability that a path survives roulette. Light between perfect reflectors ends too.
const MAX_SURVIVAL: f64 = 0.999;

/// The result of one path.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Traced {
    /// An unbiased estimate of the radiance that arrives at the start of the ray, against its direction.
    pub radiance: DVec3,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Whether the path was cut at the depth limit.
    pub truncated: bool,
    /// Whether it met a surface after it had scattered into more than one direction.
    pub further: bool,
}

/// How a path continues from a surface.
struct Scattered {
    direction: DVec3,
    /// f cos θ/pdf, or the factor of the delta function.
    weight: DVec3,
    /// Density per solid angle; `None` for a delta function.
    pdf: Option<f64>,
    /// The medium that it continues in.
    medium: u32,
    /// (n on the eye's side / n beyond)² of the boundary that it crosses; 1 if it crosses none.
    index_ratio: f64,
}

/// Where the present ray started, if light sampling could have chosen its direction as well.
struct Chosen {
    point: DVec3,
    /// Density of its direction, per solid angle.
    pdf: f64,
}

impl Tracer {
    /// Sample number `sample` of pixel (x, y): a path through a random point of the sample's stratum.
    pub fn sample_pixel(&self, [x, y]: [u32; 2], sample: u64) -> Traced {
        let settings = &self.settings;
        let pixel = u64::from(y) * u64::from(settings.size[0]) + u64::from(x);
        let cell = stratum(settings.seed, pixel, sample, settings.strata);
        let mut rng = Sampler::new(settings.seed, pixel, sample);
        let [u, v] = cell.map(|c| (f64::from(c) + rng.uniform()) / f64::from(settings.strata));
        let (film_x, film_y) = (f64::from(x) + u, f64::from(y) + v);
        let ray = camera_ray(&self.world.camera, settings.size, film_x, film_y);
        self.radiance(ray, &mut rng)
    }

    /// Follows one path that begins with `ray`.
    pub fn radiance(&self, mut ray: Ray, rng: &mut Sampler) -> Traced {
        let mut traced = Traced::default();
        let mut throughput = DVec3::ONE;
        // Radiance over n² is constant along a path. This factor is kept apart from the throughput, because roulette must not see it.
        let mut index_ratio = 1.0;
        let mut chosen: Option<Chosen> = None;
        let mut all_specular = true;
        for vertex in 1..=self.settings.max_depth {
            rng.start_vertex(vertex);
            let u = [(); 4].map(|()| rng.uniform());
            traced.rays += 1;
            let Some(hit) = self.world.intersect(&ray) else {
                break;
            };

            // A light ends the path.
            let primitive = match hit.met {
                Met::Primitive(index) => &self.world.primitives[index],
                Met::Light { index, front } => {
                    if front && self.keeps(vertex - 1) {
                        let weight = self.weight_of_chance(index, &chosen, ray.direction);
                        let emitted = self.world.lights[index].emitted;
                        traced.radiance += throughput * index_ratio * weight * emitted;
                    }
                    break;
                }
            };
            traced.further |= !all_specular;
            let only_lights_count =
                self.settings.integrator == Integrator::Whitted && chosen.is_some();
            if only_lights_count || !self.wants_more(vertex) {
                break;
            }

            // Sample lights.
            if self.estimator == Estimator::LightSampling
                && vertex < self.settings.max_depth
                && self.keeps(vertex)
            {
                let direct = self.light_samples(primitive, &hit, &ray, rng, &mut traced.rays);
                traced.radiance += throughput * index_ratio * direct;
            }

            // Choose the next direction.
            let Some(scattered) = self.scatter(primitive, &hit, &ray, [u[0], u[1], u[2]]) else {
                break;
            };
            throughput *= scattered.weight;
            index_ratio *= scattered.index_ratio;
            let survival = if vertex < FIRST_ROULETTE {
                1.0
            } else {
                throughput.max_element().min(MAX_SURVIVAL)
            };
            if throughput == DVec3::ZERO || u[3] >= survival {
                break;
            }
            throughput /= survival;
            if vertex == self.settings.max_depth {
                traced.truncated = true;
            }
            all_specular &= scattered.pdf.is_none();
            chosen = scattered.pdf.map(|pdf| Chosen {
                point: hit.point,
                pdf,
            });
            ray = Ray {
                origin: hit.point,
                direction: scattered.direction,
                medium: scattered.medium,
                face: hit.face,
            };
        }
        traced
    }

    /// Whether the picture includes light that has been scattered `times` times.
    fn keeps(&self, times: u32) -> bool {
        self.settings.light.keeps(times)
    }

    /// Whether the picture includes any light found beyond vertex `vertex`.
    fn wants_more(&self, vertex: u32) -> bool {
        self.settings.light.indirect || self.keeps(vertex)
    }

    /// An estimate, by `settings.shadow_rays` light samples, of the radiance that leaves `hit` against the direction of `ray`.
    fn light_samples(
        &self,
        primitive: &WorldPrimitive,
        hit: &Hit,
        ray: &Ray,
        rng: &mut Sampler,
        rays: &mut u64,
    ) -> DVec3 {
        let material = &self.world.materials[primitive.material];
        let wo = -ray.direction;
        let count = self.settings.shadow_rays;
        let mut sum = DVec3::ZERO;
        for k in 0..count {
            let u = [(); 3].map(|()| rng.uniform());
            let which = (f64::from(k) + u[0]) / f64::from(count);
            let lights = &self.world.lights;
            let Some((index, probability)) = light::choose(lights, hit.point, which) else {
                break;
            };
            let Some((wi, pdf)) = light::sample(&lights[index], hit.point, [u[1], u[2]]) else {
                continue;
            };
            let Some((f, material_pdf)) = evaluate(material, hit.shading, wo, wi) else {
                break;
            };
            if f == DVec3::ZERO || !hit.leads_to_side(wi, false) {
                continue;
            }
            let shadow = Ray {
                origin: hit.point,
                direction: wi,
                medium: ray.medium,
                face: hit.face,
            };
            *rays += 1;
            if self.world.occluded(&shadow, index) {
                continue;
            }
            let density = f64::from(count) * probability * pdf;
            let weight = power_heuristic(density, material_pdf);
            sum += f * (hit.shading.dot(wi) * weight / density) * lights[index].emitted;
        }
        sum
    }

    /// Weight of light `index`, which a ray in `direction` has met by chance, while light sampling looks for it as well.
    fn weight_of_chance(&self, index: usize, chosen: &Option<Chosen>, direction: DVec3) -> f64 {
        match chosen {
            Some(from) if self.estimator == Estimator::LightSampling => {
                let lights = &self.world.lights;
                let density = f64::from(self.settings.shadow_rays)
                    * light::choice_probability(lights, index, from.point)
                    * light::pdf(&lights[index], from.point, direction);
                power_heuristic(from.pdf, density)
            }
            _ => 1.0,
        }
    }

    /// Samples the material at `hit`. `None` if the path ends there.
    fn scatter(
        &self,
        primitive: &WorldPrimitive,
        hit: &Hit,
        ray: &Ray,
        u: [f64; 3],
    ) -> Option<Scattered> {
        let scattered = self.sample_material(primitive, hit, ray, u)?;
        let crosses = scattered.medium != ray.medium;
        let keeps_side = hit.leads_to_side(scattered.direction, crosses);
        keeps_side.then_some(scattered)
    }

    fn sample_material(
        &self,
        primitive: &WorldPrimitive,
        hit: &Hit,
        ray: &Ray,
        u: [f64; 3],
    ) -> Option<Scattered> {
        let same_side = Scattered {
            direction: ray.direction,
            weight: DVec3::ONE,
            pdf: None,
            medium: ray.medium,
            index_ratio: 1.0,
        };
        match self.world.materials[primitive.material] {
            Bsdf::Diffuse { reflectance } => {
                let direction = diffuse::sample(hit.shading, [u[0], u[1]]);
                let pdf = diffuse::pdf(hit.shading, direction);
                (pdf > 0.0).then_some(Scattered {
                    direction,
                    weight: reflectance,
                    pdf: Some(pdf),
                    ..same_side
                })
            }
            Bsdf::Phong {
                diffuse,
                specular,
                exponent,
            } => {
                let phong = Phong {
                    diffuse,
                    specular,
                    exponent,
                };
                let (direction, weight, pdf) = phong.sample(hit.shading, -ray.direction, u)?;
                Some(Scattered {
                    direction,
                    weight,
                    pdf: Some(pdf),
                    ..same_side
                })
            }
            Bsdf::Mirror { reflectance } => Some(Scattered {
                direction: mirror::reflect(ray.direction, hit.facing(ray.direction)),
                weight: reflectance,
                ..same_side
            }),
            Bsdf::Dielectric { ior, transmittance } => {
                let Boundary { eta, beyond } = Boundary::new(primitive, ior, ray.medium);
                let normal = hit.facing(ray.direction);
                let (direction, crossed) = dielectric::sample(ray.direction, normal, eta, u[0]);
                if !crossed {
                    return Some(Scattered {
                        direction,
                        ..same_side
                    });
                }
                Some(Scattered {
                    direction,
                    weight: transmittance,
                    pdf: None,
                    medium: beyond,
                    index_ratio: 1.0 / (eta * eta),
                })
            }
        }
    }
}

/// f from `wi` into `wo`, and the density with which the material samples `wi`. `None` for delta functions.
fn evaluate(material: &Bsdf, normal: DVec3, wo: DVec3, wi: DVec3) -> Option<(DVec3, f64)> {
    match *material {
        Bsdf::Diffuse { reflectance } => Some((
            diffuse::evaluate(reflectance, normal, wi),
            diffuse::pdf(normal, wi),
        )),
        Bsdf::Phong {
            diffuse,
            specular,
            exponent,
        } => {
            let phong = Phong {
                diffuse,
                specular,
                exponent,
            };
            Some((phong.evaluate(normal, wo, wi), phong.pdf(normal, wo, wi)))
        }
        Bsdf::Mirror { .. } | Bsdf::Dielectric { .. } => None,
    }
}

/// Veach's power heuristic: the weight of a sample that one strategy has found with density `own` > 0, and that the other strategy
/// would have found with density `other`.
fn power_heuristic(own: f64, other: f64) -> f64 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_both_strategies_add_up_to_one() {
        for (a, b) in [(1.0, 1.0), (1e-200, 3.0), (1e300, 1e-300), (2.0, 5.0)] {
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-15);
        }
        assert_eq!(power_heuristic(0.1, 0.0), 1.0);
        assert!((power_heuristic(1.0, 3.0) - 0.1).abs() < 1e-15);
    }
}
