//! Canvases that pictures are copied into.

use js_sys::{Function, Object, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

use super::Gamut;
use super::backend::BackendError;
use crate::transport::Extent;

/// Where a canvas keeps its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Where the browser likes, which is the graphics memory.
    Anywhere,
    /// In the page's memory, where pixels come from that a CPU has made: where there is no graphics
    /// processor, every frame would go to a program in the place of one and back.
    InMemory,
}

/// A canvas's 2D context, of a picture's size and, where the browser can, of a gamut.
pub fn open_2d(
    canvas: &HtmlCanvasElement,
    extent: Extent,
    gamut: Gamut,
    keep: Keep,
) -> Result<(CanvasRenderingContext2d, Gamut), BackendError> {
    let error = |reason: &str| BackendError::Canvas {
        api: "2D",
        reason: reason.into(),
    };
    let thrown = |e| error(&format!("{e:?}"));
    canvas.set_width(extent.width);
    canvas.set_height(extent.height);
    let settings = Object::new();
    let set = |name: &str, value| Reflect::set(&settings, &name.into(), &value).map_err(thrown);
    set("colorSpace", JsValue::from(gamut.color_space()))?;
    set("alpha", JsValue::from(false))?;
    set("willReadFrequently", JsValue::from(keep == Keep::InMemory))?;
    let context = canvas
        .get_context_with_context_options("2d", &settings)
        .map_err(thrown)?
        .and_then(|context| context.dyn_into::<CanvasRenderingContext2d>().ok())
        .ok_or_else(|| error("getContext returned null"))?;
    // Browsers that know no other gamut say nothing of it.
    let attributes = Reflect::get(&context, &"getContextAttributes".into())
        .and_then(|ask| ask.dyn_into::<Function>()?.call0(&context))
        .and_then(|attributes| Reflect::get(&attributes, &"colorSpace".into()));
    let given = attributes.ok().and_then(|space| space.as_string());
    let gamut = match given.as_deref() == Some(gamut.color_space()) {
        true => gamut,
        false => Gamut::Srgb,
    };
    Ok((context, gamut))
}
