//! The backend of the cases: an adapter or the CPU reference. It renders pictures, traces rays and evaluates functions.

use super::build::Build;
use super::measure::{Mean, Measure};
use crate::engine::{Counters, DeviceInfo, Engine, EngineError};
use crate::film::coverage::Rect;
use crate::film::{BLOCK, Film};
use crate::gpu::probe::{self, Probe, UNWRITTEN, Values};
use crate::gpu::{Gpu, GpuEngine, GpuError};
use crate::kernel::{Access, ProbeFeatures};
use crate::reference::{CpuEngine, Estimator};
use crate::settings::Settings;
use crate::stats::luminance;
use crate::world::World;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Most paths of a picture that is rendered until its error is small enough.
const MOST_PATHS: f64 = 3e7;

/// Why a case has no result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The backend refuses the scene, or its result is invalid.
    #[error("{0}")]
    Unable(String),
    /// The device failed and can't be used any more.
    #[error("{0}")]
    Device(String),
    /// `stop` was set.
    #[error("stopped")]
    Stopped,
}

impl From<EngineError> for Trouble {
    fn from(e: EngineError) -> Self {
        match e {
            EngineError::Stopped => Self::Stopped,
            EngineError::Device(message) => Self::Device(message),
        }
    }
}

impl From<GpuError> for Trouble {
    fn from(e: GpuError) -> Self {
        Self::Unable(e.to_string())
    }
}

/// What the cases run on.
pub struct Backend {
    gpu: Option<OpenGpu>,
    /// The kind of kernel, instead of the one that a user gets.
    access: Option<Access>,
    stop: Arc<AtomicBool>,
}

/// An open device, and the probes compiled on it so far, by their text.
pub(super) struct OpenGpu {
    pub gpu: Arc<Gpu>,
    pub probes: Mutex<HashMap<String, Arc<Probe>>>,
}

/// 16 numbers into or out of a function.
pub type Numbers = [f64; 16];

impl Backend {
    /// An adapter; `stop` ends what is under way.
    pub fn gpu(gpu: Gpu, stop: Arc<AtomicBool>) -> Self {
        Self {
            gpu: Some(OpenGpu {
                gpu: Arc::new(gpu),
                probes: Mutex::default(),
            }),
            access: None,
            stop,
        }
    }

    /// The same with kernels of another kind than users get.
    pub fn with_access(self, access: Access) -> Self {
        Self {
            access: Some(access),
            ..self
        }
    }

    /// The kind of kernel that is forced, if one is.
    pub(super) fn access(&self) -> Option<Access> {
        self.access
    }

    /// The CPU reference.
    pub fn cpu(stop: Arc<AtomicBool>) -> Self {
        Self {
            gpu: None,
            access: None,
            stop,
        }
    }

    /// What it is.
    pub fn device(&self) -> DeviceInfo {
        match &self.gpu {
            Some(open) => open.gpu.info().clone(),
            None => CpuEngine::device_info(),
        }
    }

    /// The adapter, if it is one.
    pub(super) fn open_gpu(&self) -> Option<&OpenGpu> {
        self.gpu.as_ref()
    }

    /// The largest relative error of one rounding; of the reference's and of a case's own together, for both are in f64.
    pub(super) fn epsilon(&self) -> f64 {
        match self.gpu {
            Some(_) => f64::from(f32::EPSILON) / 2.0,
            None => 4.0 * f64::EPSILON,
        }
    }

    /// An engine for the scene, with the kernel that a user gets.
    pub(super) fn engine(
        &self,
        build: &Build,
        settings: &Settings,
    ) -> Result<Box<dyn Engine>, Trouble> {
        let world = World::new(&build.0, settings.size);
        Ok(match &self.gpu {
            Some(open) => Box::new(GpuEngine::on(
                open.gpu.clone(),
                &world,
                settings,
                self.access,
            )?),
            None => Box::new(CpuEngine::new(
                world,
                settings.clone(),
                Estimator::LightSampling,
            )),
        })
    }

    /// Samples 0..`spp` of a picture.
    pub(super) fn picture(
        &self,
        build: &Build,
        settings: &Settings,
        spp: u64,
    ) -> Result<Picture, Trouble> {
        let mut picture = Picture::new(settings);
        picture.go_on(self.engine(build, settings)?.as_mut(), spp, &self.stop)?;
        Ok(picture)
    }

    /// A picture with as many samples as the standard error of its mean luminance needs to fall to `error`.
    pub(super) fn picture_to(
        &self,
        build: &Build,
        settings: &Settings,
        error: f64,
    ) -> Result<Picture, Trouble> {
        let engine = self.engine(build, settings)?;
        Picture::to(engine, settings, error, &self.stop)
    }

    /// The same on the CPU reference, for every backend, with the given estimator.
    pub(super) fn reference_to(
        &self,
        build: &Build,
        settings: &Settings,
        estimator: Estimator,
        error: f64,
    ) -> Result<Picture, Trouble> {
        let world = World::new(&build.0, settings.size);
        let engine = CpuEngine::new(world, settings.clone(), estimator);
        Picture::to(Box::new(engine), settings, error, &self.stop)
    }

