//! The part of WebGPU that relighting uses, by the names of <https://www.w3.org/TR/webgpu/>.
//!
//! Natively it is wgpu. In browsers it is the browser's own interface: wgpu's layer over it would be most of the module.

#[cfg(target_arch = "wasm32")]
mod browser;
#[cfg(not(target_arch = "wasm32"))]
mod native;

use std::sync::{Arc, OnceLock};

#[cfg(target_arch = "wasm32")]
use browser as system;
#[cfg(not(target_arch = "wasm32"))]
use native as system;

#[cfg(target_arch = "wasm32")]
pub use browser::CanvasContext;
pub use system::{
    BindGroup, ComputePipeline, DeviceAndQueue, RenderPipeline, TextureView, UniformBuffer,
    WebGpuTexture, record_dispatches, record_draw,
};

/// The interface's name in errors.
pub const API: &str = "WebGPU";

/// `GPUTextureUsage`.
pub mod usage {
    #[cfg(not(target_arch = "wasm32"))]
    pub const COPY_SRC: u32 = 1;
    pub const COPY_DST: u32 = 2;
    pub const TEXTURE_BINDING: u32 = 4;
    pub const STORAGE_BINDING: u32 = 8;
    pub const RENDER_ATTACHMENT: u32 = 16;
}

/// The resource of a binding.
pub enum BindingResource<'a> {
    Texture(&'a WebGpuTexture),
    Uniforms(&'a UniformBuffer),
}

/// The first reason why a device no longer works, if any.
pub type DeviceLoss = Arc<OnceLock<String>>;
