//! The CPU back end's way into a canvas.

use std::rc::Rc;

use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, ImageData};

use crate::relight::backend::{Backend, BackendError};
use crate::relight::{Light, cpu};
use crate::transport::Transport;

/// Relights on the CPU and puts the pixels into a canvas as they are.
pub struct Canvas2d {
    transport: Rc<Transport>,
    context: CanvasRenderingContext2d,
}

impl Canvas2d {
    pub fn new(transport: Rc<Transport>, canvas: &HtmlCanvasElement) -> Result<Self, BackendError> {
        let canvas_error = |reason: &str| BackendError::Canvas {
            api: "2D",
            reason: reason.into(),
        };
        let camera = transport.geometry.camera;
        canvas.set_width(camera.width);
        canvas.set_height(camera.height);
        let context = canvas
            .get_context("2d")
            .map_err(|e| canvas_error(&format!("{e:?}")))?
            .and_then(|context| context.dyn_into().ok())
            .ok_or_else(|| canvas_error("getContext returned null"))?;
        Ok(Self { transport, context })
    }
}

impl Backend for Canvas2d {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn kernel(&self) -> String {
        cpu::KERNEL.into()
    }

    fn render(&mut self, light: &Light, exposure: f32) -> Result<(), BackendError> {
        let picture = cpu::relight(&self.transport, light).tone_map(exposure);
        let bytes = Clamped(picture.pixels.as_flattened());
        let (width, height) = (picture.extent.width, picture.extent.height);
        ImageData::new_with_u8_clamped_array_and_sh(bytes, width, height)
            .and_then(|image| self.context.put_image_data(&image, 0.0, 0.0))
            .map_err(|e: JsValue| BackendError::Lost(format!("{e:?}")))
    }
}
