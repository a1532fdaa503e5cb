//! Dispatches: samples are cut into submissions by measured cost, which touches no bit of the picture.

use super::glances::GlanceMarks;
use super::held::{Held, continues_block, count_row};
use super::light_paths::{self, LightTracer};
use super::pack::pack;
use super::tile::{self, Tile};
use super::work::{Work, coprime_stride, workgroups};
use super::{Choice, Gpu, GpuError, scene, volumes};
use crate::engine::{Counters, DeviceInfo, Engine, EngineError, Part};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::film::splats::{Splat, SplatSetup};
use crate::kernel::layout::Params;
use crate::kernel::{Access, Kernel, compose, trips};
use crate::settings::Settings;
use crate::world::World;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A submission aims to take this long: short for watchdogs and progress, long beside its overhead.
pub(super) const SUBMISSION_SECONDS: f64 = 0.1;

/// Paths of the first submission, when nothing has been measured: enough to keep an adapter busy, a software one and
/// another, and soon done.
const FIRST_PATHS: [f64; 2] = [32_768.0, 1_048_576.0];

/// The engine that runs a scene's kernel on a Vulkan adapter.
pub struct GpuEngine {
    gpu: Arc<Gpu>,
    kernel: Kernel,
    pipeline: wgpu::ComputePipeline,
    scene: wgpu::BindGroup,
    /// Group 2, if the path kernel reads it.
    aims: Option<wgpu::BindGroup>,
    /// What traces light paths, if the scene has a use for them.
    light: Option<LightTracer>,
    film_layout: wgpu::BindGroupLayout,
    params: wgpu::Buffer,
    tile: Option<Tile>,
    /// Where lights are seen, if the kernel asks.
    seen: Option<GlanceMarks>,
    /// The tile whose marks are on the device.
    marked: Option<Rect>,
    /// What the tile's textures hold since the last call, as it was read back.
    held: Option<Held>,
    seed: u32,
    /// Whether its paths look for light by chance.
    by_chance: bool,
    /// Seconds that one sample of one pixel takes, as measured so far.
    seconds_per_path: Option<f64>,
    compile_seconds: f64,
    read_back_seconds: f64,
}

/// What is under way while an engine is made, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Making {
    /// The kernel's text.
    Composing,
    /// What of the scene lies on the device, trees among it.
    Packing,
    /// The kernel, by the driver.
    Compiling,
}

impl GpuEngine {
    /// Opens the chosen adapter and compiles the scene's kernel; `access` overrides the rule that picks
    /// baked or buffered values.
    pub fn new(
        choice: &Choice,
        world: &World,
        settings: &Settings,
        access: Option<Access>,
    ) -> Result<Self, GpuError> {
        Self::on(Gpu::open(choice)?, world, settings, access)
    }

    /// The same on an open device.
    pub fn on(
        gpu: impl Into<Arc<Gpu>>,
        world: &World,
        settings: &Settings,
        access: Option<Access>,
    ) -> Result<Self, GpuError> {
        Self::on_telling(gpu, world, settings, access, |_| ())
    }

    /// The same, and `tell` hears what is under way: large scenes take a while.
    pub fn on_telling(
        gpu: impl Into<Arc<Gpu>>,
        world: &World,
        settings: &Settings,
        access: Option<Access>,
        mut tell: impl FnMut(Making),
    ) -> Result<Self, GpuError> {
        let gpu = gpu.into();
        tell(Making::Composing);
        let access = access.unwrap_or_else(|| Access::choose_for(world, &gpu.info));
        let kernel = compose(world, settings, Some(access));
        // SAFETY: it is what `compose` made.
        unsafe { Self::make(gpu, world, settings, kernel, tell) }
    }

    /// The same with a kernel that has been changed, for tests that must see what a fault does to pictures.
    ///
    /// # Safety
    ///
    /// `kernel` is what [`compose`] made for this world and these settings, or indexes and loops as that does: it runs
    /// without runtime checks.
    pub unsafe fn with_kernel(
        gpu: impl Into<Arc<Gpu>>,
        world: &World,
        settings: &Settings,
        kernel: Kernel,
    ) -> Result<Self, GpuError> {
        // SAFETY: as above.
        unsafe { Self::make(gpu.into(), world, settings, kernel, |_| ()) }
    }

