//! What adapters there are, which one is taken, and the device opened on it.

use super::GpuError;
use super::instance::instance;
use crate::engine::DeviceInfo;
use crate::kernel::trips;
use std::sync::{Arc, Mutex};

/// Which adapter is wanted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Choice {
    /// Part of the adapter's name, any case.
    pub name: Option<String>,
}

/// An adapter and whether it can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterReport {
    /// Name, driver, kind.
    pub device: DeviceInfo,
    /// Or why it cannot be used.
    pub usable: Result<(), String>,
}

/// Invocations of a kernel's workgroup.
pub(super) const WORKGROUP: u32 = 64;

/// An open device.
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) info: DeviceInfo,
    /// The most trips, over all its loops, that an invocation is allowed on this driver.
    pub(super) trip_limit: u64,
    /// The first error that nobody was waiting for.
    failure: Arc<Mutex<Option<String>>>,
}

/// Discrete before integrated before virtual before software; ties keep the driver's order.
fn sorted_adapters() -> Vec<wgpu::Adapter> {
    let Some(instance) = instance() else {
        return Vec::new();
    };
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
}

fn describe(adapter: &wgpu::Adapter) -> DeviceInfo {
    let i = adapter.get_info();
    DeviceInfo {
        name: i.name,
        driver: format!("{} {}", i.driver, i.driver_info).trim().to_string(),
        backend: "gpu".to_string(),
        software: i.device_type == wgpu::DeviceType::Cpu,
    }
}

fn usable(adapter: &wgpu::Adapter) -> Result<(), String> {
    let limits = adapter.limits();
    let storage = adapter.get_texture_format_features(wgpu::TextureFormat::Rgba32Float);
    if limits.max_compute_invocations_per_workgroup < WORKGROUP {
        return Err(format!(
            "it allows only {} invocations per workgroup, but {WORKGROUP} are needed",
            limits.max_compute_invocations_per_workgroup
        ));
    }
    if !storage
        .allowed_usages
        .contains(wgpu::TextureUsages::STORAGE_BINDING)
    {
        return Err("it has no rgba32float storage textures".to_string());
    }
    Ok(())
}

/// All Vulkan adapters, in the order in which they would be taken.
pub fn adapters() -> Vec<AdapterReport> {
    sorted_adapters()
        .iter()
        .map(|a| AdapterReport {
            device: describe(a),
            usable: usable(a),
        })
        .collect()
}

impl Gpu {
    /// Opens the best adapter that fits the choice.
    pub fn open(choice: &Choice) -> Result<Self, GpuError> {
        let all = sorted_adapters();
        if all.is_empty() {
            return Err(GpuError::NoAdapter("no Vulkan adapter found".to_string()));
        }
        let wanted = choice.name.as_ref().map(|n| n.to_lowercase());
        let named = |a: &&wgpu::Adapter| {
            wanted
                .as_ref()
                .is_none_or(|n| a.get_info().name.to_lowercase().contains(n))
        };
        let mut problem = None;
        for adapter in all.iter().filter(named) {
            match usable(adapter).and_then(|()| open_device(adapter)) {
                Ok((device, queue)) => return Ok(Self::with(describe(adapter), device, queue)),
                // The first one's: it is the one that was meant.
                Err(e) => {
                    problem.get_or_insert(GpuError::Unable {
                        adapter: describe(adapter).name,
                        problem: e,
                    });
                }
            }
        }
        Err(problem.unwrap_or_else(|| {
            let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
            let wanted = choice.name.as_deref().unwrap_or_default();
            GpuError::NoAdapter(format!(
                "no adapter has a name that contains {wanted:?}; the adapters are: {}",
                names.join(", ")
            ))
        }))
    }

    fn with(info: DeviceInfo, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let failure = Arc::new(Mutex::new(None));
        let keep = |slot: &Arc<Mutex<Option<String>>>, message: String| {
            slot.lock()
                .unwrap_or_else(|p| p.into_inner())
                .get_or_insert(message);
        };
        let slot = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep(&slot, e.to_string())));
        let slot = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device also ends here.
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep(&slot, format!("the device was lost: {message}"));
            }
        });
        let trip_limit = trips::limit(&info.name, &info.driver);
        Self {
            device,
            queue,
            info,
            trip_limit,
            failure,
        }
    }

    /// What it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// The first error since the device was opened, if any.
    pub(super) fn check(&self) -> Result<(), String> {
        self.failure
            .lock()
            .unwrap_or_else(|p| p.into_inner())
            .clone()
            .map_or(Ok(()), Err)
    }

    /// Waits until everything submitted is done.
    pub(super) fn wait(&self) -> Result<(), String> {
        let polled = self.device.poll(wgpu::PollType::Wait {
            submission_index: None,
            timeout: None,
        });
        self.check()?;
        polled
            .map(|_| ())
            .map_err(|e| format!("waiting for the device failed: {e}"))
    }
}

/// A device with the adapter's own limits where pictures or scenes may need them.
fn open_device(adapter: &wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String> {
    let has = adapter.limits();
    let limits = wgpu::Limits {
        max_texture_dimension_2d: has.max_texture_dimension_2d,
        max_texture_dimension_3d: has.max_texture_dimension_3d,
        max_buffer_size: has.max_buffer_size,
        max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
        ..wgpu::Limits::default()
    }
    .or_worse_values_from(&has);
    pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: None,
        required_limits: limits,
        memory_hints: wgpu::MemoryHints::MemoryUsage,
        ..Default::default()
    }))
    .map_err(|e| format!("can't open a device: {e}"))
}
