//! The textures and uniforms of one photograph, and the bind groups of its passes.

use std::convert::Infallible;

use super::api::{BindGroup, BindingResource, UniformBuffer, WebGpuTexture, usage};
use super::context::GpuContext;
use crate::relight::texture_layout::{
    FrameUniforms, TEXTURES, TextureLayout, TextureRegion, binding,
};
use crate::transport::Transport;

#[derive(Debug)]
pub(super) struct PhotoTextures {
    /// By binding.
    textures: [WebGpuTexture; TEXTURES],
    pub frame: UniformBuffer,
    /// `BasisFunctionUniforms` and `DispatchUniforms` of the WGSL, pair by pair; kept alive for the bind groups.
    _pairs: Vec<[UniformBuffer; 2]>,
    /// For the correlation, pair by pair.
    pub correlation: Vec<BindGroup>,
    /// For the last pass.
    pub relighting: BindGroup,
}

impl PhotoTextures {
    /// Creates everything, and fills all textures that do not depend on the light.
    pub fn new(device: &GpuContext, layout: &TextureLayout, transport: &Transport) -> Self {
        let GpuContext { gpu, pipelines, .. } = device;
        let textures = std::array::from_fn(|i| {
            let usage = match i {
                binding::BASIS_RESPONSE => usage::STORAGE_BINDING,
                binding::LIGHT => usage::COPY_DST | usage::RENDER_ATTACHMENT,
                _ => usage::COPY_DST,
            };
            gpu.create_texture(&layout.textures[i], usage::TEXTURE_BINDING | usage)
        });
        let Ok(()) = layout.for_each_region(transport, |region: TextureRegion<'_>| {
            let texture = &textures[region.binding];
            gpu.write_texture(texture, region.texels, region.origin, region.extent);
            Ok::<_, Infallible>(())
        });
        let frame = gpu.create_uniforms(&[0; size_of::<FrameUniforms>()]);
        let pairs = (0..).zip(layout.basis_uniforms(&transport.basis));
        let pairs = pairs.map(|(pair, basis)| {
            let basis = gpu.create_uniforms(bytemuck::cast_slice(&basis));
            let dispatch: [i32; 4] = [2 * pair, 0, 0, 0];
            [basis, gpu.create_uniforms(bytemuck::bytes_of(&dispatch))]
        });
        let pairs: Vec<_> = pairs.collect();

        let correlate_layout = pipelines.correlate.get_bind_group_layout(0);
        let texture = |binding: usize| BindingResource::Texture(&textures[binding]);
        let bind_pair = |[basis, dispatch]: &[UniformBuffer; 2]| {
            let resources = [
                (5, texture(binding::LIGHT)),
                (7, BindingResource::Uniforms(&frame)),
                (8, BindingResource::Uniforms(basis)),
                (12, texture(binding::BASIS_RESPONSE)),
                (13, BindingResource::Uniforms(dispatch)),
            ];
            gpu.create_bind_group(&correlate_layout, &resources)
        };
        let resources = textures.iter().map(BindingResource::Texture);
        let resources = resources.chain([BindingResource::Uniforms(&frame)]);
        let resources: Vec<_> = (0..).zip(resources).collect();
        let relight_layout = pipelines.relight.get_bind_group_layout(0);
        Self {
            correlation: pairs.iter().map(bind_pair).collect(),
            relighting: gpu.create_bind_group(&relight_layout, &resources),
            textures,
            frame,
            _pairs: pairs,
        }
    }

    pub fn light(&self) -> &WebGpuTexture {
        &self.textures[binding::LIGHT]
    }
}