    /// # Safety
    ///
    /// That of [`with_kernel`](Self::with_kernel).
    unsafe fn make(
        gpu: Arc<Gpu>,
        world: &World,
        settings: &Settings,
        kernel: Kernel,
        mut tell: impl FnMut(Making),
    ) -> Result<Self, GpuError> {
        let start = Instant::now();
        let unable = |problem: String| GpuError::Unable {
            adapter: gpu.info.name.clone(),
            problem,
        };
        if kernel.trips_per_sample > gpu.trip_limit {
            return Err(unable(trips::too_many(
                "one path of this scene may take",
                kernel.trips_per_sample,
                &format!(" (max_depth {})", settings.max_depth),
            )));
        }
        tell(Making::Packing);
        let packed = pack(world, kernel.access, kernel.cells.as_ref());
        let device = &gpu.device;
        let limits = device.limits();
        let problem = scene::too_large(&packed, world.surface_count(), &limits);
        if let Some(problem) = problem.or_else(|| volumes::too_large(world, &limits)) {
            return Err(unable(problem));
        }
        let oom = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        tell(Making::Compiling);
        // SAFETY: without runtime checks the kernel must not index out of bounds or loop for ever. All its
        // indices are numbers of surfaces, materials and lights that `pack` wrote into buffers of just that
        // length, cells of a volume that it clamps to its size, or pixels that it compares with the tile's size first; its loops run over constant
        // ranges, over samples, each at most max_depth vertices and some glances long, or along nodes whose
        // next ones come later in a fixed order of the tree.
        let module = unsafe {
            device.create_shader_module_trusted(
                wgpu::ShaderModuleDescriptor {
                    label: Some("path"),
                    source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
                },
                wgpu::ShaderRuntimeChecks::unchecked(),
            )
        };
        let invalid = pollster::block_on(scope.pop());
        if let Some(error) = invalid {
            return Err(GpuError::Kernel(error.to_string()));
        }
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let scene_layout = scene::layout(device, kernel.access, Some(world));
        let film_layout = tile::layout(device);
        let bound = kernel.light.as_ref().filter(|l| l.aims_bound);
        let aims_layout = bound.map(|_| light_paths::aims_layout(device));
        let mut layouts = vec![Some(&scene_layout), Some(&film_layout)];
        layouts.extend(aims_layout.as_ref().map(Some));
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("path"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("render"),
            compilation_options: Default::default(),
            cache: None,
        });
        let scene = scene::bind(&gpu, &scene_layout, &packed, world);
        let aims = (aims_layout.zip(bound))
            .map(|(layout, light)| light_paths::bind_aims(&gpu, &layout, world, light));
        // SAFETY: it belongs to the path kernel.
        let light = (kernel.light.as_ref())
            .map(|k| unsafe { LightTracer::new(&gpu, world, k, &scene_layout) });
        let light = light.transpose().map_err(unable)?;
        let params = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("params"),
            size: size_of::<Params>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let errors = [
            pollster::block_on(scope.pop()),
            pollster::block_on(oom.pop()),
        ];
        if let Some(error) = errors.into_iter().flatten().next() {
            return Err(unable(format!("the driver rejected the kernel: {error}")));
        }
        let seen = (kernel.sight > 0).then(|| GlanceMarks::new(world, settings, kernel.sight));
        let mut engine = Self {
            kernel,
            pipeline,
            scene,
            aims,
            light,
            film_layout,
            params,
            tile: None,
            seen,
            marked: None,
            held: None,
            seed: settings.seed,
            by_chance: settings.finds_light_by_chance(),
            seconds_per_path: None,
            compile_seconds: 0.0,
            read_back_seconds: 0.0,
            gpu,
        };
        engine.warm_up().map_err(|problem| GpuError::Unable {
            adapter: engine.gpu.info.name.clone(),
            problem,
        })?;
        engine.compile_seconds = start.elapsed().as_secs_f64();
        Ok(engine)
    }

    /// Seconds from the opened device to the compiled kernel.
    pub fn compile_seconds(&self) -> f64 {
        self.compile_seconds
    }

    /// Seconds spent so far on reading back what dispatches left, and on folding it into films.
    pub fn read_back_seconds(&self) -> f64 {
        self.read_back_seconds
    }

    /// The kernel.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Sets another seed. No part of the kernel depends on it.
    pub fn reseed(&mut self, seed: u32) {
        self.seed = seed;
    }

    /// Drivers may compile at the first dispatch: make it one without samples.
    fn warm_up(&mut self) -> Result<(), String> {
        let rect = Rect {
            x0: 0,
            y0: 0,
            x1: 1,
            y1: 1,
        };
        self.prepare_tile(rect)?;
        self.dispatch(rect, 0, 0..1, 0)?;
        self.tile = None;
        Ok(())
    }

    fn prepare_tile(&mut self, rect: Rect) -> Result<(), String> {
        let size = [rect.width(), rect.height()];
        if self.tile.as_ref().is_none_or(|t| t.size != size) {
            self.tile = None;
            self.held = None;
            let oom = self
                .gpu
                .device
                .push_error_scope(wgpu::ErrorFilter::OutOfMemory);
            let invalid = self
                .gpu
                .device
                .push_error_scope(wgpu::ErrorFilter::Validation);
            self.marked = None;
            let marks = self.seen.is_some();
            let tile = Tile::new(&self.gpu, &self.film_layout, &self.params, size, marks);
            let invalid = pollster::block_on(invalid.pop());
            // What failed for want of memory is invalid where it is used: the first cause is told.
            if let Some(e) = pollster::block_on(oom.pop()).or(invalid) {
                return Err(format!(
                    "not enough memory for a tile of {} x {} pixels: {e}",
                    size[0], size[1]
                ));
            }
            self.tile = Some(tile);
        }
        Ok(())
    }

    /// Whether the kernel counts its loop trips and leaves what it cannot finish.
    fn counts_trips(&self) -> bool {
        self.kernel.trips_per_sample == 0
    }

    /// Dispatches up to `most` samples of each pixel of some of the workgroups of `rect` until all are done. `place` says
    /// which texture holds the running sums; the new ones are in the other in the end.
    fn submit(
        &self,
        rect: Rect,
        most: u64,
        groups: Range<u32>,
        place: usize,
    ) -> Result<(), String> {
        self.dispatch(rect, most, groups.clone(), place)?;
        // Every dispatch reads one texture and writes the other.
        let mut from = 1 - place;
        while self.counts_trips() {
            let [unfinished, stuck] = self.tile.as_ref().ok_or("no tile")?.unfinished(&self.gpu)?;
            if unfinished == 0 && from == 1 - place {
                break;
            }
            if stuck > 0 {
                let (x, y) = ((stuck - 1) % rect.width(), (stuck - 1) / rect.width());
                let path = format!(
                    "one path of pixel {}, {} takes more than",
                    rect.x0 + x,
                    rect.y0 + y
                );
                return Err(trips::too_many(&path, self.gpu.trip_limit, ""));
            }
            self.dispatch(rect, most, groups.clone(), from)?;
            from = 1 - from;
        }
        Ok(())
    }

    /// Makes one dispatch and waits for it. Each pixel continues where its last dispatch ended.
    fn dispatch(
        &self,
        rect: Rect,
        most: u64,
        groups: Range<u32>,
        place: usize,
    ) -> Result<(), String> {
        let tile = self.tile.as_ref().ok_or("no tile")?;
        let all = workgroups(rect);
        let number = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        let params = Params {
            tile: [rect.x0, rect.y0],
            size: [rect.width(), rect.height()],
            pixels: number(rect.area()),
            max_samples: number(most),
            seed: self.seed,
            groups: all,
            first_group: groups.start,
            stride: coprime_stride(all),
            trips: number(self.gpu.trip_limit),
            opaque_two: 2,
        };
        self.gpu
            .queue
            .write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        tile.clear_unfinished(&mut encoder);
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.scene, &[]);
            pass.set_bind_group(1, &tile.bind_groups[place], &[]);
            if let Some(aims) = &self.aims {
                pass.set_bind_group(2, aims, &[]);
            }
            pass.dispatch_workgroups(groups.end - groups.start, 1, 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()
    }

    /// Does the work on the pixels of `rect`, in as many submissions as its cost asks for. A lane that
    /// takes many samples of its pixel one after another waits the least for its neighbours' longer paths, so what is
    /// cut is the picture, and the samples only where the driver's limit on loop trips is near.
    fn submit_all(
        &mut self,
        rect: Rect,
        work: &Work,
        place: &mut usize,
        stop: &AtomicBool,
    ) -> Result<(), EngineError> {
        let most = (self.gpu.trip_limit / self.kernel.trips_per_sample.max(1)).max(1);
        let mut done = 0;
        while done < work.longest {
            let paths = work.paths(done, most);
            let mut group = 0;
            while group < paths.len() {
                if stop.load(Ordering::Relaxed) {
                    return Err(EngineError::Stopped);
                }
                let affordable = match self.seconds_per_path {
                    Some(cost) => SUBMISSION_SECONDS / cost,
                    None => FIRST_PATHS[usize::from(!self.gpu.info.software)],
                };
                let (mut end, mut sum) = (group + 1, paths[group] as f64);
                while end < paths.len() && sum + paths[end] as f64 <= affordable {
                    sum += paths[end] as f64;
                    end += 1;
                }
                let start = Instant::now();
                self.submit(rect, most, group as u32..end as u32, *place)
                    .map_err(EngineError::Device)?;
                // Where there is nothing to do its cost tells nothing.
                if sum > 0.0 {
                    let cost = start.elapsed().as_secs_f64() / sum;
                    // What was too little to keep an adapter busy says nothing of what more will cost.
                    let known = self.seconds_per_path.unwrap_or(cost);
                    self.seconds_per_path = Some(cost.min(0.5 * (known + cost)));
                }
                group = end;
            }
            *place = 1 - *place;
            done += most;
        }
        Ok(())
    }

    fn render_tile(
        &mut self,
        film: &Film,
        rect: Rect,
        parts: &[Part],
        stop: &AtomicBool,
    ) -> Result<Vec<[u32; 4]>, EngineError> {
        let device_error = EngineError::Device;
        self.prepare_tile(rect).map_err(device_error)?;
        let tile = self
            .tile
            .as_ref()
            .ok_or_else(|| EngineError::Device("no tile".into()))?;
        if let Some(seen) = self.seen.as_mut().filter(|_| self.marked != Some(rect)) {
            tile.upload_seen(&self.gpu, seen.marks(rect));
            self.marked = Some(rect);
        }
        let work = Work::new(rect, parts);
        tile.upload_ranges(&self.gpu, &work.ranges());
        let mut place = 0;
        let held = self.held.take();
        if parts.iter().any(continues_block) {
            match &held {
                Some(held) if held.serves(film, rect, parts) => place = held.place,
                _ => {
                    let pixels =
                        (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)));
                    let running: Vec<_> = pixels.map(|(x, y)| film.partial_at(x, y)).collect();
                    tile.upload(&self.gpu, &running);
                }
            };
        }
        // Its memory serves again: fresh pages would cost as much as filling them.
        let mut running = held.map_or(Vec::new(), |held| held.running);
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        tile.clear_counters(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);

        self.submit_all(rect, &work, &mut place, stop)?;
        let tile = self
            .tile
            .as_ref()
            .ok_or_else(|| EngineError::Device("no tile".into()))?;
        let begun = Instant::now();
        let counters = tile
            .download(&self.gpu, place, &mut running)
            .map_err(device_error)?;
        self.read_back_seconds += begun.elapsed().as_secs_f64();
        self.held = Some(Held {
            tile: rect,
            place,
            running,
        });
        Ok(counters)
    }
}

