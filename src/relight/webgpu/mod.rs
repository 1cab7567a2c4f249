//! Relighting by WebGPU: the browser's, and the system's own graphics devices.

#[cfg(target_arch = "wasm32")]
mod canvas;
mod device;
mod gpu;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
#[cfg(target_arch = "wasm32")]
mod pictures;
mod scene;
mod shader;
mod textures;

#[cfg(target_arch = "wasm32")]
pub use canvas::WebGpu;
pub use device::Device;
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::Offscreen;
