//! The textures and uniforms of one photograph, and the bind groups of its passes.

use super::api::{
    BindGroup, BindingResource, ComputePipeline, DeviceQueue, RenderPipeline, Texture,
    TextureDescriptor, TextureFormat, UniformBuffer, usage,
};
use crate::relight::texture_layout::{ArrayExtent, FrameUniforms, TextureLayout, TextureRegion};
use crate::transport::{Basis, CHANNELS, Transport};

/// The resources of the bindings, in their order.
#[derive(Debug)]
pub(super) struct PhotoTextures {
    coefficients: Texture,
    basis_response: Texture,
    codes: Texture,
    origins: Texture,
    steps: Texture,
    pub light: Texture,
    tiles: Texture,
    pub frame: UniformBuffer,
    /// Pair by pair.
    basis: Vec<UniformBuffer>,
    /// `[channel][pair]`.
    dispatches: [Vec<UniformBuffer>; CHANNELS],
}

impl PhotoTextures {
    pub fn new(gpu: &DeviceQueue, layout: &TextureLayout, basis: &Basis) -> Self {
        use TextureFormat::{Rg16Sint, Rgba16Sint, Rgba32Float, Rgba32Sint};
        let create = |label, extent, layers, format, usage| {
            gpu.create_texture(&TextureDescriptor {
                label,
                extent,
                layers,
                format,
                usage: usage::TEXTURE_BINDING | usage,
            })
        };
        let array = |label, ArrayExtent { extent, layers }, format, usage| {
            create(label, extent, Some(layers), format, usage)
        };
        let flat = |label, extent, format, usage| create(label, extent, None, format, usage);
        let uploaded = usage::COPY_DST;
        let drawn = uploaded | usage::RENDER_ATTACHMENT;
        let response = layout.basis_response();
        let basis = layout.basis_uniforms(basis);
        let basis = basis.iter().map(|pair| bytemuck::cast_slice(pair));
        Self {
            coefficients: array("coefficients", layout.coefficients(), Rgba16Sint, uploaded),
            basis_response: array(
                "basis response",
                response,
                Rgba32Float,
                usage::STORAGE_BINDING,
            ),
            codes: array("codes", layout.codes(), Rgba16Sint, uploaded),
            origins: flat("origins", layout.origins(), Rg16Sint, uploaded),
            steps: flat("steps", layout.steps(), Rgba32Float, uploaded),
            light: flat("light", layout.light(), Rgba32Float, drawn),
            tiles: flat("tiles", layout.tiles(), Rgba32Sint, uploaded),
            frame: gpu.create_uniforms(&[0; size_of::<FrameUniforms>()]),
            basis: basis.map(|pair| gpu.create_uniforms(pair)).collect(),
            dispatches: std::array::from_fn(|channel| {
                let dispatches = layout.dispatch_uniforms(channel);
                dispatches
                    .map(|dispatch| gpu.create_uniforms(bytemuck::bytes_of(&dispatch)))
                    .collect()
            }),
        }
    }

    /// Fills all textures that do not depend on the light.
    pub fn upload(&self, gpu: &DeviceQueue, layout: &TextureLayout, transport: &Transport) {
        let write = |texture, region: TextureRegion<'_>| {
            let texels = bytemuck::cast_slice(region.texels);
            gpu.write_texture(texture, texels, region.origin, region.extent);
            Ok::<_, std::convert::Infallible>(())
        };
        let Ok(()) = layout
            .for_each_coefficient_region(transport, |region| write(&self.coefficients, region));
        let Ok(()) = layout.for_each_code_region(transport, |region| write(&self.codes, region));
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

    /// The bind group of the last pass.
    pub fn bind_relighting(&self, gpu: &DeviceQueue, pipeline: &RenderPipeline) -> BindGroup {
        let resources = [
            (0, BindingResource::Texture(&self.coefficients)),
            (1, BindingResource::Texture(&self.basis_response)),
            (2, BindingResource::Texture(&self.codes)),
            (3, BindingResource::Texture(&self.origins)),
            (4, BindingResource::Texture(&self.steps)),
            (5, BindingResource::Texture(&self.light)),
            (6, BindingResource::Texture(&self.tiles)),
            (7, BindingResource::Uniforms(&self.frame)),
        ];
        pipeline.bind(gpu, &resources)
    }

    /// The bind groups of the correlation, `[channel][pair]`.
    pub fn bind_correlation(
        &self,
        gpu: &DeviceQueue,
        pipeline: &ComputePipeline,
    ) -> [Vec<BindGroup>; CHANNELS] {
        let bind = |(basis, dispatch): (&UniformBuffer, &UniformBuffer)| {
            let resources = [
                (5, BindingResource::Texture(&self.light)),
                (7, BindingResource::Uniforms(&self.frame)),
                (8, BindingResource::Uniforms(basis)),
                (12, BindingResource::Texture(&self.basis_response)),
                (13, BindingResource::Uniforms(dispatch)),
            ];
            pipeline.bind(gpu, &resources)
        };
        let pairs = |dispatches: &Vec<UniformBuffer>| {
            let pairs = self.basis.iter().zip(dispatches);
            pairs.map(bind).collect()
        };
        self.dispatches.each_ref().map(pairs)
    }
}
