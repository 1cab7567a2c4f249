//! What a page needs to know of a back end, whichever it is.

use js_sys::Promise;
use thiserror::Error;

use super::Light;
use super::texture_layout::LayoutError;

/// One way of drawing a relit photograph into a canvas.
pub trait Backend {
    /// The name by which attributes call it.
    fn name(&self) -> &'static str;

    /// What does the work: an instruction set, or the graphics device.
    fn kernel(&self) -> String;

    /// Draws the whole picture under `light`, scaled by `exposure`, before it returns.
    fn render(&mut self, light: &Light, exposure: f32) -> Result<(), BackendError>;

    /// Settles, with an object that has a `message`, when the graphics device goes away: a picture
    /// that is not drawn again would be blank without anyone knowing. `None` where there is no such
    /// device, or the canvas itself tells.
    fn lost(&self) -> Option<Promise> {
        None
    }
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
    #[error("the graphics device was lost: {0}; create the back end anew")]
    Lost(String),
}

impl BackendError {
    /// Whether the back end had been working before.
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Lost(_))
    }
}