    /// A function of numbers: on an adapter the WGSL statements `body`, which read `x` and write `y`, beside the shader
    /// modules; on the reference `twin`. What `inputs` an adapter gets are rounded to f32 first.
    pub(super) fn evaluate(
        &self,
        body: &str,
        twin: impl Fn(&Numbers) -> Numbers,
        inputs: &[Numbers],
    ) -> Result<Vec<Numbers>, Trouble> {
        let Some(open) = &self.gpu else {
            return Ok(inputs.iter().map(twin).collect());
        };
        let rounded: Vec<Values> = inputs.iter().map(|x| x.map(|x| x as f32)).collect();
        let out = probe::run(&open.gpu, &ProbeFeatures::default(), body, &rounded)
            .map_err(Trouble::Device)?;
        written(&out)
    }

    /// What stops it.
    pub(super) fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }

    pub(super) fn check_stop(&self) -> Result<(), Trouble> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Trouble::Stopped);
        }
        Ok(())
    }
}

/// Outputs of a probe as f64; all of them must have been written.
pub(super) fn written(out: &[Values]) -> Result<Vec<Numbers>, Trouble> {
    if out.iter().any(|y| y[0] == UNWRITTEN) {
        return Err(Trouble::Unable("an invocation wrote no result".into()));
    }
    Ok(out.iter().map(|y| y.map(f64::from)).collect())
}

/// A picture whose samples are independent: one stratum.
pub struct Picture {
    pub film: Film,
    pub counters: Counters,
    /// Samples per pixel.
    pub spp: u64,
}

impl Picture {
    fn new(settings: &Settings) -> Self {
        let rect = Rect::whole(settings.size);
        Self {
            film: Film::new(settings.size, rect, settings.strata),
            counters: Counters::default(),
            spp: 0,
        }
    }

    fn to(
        mut engine: Box<dyn Engine>,
        settings: &Settings,
        error: f64,
        stop: &AtomicBool,
    ) -> Result<Self, Trouble> {
        let mut picture = Self::new(settings);
        let most = (MOST_PATHS / Rect::whole(settings.size).area() as f64) as u64;
        let mut spp = BLOCK;
        loop {
            picture.go_on(engine.as_mut(), spp, stop)?;
            let ratio = picture.mean().error / error;
            if ratio <= 1.0 || spp >= most {
                return Ok(picture);
            }
            // A little more than the variance so far requires, in whole blocks.
            let wanted = (spp as f64 * ratio * ratio * 1.05) as u64;
            spp = (wanted.next_multiple_of(BLOCK)).min(most.next_multiple_of(BLOCK));
        }
    }

    /// Takes samples up to `spp`.
    pub fn go_on(
        &mut self,
        engine: &mut dyn Engine,
        spp: u64,
        stop: &AtomicBool,
    ) -> Result<(), Trouble> {
        while self.spp < spp {
            let end = ((self.spp / BLOCK + 1) * BLOCK).min(spp);
            let rect = Rect::whole(self.film.size);
            self.counters += engine.render(&mut self.film, rect, self.spp..end, stop)?;
            self.spp = end;
        }
        Ok(())
    }

    /// Mean luminance over the picture.
    pub fn mean(&self) -> Mean {
        self.mean_of(Rect::whole(self.film.size))
    }

    /// Mean luminance over some pixels, with the standard error that independent samples have.
    pub fn mean_of(&self, rect: Rect) -> Mean {
        let n = self.spp as f64;
        let (mut sum, mut variance) = (0.0, 0.0);
        for y in rect.y0..rect.y1 {
            for x in rect.x0..rect.x1 {
                let [r, g, b, square] = self
                    .film
                    .total(x, y)
                    .iter()
                    .fold([0.0; 4], |t, s| std::array::from_fn(|c| t[c] + s[c]));
                let mean = luminance([r, g, b]) / n;
                sum += mean;
                variance += (square / n - mean * mean).max(0.0) / (n - 1.0);
            }
        }
        let pixels = rect.area() as f64;
        Mean {
            mean: sum / pixels,
            error: variance.sqrt() / pixels,
        }
    }

    /// Means of blocks of `side` x `side` pixels.
    pub fn blocks(&self, side: u32) -> Vec<Mean> {
        let [w, h] = self.film.size;
        let corners = (0..h)
            .step_by(side as usize)
            .flat_map(|y| (0..w).step_by(side as usize).map(move |x| (x, y)));
        corners
            .map(|(x0, y0)| {
                self.mean_of(Rect {
                    x0,
                    y0,
                    x1: (x0 + side).min(w),
                    y1: (y0 + side).min(h),
                })
            })
            .collect()
    }

    /// Blocks of pixels that should all have one value.
    pub fn even(&self, quantity: &str, side: u32, expected: f64) -> Measure {
        let pairs: Vec<(Mean, f64)> = self
            .blocks(side)
            .into_iter()
            .map(|m| (m, expected))
            .collect();
        Measure::farthest(quantity, &pairs)
    }

    /// How many pixels are not black.
    pub fn lit_pixels(&self) -> usize {
        let mut lit = 0;
        self.film
            .for_each(|_, _, e| lit += usize::from(e.mean != [0.0; 3]));
        lit
    }
}
