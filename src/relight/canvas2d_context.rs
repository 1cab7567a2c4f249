//! Opens the 2D context of a canvas that pictures are copied into.

use js_sys::{Function, Object, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

use super::Gamut;
use super::backend::BackendError;
use crate::transport::Extent;

/// Where a canvas stores its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanvasMemoryLocation {
    /// The browser decides, usually for graphics memory.
    Default,
    /// Main memory, for pixels that come from the CPU: a software renderer would copy every frame twice.
    MainMemory,
}

/// Resizes a canvas and opens its 2D context. Returns the context and its gamut: the one asked for, if the browser
/// supports it, or sRGB.
///
/// # Errors
/// [`BackendError::Canvas`] if the canvas gives no 2D context.
pub fn open_2d(
    canvas: &HtmlCanvasElement,
    extent: Extent,
    gamut: Gamut,
    storage: CanvasMemoryLocation,
) -> Result<(CanvasRenderingContext2d, Gamut), BackendError> {
    let error = |reason: &str| BackendError::Canvas("2D", reason.into());
    let thrown = |e| error(&format!("{e:?}"));
    canvas.set_width(extent.width);
    canvas.set_height(extent.height);
    let settings = Object::new();
    let set = |name: &str, value| Reflect::set(&settings, &name.into(), &value).map_err(thrown);
    set("colorSpace", JsValue::from(gamut.color_space()))?;
    set("alpha", JsValue::from(false))?;
    set(
        "willReadFrequently",
        JsValue::from(storage == CanvasMemoryLocation::MainMemory),
    )?;
    let context = canvas
        .get_context_with_context_options("2d", &settings)
        .map_err(thrown)?
        .and_then(|context| context.dyn_into::<CanvasRenderingContext2d>().ok())
        .ok_or_else(|| error("getContext returned null"))?;
    // Browsers without other gamuts ignore the setting, and report none.
    let attributes = Reflect::get(&context, &"getContextAttributes".into())
        .and_then(|method| method.dyn_into::<Function>()?.call0(&context))
        .and_then(|attributes| Reflect::get(&attributes, &"colorSpace".into()));
    let actual = attributes.ok().and_then(|space| space.as_string());
    let gamut = match actual.as_deref() == Some(gamut.color_space()) {
        true => gamut,
        false => Gamut::Srgb,
    };
    Ok((context, gamut))
}
