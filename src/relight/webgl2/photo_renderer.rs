//! Draws one photograph in a context: the basis response where the light or the quality has changed, then the picture.

use std::rc::Rc;

use js_sys::{Float32Array, Int16Array, Int32Array};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::WebGl2RenderingContext as Gl;

use super::context::{
    API, BASIS, BASIS_RESPONSE, CHANNEL, CODES, COEFFICIENTS, Context, FRAME, LIGHT, ORIGINS,
    STEPS, TILES,
};
use super::downsampler::Downsampler;
use super::resources::{
    Framebuffer, RG16_SINT, RGBA16_SINT, RGBA32_FLOAT, RGBA32_SINT, Texture, UniformBuffer,
};
use crate::relight::backend::{BackendError, Frame, LightCache};
use crate::relight::texture_layout::{
    ArrayExtent, CorrelationPass, FrameUniforms, TextureLayout, TextureRegion,
};
use crate::relight::{Gamut, LightChroma};
use crate::transport::{Extent, Transport};

/// A transport in a context's memory, and the basis response of the last light.
#[derive(Debug)]
pub(super) struct PhotoRenderer {
    pub context: Rc<Context>,
    layout: TextureLayout,
    resources: PhotoResources,
    /// The light's elements on their way to the context, kept to save an allocation a frame.
    staging: Float32Array,
    light: LightCache,
    downsampler: Option<Downsampler>,
}

#[derive(Debug)]
struct PhotoResources {
    gl: Gl,
    light: Texture,
    basis_response: Texture,
    /// Coefficients, codes, origins, steps and tiles.
    transport: Vec<Texture>,
    /// For each two layers of the basis response.
    framebuffers: Vec<Framebuffer>,
    frame: UniformBuffer,
    /// Pair by pair.
    basis: Vec<UniformBuffer>,
    channels: Vec<UniformBuffer>,
}

impl PhotoRenderer {
    /// Uploads a transport. A failure leaves nothing in the context.
    ///
    /// # Errors
    /// [`BackendError`] if the device cannot hold the transport.
    pub fn new(context: Rc<Context>, transport: &Transport) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, context.limits)?;
        context.clear_errors();
        if layout.quad_pairs() > 0 && context.float_programs.is_none() {
            return Err(BackendError::Device {
                api: API,
                reason: "it does not draw into floating-point textures".into(),
            });
        }
        let resources = PhotoResources::new(&context, &layout, transport)?;
        context.check()?;
        Ok(Self {
            staging: Float32Array::new_with_length(4 * layout.light().area() as u32),
            light: LightCache::default(),
            downsampler: None,
            context,
            layout,
            resources,
        })
    }

    /// The picture's extent.
    pub fn extent(&self) -> Extent {
        self.layout.origins()
    }

    /// Draws a frame into the context's canvas.
    ///
    /// # Errors
    /// [`BackendError::Lost`] once the context is lost.
    pub fn draw(&mut self, frame: &Frame<'_>, gamut: Gamut) -> Result<(), BackendError> {
        let Frame {
            light,
            output,
            quality,
        } = *frame;
        let (gl, resources) = (&self.context.gl, &self.resources);
        // Calls to a lost context do nothing. Asking for other errors would wait for the device, and a draw that
        // succeeded once has none.
        let check_loss = || match gl.is_context_lost() {
            true => Err(BackendError::Lost("the browser dropped its context".into())),
            false => Ok(()),
        };
        check_loss()?;
        resources.bind();
        if let Some(light) = light.filter(|light| !self.light.has(light)) {
            self.light = LightCache::default();
            self.staging.copy_from(light.elements().as_flattened());
            let extent = self.layout.light();
            resources.light.write(RGBA32_FLOAT, extent, &self.staging)?;
            self.light = LightCache::new(light);
            self.downsampler = None;
        }
        let chroma = self.light.chroma();
        let uniforms = self.layout.frame_uniforms(chroma, &output, quality);
        resources.frame.write(bytemuck::bytes_of(&uniforms));
        if self.light.set_quality(quality) {
            resources.correlate(&self.context, &self.layout, chroma, quality);
        }
        self.context.set_target(self.extent(), gamut)?;
        gl.use_program(Some(&self.context.relight));
        gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        check_loss()
    }

    /// Makes a picture of the browser's the light. Returns `false` if the device cannot.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The light stays.
    pub fn set_light_image(&mut self, image: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        let context = &*self.context;
        // An `ImageBitmap` is uploaded as it is, and nothing tells whether its alpha is straight.
        let is_bitmap = image.is_instance_of::<web_sys::ImageBitmap>();
        let Some(programs) = &context.float_programs else {
            return Ok(false);
        };
        if is_bitmap || !self.layout.is_light_image_allowed(extent, context.limits) {
            return Ok(false);
        }
        let fits = |downsampler: &Downsampler| downsampler.extent() == extent;
        let downsampler = match self.downsampler.take().filter(fits) {
            Some(downsampler) => downsampler,
            None => {
                context.clear_errors();
                let light = &self.resources.light;
                let created = Downsampler::new(&context.gl, extent, light, self.layout.light());
                // Out of memory; the photograph itself is still there.
                let (Ok(created), Ok(())) = (created, context.check()) else {
                    return Ok(false);
                };
                created
            }
        };
        let downsampler = self.downsampler.insert(downsampler);
        downsampler.upload(image)?;
        downsampler.downsample(&programs.downsample);
        self.light = LightCache::default();
        Ok(true)
    }
}

