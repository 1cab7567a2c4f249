//! One photograph on one canvas.

use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::display::Display;
use super::light::Light;
use crate::relight::LightError;
use crate::relight::backend::{Backend, Frame};
use crate::transport::Extent;
use crate::web::CodedError;

/// Draws a photograph into a canvas, by one back end.
#[wasm_bindgen]
pub struct Relighter {
    backend: Box<dyn Backend>,
    light: Extent,
}

impl Relighter {
    pub(in crate::web) fn of(backend: Box<dyn Backend>, light: Extent) -> Self {
        Self { backend, light }
    }
}

#[wasm_bindgen]
impl Relighter {
    /// The back end's name.
    #[wasm_bindgen(getter)]
    pub fn backend(&self) -> String {
        self.backend.name().into()
    }

    /// What does the work: `simd128` or `scalar`, or the graphics device by name.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        self.backend.kernel()
    }

    /// What the canvas shows: the gamut that was asked for, where the browser can.
    #[wasm_bindgen(getter, unchecked_return_type = "\"srgb\" | \"display-p3\"")]
    pub fn gamut(&self) -> String {
        self.backend.gamut().color_space().into()
    }

    /// Draws the picture under `light` before it returns, by a share of its components from 0, which
    /// is fastest, to 1, which is all. The canvas can be read until the end of the current task.
    pub fn render(
        &mut self,
        light: &Light,
        display: &Display,
        detail: f64,
    ) -> Result<(), CodedError> {
        let light = light.inner();
        if light.extent() != self.light {
            return Err(LightError::Length {
                got: light.elements().len() * 3,
                need: self.light.area() * 3,
                extent: self.light,
            }
            .into());
        }
        self.draw(Some(light), display, detail)
    }

    /// Takes a picture that the browser has, of so many pixels, as the light of
    /// [`renderPicture`](Self::render_picture): codes are decoded from sRGB, and averaged by area. `false`
    /// where this back end cannot. Throws what the browser does, as for pictures of another origin; the
    /// last light stays.
    #[wasm_bindgen(js_name = takePicture)]
    pub fn take_picture(
        &mut self,
        picture: &JsValue,
        width: u32,
        height: u32,
    ) -> Result<bool, JsValue> {
        self.backend.take_picture(picture, Extent { width, height })
    }

    /// As [`render`](Self::render), under the picture that was taken last.
    #[wasm_bindgen(js_name = renderPicture)]
    pub fn render_picture(&mut self, display: &Display, detail: f64) -> Result<(), CodedError> {
        self.draw(None, display, detail)
    }

    fn draw(
        &mut self,
        light: Option<&crate::relight::Light>,
        display: &Display,
        detail: f64,
    ) -> Result<(), CodedError> {
        let (display, detail) = (display.inner(), detail as f32);
        Ok(self.backend.render(&Frame {
            light,
            display,
            detail,
        })?)
    }
}
