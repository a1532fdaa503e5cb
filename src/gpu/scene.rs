//! Group 0 of every kernel: the storage buffers of a scene.

use super::pack::Packed;
use wgpu::util::DeviceExt as _;

/// Buffers that are only read: surfaces, materials, lights; trees, light clusters, and the lights in their order.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let storage = |binding: u32| wgpu::BindGroupLayoutEntry {
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
        entries: &[0, 1, 2, 3, 4, 5].map(storage),
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
        buffer(bytemuck::cast_slice(&packed.nodes)),
        buffer(bytemuck::cast_slice(&packed.clusters)),
        buffer(bytemuck::cast_slice(&packed.places)),
    ];
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout,
        entries: &[0, 1, 2, 3, 4, 5].map(|k| wgpu::BindGroupEntry {
            binding: k as u32,
            resource: buffers[k].as_entire_binding(),
        }),
    })
}

/// What is too large for a device that binds at most `limit` bytes, with the numbers.
pub(super) fn too_large(packed: &Packed, limit: u64) -> Option<String> {
    let sizes = [
        (
            "surfaces",
            packed.surfaces.len(),
            size_of_val(&packed.surfaces[..]),
        ),
        (
            "surfaces",
            packed.surfaces.len(),
            size_of_val(&packed.nodes[..]),
        ),
        (
            "materials",
            packed.materials.len(),
            size_of_val(&packed.materials[..]),
        ),
        (
            "lights",
            packed.lights.len(),
            size_of_val(&packed.clusters[..]),
        ),
    ];
    let (what, count, bytes) = sizes.into_iter().find(|s| s.2 as u64 > limit)?;
    Some(format!(
        "{count} {what} need a storage buffer of {bytes} bytes, it binds {limit} at most"
    ))
}
