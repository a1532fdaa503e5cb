//! Group 0 of every kernel: the scene, as far as it is not in the kernel's text.

use super::Gpu;
use super::pack::Packed;
use super::volumes;
use crate::kernel::Access;
use crate::kernel::records::RECORDS_A_ROW;
use crate::kernel::trees::{MAX_UNITS, UNIT};
use crate::world::World;
use wgpu::util::DeviceExt as _;

/// What is only read: nothing; surfaces, materials and lights; or records. And the volumes of `world`.
pub(super) fn layout(
    device: &wgpu::Device,
    access: Access,
    world: Option<&World>,
) -> wgpu::BindGroupLayout {
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
    let bound: &[wgpu::BindingType] = match access {
        Access::Baked => &[],
        Access::Buffers => &[buffer; 3],
        Access::Tree => &[texture],
    };
    let mut entries: Vec<_> = (0..)
        .zip(bound)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    entries.extend(world.into_iter().flat_map(volumes::entries));
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &entries,
    })
}

/// Makes buffers or textures, and binds them.
pub(super) fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    packed: &Packed,
    world: &World,
) -> wgpu::BindGroup {
    let volumes = volumes::textures(gpu, world);
    let group = |resources: &[wgpu::BindingResource]| {
        let numbered = (0..).zip(resources);
        let views = volumes.iter();
        let views = views.map(|(binding, v)| (*binding, wgpu::BindingResource::TextureView(v)));
        let entries: Vec<_> = numbered
            .map(|(binding, resource)| (binding, resource.clone()))
            .chain(views)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout,
            entries: &entries,
        })
    };
    match packed {
        Packed::Baked => group(&[]),
        Packed::Buffers(arrays) => {
            let contents: [&[u8]; 3] = [
                bytemuck::cast_slice(&arrays.surfaces),
                bytemuck::cast_slice(&arrays.materials),
                bytemuck::cast_slice(&arrays.lights),
            ];
            let buffers = contents.map(|contents| {
                gpu.device
                    .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                        label: Some("scene"),
                        contents,
                        usage: wgpu::BufferUsages::STORAGE,
                    })
            });
            group(&buffers.each_ref().map(|b| b.as_entire_binding()))
        }
        Packed::Records(records) => {
            group(&[wgpu::BindingResource::TextureView(&texture(gpu, records))])
        }
    }
}

/// A texture of one row, or of whole ones.
fn texture(gpu: &Gpu, records: &[[u32; 4]]) -> wgpu::TextureView {
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

/// What is too large for a device, with the numbers; of a world with so many `surfaces`.
pub(super) fn too_large(packed: &Packed, surfaces: usize, limits: &wgpu::Limits) -> Option<String> {
    match packed {
        Packed::Baked => None,
        Packed::Buffers(arrays) => {
            let bound = limits.max_storage_buffer_binding_size;
            let bytes = size_of_val(&arrays.surfaces[..]).max(size_of_val(&arrays.materials[..]));
            (bytes as u64 > bound).then(|| {
                format!(
                    "{surfaces} surfaces need a storage buffer of {bytes} bytes, but it allows at most {bound}"
                )
            })
        }
        Packed::Records(records) => {
            let rows = records.len().div_ceil(RECORDS_A_ROW as usize);
            let most = (limits.max_texture_dimension_2d as usize)
                .min(MAX_UNITS * UNIT / RECORDS_A_ROW as usize);
            (rows > most).then(|| {
                format!(
                    "{surfaces} surfaces with their trees need a texture of {rows} rows of {RECORDS_A_ROW}, but it allows at most {most}"
                )
            })
        }
    }
}
