//! The engines that a benchmark can compare.

use crate::engine::{DeviceInfo, Engine, EngineError, tile_pixels};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::gpu::{Gpu, GpuEngine, GpuError};
use crate::kernel::Access;
use crate::reference::{CpuEngine, Estimator};
use crate::run;
use crate::settings::Settings;
use crate::world::World;
use sha2::{Digest, Sha256};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Which engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EngineKind {
    /// The kernel with the scene's values as constants.
    GpuBaked,
    /// The kernel that reads them from buffers.
    GpuBuffers,
    /// The kernel that reads them from buffers through trees.
    GpuTree,
    /// The f64 reference with light sampling.
    Cpu,
    /// The f64 reference without light sampling.
    CpuBrute,
}

impl EngineKind {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::GpuBaked,
        Self::GpuBuffers,
        Self::GpuTree,
        Self::Cpu,
        Self::CpuBrute,
    ];

    /// As `--engine` reads it.
    pub fn name(self) -> &'static str {
        match self {
            Self::GpuBaked => "gpu-baked",
            Self::GpuBuffers => "gpu-buffers",
            Self::GpuTree => "gpu-tree",
            Self::Cpu => "cpu",
            Self::CpuBrute => "cpu-brute",
        }
    }

    /// The engine of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|k| k.name() == name)
    }

    /// Whether it needs an adapter.
    pub fn on_gpu(self) -> bool {
        matches!(self, Self::GpuBaked | Self::GpuBuffers | Self::GpuTree)
    }

    /// The engine whose kernel reaches the scene's values this way.
    pub fn with_access(access: Access) -> Self {
        match access {
            Access::Baked => Self::GpuBaked,
            Access::Buffers => Self::GpuBuffers,
            Access::Tree => Self::GpuTree,
        }
    }
}

/// An engine prepared for a scene.
pub struct Contender {
    /// Which one.
    pub kind: EngineKind,
    engine: Either,
    /// Tiles of the whole picture.
    pub tiles: Vec<Rect>,
    /// Seconds that making and compiling the kernel took; 0 on the CPU.
    pub compile_seconds: f64,
    /// Seconds for the first sample of every pixel, including one-time allocations.
    pub warm_up_seconds: f64,
}

enum Either {
    Gpu(Box<GpuEngine>),
    Cpu(Box<Cpu>),
}

/// The reference, with the scene and settings: for another seed it must be created again.
struct Cpu {
    world: World,
    settings: Settings,
    estimator: Estimator,
    engine: CpuEngine,
}

impl Cpu {
    fn new(world: World, settings: Settings, estimator: Estimator) -> Self {
        Self {
            engine: CpuEngine::new(world.clone(), settings.clone(), estimator),
            world,
            settings,
            estimator,
        }
    }
}

impl Contender {
    /// Makes an engine and warms it up with one sample of every pixel. `gpu` must be given for engines that need it.
    pub fn new(
        kind: EngineKind,
        gpu: Option<&Arc<Gpu>>,
        world: &World,
        settings: &Settings,
        stop: &AtomicBool,
    ) -> Result<Self, Unready> {
        let (engine, compile_seconds, tile_pixels) = match kind {
            EngineKind::GpuBaked | EngineKind::GpuBuffers | EngineKind::GpuTree => {
                let gpu = gpu.ok_or_else(|| GpuError::NoAdapter("no Vulkan adapter".into()))?;
                let access = match kind {
                    EngineKind::GpuBaked => Access::Baked,
                    EngineKind::GpuTree => Access::Tree,
                    _ => Access::Buffers,
                };
                let engine = GpuEngine::on(Arc::clone(gpu), world, settings, Some(access))?;
                let (seconds, pixels) = (engine.compile_seconds(), tile_pixels(engine.device()));
                (Either::Gpu(Box::new(engine)), seconds, pixels)
            }
            EngineKind::Cpu | EngineKind::CpuBrute => {
                let estimator = match kind {
                    EngineKind::Cpu => Estimator::LightSampling,
                    _ => Estimator::NoLightSampling,
                };
                let cpu = Cpu::new(world.clone(), settings.clone(), estimator);
                let pixels = tile_pixels(&CpuEngine::device_info());
                (Either::Cpu(Box::new(cpu)), 0.0, pixels)
            }
        };
        let whole = Rect::whole(settings.size);
        let mut contender = Self {
            kind,
            engine,
            tiles: run::tiles(&[whole], tile_pixels),
            compile_seconds,
            warm_up_seconds: 0.0,
        };
        let begun = Instant::now();
        let mut film = Film::new(settings.size, whole, settings.strata);
        for tile in contender.tiles.clone() {
            contender.engine_mut().render(&mut film, tile, 0..1, stop)?;
        }
        contender.warm_up_seconds = begun.elapsed().as_secs_f64();
        Ok(contender)
    }

    /// What the next samples are made by.
    pub fn engine_mut(&mut self) -> &mut dyn Engine {
        match &mut self.engine {
            Either::Gpu(engine) => engine.as_mut(),
            Either::Cpu(cpu) => &mut cpu.engine,
        }
    }

    /// What it runs on.
    pub fn device(&self) -> &DeviceInfo {
        match &self.engine {
            Either::Gpu(engine) => engine.device(),
            Either::Cpu(cpu) => cpu.engine.device(),
        }
    }

    /// Seconds spent so far on bringing samples from the device into films.
    pub fn read_back_seconds(&self) -> f64 {
        match &self.engine {
            Either::Gpu(engine) => engine.read_back_seconds(),
            Either::Cpu(_) => 0.0,
        }
    }

    /// Changes the seed of later samples.
    pub fn reseed(&mut self, seed: u32) {
        match &mut self.engine {
            Either::Gpu(engine) => engine.reseed(seed),
            Either::Cpu(cpu) => {
                let settings = Settings {
                    seed,
                    ..cpu.settings.clone()
                };
                **cpu = Cpu::new(cpu.world.clone(), settings, cpu.estimator);
            }
        }
    }

    /// Everything besides scene, settings and seed that determines the values of its samples: kernel, adapter and driver, or
    /// the reference's version.
    pub fn identity(&self) -> String {
        let made_by: String = match &self.engine {
            Either::Gpu(engine) => {
                let hash = Sha256::digest(&engine.kernel().wgsl);
                hash[..8].iter().map(|b| format!("{b:02x}")).collect()
            }
            Either::Cpu(_) => env!("CARGO_PKG_VERSION").to_owned(),
        };
        let device = self.device();
        let mut parts = vec![self.kind.name(), &device.name, &device.driver, &made_by];
        if !self.kind.on_gpu() {
            // The reference's number of threads does not matter.
            parts.remove(2);
        }
        parts.join("; ")
    }
}

/// Why an engine is not ready.
#[derive(Debug, thiserror::Error)]
pub enum Unready {
    /// The engine does not support this scene.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// It failed, or was stopped.
    #[error(transparent)]
    Engine(#[from] EngineError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for kind in EngineKind::ALL {
            assert_eq!(EngineKind::from_name(kind.name()), Some(kind));
        }
        assert_eq!(EngineKind::from_name("tpu"), None);
    }
}
