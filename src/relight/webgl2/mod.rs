//! Relighting by WebGL2.
//!
//! All photographs of a page share one context, on a hidden canvas; each frame is copied from there into the
//! photograph's own canvas.

mod context;
mod downsampler;
mod photo_renderer;
mod resources;

use std::rc::Rc;

use wasm_bindgen::JsValue;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

pub use context::Context;

use super::Gamut;
use super::backend::{Backend, BackendError, Frame};
use super::canvas2d::{CanvasStorage, open_2d};
use crate::transport::{Extent, Transport};
use photo_renderer::PhotoRenderer;

/// Draws one photograph into one canvas.
#[derive(Debug)]
pub struct WebGl2Backend {
    renderer: PhotoRenderer,
    /// The canvas's 2D context.
    canvas: CanvasRenderingContext2d,
    gamut: Gamut,
}

impl WebGl2Backend {
    /// Uploads a transport.
    ///
    /// # Errors
    /// [`BackendError`] if the device cannot hold the transport or the canvas gives no context.
    pub fn new(
        context: Rc<Context>,
        transport: &Transport,
        canvas: &HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let renderer = PhotoRenderer::new(context, transport)?;
        let gamut = match renderer.context.has_gamut(gamut) {
            true => gamut,
            false => Gamut::Srgb,
        };
        let extent = renderer.extent();
        let (canvas, gamut) = open_2d(canvas, extent, gamut, CanvasStorage::Default)?;
        renderer.context.set_target(extent, gamut)?;
        Ok(Self {
            renderer,
            canvas,
            gamut,
        })
    }
}

impl Backend for WebGl2Backend {
    fn name(&self) -> &'static str {
        "webgl2"
    }

    fn kernel(&self) -> String {
        self.renderer.context.kernel().into()
    }

    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn set_light_image(&mut self, image: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        self.renderer.set_light_image(image, extent)
    }

    fn render(&mut self, frame: &Frame<'_>) -> Result<(), BackendError> {
        self.renderer.draw(frame, self.gamut)?;
        let Extent { width, height } = self.renderer.extent();
        let [width, height] = [width, height].map(f64::from);
        self.canvas
            .draw_image_with_html_canvas_element_and_sw_and_sh_and_dx_and_dy_and_dw_and_dh(
                &self.renderer.context.canvas,
                0.0,
                0.0,
                width,
                height,
                0.0,
                0.0,
                width,
                height,
            )
            .map_err(|e| BackendError::Lost(format!("the browser cannot copy the picture: {e:?}")))
    }
}