impl PhotoResources {
    /// Creates everything, and fills all textures that do not depend on the light.
    fn new(
        context: &Context,
        layout: &TextureLayout,
        transport: &Transport,
    ) -> Result<Self, BackendError> {
        let gl = &context.gl;
        let array = |unit, format, ArrayExtent { extent, layers }| {
            Texture::new(gl, unit, format, extent, Some(layers))
        };
        let flat = |unit, format, extent| Texture::new(gl, unit, format, extent, None);
        let coefficients = array(COEFFICIENTS, RGBA16_SINT, layout.coefficients())?;
        let response = layout.basis_response();
        let basis_response = array(BASIS_RESPONSE, RGBA32_FLOAT, response)?;
        let codes = array(CODES, RGBA16_SINT, layout.codes())?;
        // Reports out of memory before the long uploads.
        context.check()?;
        let mut framebuffers = Vec::new();
        if layout.quad_pairs() > 0 {
            for first in (0..response.layers).step_by(2) {
                framebuffers.push(Framebuffer::of_two_layers(gl, &basis_response, first)?);
            }
        }
        let uniforms = |bytes: &[u8]| UniformBuffer::new(gl, bytes);
        let (mut basis, mut channels) = (Vec::new(), Vec::new());
        for pair in layout.basis_uniforms(&transport.basis) {
            basis.push(uniforms(bytemuck::cast_slice(&pair))?);
        }
        for weights in TextureLayout::CHANNEL_WEIGHTS {
            channels.push(uniforms(bytemuck::cast_slice(&weights))?);
        }
        let mut staging = Int16Array::new_with_length(0);
        let mut write = |texture: &Texture, region: TextureRegion<'_>| {
            let components = region.texels.as_flattened();
            if staging.length() as usize != components.len() {
                staging = Int16Array::new_with_length(components.len() as u32);
            }
            staging.copy_from(components);
            texture.write_layer(RGBA16_SINT, region.origin, region.extent, &staging)
        };
        coefficients.bind();
        layout.for_each_coefficient_region(transport, |region| write(&coefficients, region))?;
        codes.bind();
        layout.for_each_code_region(transport, |region| write(&codes, region))?;
        let origins = flat(ORIGINS, RG16_SINT, layout.origins())?;
        let texels = Int16Array::from(layout.origin_texels().as_flattened());
        origins.write(RG16_SINT, layout.origins(), &texels)?;
        let steps = flat(STEPS, RGBA32_FLOAT, layout.steps())?;
        let texels = Float32Array::from(layout.step_texels(transport).as_flattened());
        steps.write(RGBA32_FLOAT, layout.steps(), &texels)?;
        let tiles = flat(TILES, RGBA32_SINT, layout.tiles())?;
        let texels = Int32Array::from(layout.tile_texels(transport).as_flattened());
        tiles.write(RGBA32_SINT, layout.tiles(), &texels)?;
        Ok(Self {
            light: flat(LIGHT, RGBA32_FLOAT, layout.light())?,
            basis_response,
            transport: vec![coefficients, codes, origins, steps, tiles],
            framebuffers,
            frame: uniforms(&[0; size_of::<FrameUniforms>()])?,
            basis,
            channels,
            gl: gl.clone(),
        })
    }

    /// Binds everything anew: another photograph may have drawn.
    fn bind(&self) {
        for texture in self
            .transport
            .iter()
            .chain([&self.light, &self.basis_response])
        {
            texture.bind();
        }
        self.frame.bind(FRAME);
    }

    /// Computes the basis response of the light.
    fn correlate(
        &self,
        context: &Context,
        layout: &TextureLayout,
        chroma: LightChroma,
        quality: f32,
    ) {
        let gl = &self.gl;
        let Extent { width, height } = layout.basis_response().extent;
        gl.viewport(0, 0, width as i32, height as i32);
        let programs = context.float_programs.as_ref();
        gl.use_program(programs.map(|programs| &programs.correlate));
        // A texture must not be bound while it is drawn into.
        self.basis_response.unbind();
        for CorrelationPass {
            channel,
            pair,
            layer,
        } in layout.correlation_passes(chroma, quality)
        {
            self.framebuffers[layer as usize / 2].bind();
            self.basis[pair].bind(BASIS);
            self.channels[channel].bind(CHANNEL);
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        self.basis_response.bind();
    }
}
