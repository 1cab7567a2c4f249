//! The textures, framebuffers and uniforms of one photograph.

use web_sys::{WebGl2RenderingContext as Gl, WebGlProgram};

use super::context::{BASIS, CHANNEL, FRAME, GlContext};
use super::resources::{Framebuffer, GlTexture, GlUniformBuffer, Staging};
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{FrameUniforms, TextureLayout, TextureRegion, binding};
use crate::transport::Transport;

#[derive(Debug)]
pub(super) struct PhotoResources {
    gl: Gl,
    /// By binding, which is also the texture unit.
    textures: Vec<GlTexture>,
    /// For each two layers of the basis response: `[channel][pair]`.
    framebuffers: Vec<Framebuffer>,
    pub frame: GlUniformBuffer,
    /// Pair by pair.
    basis: Vec<GlUniformBuffer>,
    channels: Vec<GlUniformBuffer>,
}

impl PhotoResources {
    /// Creates everything, and fills all textures that do not depend on the light.
    pub fn new(
        context: &GlContext,
        layout: &TextureLayout,
        transport: &Transport,
    ) -> Result<Self, BackendError> {
        let gl = &context.gl;
        let textures = (0..).zip(layout.textures.clone());
        let textures = textures.map(|(unit, texture)| GlTexture::new(gl, unit, texture));
        let textures: Vec<_> = textures.collect::<Result<_, _>>()?;
        // Reports out of memory before the long uploads.
        context.check()?;
        let mut framebuffers = Vec::new();
        if layout.quad_pairs() > 0 {
            let response = &textures[binding::BASIS_RESPONSE];
            for first in (0..response.layers()).step_by(2) {
                framebuffers.push(Framebuffer::of_two_layers(gl, response, first)?);
            }
        }
        let uniforms = |bytes: &[u8]| GlUniformBuffer::new(gl, bytes);
        let basis = layout.basis_uniforms(&transport.basis);
        let basis = basis
            .iter()
            .map(|pair| uniforms(bytemuck::cast_slice(pair)));
        let channels = TextureLayout::CHANNEL_WEIGHTS.iter();
        let channels = channels.map(|weights| uniforms(bytemuck::cast_slice(weights)));
        let mut staging = Staging::default();
        layout.for_each_region(transport, |region: TextureRegion<'_>| {
            let texture = &textures[region.binding];
            texture.write(region.origin, region.extent, region.texels, &mut staging)
        })?;
        Ok(Self {
            framebuffers,
            frame: uniforms(&[0; size_of::<FrameUniforms>()])?,
            basis: basis.collect::<Result<_, _>>()?,
            channels: channels.collect::<Result<_, _>>()?,
            textures,
            gl: gl.clone(),
        })
    }

    pub fn light(&self) -> &GlTexture {
        &self.textures[binding::LIGHT]
    }

    /// Binds everything anew: another photograph may have drawn.
    pub fn bind(&self) {
        self.textures.iter().for_each(GlTexture::bind);
        self.frame.bind(FRAME);
    }

    /// Computes the basis response of the light, by [`TextureLayout::correlation_passes`].
    pub fn correlate(&self, program: &WebGlProgram, passes: impl Iterator<Item = [usize; 3]>) {
        let (gl, response) = (&self.gl, &self.textures[binding::BASIS_RESPONSE]);
        gl.use_program(Some(program));
        response.set_viewport();
        // A texture must not be bound while it is drawn into.
        response.unbind();
        for [channel, pair, layers] in passes {
            self.channels[channel].bind(CHANNEL);
            self.basis[pair].bind(BASIS);
            self.framebuffers[layers].bind();
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        response.bind();
    }
}
