//! Group 0 of every kernel: the storage buffers of a scene, and the texture of records for kernels with trees.

use super::Gpu;
use super::pack::Packed;
use crate::kernel::records::RECORDS_A_ROW;
use wgpu::util::DeviceExt as _;

/// The binding of the records.
const RECORDS: u32 = 3;

/// What is only read: surfaces, materials, lights, records.
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
        ty: if binding == RECORDS { texture } else { buffer },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &[0, 1, 2, 3].map(entry),
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
    let records = records(gpu, &packed.records);
    let resources = [
        surfaces.as_entire_binding(),
        materials.as_entire_binding(),
        lights.as_entire_binding(),
        wgpu::BindingResource::TextureView(&records),
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

/// A texture of one row, or of whole ones.
fn records(gpu: &Gpu, records: &[[u32; 4]]) -> wgpu::TextureView {
    let width = (records.len() as u32).min(RECORDS_A_ROW);
    let descriptor = wgpu::TextureDescriptor {
        label: Some("records"),
        size: wgpu::Extent3d {
            width,
            height: records.len() as u32 / width,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    };
    let bytes = bytemuck::cast_slice(records);
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture = gpu
        .device
        .create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// What is too large for a device, with the numbers.
pub(super) fn too_large(packed: &Packed, limits: &wgpu::Limits) -> Option<String> {
    let bound = limits.max_storage_buffer_binding_size;
    let sizes = [
        (
            "surfaces",
            packed.surfaces.len(),
            size_of_val(&packed.surfaces[..]),
        ),
        (
            "materials",
            packed.materials.len(),
            size_of_val(&packed.materials[..]),
        ),
    ];
    for (what, count, bytes) in sizes {
        if bytes as u64 > bound {
            return Some(format!(
                "{count} {what} need a storage buffer of {bytes} bytes, but it allows at most {bound}"
            ));
        }
    }
    let rows = packed.records.len().div_ceil(RECORDS_A_ROW as usize);
    let most = limits.max_texture_dimension_2d;
    (rows > most as usize).then(|| {
        format!(
            "{} surfaces with their trees need a texture of {rows} rows of {RECORDS_A_ROW}, but it allows at most {most}",
            packed.surfaces.len()
        )
    })
}
