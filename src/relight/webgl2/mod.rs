//! Relighting by WebGL2.
//!
//! All photographs of a page share one context, on a hidden canvas; each frame is copied from there into the
//! photograph's own canvas.

mod backend;
mod context;
mod downsampler;
mod photo_resources;
mod resources;

pub use backend::WebGl2Backend;
pub use context::GlContext;