impl Engine for GpuEngine {
    fn render_parts(
        &mut self,
        film: &mut Film,
        tile: Rect,
        parts: &[Part],
        stop: &AtomicBool,
    ) -> Result<Counters, EngineError> {
        let counted = self.render_tile(film, tile, parts, stop)?;
        let begun = Instant::now();
        let held = self.held.as_ref().map_or(&[][..], |h| &h.running);
        let width = tile.width() as usize;
        let at = |x: u32, y: u32| (y - tile.y0) as usize * width + (x - tile.x0) as usize;
        let mut counters = Counters::default();
        for part in parts {
            let Part { rect, samples } = part;
            counters.paths += part.paths();
            let rows: Vec<_> = (rect.y0..rect.y1)
                .into_par_iter()
                .map(|y| {
                    count_row(
                        (rect.x0..rect.x1).map(|x| (x, y, counted[at(x, y)])),
                        samples,
                    )
                })
                .collect();
            for row in rows {
                counters += row.counters;
                for (x, y, samples) in row.lost {
                    film.leave_out(x, y, samples);
                }
                if self.by_chance {
                    row.reached
                        .iter()
                        .for_each(|&(x, y, how)| film.reach(x, y, how));
                }
            }
            film.put_block(*rect, samples.clone(), |x, y| held[at(x, y)]);
        }
        self.read_back_seconds += begun.elapsed().as_secs_f64();
        Ok(counters)
    }

    fn light_paths(&self) -> Option<SplatSetup> {
        self.light.as_ref().map(LightTracer::setup)
    }

    fn trace_light(
        &mut self,
        passes: Range<u64>,
        stop: &AtomicBool,
    ) -> Result<(Vec<Splat>, Counters), EngineError> {
        let Some(light) = &mut self.light else {
            return Ok((Vec::new(), Counters::default()));
        };
        let mut splats = Vec::new();
        let (gpu, scene, seed) = (&self.gpu, &self.scene, self.seed);
        let counters = light.trace(gpu, scene, seed, passes, stop, |s| splats.push(s))?;
        Ok((splats, counters))
    }

    fn reseed(&mut self, seed: u32) {
        self.seed = seed;
    }

    fn device(&self) -> &DeviceInfo {
        &self.gpu.info
    }
}

#[cfg(test)]
mod tests;
