//! Probes: functions of the shader modules run on chosen inputs, to hold them against closed forms and f64 twins.

use super::adapters::WORKGROUP;
use super::pack::pack;
use super::{Gpu, scene};
use crate::kernel::{Access, ProbeFeatures, probe_source};
use crate::world::World;
use glam::DVec3;
use wgpu::util::DeviceExt as _;

/// Numbers in and out of one invocation.
pub type Values = [f32; 16];

/// What an output reads that no invocation wrote; no function returns it.
pub const UNWRITTEN: f32 = -1.234_567_8e-30;

/// Deterministic uniform numbers for inputs, by Knuth's linear congruence.
pub struct Uniform(pub u64);

impl Uniform {
    /// The next, in [0, 1): a multiple of 2⁻²⁴, as f32 holds.
    #[allow(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }

    /// The next, in [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next()
    }

    /// The next three, each in [-1, 1).
    pub fn vector(&mut self) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.between(-1.0, 1.0)))
    }
}

/// Runs `body` once for each of `inputs`: WGSL statements that read `x`, an array of 16 floats, and write
/// `y`, another. The product's own modules are there, under `features`.
///
/// # Errors
/// When the module is refused or the device fails.
pub fn run(
    gpu: &Gpu,
    features: &ProbeFeatures,
    body: &str,
    inputs: &[Values],
) -> Result<Vec<Values>, String> {
    Probe::compile(gpu, &probe_source(features, body), None)?.run(gpu, None, inputs)
}

/// A compiled probe.
pub struct Probe {
    pipeline: wgpu::ComputePipeline,
    /// Layout of a scene's buffers, if it reads any, and how.
    scene: Option<(wgpu::BindGroupLayout, Access)>,
    values: wgpu::BindGroupLayout,
}

impl Probe {
    /// Compiles `source`, which reads a scene's buffers if it was composed for such an access.
    ///
    /// # Errors
    /// When the module is refused.
    pub fn compile(gpu: &Gpu, source: &str, access: Option<Access>) -> Result<Self, String> {
        Self::compile_for(gpu, source, access, None)
    }

    /// The same for a source that reads the volumes of `world` too.
    ///
    /// # Errors
    /// When the module is refused.
    pub fn compile_for(
        gpu: &Gpu,
        source: &str,
        access: Option<Access>,
        world: Option<&World>,
    ) -> Result<Self, String> {
        let device = &gpu.device;
        let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("probe"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let scene = access.map(|access| (scene::layout(device, access, world), access));
        let values = values_layout(device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("probe"),
            bind_group_layouts: &[scene.as_ref().map(|s| &s.0), Some(&values)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("probe"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("probe"),
            compilation_options: Default::default(),
            cache: None,
        });
        match pollster::block_on(invalid.pop()) {
            Some(e) => Err(e.to_string()),
            None => Ok(Self {
                pipeline,
                scene,
                values,
            }),
        }
    }

    /// Runs it once for each of `inputs`. A probe of a scene takes a `world` that would compose the same text: the one
    /// it was composed for, or, where values are in buffers, another with as many things of the same kinds.
    ///
    /// # Errors
    /// When the device fails.
    pub fn run(
        &self,
        gpu: &Gpu,
        world: Option<&World>,
        inputs: &[Values],
    ) -> Result<Vec<Values>, String> {
        let device = &gpu.device;
        let bytes = size_of_val(inputs) as u64;
        let buffer = |contents: &[Values], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("values"),
                contents: bytemuck::cast_slice(contents),
                usage: wgpu::BufferUsages::STORAGE | usage,
            })
        };
        let input = buffer(inputs, wgpu::BufferUsages::empty());
        let unwritten = vec![[UNWRITTEN; 16]; inputs.len()];
        let output = buffer(&unwritten, wgpu::BufferUsages::COPY_SRC);
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let values = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.values,
            entries: &[(0, &input), (1, &output)].map(|(binding, b)| wgpu::BindGroupEntry {
                binding,
                resource: b.as_entire_binding(),
            }),
        });
        let scene = (self.scene.as_ref().zip(world)).map(|((layout, access), world)| {
            let packed = pack(world, *access, None);
            scene::bind(gpu, layout, &packed, world)
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            if let Some(scene) = &scene {
                pass.set_bind_group(0, scene, &[]);
            }
            pass.set_bind_group(1, &values, &[]);
            pass.dispatch_workgroups((inputs.len() as u32).div_ceil(WORKGROUP), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &staging, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait()?;
        let mapped = staging
            .slice(..)
            .get_mapped_range()
            .map_err(|e| e.to_string())?;
        Ok(bytemuck::pod_collect_to_vec(&mapped))
    }
}

fn values_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("values"),
        entries: &[entry(0, true), entry(1, false)],
    })
}
