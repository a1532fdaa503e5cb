//! The CPU reference: the same light transport as the kernel's, in f64. It is written to be read, and the kernel is compared with it.
//!
//! Each part has a file of its own, with the name of the shader module that does the same. The reference shares the
//! [`World`] and its [exact rays](crate::world::trace) with the GPU's host, and nothing with the kernel. It has two estimators
//! of the same picture. One samples lights, and the other finds them only by chance. If both agree, there is little room for an
//! error in either.

pub mod diffuse;
pub mod frame;
pub mod light;
pub mod path;
pub mod phong;
pub mod radiosity;
pub mod sampler;
pub mod tracer;

#[cfg(test)]
mod chi_square;

pub use sampler::Sampler;
pub use tracer::Tracer;

use crate::engine::{Counters, DeviceInfo, Engine, EngineError, Part};
use crate::film::coverage::Rect;
use crate::film::{Film, REPLICATES, Reach, Sums};
use crate::settings::Settings;
use crate::stats::luminance;
use crate::world::World;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// How a path finds lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Shadow rays from every surface whose BSDF is not a delta function, weighted against chance hits.
    LightSampling,
    /// Only chance hits.
    NoLightSampling,
}

/// Makes samples on the CPU, on rayon's threads.
#[derive(Debug)]
pub struct CpuEngine {
    tracer: Tracer,
    device: DeviceInfo,
}

impl CpuEngine {
    /// An engine for `world`, which was made for a picture of `settings.size`.
    pub fn new(world: World, settings: Settings, estimator: Estimator) -> Self {
        Self {
            tracer: Tracer::new(world, settings, estimator),
            device: Self::device_info(),
        }
    }

    /// The device of every engine of this kind.
    pub fn device_info() -> DeviceInfo {
        DeviceInfo {
            name: "CPU reference (f64)".to_owned(),
            driver: match rayon::current_num_threads() {
                1 => "1 thread".to_owned(),
                n => format!("{n} threads"),
            },
            backend: "cpu".to_owned(),
            software: true,
        }
    }

    /// Adds samples to the sums of one pixel, one after another. Samples that are not finite are left out and counted. `None` when
    /// told to stop.
    fn render_pixel(
        &self,
        [x, y]: [u32; 2],
        samples: Range<u64>,
        mut sums: [Sums<f64>; REPLICATES],
        stop: &AtomicBool,
    ) -> Option<Pixel> {
        let round = self.tracer.settings().round();
        let mut left_out = [0; REPLICATES];
        let mut counters = Counters::default();
        let mut further = false;
        for sample in samples {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let traced = self.tracer.sample_pixel([x, y], sample);
            counters.paths += 1;
            counters.rays += traced.rays;
            counters.truncated += u64::from(traced.truncated);
            further |= traced.further;
            let rgb = traced.radiance.to_array();
            let replicate = (sample / round % REPLICATES as u64) as usize;
            if !traced.radiance.is_finite() {
                left_out[replicate] += 1;
                counters.nonfinite += 1;
                counters.first_nonfinite = counters.first_nonfinite.or(Some((x, y, sample)));
                continue;
            }
            let added = [rgb[0], rgb[1], rgb[2], luminance(rgb).powi(2)];
            for (sum, value) in sums[replicate].iter_mut().zip(added) {
                *sum += value;
            }
        }
        Some(Pixel {
            sums,
            left_out,
            counters,
            further,
        })
    }
}

/// A pixel after more samples.
struct Pixel {
    sums: [Sums<f64>; REPLICATES],
    left_out: [u64; REPLICATES],
    counters: Counters,
    /// As [`Reach::Further`].
    further: bool,
}

impl Engine for CpuEngine {
    fn render_parts(
        &mut self,
        film: &mut Film,
        _: Rect,
        parts: &[Part],
        stop: &AtomicBool,
    ) -> Result<Counters, EngineError> {
        let before = &*film;
        let render = |part: &Part| -> Option<Vec<Pixel>> {
            let rect = part.rect;
            (0..rect.area())
                .into_par_iter()
                .map(|k| {
                    let width = u64::from(rect.width());
                    let x = rect.x0 + (k % width) as u32;
                    let y = rect.y0 + (k / width) as u32;
                    let sums = before.sums()[before.index(x, y)];
                    self.render_pixel([x, y], part.samples.clone(), sums, stop)
                })
                .collect()
        };
        let all: Option<Vec<_>> = parts.iter().map(render).collect();
        let by_chance = self.tracer.settings().finds_light_by_chance();
        let mut total = Counters::default();
        for (Part { rect, samples }, pixels) in parts.iter().zip(all.ok_or(EngineError::Stopped)?) {
            let sums = pixels.iter().map(|p| p.sums).collect();
            film.put_samples(*rect, samples.clone(), sums);
            for (k, pixel) in (0..).zip(pixels) {
                let (x, y) = (rect.x0 + k % rect.width(), rect.y0 + k / rect.width());
                film.leave_out(x, y, pixel.left_out);
                if by_chance && pixel.further {
                    film.reach(x, y, Reach::Further);
                } else if by_chance && pixel.counters.rays > pixel.counters.paths {
                    film.reach(x, y, Reach::Surface);
                }
                total += pixel.counters;
            }
        }
        Ok(total)
    }

    fn reseed(&mut self, seed: u32) {
        self.tracer.settings.seed = seed;
    }

    fn device(&self) -> &DeviceInfo {
        &self.device
    }
}
