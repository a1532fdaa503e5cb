//! Benchmarks: error against rendering time.
//!
//! Pictures with 1, 2, 4, ... samples per pixel and several seeds are compared with a reference. The *efficiency*
//! 1 / (MSE × seconds) does not depend on the rendering time. Only ratios of efficiencies are meaningful, within one run on
//! one machine.

pub mod engines;
pub mod errors;
pub mod figure9;
pub mod measure;
pub mod panels;
pub mod record;
pub mod reference;
pub mod scaling;
pub mod summary;
pub mod table;

pub use engines::{Contender, EngineKind, Unready};
pub use errors::{Errors, Truth};
pub use measure::{Measurement, Plan, Standing, measure};
pub use reference::Reference;
pub use summary::{Point, Spread};

use crate::engine::{DeviceInfo, Engine, EngineError};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::reference::{CpuEngine, Estimator};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::world::World;
use std::sync::atomic::AtomicBool;

/// An engine, and what making it ready took.
#[derive(Debug, Clone, PartialEq)]
pub struct Entrant {
    /// Which engine.
    pub kind: EngineKind,
    /// What it runs on.
    pub device: DeviceInfo,
    /// See [`Contender::compile_seconds`].
    pub compile_seconds: f64,
    /// See [`Contender::warm_up_seconds`].
    pub warm_up_seconds: f64,
}

impl From<&Contender> for Entrant {
    fn from(c: &Contender) -> Self {
        Self {
            kind: c.kind,
            device: c.device().clone(),
            compile_seconds: c.compile_seconds,
            warm_up_seconds: c.warm_up_seconds,
        }
    }
}

/// All that was measured on one scene.
#[derive(Debug, Clone)]
pub struct Results {
    /// The scene file's name.
    pub scene: String,
    /// Hash of scene and settings.
    pub scene_hash: String,
    /// What was rendered.
    pub settings: Settings,
    /// Vertices of a path, the last one included and the eye not, on average.
    pub mean_path_length: f64,
    /// The engines, in the order that was asked for.
    pub entrants: Vec<Entrant>,
    /// The reference.
    pub reference: Reference,
    /// One for each picture, in the order in which they were made.
    pub measurements: Vec<Measurement>,
}

impl Results {
    /// The engines' kinds.
    pub fn engines(&self) -> Vec<EngineKind> {
        self.entrants.iter().map(|e| e.kind).collect()
    }

    /// See [`summary::points`].
    pub fn points(&self) -> Vec<Point> {
        summary::points(&self.engines(), &self.measurements)
    }
}

/// Pixels of the small picture that paths are counted in.
const COUNTED_PIXELS: f64 = 2048.0;

/// Samples of each of them.
const COUNTED_SAMPLES: u64 = 16;

/// Mean number of path vertices over the picture, including the last one but not the eye. Counted on the CPU
/// reference without light sampling, where each vertex is the end of one ray (a ray that leaves the scene counts too). Shadow
/// rays do not change how a path continues, so the number describes the scene, for every engine. It is based on about 30 000
/// paths, and accurate to a few per cent.
pub fn mean_path_length(
    scene: &Scene,
    settings: &Settings,
    stop: &AtomicBool,
) -> Result<f64, EngineError> {
    let [w, h] = settings.size.map(f64::from);
    let scale = (COUNTED_PIXELS / (w * h)).sqrt().min(1.0);
    let size = [w, h].map(|n| (n * scale).round().max(1.0) as u32);
    let settings = Settings {
        size,
        ..settings.clone()
    };
    let whole = Rect::whole(size);
    let world = World::new(scene, size);
    let mut engine = CpuEngine::new(world, settings.clone(), Estimator::NoLightSampling);
    let mut film = Film::new(size, whole, settings.strata);
    let counters = engine.render(&mut film, whole, 0..COUNTED_SAMPLES, stop)?;
    Ok(counters.rays as f64 / counters.paths as f64)
}
