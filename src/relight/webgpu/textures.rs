//! The transport and the light as WebGPU textures.

use wgpu::util::DeviceExt;

use crate::relight::texture_layout::{Fold, Params, TextureLayout};
use crate::transport::{Basis, CHANNELS, Extent, Transport};

/// What the shader's bindings stand for, in their order.
#[derive(Debug)]
pub(super) struct Textures {
    coefficients: wgpu::Texture,
    seen: wgpu::Texture,
    codes: wgpu::Texture,
    origins: wgpu::Texture,
    steps: wgpu::Texture,
    pub light: wgpu::Texture,
    tiles: wgpu::Texture,
    pub params: wgpu::Buffer,
    /// Pair by pair.
    basis: Vec<wgpu::Buffer>,
    /// `[channel][pair]`.
    parts: [Vec<wgpu::Buffer>; CHANNELS],
}

impl Textures {
    pub fn new(device: &wgpu::Device, layout: &TextureLayout, basis: &Basis) -> Self {
        use wgpu::TextureFormat::{Rg16Sint, Rgba16Sint, Rgba32Float, Rgba32Sint};
        use wgpu::TextureUsages;
        let texture = |label, Fold { extent, layers }, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: size(extent, layers),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: TextureUsages::TEXTURE_BINDING | usage,
                view_formats: &[],
            })
        };
        let flat = |extent| Fold { extent, layers: 1 };
        let given = TextureUsages::COPY_DST;
        let uniforms = |label, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        };
        let pairs = layout.basis(basis);
        Self {
            coefficients: texture("coefficients", layout.coefficients(), Rgba16Sint, given),
            seen: texture(
                "seen",
                layout.seen(),
                Rgba32Float,
                TextureUsages::STORAGE_BINDING,
            ),
            codes: texture("codes", layout.codes(), Rgba16Sint, given),
            origins: texture("origins", flat(layout.origins()), Rg16Sint, given),
            steps: texture("steps", flat(layout.steps()), Rgba32Float, given),
            light: texture(
                "light",
                flat(layout.light()),
                Rgba32Float,
                given | TextureUsages::RENDER_ATTACHMENT,
            ),
            tiles: texture("tiles", flat(layout.tiles()), Rgba32Sint, given),
            params: uniforms("params", &[0; size_of::<Params>()]),
            basis: pairs
                .iter()
                .map(|pair| uniforms("basis", bytemuck::cast_slice(pair)))
                .collect(),
            parts: std::array::from_fn(|channel| {
                let parts = layout.parts(channel);
                parts
                    .map(|part| uniforms("part", bytemuck::bytes_of(&part)))
                    .collect()
            }),
        }
    }

    /// Fills what does not depend on the light.
    pub fn upload(&self, queue: &wgpu::Queue, layout: &TextureLayout, transport: &Transport) {
        let Ok(()) = layout.for_each_coefficient_block(transport, |block| {
            let [x, y] = block.at;
            let texels = bytemuck::cast_slice(block.texels);
            write_texture(
                queue,
                &self.coefficients,
                texels,
                [x, y, block.layer],
                block.extent,
            );
            Ok::<_, std::convert::Infallible>(())
        });
        let width = layout.codes().extent.width;
        let Ok(()) = layout.for_each_code_block(transport, |block| {
            let rows = Extent {
                width,
                height: block.rows,
            };
            let texels = bytemuck::cast_slice(block.texels);
            write_texture(
                queue,
                &self.codes,
                texels,
                [0, block.row, block.layer],
                rows,
            );
            Ok::<_, std::convert::Infallible>(())
        });
        let origins = layout.origin_texels();
        let texels = bytemuck::cast_slice(&origins);
        write_texture(queue, &self.origins, texels, [0; 3], layout.origins());
        let tiles = layout.tile_texels(transport);
        let texels = bytemuck::cast_slice(&tiles);
        write_texture(queue, &self.tiles, texels, [0; 3], layout.tiles());
        let steps = layout.step_texels(transport);
        let texels = bytemuck::cast_slice(&steps);
        write_texture(queue, &self.steps, texels, [0; 3], layout.steps());
    }

    /// What the last pass reads.
    pub fn bind(&self, device: &wgpu::Device, pipeline: &wgpu::RenderPipeline) -> wgpu::BindGroup {
        let views = [
            array(&self.coefficients),
            array(&self.seen),
            array(&self.codes),
            self.origins.create_view(&Default::default()),
            self.steps.create_view(&Default::default()),
            self.light.create_view(&Default::default()),
            self.tiles.create_view(&Default::default()),
        ];
        let textures = (0..).zip(&views).map(|(binding, of)| view(binding, of));
        let entries: Vec<_> = textures.chain([uniform(7, &self.params)]).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("relight"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    /// What the dispatches before read and write: `[channel][pair]`.
    pub fn bind_parts(
        &self,
        device: &wgpu::Device,
        pipeline: &wgpu::ComputePipeline,
    ) -> [Vec<wgpu::BindGroup>; CHANNELS] {
        let layout = pipeline.get_bind_group_layout(0);
        let light = self.light.create_view(&Default::default());
        let seen = array(&self.seen);
        let bind = |(basis, part): (&wgpu::Buffer, &wgpu::Buffer)| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("see"),
                layout: &layout,
                entries: &[
                    view(5, &light),
                    uniform(7, &self.params),
                    uniform(8, basis),
                    view(12, &seen),
                    uniform(13, part),
                ],
            })
        };
        let of = |parts: &Vec<wgpu::Buffer>| self.basis.iter().zip(parts).map(bind).collect();
        self.parts.each_ref().map(of)
    }
}

impl Drop for Textures {
    /// Frees the device's memory now; the garbage collector does not know how much there is.
    fn drop(&mut self) {
        for texture in [
            &self.coefficients,
            &self.seen,
            &self.codes,
            &self.origins,
            &self.steps,
            &self.light,
            &self.tiles,
        ] {
            texture.destroy();
        }
        for buffer in self
            .basis
            .iter()
            .chain(self.parts.iter().flatten())
            .chain([&self.params])
        {
            buffer.destroy();
        }
    }
}

/// All layers: an array of one is still an array to the shader.
fn array(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

fn view(binding: u32, view: &wgpu::TextureView) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry {
        binding,
        resource: wgpu::BindingResource::TextureView(view),
    }
}

fn uniform(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry {
        binding,
        resource: buffer.as_entire_binding(),
    }
}

fn size(extent: Extent, layers: u32) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: extent.width,
        height: extent.height,
        depth_or_array_layers: layers,
    }
}

/// Writes a rectangle of one layer, from column, row and layer `at` on.
pub(super) fn write_texture(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    texels: &[u8],
    [x, y, z]: [u32; 3],
    extent: Extent,
) {
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z },
            aspect: wgpu::TextureAspect::All,
        },
        texels,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((texels.len() / extent.height as usize) as u32),
            rows_per_image: None,
        },
        size(extent, 1),
    );
}
