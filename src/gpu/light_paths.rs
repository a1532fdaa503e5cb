//! Traces light paths: the kernel of `shaders/light_path/trace.wgsl`, and the splats that it lists.

use super::Gpu;
use super::engine::SUBMISSION_SECONDS;
use crate::engine::{Counters, EngineError};
use crate::film::splats::{Splat, SplatSetup};
use crate::kernel::layout::LightParams;
use crate::kernel::{LightKernel, light_paths, trips};
use crate::world::World;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use wgpu::util::DeviceExt as _;

/// Light paths that an invocation takes one after another: enough that lanes with short ones seldom wait for the others.
const EACH: u32 = 16;

/// Splats for which an invocation has room, for each of its light paths.
const ROOM: u32 = 4;

/// Invocations of a dispatch, of a software adapter and another.
const INVOCATIONS: [u32; 2] = [4096, 65_536];

/// Invocations of a workgroup.
const WORKGROUP: u32 = 64;

/// Bytes of a splat, and of what an invocation says of its progress.
const RECORD: u64 = 16;

/// What the device holds for light paths.
pub(super) struct LightTracer {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    /// Group 2.
    aims: wgpu::BindGroup,
    params: wgpu::Buffer,
    buffers: Buffers,
    setup: SplatSetup,
    each: u32,
    /// Light paths that a submission aims at.
    batch: f64,
}

struct Buffers {
    invocations: u32,
    room: u32,
    splats: wgpu::Buffer,
    progress: wgpu::Buffer,
    staging: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Group 2 of kernels that read aims.
pub(super) fn aims_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aims"),
        entries: &[storage(0, true)],
    })
}

fn storage(binding: u32, read_only: bool) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

