//! The CPU back end's way into a canvas.

use std::sync::Arc;

use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, ImageData};

use crate::relight::backend::{Backend, BackendError};
use crate::relight::{Light, Rgba8Picture, cpu};
use crate::transport::{Extent, Transport};
use crate::workers::OneThread;

/// Relights on the CPU and puts the pixels into a canvas as they are.
pub struct Canvas2d {
    relighter: cpu::Relighter,
    picture: Rgba8Picture,
    context: CanvasRenderingContext2d,
}

impl Canvas2d {
    pub fn new(
        transport: Arc<Transport>,
        canvas: &HtmlCanvasElement,
    ) -> Result<Self, BackendError> {
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
        Ok(Self {
            relighter: cpu::Relighter::new(transport),
            picture: Rgba8Picture::black(camera),
            context,
        })
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
        self.relighter.relight(light, &OneThread);
        self.relighter.tone_map(exposure, &mut self.picture);
        let bytes = Clamped(self.picture.pixels.as_flattened());
        let Extent { width, height } = self.picture.extent;
        ImageData::new_with_u8_clamped_array_and_sh(bytes, width, height)
            .and_then(|image| self.context.put_image_data(&image, 0.0, 0.0))
            .map_err(|e: JsValue| BackendError::Lost(format!("{e:?}")))
    }
}
