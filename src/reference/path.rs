//! The path loop.
//!
//! Vertices are numbered from 1, the first thing the eye sees. Light found at vertex k has been scattered k - 1
//! times; light sampled at vertex k is found at a vertex k + 1.

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

/// The first vertex at which a path may be ended by chance: short paths are cheap, and roulette adds noise.
const FIRST_ROULETTE: u32 = 5;

/// The most likely that a path survives roulette: light caught between perfect reflectors ends, too.
const MOST_LIKELY: f64 = 0.999;

/// What one path has brought.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Traced {
    /// An unbiased estimate of the radiance that arrives against the ray.
    pub radiance: DVec3,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Whether the path was cut at the depth limit.
    pub truncated: bool,
}

/// How a path goes on from a surface.
struct Scattered {
    direction: DVec3,
    /// f cos θ/pdf, or what stands for it where f is a delta function.
    weight: DVec3,
    /// Density per solid angle; `None` for a delta function.
    pdf: Option<f64>,
    /// The solid it goes on in.
    medium: u32,
    /// (n on the eye's side / n beyond)² of the boundary crossed, 1 if none is.
    index_ratio: f64,
}

/// Where the ray under way was chosen with a density that light sampling could have had as well.
struct Chosen {
    point: DVec3,
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
        // Radiance over n² is what stays constant; roulette must not see the factor.
        let mut index_ratio = 1.0;
        let mut chosen: Option<Chosen> = None;
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
            let only_lights_count =
                self.settings.integrator == Integrator::Whitted && chosen.is_some();
            if only_lights_count || !self.wants_more(vertex) {
                break;
            }

            // Light sampled from here.
            if self.estimator == Estimator::LightSampling
                && vertex < self.settings.max_depth
                && self.keeps(vertex)
            {
                let direct = self.light_samples(primitive, &hit, &ray, rng, &mut traced.rays);
                traced.radiance += throughput * index_ratio * direct;
            }

            // The way on.
            let Some(scattered) = self.scatter(primitive, &hit, &ray, [u[0], u[1], u[2]]) else {
                break;
            };
            throughput *= scattered.weight;
            index_ratio *= scattered.index_ratio;
            let survival = if vertex < FIRST_ROULETTE {
                1.0
            } else {
                throughput.max_element().min(MOST_LIKELY)
            };
            if throughput == DVec3::ZERO || u[3] >= survival {
                break;
            }
            throughput /= survival;
            if vertex == self.settings.max_depth {
                traced.truncated = true;
            }
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

    /// Whether the picture keeps light that has been scattered `times` times.
    fn keeps(&self, times: u32) -> bool {
        self.settings.light.keeps(times)
    }

    /// Whether any light found beyond vertex `vertex` is kept.
    fn wants_more(&self, vertex: u32) -> bool {
        self.settings.light.indirect || self.keeps(vertex)
    }

    /// Radiance that `settings.shadow_rays` light samples say leaves `hit` against `ray`.
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
            let Some((f, material_pdf)) = evaluate(material, hit.normal, wo, wi) else {
                break;
            };
            if f == DVec3::ZERO {
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
            sum += f * (hit.normal.dot(wi) * weight / density) * lights[index].emitted;
        }
        sum
    }

    /// Weight of light `index` met by chance, in `direction`, given that light sampling looks for it as well.
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

    /// Samples the material at `hit`; `None` when the path ends there.
    fn scatter(
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
                let direction = diffuse::sample(hit.normal, [u[0], u[1]]);
                let pdf = diffuse::pdf(hit.normal, direction);
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
                let (direction, weight, pdf) = phong.sample(hit.normal, -ray.direction, u)?;
                Some(Scattered {
                    direction,
                    weight,
                    pdf: Some(pdf),
                    ..same_side
                })
            }
            Bsdf::Mirror { reflectance } => Some(Scattered {
                direction: mirror::reflect(ray.direction, hit.normal),
                weight: reflectance,
                ..same_side
            }),
            Bsdf::Dielectric { ior, transmittance } => {
                let Boundary { eta, beyond } = Boundary::new(primitive, ior, ray.medium);
                let (direction, crossed) = dielectric::sample(ray.direction, hit.normal, eta, u[0]);
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

/// f from `wi` into `wo` and the density with which the material samples `wi`; `None` for delta functions.
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

/// Veach's power heuristic: the weight of a sample whose strategy has density `own`, `other` being that of the
/// strategy which could have found it too. `own` > 0.
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
