//! The transport and the light as WebGPU textures.

use super::gpu::{
    Bindings, ComputePipeline, Gpu, RenderPipeline, Resource, Texture, TextureDescriptor,
    TextureFormat, Uniforms, usage,
};
use crate::relight::texture_layout::{Fold, Params, TextureLayout};
use crate::transport::{Basis, CHANNELS, Extent, Transport};

/// What the shader's bindings stand for, in their order.
#[derive(Debug)]
pub(super) struct Textures {
    coefficients: Texture,
    seen: Texture,
    codes: Texture,
    origins: Texture,
    steps: Texture,
    pub light: Texture,
    tiles: Texture,
    pub params: Uniforms,
    /// Pair by pair.
    basis: Vec<Uniforms>,
    /// `[channel][pair]`.
    parts: [Vec<Uniforms>; CHANNELS],
}

impl Textures {
    pub fn new(gpu: &Gpu, layout: &TextureLayout, basis: &Basis) -> Self {
        use TextureFormat::{Rg16Sint, Rgba16Sint, Rgba32Float, Rgba32Sint};
        let texture = |label, extent, layers, format, usage| {
            gpu.texture(&TextureDescriptor {
                label,
                extent,
                layers,
                format,
                usage: usage::TEXTURE_BINDING | usage,
            })
        };
        let array = |label, Fold { extent, layers }, format, usage| {
            texture(label, extent, Some(layers), format, usage)
        };
        let flat = |label, extent, format, usage| texture(label, extent, None, format, usage);
        let given = usage::COPY_DST;
        let lit = given | usage::RENDER_ATTACHMENT;
        let pairs = layout.basis(basis);
        let pairs = pairs.iter().map(|pair| bytemuck::cast_slice(pair));
        Self {
            coefficients: array("coefficients", layout.coefficients(), Rgba16Sint, given),
            seen: array("seen", layout.seen(), Rgba32Float, usage::STORAGE_BINDING),
            codes: array("codes", layout.codes(), Rgba16Sint, given),
            origins: flat("origins", layout.origins(), Rg16Sint, given),
            steps: flat("steps", layout.steps(), Rgba32Float, given),
            light: flat("light", layout.light(), Rgba32Float, lit),
            tiles: flat("tiles", layout.tiles(), Rgba32Sint, given),
            params: gpu.uniforms(&[0; size_of::<Params>()]),
            basis: pairs.map(|pair| gpu.uniforms(pair)).collect(),
            parts: std::array::from_fn(|channel| {
                let parts = layout.parts(channel);
                parts
                    .map(|part| gpu.uniforms(bytemuck::bytes_of(&part)))
                    .collect()
            }),
        }
    }

    /// Fills what does not depend on the light.
    pub fn upload(&self, gpu: &Gpu, layout: &TextureLayout, transport: &Transport) {
        let Ok(()) = layout.for_each_coefficient_block(transport, |block| {
            let [x, y] = block.at;
            let texels = bytemuck::cast_slice(block.texels);
            gpu.write_texture(
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
            gpu.write_texture(&self.codes, texels, [0, block.row, block.layer], rows);
            Ok::<_, std::convert::Infallible>(())
        });
        let origins = layout.origin_texels();
        let texels = bytemuck::cast_slice(&origins);
        gpu.write_texture(&self.origins, texels, [0; 3], layout.origins());
        let tiles = layout.tile_texels(transport);
        let texels = bytemuck::cast_slice(&tiles);
        gpu.write_texture(&self.tiles, texels, [0; 3], layout.tiles());
        let steps = layout.step_texels(transport);
        let texels = bytemuck::cast_slice(&steps);
        gpu.write_texture(&self.steps, texels, [0; 3], layout.steps());
    }

    /// What the last pass reads.
    pub fn bind(&self, gpu: &Gpu, pipeline: &RenderPipeline) -> Bindings {
        let resources = [
            (0, Resource::Texture(&self.coefficients)),
            (1, Resource::Texture(&self.seen)),
            (2, Resource::Texture(&self.codes)),
            (3, Resource::Texture(&self.origins)),
            (4, Resource::Texture(&self.steps)),
            (5, Resource::Texture(&self.light)),
            (6, Resource::Texture(&self.tiles)),
            (7, Resource::Uniforms(&self.params)),
        ];
        pipeline.bind(gpu, &resources)
    }

    /// What the dispatches before read and write: `[channel][pair]`.
    pub fn bind_parts(&self, gpu: &Gpu, pipeline: &ComputePipeline) -> [Vec<Bindings>; CHANNELS] {
        let bind = |(basis, part): (&Uniforms, &Uniforms)| {
            let resources = [
                (5, Resource::Texture(&self.light)),
                (7, Resource::Uniforms(&self.params)),
                (8, Resource::Uniforms(basis)),
                (12, Resource::Texture(&self.seen)),
                (13, Resource::Uniforms(part)),
            ];
            pipeline.bind(gpu, &resources)
        };
        let of = |parts: &Vec<Uniforms>| self.basis.iter().zip(parts).map(bind).collect();
        self.parts.each_ref().map(of)
    }
}
