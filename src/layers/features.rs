//! Features for denoisers: what is seen in each pixel, through mirrors and glass too, and how much light comes straight from lamps.
//!
//! At glass a ray goes both ways, weighted by Fresnel's equations. Nothing is random, so features have no noise, and are the same for
//! all replicates of a film.

use super::{SIDE, View, albedo};
use crate::film::coverage::Rect;
use crate::scene::Bsdf;
use crate::stats::luminance;
use crate::world::trace::dielectric::{Boundary, fresnel};
use crate::world::trace::{Finder, Met, Ray};
use glam::DVec3;
use rayon::prelude::*;

/// Branches that show less than this are left out.
const FAINT: f64 = 0.01;

/// Mirrors and glass behind each other.
const DEEPEST: u32 = 24;

/// The features of the pixels of a rectangle, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// The share of light that what is seen gives back, 0 to 1; of lamps 1.
    pub albedo: Vec<[f32; 3]>,
    /// Its normal in the scene's axes, on the side that is seen; 0 where nothing is.
    pub normal: Vec<[f32; 3]>,
    /// Luminance of the light that comes from lamps without being scattered.
    pub lamps: Vec<f32>,
}

#[derive(Default, Clone, Copy)]
struct Seen {
    albedo: DVec3,
    normal: DVec3,
    lamp: f64,
}

impl Features {
    /// Those of `bounds`. `done` hears how many rows are done.
    pub fn new(view: &View, bounds: Rect, mut done: impl FnMut(u32)) -> Self {
        /// Rows between two words of progress.
        const BAND: u32 = 32;
        let finder = Finder::new(&view.world);
        let count = bounds.area() as usize;
        let mut out = Self {
            albedo: Vec::with_capacity(count),
            normal: Vec::with_capacity(count),
            lamps: Vec::with_capacity(count),
        };
        let mut y = bounds.y0;
        while y < bounds.y1 {
            let end = bounds.y1.min(y + BAND);
            let band: Vec<Seen> = (y..end)
                .into_par_iter()
                .flat_map_iter(|y| (bounds.x0..bounds.x1).map(move |x| [x, y]))
                .map(|place| pixel(view, &finder, place))
                .collect();
            for seen in band {
                out.albedo.push(seen.albedo.as_vec3().to_array());
                out.normal.push(seen.normal.as_vec3().to_array());
                out.lamps.push(seen.lamp as f32);
            }
            y = end;
            done(y - bounds.y0);
        }
        out
    }
}

fn pixel(view: &View, finder: &Finder, place: [u32; 2]) -> Seen {
    let mut seen = Seen::default();
    for k in 0..SIDE * SIDE {
        follow(view, finder, view.ray(place, k), &mut seen);
    }
    let share = 1.0 / f64::from(SIDE * SIDE);
    Seen {
        albedo: (seen.albedo * share).clamp(DVec3::ZERO, DVec3::ONE),
        normal: seen.normal * share,
        lamp: seen.lamp * share,
    }
}

/// Adds what a ray shows, by way of all mirrors and glass.
fn follow(view: &View, finder: &Finder, ray: Ray, seen: &mut Seen) {
    let world = &view.world;
    let mut open = vec![(ray, DVec3::ONE, 0)];
    while let Some((ray, weight, depth)) = open.pop() {
        let Some(hit) = finder.intersect(&ray) else {
            continue;
        };
        let mut branch = |weight: DVec3, reflects: bool| {
            if depth < DEEPEST && weight.max_element() > FAINT {
                let next = world.specular(&hit, &ray, reflects);
                open.extend(next.map(|ray| (ray, weight, depth + 1)));
            }
        };
        match (hit.met, view.bsdf(&hit)) {
            (Met::Light { index, front }, _) => {
                seen.albedo += weight;
                seen.normal += hit.shading * weight.max_element();
                if front && view.emitted {
                    let scales = world.light_scales.as_ref();
                    let scale = scales.map_or(1.0, |s| s[ray.medium as usize]);
                    let light = weight * view.light(index).radiance * scale;
                    seen.lamp += luminance(light.to_array());
                }
            }
            (_, Some(&Bsdf::Mirror { reflectance })) => branch(weight * reflectance, true),
            (Met::Primitive(index), Some(&Bsdf::Dielectric { ior, transmittance })) => {
                let eta = Boundary::new(view.primitive(index), ior, ray.medium).eta;
                let cosine = (-hit.facing(ray.direction).dot(ray.direction)).clamp(0.0, 1.0);
                let through = fresnel(cosine, eta).transmittance;
                branch(weight * (1.0 - through), true);
                branch(weight * transmittance * through, false);
            }
            (_, Some(bsdf)) => {
                seen.albedo += weight * albedo(bsdf);
                seen.normal += hit.shading * weight.max_element();
            }
            (_, None) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::settings::{Overrides, Settings};

    /// Through a pane of glass: a red wall. Beside it: a lamp's front.
    fn features() -> Features {
        let scene = Scene::builder()
            .camera([0.0, 0.0, 4.0], [0.0, 0.0, 0.0], 60.0, [21, 21])
            .diffuse("red", [0.8, 0.1, 0.1])
            .dielectric("glass", 1.5)
            .plane([0.0, 0.0, -3.0], [0.0, 0.0, 1.0], "red")
            .cylinder([0.0, 0.0, 0.0], [0.0, 0.0, 0.5], 0.5, "glass")
            .light([2.0, 0.0, -2.0], [0.0, 0.0, 1.0], 0.5, [5.0; 3])
            .build()
            .unwrap();
        let settings = Settings::resolve(&scene, &Overrides::default());
        Features::new(&View::new(&scene, &settings), Rect::whole([21, 21]), |_| ())
    }

    #[test]
    fn glass_shows_what_is_behind_it_weighted_by_fresnel() {
        let f = features();
        let middle = 10 * 21 + 10;
        // Straight through two faces of reflectance 0.04, with all reflections between them: (1 - 0.04) / (1 + 0.04).
        let through = 0.96 / 1.04;
        let albedo = f.albedo[middle];
        assert!(
            (f64::from(albedo[0]) / (0.8 * through) - 1.0).abs() < 0.01,
            "{albedo:?}"
        );
        assert_eq!(f.lamps[middle], 0.0);
        let lamp = f.lamps.iter().position(|l| *l > 4.99).unwrap();
        assert!((f.lamps[lamp] - 5.0).abs() < 1e-6);
        assert_eq!(f.albedo[lamp], [1.0; 3]);
    }
}
