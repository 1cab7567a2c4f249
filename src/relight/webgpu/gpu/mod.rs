//! What of WebGPU relighting takes: by wgpu from the system, and from a browser as it is, as wgpu's way to it
//! would be most of the module.

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
pub use browser::Canvas;
pub use system::{Bindings, ComputePipeline, Gpu, RenderPipeline, Texture, Uniforms, View};

/// What errors call the interface.
pub const API: &str = "WebGPU";

/// What the system tells of a device.
pub struct Adapter {
    pub limits: TextureLimits,
    /// In full, by vendor and architecture, or empty.
    pub name: String,
    #[cfg(not(target_arch = "wasm32"))]
    /// Whether the system says that it is a program that makes up for a missing graphics processor.
    pub fallback: bool,
}

/// What a texture's texels are.
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

/// What a texture is for, by the bits of the standard.
pub mod usage {
    #[cfg(not(target_arch = "wasm32"))]
    pub const COPY_SRC: u32 = 1;
    pub const COPY_DST: u32 = 2;
    pub const TEXTURE_BINDING: u32 = 4;
    pub const STORAGE_BINDING: u32 = 8;
    pub const RENDER_ATTACHMENT: u32 = 16;
}

/// A texture that is to be made.
pub struct TextureDescriptor {
    pub label: &'static str,
    pub extent: Extent,
    /// Of an array: one of a single layer is still one to the shader.
    pub layers: Option<u32>,
    pub format: TextureFormat,
    /// Of [`usage`].
    pub usage: u32,
}

/// What a binding stands for.
pub enum Resource<'a> {
    Texture(&'a Texture),
    Uniforms(&'a Uniforms),
}

/// Why a device no longer works, once it does not: the first thing that stopped it.
#[derive(Clone, Debug, Default)]
pub struct Loss(Arc<OnceLock<String>>);

impl Loss {
    fn note(&self, reason: String) {
        let _ = self.0.set(reason);
    }

    pub fn reason(&self) -> Option<&str> {
        self.0.get().map(String::as_str)
    }
}
