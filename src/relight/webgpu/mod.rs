//! Relighting by WebGPU: in browsers, and natively on the system's graphics devices.
//!
//! `api` has one implementation for browsers and one over wgpu; everything else is shared.

mod api;
#[cfg(target_arch = "wasm32")]
mod backend;
mod context;
#[cfg(target_arch = "wasm32")]
mod downsampler;
#[cfg(not(target_arch = "wasm32"))]
mod headless;
mod photo_renderer;
mod photo_textures;
mod shader;

#[cfg(target_arch = "wasm32")]
pub use backend::WebGpuBackend;
pub use context::GpuContext;
#[cfg(not(target_arch = "wasm32"))]
pub use headless::HeadlessRenderer;
