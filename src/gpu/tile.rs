//! The textures and buffers of one tile, and their way to and from the host.

use super::Gpu;
use crate::film::{REPLICATES, Sums};
use rayon::prelude::*;

/// Bytes of an rgba32float texel.
const TEXEL: u32 = 16;

/// GPU memory for a tile of `size` pixels.
pub(super) struct Tile {
    pub size: [u32; 2],
    /// Running sums, one layer for each replicate; a dispatch reads one and writes the other.
    textures: [wgpu::Texture; 2],
    /// Bind group k reads texture k.
    pub bind_groups: [wgpu::BindGroup; 2],
    counters: wgpu::Buffer,
    /// The work to do, as `Work` of `shaders/film.wgsl` says.
    work: wgpu::Buffer,
    staging: wgpu::Buffer,
}

/// Bytes of the two counts at the head of `Work`.
const WORK_HEAD: u64 = 8;

fn row_bytes(width: u32) -> u32 {
    (width * TEXEL).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// llvmpipe compiles a kernel again for textures whose width or height is a power of two, as if it sampled them. With no such
/// textures the compilation at start-up serves every tile.
fn not_a_power_of_two(n: u32) -> u32 {
    if n.is_power_of_two() {
        n + 1 + u32::from(n == 1)
    } else {
        n
    }
}

impl Tile {
    pub fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        params: &wgpu::Buffer,
        size: [u32; 2],
        marks_seen: bool,
    ) -> Self {
        let texture = || {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("running sums"),
                size: extent(size.map(not_a_power_of_two), REPLICATES as u32),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let textures = [texture(), texture()];
        let counter_bytes = u64::from(size[0]) * u64::from(size[1]) * u64::from(TEXEL);
        let counters = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("counters"),
            size: counter_bytes,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let numbers = if marks_seen { 3 } else { 2 } * pixels;
        let work = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("work"),
            size: WORK_HEAD + 4 * numbers,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: counter_bytes.next_multiple_of(256) + layer_bytes(size) * REPLICATES as u64,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let view = |k: usize| {
            textures[k].create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let bind_group = |from: usize| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("film"),
                layout,
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: params.as_entire_binding(),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: wgpu::BindingResource::TextureView(&view(from)),
                    },
                    wgpu::BindGroupEntry {
                        binding: 2,
                        resource: wgpu::BindingResource::TextureView(&view(1 - from)),
                    },
                    wgpu::BindGroupEntry {
                        binding: 3,
                        resource: counters.as_entire_binding(),
                    },
                    wgpu::BindGroupEntry {
                        binding: 4,
                        resource: work.as_entire_binding(),
                    },
                ],
            })
        };
        let bind_groups = [bind_group(0), bind_group(1)];
        Self {
            size,
            textures,
            bind_groups,
            counters,
            work,
            staging,
        }
    }

    /// Uploads which samples each pixel is to get: see [`Work::ranges`](super::work::Work::ranges).
    pub fn upload_ranges(&self, gpu: &Gpu, ranges: &[u32]) {
        gpu.queue
            .write_buffer(&self.work, WORK_HEAD, bytemuck::cast_slice(ranges));
    }

    /// Says up to which vertex glances look for lights, in rows of the tile.
    pub fn upload_seen(&self, gpu: &Gpu, seen: &[u32]) {
        let at = WORK_HEAD + 2 * 4 * seen.len() as u64;
        gpu.queue
            .write_buffer(&self.work, at, bytemuck::cast_slice(seen));
    }

    /// Before a dispatch no pixel is unfinished.
    pub fn clear_unfinished(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.work, 0, Some(WORK_HEAD));
    }

    /// In how many pixels the last dispatch ran out of loop trips, and 1 + the number of one in which it finished no sample at all.
    pub fn unfinished(&self, gpu: &Gpu) -> Result<[u32; 2], String> {
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.work, 0, &self.staging, 0, WORK_HEAD);
        gpu.queue.submit([encoder.finish()]);
        let head = self.staging.slice(..WORK_HEAD);
        head.map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait()?;
        let mapped = head
            .get_mapped_range()
            .map_err(|e| format!("reading back failed: {e}"))?;
        let counts = bytemuck::pod_read_unaligned(&mapped);
        drop(mapped);
        self.staging.unmap();
        Ok(counts)
    }

    /// Counters to zero.
    pub fn clear_counters(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.counters, 0, None);
    }

    /// Uploads running sums, in rows of the tile, into texture 0.
    pub fn upload(&self, gpu: &Gpu, sums: &[[Sums<f32>; REPLICATES]]) {
        for r in 0..REPLICATES {
            let layer: Vec<Sums<f32>> = sums.iter().map(|s| s[r]).collect();
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.textures[0],
                    mip_level: 0,
                    origin: wgpu::Origin3d {
                        x: 0,
                        y: 0,
                        z: r as u32,
                    },
                    aspect: wgpu::TextureAspect::All,
                },
                bytemuck::cast_slice(&layer),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.size[0] * TEXEL),
                    rows_per_image: None,
                },
                extent(self.size, 1),
            );
        }
    }

    /// Reads the sums in texture number `place` into `running`, rows of pixels, and returns the counters of each pixel, as
    /// `PixelFilm` of `shaders/film.wgsl` holds them.
    pub fn download(
        &self,
        gpu: &Gpu,
        place: usize,
        running: &mut Vec<[Sums<f32>; REPLICATES]>,
    ) -> Result<Vec<[u32; 4]>, String> {
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let counter_bytes = self.counters.size();
        encoder.copy_buffer_to_buffer(&self.counters, 0, &self.staging, 0, counter_bytes);
        for r in 0..REPLICATES {
            encoder.copy_texture_to_buffer(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.textures[place],
                    mip_level: 0,
                    origin: wgpu::Origin3d {
                        x: 0,
                        y: 0,
                        z: r as u32,
                    },
                    aspect: wgpu::TextureAspect::All,
                },
                wgpu::TexelCopyBufferInfo {
                    buffer: &self.staging,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: counter_bytes.next_multiple_of(256)
                            + layer_bytes(self.size) * r as u64,
                        bytes_per_row: Some(row_bytes(self.size[0])),
                        rows_per_image: None,
                    },
                },
                extent(self.size, 1),
            );
        }
        gpu.queue.submit([encoder.finish()]);
        self.staging
            .slice(..)
            .map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait()?;
        let mapped = self
            .staging
            .slice(..)
            .get_mapped_range()
            .map_err(|e| format!("reading back failed: {e}"))?;
        let bytes: &[u8] = &mapped;
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let counters = bytemuck::pod_collect_to_vec(&bytes[..counter_bytes as usize]);
        let width = self.size[0] as usize;
        let stride = row_bytes(self.size[0]) as usize;
        let layers = &bytes[counter_bytes.next_multiple_of(256) as usize..];
        running.resize(pixels, Default::default());
        let rows = running.par_chunks_exact_mut(width).enumerate();
        rows.for_each(|(y, row)| {
            let rows: [_; REPLICATES] = std::array::from_fn(|r| {
                &layers[layer_bytes(self.size) as usize * r + y * stride..]
            });
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel = rows.map(|row| {
                    bytemuck::pod_read_unaligned(&row[x * TEXEL as usize..][..TEXEL as usize])
                });
            }
        });
        drop(mapped);
        self.staging.unmap();
        Ok(counters)
    }
}

fn layer_bytes(size: [u32; 2]) -> u64 {
    u64::from(row_bytes(size[0])) * u64::from(size[1])
}

fn extent(size: [u32; 2], layers: u32) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: size[0],
        height: size[1],
        depth_or_array_layers: layers,
    }
}

/// Group 1 of the kernel: parameters, running sums in and out, counters, what is left.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("film"),
        entries: &[
            entry(
                0,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
            entry(
                1,
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2Array,
                    multisampled: false,
                },
            ),
            entry(
                2,
                wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: wgpu::TextureFormat::Rgba32Float,
                    view_dimension: wgpu::TextureViewDimension::D2Array,
                },
            ),
            entry(
                3,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
            entry(
                4,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
        ],
    })
}
