//! Backends, which draw a relit photograph into a canvas: their common interface, errors, and cache of the last light.

use thiserror::Error;

use super::texture_layout::TextureLayoutError;
use super::{Gamut, Light, LightChroma, OutputTransform};
#[cfg(target_arch = "wasm32")]
use crate::transport::Extent;

/// One frame to draw.
#[derive(Clone, Copy, Debug)]
pub struct FrameRequest<'a> {
    /// The light; `None` for the last light image.
    pub light: Option<&'a Light>,
    /// From linear light to codes.
    pub output: OutputTransform,
    /// The share of the components in use, 0 to 1.
    pub quality: f32,
}

/// What a graphics device holds of the last light.
#[derive(Clone, Debug, Default)]
pub struct UploadedLight {
    /// The uploaded light; `None` for a light image, whose elements only the device has.
    light: Option<Light>,
    /// The ratio between the light's channels.
    pub chroma: LightChroma,
    /// The quality of the basis response, once it is computed.
    response_quality: Option<f32>,
}

impl UploadedLight {
    /// A light that was just uploaded.
    pub fn new(light: &Light) -> Self {
        Self {
            light: Some(light.clone()),
            chroma: LightChroma::of_rows(std::iter::once(light.elements())),
            response_quality: None,
        }
    }

    /// Whether the device holds this light.
    pub fn has(&self, light: &Light) -> bool {
        self.light.as_ref() == Some(light)
    }

    /// Sets the quality of the basis response. Returns whether the response has to be computed again.
    pub fn set_quality(&mut self, quality: f32) -> bool {
        self.response_quality.replace(quality) != Some(quality)
    }
}

/// Draws one relit photograph into one canvas.
pub trait Backend {
    /// The gamut of the canvas.
    fn gamut(&self) -> Gamut;

    /// Uploads a picture of the browser's as the light of frames without one. Returns `false` if the backend cannot.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The last light stays.
    #[cfg(target_arch = "wasm32")]
    fn set_light_image(
        &mut self,
        _image: &wasm_bindgen::JsValue,
        _extent: Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        Ok(false)
    }

    /// Draws a frame before it returns.
    ///
    /// # Errors
    /// [`BackendError::Lost`] once the device no longer works.
    fn render(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError>;
}

/// Why a backend does not draw.
#[derive(Debug, Error)]
pub enum BackendError {
    /// The browser lacks the interface, or it is switched off.
    #[error("this browser does not offer {0}")]
    Missing(&'static str),
    /// The canvas gives no context of an interface, for a reason.
    #[error(
        "the canvas gives no {0} context: {1}. A canvas that already has a context of another kind never gives one; use \
         a new canvas"
    )]
    Canvas(&'static str, String),
    /// An interface finds no device, for a reason.
    #[error("{0} finds no usable graphics device: {1}")]
    Device(&'static str, String),
    /// The photograph exceeds the device's limits.
    #[error("{0}")]
    Layout(#[from] TextureLayoutError),
    /// The driver rejects a shader, with this log.
    #[error("the graphics driver rejects a shader: {0}")]
    Shader(String),
    /// The device rejects textures or buffers.
    #[error("the graphics device cannot hold the photograph: {0}")]
    Upload(String),
    /// The device was lost after it had been working.
    #[error("the graphics device was lost: {0}")]
    Lost(String),
}
