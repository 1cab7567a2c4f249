//! The WebGL2 backend of a page: draws in a shared context and copies into a canvas.

use std::rc::Rc;

use wasm_bindgen::{JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, WebGl2RenderingContext as Gl};

use super::context::{API, GlContext};
use super::downsampler::GlDownsampler;
use super::photo_resources::PhotoResources;
use super::resources::Staging;
use crate::relight::Gamut;
use crate::relight::backend::{Backend, BackendError, FrameRequest, UploadedLight};
use crate::relight::canvas2d_context::{CanvasMemoryLocation, open_2d};
use crate::relight::texture_layout::TextureLayout;
use crate::transport::{Extent, Transport};

/// Draws one photograph into one canvas: the basis response where the light or the quality has changed, then the picture.
#[derive(Debug)]
pub struct WebGl2Backend {
    context: Rc<GlContext>,
    layout: TextureLayout,
    resources: PhotoResources,
    /// For the light's elements.
    staging: Staging,
    light: UploadedLight,
    downsampler: Option<GlDownsampler>,
    camera: Extent,
    canvas: CanvasRenderingContext2d,
    gamut: Gamut,
}

impl WebGl2Backend {
    /// Uploads a transport. A failure leaves nothing in the context.
    ///
    /// # Errors
    /// [`BackendError`] if the device cannot hold the transport or the canvas gives no context.
    pub fn new(
        context: Rc<GlContext>,
        transport: &Transport,
        canvas: &HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, context.limits)?;
        context.clear_errors();
        if layout.quad_pairs() > 0 && context.float_programs.is_none() {
            let reason = "it does not draw into floating-point textures";
            return Err(BackendError::Device(API, reason.into()));
        }
        let resources = PhotoResources::new(&context, &layout, transport)?;
        context.check()?;
        let gamut = match context.has_gamut(gamut) {
            true => gamut,
            false => Gamut::Srgb,
        };
        let camera = transport.geometry.camera;
        let (canvas, gamut) = open_2d(canvas, camera, gamut, CanvasMemoryLocation::Default)?;
        context.set_target(camera, gamut)?;
        Ok(Self {
            context,
            layout,
            resources,
            staging: Staging::default(),
            light: UploadedLight::default(),
            downsampler: None,
            camera,
            canvas,
            gamut,
        })
    }

    /// Draws a frame into the context's canvas.
    fn draw(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError> {
        let gl = &self.context.gl;
        // Calls to a lost context do nothing. Asking for other errors would wait for the device, and a draw that
        // succeeded once has none.
        let check_loss = || match gl.is_context_lost() {
            true => Err(BackendError::Lost("the browser dropped its context".into())),
            false => Ok(()),
        };
        check_loss()?;
        self.resources.bind();
        if let Some(light) = frame.light.filter(|light| !self.light.has(light)) {
            self.light = UploadedLight::default();
            let elements = bytemuck::cast_slice(light.elements());
            let texture = self.resources.light();
            texture.write([0; 3], light.extent(), elements, &mut self.staging)?;
            self.light = UploadedLight::new(light);
            self.downsampler = None;
        }
        let chroma = self.light.chroma;
        let uniforms = self
            .layout
            .frame_uniforms(chroma, &frame.output, frame.quality);
        self.resources.frame.write(bytemuck::bytes_of(&uniforms));
        if self.light.set_quality(frame.quality)
            && let Some(programs) = &self.context.float_programs
        {
            let passes = self
                .layout
                .correlation_passes(chroma.channels(), frame.quality);
            self.resources.correlate(&programs.correlate, passes);
        }
        self.context.set_target(self.camera, self.gamut)?;
        gl.use_program(Some(&self.context.relight));
        gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        check_loss()
    }
}

impl Backend for WebGl2Backend {
    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn set_light_image(&mut self, image: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        let context = &*self.context;
        // An `ImageBitmap` is uploaded as it is, and nothing tells whether its alpha is straight.
        let is_bitmap = image.is_instance_of::<web_sys::ImageBitmap>();
        let Some(programs) = &context.float_programs else {
            return Ok(false);
        };
        if is_bitmap || !self.layout.is_light_image_allowed(extent, context.limits) {
            return Ok(false);
        }
        let fits = |downsampler: &GlDownsampler| downsampler.extent() == extent;
        let downsampler = match self.downsampler.take().filter(fits) {
            Some(downsampler) => downsampler,
            None => {
                context.clear_errors();
                let created = GlDownsampler::new(&context.gl, extent, self.resources.light());
                // Out of memory; the photograph itself is still there.
                let (Ok(created), Ok(())) = (created, context.check()) else {
                    return Ok(false);
                };
                created
            }
        };
        let downsampler = self.downsampler.insert(downsampler);
        downsampler.downsample(&programs.downsample, image, self.resources.light())?;
        self.light = UploadedLight::default();
        Ok(true)
    }

    fn render(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError> {
        self.draw(frame)?;
        // The picture is in the upper left corner; the rest, if any, falls outside the canvas.
        self.canvas
            .draw_image_with_html_canvas_element(&self.context.canvas, 0.0, 0.0)
            .map_err(|e| BackendError::Lost(format!("the browser cannot copy the picture: {e:?}")))
    }
}