impl LightTracer {
    /// Compiles the kernel. `scene` is the layout of group 0.
    ///
    /// # Safety
    ///
    /// `kernel` is what [`compose`](crate::kernel::compose) made for this world: it runs without runtime checks.
    pub unsafe fn new(
        gpu: &Gpu,
        world: &World,
        kernel: &LightKernel,
        scene: &wgpu::BindGroupLayout,
    ) -> Result<Self, String> {
        if kernel.trips_per_path > gpu.trip_limit {
            let what = "one light path of this scene may take";
            let advice = " (without light paths it may take fewer)";
            return Err(trips::too_many(what, kernel.trips_per_path, advice));
        }
        let device = &gpu.device;
        // SAFETY: as the caller promises. Its indices are numbers of surfaces, materials, lights and aims that were packed for it, and places
        // of splats below its own room; its loops run over constant ranges, light paths of at most max_depth vertices, or along nodes
        // whose next ones come later in a fixed order of the tree.
        let module = unsafe {
            device.create_shader_module_trusted(
                wgpu::ShaderModuleDescriptor {
                    label: Some("light paths"),
                    source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
                },
                wgpu::ShaderRuntimeChecks::unchecked(),
            )
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("splats"),
            entries: &[
                wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::COMPUTE,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                    count: None,
                },
                storage(1, false),
                storage(2, false),
            ],
        });
        let aims_layout = aims_layout(device);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("light paths"),
            layout: Some(
                &device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: None,
                    bind_group_layouts: &[Some(scene), Some(&layout), Some(&aims_layout)],
                    immediate_size: 0,
                }),
            ),
            module: &module,
            entry_point: Some("trace"),
            compilation_options: Default::default(),
            cache: None,
        });
        let aims = bind_aims(gpu, &aims_layout, world, kernel);
        let params = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("light params"),
            size: size_of::<LightParams>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let each = (gpu.trip_limit / kernel.trips_per_path.max(1)).clamp(1, EACH.into()) as u32;
        let invocations = INVOCATIONS[usize::from(!gpu.info.software)];
        let buffers = Buffers::new(gpu, &layout, &params, invocations, ROOM * each);
        let brightest = (world.lights.iter()).map(|l| l.radiance.max_element());
        let brightest = brightest.fold(f64::MIN_POSITIVE, f64::max);
        Ok(Self {
            pipeline,
            layout,
            aims,
            params,
            buffers,
            setup: SplatSetup {
                paths: kernel.photons,
                scale: brightest.log2().ceil().exp2(),
            },
            each,
            batch: f64::from(WORKGROUP * each),
        })
    }

    /// See [`Engine::light_paths`](crate::engine::Engine::light_paths).
    pub fn setup(&self) -> SplatSetup {
        self.setup
    }

    /// Traces `passes`, and gives all their splats to `take`. Splats that are not finite are counted instead.
    pub fn trace(
        &mut self,
        gpu: &Gpu,
        scene: &wgpu::BindGroup,
        seed: u32,
        passes: Range<u64>,
        stop: &AtomicBool,
        mut take: impl FnMut(Splat),
    ) -> Result<Counters, EngineError> {
        let photons = u64::from(self.setup.paths);
        let all = (passes.end - passes.start) * photons;
        let mut counters = Counters {
            light_paths: all,
            ..Counters::default()
        };
        let mut at = 0;
        while at < all {
            if stop.load(Ordering::Relaxed) {
                return Err(EngineError::Stopped);
            }
            let most = u64::from(self.buffers.invocations) * u64::from(self.each);
            let paths = (all - at).min(most).min(self.batch.max(1.0) as u64) as u32;
            let params = LightParams {
                first_pass: (passes.start + at / photons) as u32,
                first_path: (at % photons) as u32,
                paths,
                each: self.each_of(paths),
                invocations: 0,
                room: 0,
                seed,
                trips: u32::try_from(gpu.trip_limit).unwrap_or(u32::MAX),
                opaque_two: 2,
            };
            let begun = Instant::now();
            self.batch_of(gpu, scene, params, &mut counters, &mut take)
                .map_err(EngineError::Device)?;
            // A submission grows to what takes its time.
            let fits =
                f64::from(paths) * SUBMISSION_SECONDS / begun.elapsed().as_secs_f64().max(1e-6);
            self.batch = fits.clamp(0.5 * self.batch, 4.0 * self.batch).max(1.0);
            at += u64::from(paths);
        }
        Ok(counters)
    }

    /// Light paths of an invocation, of so many: fewer where there would be too few invocations.
    fn each_of(&self, paths: u32) -> u32 {
        (paths / (8 * WORKGROUP)).clamp(1, self.each)
    }

    /// Dispatches until every invocation has done its light paths.
    fn batch_of(
        &mut self,
        gpu: &Gpu,
        scene: &wgpu::BindGroup,
        mut params: LightParams,
        counters: &mut Counters,
        take: &mut impl FnMut(Splat),
    ) -> Result<(), String> {
        params.invocations = params.paths.div_ceil(params.each);
        let mut done = vec![0; params.invocations as usize];
        loop {
            params.room = self.buffers.room;
            self.dispatch(gpu, scene, &params, &done)?;
            let (mut unfinished, mut stuck, mut full) = (false, false, false);
            self.read(gpu, &params, |k, [now, splats, rays, was_full], records| {
                let end = params.each.min(params.paths - k as u32 * params.each);
                unfinished |= now < end;
                stuck |= now < end && now == done[k];
                full |= was_full > 0;
                done[k] = now;
                counters.rays += u64::from(rays);
                for splat in records[..splats as usize]
                    .iter()
                    .copied()
                    .map(Splat::from_words)
                {
                    if splat.value.iter().all(|v| v.is_finite()) {
                        take(splat);
                    } else {
                        counters.nonfinite += 1;
                    }
                }
            })?;
            if !unfinished {
                return Ok(());
            }
            if stuck && !full {
                return Err(trips::too_many(
                    "one light path takes more than",
                    gpu.trip_limit,
                    "",
                ));
            }
            if stuck {
                // A single light path has more splats than there is room for.
                let room = self.buffers.room * 2;
                let bytes = u64::from(room) * u64::from(params.invocations) * RECORD;
                if bytes > gpu.device.limits().max_storage_buffer_binding_size {
                    return Err("one light path has too many splats for this adapter".into());
                }
                let grown = Buffers::new(gpu, &self.layout, &self.params, params.invocations, room);
                self.buffers = grown;
            }
        }
    }

    /// Makes one dispatch and waits for it; `done` says which light paths each invocation has done already.
    fn dispatch(
        &self,
        gpu: &Gpu,
        scene: &wgpu::BindGroup,
        params: &LightParams,
        done: &[u32],
    ) -> Result<(), String> {
        let progress: Vec<[u32; 4]> = done.iter().map(|d| [*d, 0, 0, 0]).collect();
        gpu.queue
            .write_buffer(&self.buffers.progress, 0, bytemuck::cast_slice(&progress));
        gpu.queue
            .write_buffer(&self.params, 0, bytemuck::bytes_of(params));
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, scene, &[]);
            pass.set_bind_group(1, &self.buffers.group, &[]);
            pass.set_bind_group(2, &self.aims, &[]);
            pass.dispatch_workgroups(params.invocations.div_ceil(WORKGROUP), 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()
    }

    /// Calls `each` for every invocation, with its number, its progress, and its splats.
    fn read(
        &self,
        gpu: &Gpu,
        params: &LightParams,
        mut each: impl FnMut(usize, [u32; 4], &[[u32; 4]]),
    ) -> Result<(), String> {
        let Buffers {
            splats,
            progress,
            staging,
            ..
        } = &self.buffers;
        let invocations = u64::from(params.invocations);
        let (head, body) = (
            invocations * RECORD,
            invocations * u64::from(params.room) * RECORD,
        );
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(progress, 0, staging, 0, head);
        encoder.copy_buffer_to_buffer(splats, 0, staging, head, body);
        gpu.queue.submit([encoder.finish()]);
        let slice = staging.slice(..head + body);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait()?;
        let mapped = slice
            .get_mapped_range()
            .map_err(|e| format!("reading back failed: {e}"))?;
        let records: &[[u32; 4]] =
            bytemuck::try_cast_slice(&mapped).map_err(|e| format!("reading back failed: {e}"))?;
        let (heads, splats) = records.split_at(params.invocations as usize);
        for (k, (head, splats)) in
            (heads.iter().zip(splats.chunks(params.room as usize))).enumerate()
        {
            each(k, *head, splats);
        }
        drop(mapped);
        staging.unmap();
        Ok(())
    }
}

