//! Volumes in group 0 of a kernel: for each a texture of its numbers, and one of the empty cubes around its cells.

use super::Gpu;
use crate::files::npy::Numbers;
use crate::implicit::Grid;
use crate::kernel::{FIRST_BINDING, holds_heights, volumes};
use crate::world::World;

/// Bytes that are handed to the driver at once: what waits for it is a copy.
const AT_ONCE: usize = 16 << 20;

fn format_of(numbers: &Numbers) -> wgpu::TextureFormat {
    match numbers {
        Numbers::U8(_) => wgpu::TextureFormat::R8Uint,
        Numbers::U16(_) => wgpu::TextureFormat::R16Uint,
        Numbers::F32(_) | Numbers::F64(_) => wgpu::TextureFormat::R32Float,
    }
}

/// The bindings of a world's volumes.
pub(super) fn entries(world: &World) -> Vec<wgpu::BindGroupLayoutEntry> {
    let kinds = volumes(world).into_iter().flat_map(|(grid, _)| {
        let numbers = match holds_heights(grid.volume.numbers()) {
            true => wgpu::TextureSampleType::Float { filterable: false },
            false => wgpu::TextureSampleType::Uint,
        };
        [numbers, wgpu::TextureSampleType::Uint]
    });
    (FIRST_BINDING..)
        .zip(kinds)
        .map(|(binding, sample_type)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D3,
                multisampled: false,
            },
            count: None,
        })
        .collect()
}

/// What is bound there.
pub(super) fn textures(gpu: &Gpu, world: &World) -> Vec<(u32, wgpu::TextureView)> {
    let views = volumes(world)
        .into_iter()
        .flat_map(|(grid, level)| [numbers(gpu, grid, level), cubes(gpu, grid, level)]);
    (FIRST_BINDING..).zip(views).collect()
}

/// What is too large for a device.
pub(super) fn too_large(world: &World, limits: &wgpu::Limits) -> Option<String> {
    let most = limits.max_texture_dimension_3d as usize;
    let all = volumes(world);
    let large = all
        .iter()
        .find(|(grid, _)| grid.volume.size().iter().any(|n| *n > most));
    large.map(|(grid, _)| {
        let [x, y, z] = grid.volume.size();
        format!(
            "the volume {} has {x} x {y} x {z} points, but it allows at most {most} along an axis",
            grid.file
        )
    })
}

fn numbers(gpu: &Gpu, grid: &Grid, level: f64) -> wgpu::TextureView {
    let volume = &grid.volume;
    let size = volume.size();
    let slab = size[0] * size[1];
    let gain = grid.gain(level);
    let texture = texture(gpu, size, format_of(volume.numbers()));
    // Floats are scaled before the level is taken off: the difference may be more than f64 holds.
    let floats = |wide: &mut dyn Iterator<Item = f64>| -> Vec<u8> {
        let heights: Vec<f32> = wide.map(|v| (v * gain - level * gain) as f32).collect();
        bytemuck::cast_slice(&heights).to_vec()
    };
    upload(gpu, &texture, size, |from, to| {
        let range = from * slab..to * slab;
        match volume.numbers() {
            Numbers::U8(all) => all[range].to_vec(),
            Numbers::U16(all) => bytemuck::cast_slice(&all[range]).to_vec(),
            Numbers::F32(all) => floats(&mut all[range].iter().map(|v| f64::from(*v))),
            Numbers::F64(all) => floats(&mut all[range].iter().copied()),
        }
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn cubes(gpu: &Gpu, grid: &Grid, level: f64) -> wgpu::TextureView {
    let cells = grid.volume.cells();
    let texture = texture(gpu, cells, wgpu::TextureFormat::R8Uint);
    let all = grid.volume.hierarchy(level);
    let slab = cells[0] * cells[1];
    upload(gpu, &texture, cells, |from, to| {
        all[from * slab..to * slab].to_vec()
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn texture(gpu: &Gpu, size: [usize; 3], format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("volume"),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn extent([width, height, depth]: [usize; 3]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: width as u32,
        height: height as u32,
        depth_or_array_layers: depth as u32,
    }
}

/// Fills a texture, some layers after others; `bytes` gives those of the layers from one to another.
fn upload(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    [width, height, depth]: [usize; 3],
    bytes: impl Fn(usize, usize) -> Vec<u8>,
) {
    let pixel = texture.format().block_copy_size(None).unwrap_or(4) as usize;
    let layers = (AT_ONCE / (pixel * width * height)).max(1);
    for from in (0..depth).step_by(layers) {
        let to = depth.min(from + layers);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d {
                    x: 0,
                    y: 0,
                    z: from as u32,
                },
                aspect: wgpu::TextureAspect::All,
            },
            &bytes(from, to),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((pixel * width) as u32),
                rows_per_image: Some(height as u32),
            },
            extent([width, height, to - from]),
        );
        if to < depth {
            // So that the copies do not gather. An error is found by whoever waits next.
            gpu.queue.submit([]);
            let _ = gpu.wait();
        }
    }
}
