//! One photograph on one canvas, by any backend.

use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::light::WebLight;
use super::output_transform::WebOutputTransform;
use crate::relight::backend::{Backend, FrameRequest};
use crate::relight::{Light, LightError};
use crate::transport::Extent;
use crate::web::CodedError;

/// Draws a photograph into a canvas by one backend.
#[wasm_bindgen]
pub struct CanvasRelighter {
    pub(in crate::web) backend: Box<dyn Backend>,
    /// The graphics device, or the instruction set of the CPU.
    pub(in crate::web) kernel: String,
    /// Extent of the light plane.
    pub(in crate::web) light: Extent,
}

#[wasm_bindgen]
impl CanvasRelighter {
    /// The graphics device's name, or `simd128` or `scalar` on the CPU.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        self.kernel.clone()
    }

    /// The canvas's gamut: the one asked for, if the browser supports it.
    #[wasm_bindgen(getter, unchecked_return_type = "\"srgb\" | \"display-p3\"")]
    pub fn gamut(&self) -> String {
        self.backend.gamut().color_space().into()
    }

    /// Draws the picture under a light before it returns. `quality` is the share of the components in use, 0 (fastest) to
    /// 1. The canvas can be read until the end of the current task.
    ///
    /// # Errors
    /// Code `light-size` for a light of another photograph, `backend-lost` if the device is lost.
    pub fn render(
        &mut self,
        light: &WebLight,
        output: &WebOutputTransform,
        quality: f64,
    ) -> Result<(), CodedError> {
        let light = &light.0;
        if light.extent() != self.light {
            return Err(LightError::WrongLength {
                got: light.elements().len() * 3,
                need: self.light.area() * 3,
                extent: self.light,
            }
            .into());
        }
        self.draw(Some(light), output, quality)
    }

    /// Makes a picture of the browser's, of that size, the light of [`renderLightImage`](Self::render_light_image): it is
    /// decoded from sRGB and resampled by area. Returns `false` if this backend cannot.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The last light stays.
    #[wasm_bindgen(js_name = setLightImage)]
    pub fn set_light_image(
        &mut self,
        image: &JsValue,
        width: u32,
        height: u32,
    ) -> Result<bool, JsValue> {
        self.backend
            .set_light_image(image, Extent { width, height })
    }

    /// Draws the picture under the last light image, as [`render`](Self::render).
    ///
    /// # Errors
    /// Code `backend-lost` if the device is lost.
    #[wasm_bindgen(js_name = renderLightImage)]
    pub fn render_light_image(
        &mut self,
        output: &WebOutputTransform,
        quality: f64,
    ) -> Result<(), CodedError> {
        self.draw(None, output, quality)
    }

    fn draw(
        &mut self,
        light: Option<&Light>,
        output: &WebOutputTransform,
        quality: f64,
    ) -> Result<(), CodedError> {
        Ok(self.backend.render(&FrameRequest {
            light,
            output: output.0,
            quality: quality as f32,
        })?)
    }
}
