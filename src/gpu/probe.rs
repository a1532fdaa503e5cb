//! Probes: functions of the shader modules run on chosen inputs, to hold them against closed forms and f64 twins.

use super::Gpu;
use super::adapters::WORKGROUP;
use crate::kernel::probe_source;
use wgpu::util::DeviceExt as _;

/// Numbers in and out of one invocation.
pub type Values = [f32; 16];

/// What an output reads that no invocation wrote; no function returns it.
pub const UNWRITTEN: f32 = -1.234_567_8e-30;

/// Runs `body` once for each of `inputs`: WGSL statements that read `x`, an array of 16 floats, and write
/// `y`, another. The product's own modules are there, under `features`.
///
/// # Errors
/// When the module is refused or the device fails.
pub fn run(
    gpu: &Gpu,
    features: &[&'static str],
    body: &str,
    inputs: &[Values],
) -> Result<Vec<Values>, String> {
    let device = &gpu.device;
    let source = probe_source(features, body);
    let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("probe"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("probe"),
        layout: None,
        module: &module,
        entry_point: Some("probe"),
        compilation_options: Default::default(),
        cache: None,
    });
    if let Some(e) = pollster::block_on(invalid.pop()) {
        return Err(e.to_string());
    }
    let bytes = size_of_val(inputs) as u64;
    let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("inputs"),
        contents: bytemuck::cast_slice(inputs),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let unwritten = vec![[UNWRITTEN; 16]; inputs.len()];
    let output = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("outputs"),
        contents: bytemuck::cast_slice(&unwritten),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    });
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("staging"),
        size: bytes,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: input.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: output.as_entire_binding(),
            },
        ],
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
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
