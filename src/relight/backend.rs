//! What is asked of a back end, whichever it is.

use thiserror::Error;

use super::texture_layout::LayoutError;
use super::{Display, Gamut, Light, Tint};
#[cfg(target_arch = "wasm32")]
use crate::transport::Extent;

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The light; `None` for the picture that was taken last.
    pub light: Option<&'a Light>,
    /// How it is shown.
    pub display: Display,
    /// The share of the components that is used, 0 to 1.
    pub detail: f32,
}

/// The light that a device has.
#[derive(Clone, Debug, Default)]
pub struct Lit {
    /// `None` for a picture, whose colours nobody has looked at.
    light: Option<(Light, Tint)>,
    /// The detail in which it is seen, if it is already.
    seen: Option<f32>,
}

impl Lit {
    /// One that was just given.
    pub fn of(light: &Light) -> Self {
        Self {
            light: Some((light.clone(), light.tint())),
            seen: None,
        }
    }

    /// Whether it is that one.
    pub fn is(&self, light: &Light) -> bool {
        self.light.as_ref().is_some_and(|(own, _)| own == light)
    }

    /// What its channels have in common.
    pub fn tint(&self) -> Tint {
        self.light.as_ref().map_or(Tint::Many, |(_, tint)| *tint)
    }

    /// Whether it is yet to be seen in that detail, as it is afterwards.
    pub fn look(&mut self, detail: f32) -> bool {
        self.seen.replace(detail) != Some(detail)
    }
}

/// One way of drawing a relit photograph into a canvas.
pub trait Backend {
    /// The name by which attributes call it.
    fn name(&self) -> &'static str;

    /// What does the work: an instruction set, or the graphics device.
    fn kernel(&self) -> String;

    /// What its canvas shows.
    fn gamut(&self) -> Gamut;

    /// Takes a picture that the browser has as the light of frames without one; `false` where the
    /// device cannot.
    ///
    /// # Errors
    /// What the browser throws, as for pictures of another origin. The last light stays.
    #[cfg(target_arch = "wasm32")]
    fn take_picture(
        &mut self,
        _: &wasm_bindgen::JsValue,
        _: Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        Ok(false)
    }

    /// Draws the whole picture before it returns.
    fn render(&mut self, frame: &Frame<'_>) -> Result<(), BackendError>;
}

/// Why a back end does not draw.
#[derive(Debug, Error)]
pub enum BackendError {
    /// The browser does not have the interface, or has it switched off.
    #[error("this browser has no {0} to offer")]
    Missing(&'static str),
    /// The canvas gives no context.
    #[error(
        "the canvas gives no {api} context ({reason}), nor would one that another interface has used"
    )]
    Canvas {
        /// The interface.
        api: &'static str,
        /// The browser's word for it.
        reason: String,
    },
    /// The browser has the interface but no device behind it.
    #[error("{api} finds no usable graphics device: {reason}")]
    Device {
        /// The interface.
        api: &'static str,
        /// The browser's word for it.
        reason: String,
    },
    /// The device is too small for the photograph.
    #[error("{0}")]
    Layout(#[from] LayoutError),
    /// The driver refuses a shader.
    #[error("the graphics driver refuses the {stage}: {log}")]
    Shader {
        /// Vertex shader, fragment shader or program.
        stage: &'static str,
        /// The driver's word for it.
        log: String,
    },
    /// The device refuses textures or buffers.
    #[error("the graphics device does not take the photograph: {0}")]
    Upload(String),
    /// The device went away after it had been working.
    #[error("the graphics device was lost: {0}")]
    Lost(String),
}

impl BackendError {
    /// Whether the back end had been working before.
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Lost(_))
    }
}
