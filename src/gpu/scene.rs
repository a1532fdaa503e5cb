//! Group 0 of every kernel: the storage buffers of a scene.

use super::pack::Packed;
use wgpu::util::DeviceExt as _;

/// Three buffers that are only read: surfaces, materials, lights.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let storage = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &[storage(0), storage(1), storage(2)],
    })
}

/// Makes the buffers and binds them.
pub(super) fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    packed: &Packed,
) -> wgpu::BindGroup {
    let buffer = |contents: &[u8]| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("scene"),
            contents,
            usage: wgpu::BufferUsages::STORAGE,
        })
    };
    let buffers = [
        buffer(bytemuck::cast_slice(&packed.surfaces)),
        buffer(bytemuck::cast_slice(&packed.materials)),
        buffer(bytemuck::cast_slice(&packed.lights)),
    ];
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout,
        entries: &[0, 1, 2].map(|k| wgpu::BindGroupEntry {
            binding: k as u32,
            resource: buffers[k].as_entire_binding(),
        }),
    })
}
