//! Group 0 of every kernel: the storage buffers of a scene, and the texture that holds its trees.

use super::Gpu;
use super::pack::Packed;
use crate::kernel::trees::NODES_A_ROW;
use wgpu::util::DeviceExt as _;

/// The binding of the trees.
const NODES: u32 = 3;

/// What is only read: surfaces, materials, lights; trees, light clusters, and the lights in their order.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let buffer = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::ReadOnly,
        format: wgpu::TextureFormat::Rgba32Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: if binding == NODES { texture } else { buffer },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &[0, 1, 2, 3, 4, 5].map(entry),
    })
}

/// Makes buffers and texture, and binds them.
pub(super) fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, packed: &Packed) -> wgpu::BindGroup {
    let buffer = |contents: &[u8]| {
        gpu.device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("scene"),
                contents,
                usage: wgpu::BufferUsages::STORAGE,
            })
    };
    let surfaces = buffer(bytemuck::cast_slice(&packed.surfaces));
    let materials = buffer(bytemuck::cast_slice(&packed.materials));
    let lights = buffer(bytemuck::cast_slice(&packed.lights));
    let clusters = buffer(bytemuck::cast_slice(&packed.clusters));
    let places = buffer(bytemuck::cast_slice(&packed.places));
    let nodes = nodes(gpu, &packed.nodes);
    let resources = [
        surfaces.as_entire_binding(),
        materials.as_entire_binding(),
        lights.as_entire_binding(),
        wgpu::BindingResource::TextureView(&nodes),
        clusters.as_entire_binding(),
        places.as_entire_binding(),
    ];
    let mut binding = 0..;
    let entries = resources.map(|resource| wgpu::BindGroupEntry {
        binding: binding.next().expect("endless"),
        resource,
    });
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout,
        entries: &entries,
    })
}

/// The trees as a texture: one row, or whole ones.
fn nodes(gpu: &Gpu, nodes: &[[u32; 4]]) -> wgpu::TextureView {
    let width = (nodes.len() as u32).min(2 * NODES_A_ROW);
    let descriptor = wgpu::TextureDescriptor {
        label: Some("nodes"),
        size: wgpu::Extent3d {
            width,
            height: nodes.len() as u32 / width,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    };
    let bytes = bytemuck::cast_slice(nodes);
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture = gpu
        .device
        .create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
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
