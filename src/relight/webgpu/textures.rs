//! The transport and the light as WebGPU textures.

use crate::relight::texture_layout::{Params, TextureLayout};
use crate::transport::{Extent, Transport};

/// What the shader's bindings stand for, in their order.
pub(super) struct Textures {
    codes: wgpu::Texture,
    pixels: wgpu::Texture,
    steps: wgpu::Texture,
    pub light: wgpu::Texture,
    pub params: wgpu::Buffer,
}

impl Textures {
    pub fn new(device: &wgpu::Device, layout: &TextureLayout) -> Self {
        let texture = |label, extent: Extent, layers, format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: size(extent, layers),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        use wgpu::TextureFormat::{Rgba16Sint, Rgba32Float, Rgba32Sint};
        let codes = layout.codes();
        Self {
            codes: texture("codes", codes.extent, codes.layers, Rgba16Sint),
            pixels: texture("pixels", layout.pixels(), 1, Rgba32Sint),
            steps: texture("steps", layout.steps(), 1, Rgba32Float),
            light: texture("light", layout.light(), 1, Rgba32Float),
            params: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("params"),
                size: size_of::<Params>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }

    /// Fills all but the light, which every frame brings anew.
    pub fn upload(&self, queue: &wgpu::Queue, layout: &TextureLayout, transport: &Transport) {
        let width = layout.codes().extent.width;
        let Ok(()) = layout.for_each_code_block(transport, |block| {
            let rows = Extent {
                width,
                height: block.rows,
            };
            let texels = bytemuck::cast_slice(block.texels);
            write_texture(queue, &self.codes, texels, (block.layer, block.row), rows);
            Ok::<_, std::convert::Infallible>(())
        });
        let pixels = layout.pixel_texels();
        let texels = bytemuck::cast_slice(&pixels);
        write_texture(queue, &self.pixels, texels, (0, 0), layout.pixels());
        let steps = layout.step_texels(transport);
        let texels = bytemuck::cast_slice(&steps);
        write_texture(queue, &self.steps, texels, (0, 0), layout.steps());
    }

    pub fn bind(&self, device: &wgpu::Device, pipeline: &wgpu::RenderPipeline) -> wgpu::BindGroup {
        // An array of one layer is still an array to the shader.
        let codes = self.codes.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let [pixels, steps, light] = [&self.pixels, &self.steps, &self.light]
            .map(|texture| texture.create_view(&Default::default()));
        let entry = |binding, view| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("relight"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                entry(0, &codes),
                entry(1, &pixels),
                entry(2, &steps),
                entry(3, &light),
                wgpu::BindGroupEntry {
                    binding: 4,
                    resource: self.params.as_entire_binding(),
                },
            ],
        })
    }
}

fn size(extent: Extent, layers: u32) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: extent.width,
        height: extent.height,
        depth_or_array_layers: layers,
    }
}

/// Writes whole rows of one layer, from `(layer, row)` on.
pub(super) fn write_texture(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    texels: &[u8],
    (layer, row): (u32, u32),
    rows: Extent,
) {
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d {
                x: 0,
                y: row,
                z: layer,
            },
            aspect: wgpu::TextureAspect::All,
        },
        texels,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((texels.len() / rows.height as usize) as u32),
            rows_per_image: None,
        },
        size(rows, 1),
    );
}