impl Buffers {
    fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        params: &wgpu::Buffer,
        invocations: u32,
        room: u32,
    ) -> Self {
        let buffer = |label, size, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Use;
        let head = u64::from(invocations) * RECORD;
        let body = head * u64::from(room);
        let splats = buffer("splats", body, Use::STORAGE | Use::COPY_SRC);
        let usage = Use::STORAGE | Use::COPY_SRC | Use::COPY_DST;
        let progress = buffer("progress", head, usage);
        let staging = buffer("light staging", head + body, Use::MAP_READ | Use::COPY_DST);
        let bound = [params, &splats, &progress];
        let entries: Vec<_> = (0..)
            .zip(bound)
            .map(|(binding, b)| wgpu::BindGroupEntry {
                binding,
                resource: b.as_entire_binding(),
            })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("splats"),
            layout,
            entries: &entries,
        });
        Self {
            invocations,
            room,
            splats,
            progress,
            staging,
            group,
        }
    }
}

/// Puts the aims on the device.
pub(super) fn bind_aims(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    world: &World,
    kernel: &LightKernel,
) -> wgpu::BindGroup {
    let words = light_paths::pack(world, &kernel.aims, kernel.photons);
    let buffer = gpu
        .device
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("aims"),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::STORAGE,
        });
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("aims"),
        layout,
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: buffer.as_entire_binding(),
        }],
    })
}
