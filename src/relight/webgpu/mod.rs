//! Relighting by WebGPU: in browsers, and natively on the system's graphics devices.
//!
//! `api` has one implementation for browsers and one over wgpu; everything else is shared.

mod api;
#[cfg(target_arch = "wasm32")]
mod backend;
mod device;
#[cfg(target_arch = "wasm32")]
mod downsampler;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
mod photo_renderer;
mod photo_textures;
mod shader;

#[cfg(target_arch = "wasm32")]
pub use backend::WebGpuBackend;
pub use device::Device;
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::OffscreenRenderer;
