//! Chooses what renders: a real GPU, else a software adapter, else the CPU reference.

use super::Error;
use crate::engine::{Engine, tile_pixels};
use crate::gpu::{self, Gpu, GpuEngine, GpuError, Making};
use crate::kernel::Access;
use crate::reference::{CpuEngine, Estimator};
use crate::settings::Settings;
use crate::world::World;
use std::sync::Arc;

/// What renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Backend {
    /// A hardware GPU if there is one, else a software adapter, else the CPU reference.
    #[default]
    Auto,
    /// Any adapter, hardware or software.
    Gpu,
    /// The f64 reference.
    Cpu,
}

/// The command that installs a software adapter (Debian, Ubuntu).
pub const GET_ADAPTER: &str = "apt-get install mesa-vulkan-drivers";

/// An engine that is ready to render, and what the renderer must know about it.
pub struct Chosen {
    /// What renders.
    pub engine: Box<dyn Engine>,
    /// Seconds spent on generating and compiling the kernel.
    pub compile_seconds: f64,
    /// The kernel generated for the scene; the CPU reference has none.
    pub wgsl: Option<String>,
    /// How that kernel reaches the scene's values.
    pub access: Option<Access>,
    /// Most pixels in one call to the engine.
    pub tile_pixels: u64,
    /// Why the CPU reference renders although the user did not ask for it.
    pub note: Option<String>,
}

/// A device that is open, for one engine after another; or the CPU reference.
#[derive(Clone)]
pub struct Device {
    gpu: Option<Arc<Gpu>>,
    /// Why the CPU reference renders although the user did not ask for it.
    note: Option<String>,
    backend: Backend,
    adapter: Option<String>,
}

impl Device {
    /// The device that `backend` and `adapter` select.
    pub fn open(backend: Backend, adapter: Option<&str>) -> Result<Self, Error> {
        let (gpu, note) = open(backend, adapter)?;
        Ok(Self {
            gpu: gpu.map(Arc::new),
            note,
            backend,
            adapter: adapter.map(str::to_owned),
        })
    }

    /// This device for options that name `backend` and `adapter`, or why it is not what they name.
    pub fn for_options(&self, backend: Backend, adapter: Option<&str>) -> Result<Self, Error> {
        let is = match &self.gpu {
            Some(gpu) => gpu.info().name.as_str(),
            None => "the CPU reference",
        };
        let named = |part: &str| is.to_lowercase().contains(&part.to_lowercase());
        let wanted = match (backend, adapter) {
            (Backend::Cpu, _) if self.gpu.is_some() => "backend cpu".to_owned(),
            (Backend::Gpu, None) if self.gpu.is_none() => "backend gpu".to_owned(),
            (_, Some(part)) if self.gpu.is_none() || !named(part) => format!("adapter {part:?}"),
            _ => {
                let backend = match backend {
                    Backend::Auto => self.backend,
                    other => other,
                };
                let adapter = adapter.map(str::to_owned).or_else(|| self.adapter.clone());
                return Ok(Self {
                    backend,
                    adapter,
                    ..self.clone()
                });
            }
        };
        Err(Error::Input(format!(
            "the options name {wanted}, but the renderer was opened on {is}; open another, or leave backend and adapter as they are by default"
        )))
    }

    /// An engine on it, ready for this scene. Calls `tell` at each step of the preparation.
    pub fn engine(
        &self,
        world: &World,
        settings: &Settings,
        tell: impl FnMut(Making),
    ) -> Result<Chosen, Error> {
        let Some(gpu) = &self.gpu else {
            return Ok(cpu(world, settings, self.note.clone()));
        };
        match GpuEngine::on_telling(gpu.clone(), world, settings, None, tell) {
            Ok(engine) => Ok(Chosen {
                compile_seconds: engine.compile_seconds(),
                wgsl: Some(engine.kernel().wgsl.clone()),
                access: Some(engine.kernel().access),
                tile_pixels: tile_pixels(engine.device()),
                engine: Box::new(engine),
                note: None,
            }),
            Err(e) => {
                let note = instead(&e, self.backend, self.adapter.as_deref())?;
                Ok(cpu(world, settings, Some(note)))
            }
        }
    }
}

/// The engine that `backend` and `adapter` select, ready for this scene. Calls `tell` at each step of the preparation.
pub fn choose(
    backend: Backend,
    adapter: Option<&str>,
    world: &World,
    settings: &Settings,
    tell: impl FnMut(Making),
) -> Result<Chosen, Error> {
    Device::open(backend, adapter)?.engine(world, settings, tell)
}

/// Opens the adapter that `backend` and `adapter` select. `None` means the CPU reference; the second value then says why,
/// unless the user asked for it.
pub fn open(
    backend: Backend,
    adapter: Option<&str>,
) -> Result<(Option<Gpu>, Option<String>), Error> {
    if backend == Backend::Cpu {
        return Ok((None, None));
    }
    let choice = gpu::Choice {
        name: adapter.map(str::to_owned),
    };
    match Gpu::open(&choice) {
        Ok(gpu) => Ok((Some(gpu), None)),
        Err(e) => Ok((None, Some(instead(&e, backend, adapter)?))),
    }
}

/// The note that the CPU reference renders instead, if that is allowed; else the failure.
fn instead(e: &GpuError, backend: Backend, adapter: Option<&str>) -> Result<String, Error> {
    match e {
        // The reference would hide it.
        GpuError::Kernel(_) => Err(Error::Device(format!(
            "{e}; the CPU reference (backend cpu) renders without a kernel"
        ))),
        _ if backend == Backend::Auto && adapter.is_none() => {
            let faster = match e {
                GpuError::NoAdapter(_) => {
                    format!(" (to install a faster software adapter: {GET_ADAPTER})")
                }
                GpuError::Kernel(_) | GpuError::Unable { .. } => String::new(),
            };
            Ok(format!("{e}; rendering on the CPU reference{faster}"))
        }
        GpuError::NoAdapter(_) if adapter.is_none() => Err(Error::Device(format!(
            "{e}; to install a software adapter: {GET_ADAPTER}"
        ))),
        _ => Err(Error::Device(e.to_string())),
    }
}

fn cpu(world: &World, settings: &Settings, note: Option<String>) -> Chosen {
    let engine = CpuEngine::new(world.clone(), settings.clone(), Estimator::LightSampling);
    Chosen {
        engine: Box::new(engine),
        compile_seconds: 0.0,
        wgsl: None,
        access: None,
        tile_pixels: tile_pixels(&CpuEngine::device_info()),
        note,
    }
}
