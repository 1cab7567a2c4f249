//! The part of WebGPU that relighting uses, by the names of <https://www.w3.org/TR/webgpu/>.
//!
//! Natively it is wgpu. In browsers it is the browser's own interface: wgpu's layer over it would be most of the module.

#[cfg(target_arch = "wasm32")]
mod browser;
#[cfg(not(target_arch = "wasm32"))]
mod native;

use std::sync::{Arc, OnceLock};

use crate::relight::texture_layout::TextureLimits;
use crate::transport::Extent;

#[cfg(target_arch = "wasm32")]
use browser as system;
#[cfg(not(target_arch = "wasm32"))]
use native as system;

#[cfg(target_arch = "wasm32")]
pub use browser::CanvasContext;
pub use system::{
    BindGroup, ComputePipeline, DeviceQueue, RenderPipeline, Texture, TextureView, UniformBuffer,
};

/// The interface's name in errors.
pub const API: &str = "WebGPU";

/// A device's limits and name.
pub struct AdapterInfo {
    pub limits: TextureLimits,
    /// Name, or vendor and architecture; may be empty.
    pub name: String,
    #[cfg(not(target_arch = "wasm32"))]
    /// Whether the system reports a software renderer.
    pub is_software: bool,
}

/// A texture's format.
#[derive(Clone, Copy, Debug)]
pub enum TextureFormat {
    Rgba8Unorm,
    #[cfg(target_arch = "wasm32")]
    Bgra8Unorm,
    Rg16Sint,
    Rgba16Sint,
    Rgba32Sint,
    Rgba32Float,
}

/// `GPUTextureUsage`.
pub mod usage {
    #[cfg(not(target_arch = "wasm32"))]
    pub const COPY_SRC: u32 = 1;
    pub const COPY_DST: u32 = 2;
    pub const TEXTURE_BINDING: u32 = 4;
    pub const STORAGE_BINDING: u32 = 8;
    pub const RENDER_ATTACHMENT: u32 = 16;
}

/// A texture to create.
pub struct TextureDescriptor {
    pub label: &'static str,
    pub extent: Extent,
    /// `Some` for an array: also one of a single layer is an array in the shader.
    pub layers: Option<u32>,
    pub format: TextureFormat,
    /// Bits of [`usage`].
    pub usage: u32,
}

/// The resource of a binding.
pub enum BindingResource<'a> {
    Texture(&'a Texture),
    Uniforms(&'a UniformBuffer),
}

/// The first reason why a device no longer works, if any.
#[derive(Clone, Debug, Default)]
pub struct DeviceLoss(Arc<OnceLock<String>>);

impl DeviceLoss {
    fn record(&self, reason: String) {
        let _ = self.0.set(reason);
    }

    pub fn reason(&self) -> Option<&str> {
        self.0.get().map(String::as_str)
    }
}
