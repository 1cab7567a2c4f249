//! From a transport and a light to a picture: `y = pT` on the CPU, WebGPU and WebGL2.
//!
//! Every back end computes the same thing from the same bytes: the light seen through each function
//! of the basis from each window's place; for each camera pixel and channel Σ of that times its
//! coefficients, and Σ over its window of `code · step · light` for what it has by element; then
//! exposure and the sRGB curve ([`tone`]).
//! [`reference`] does it in double precision and is what the others are tested against. The GPU
//! back ends share one WGSL source, `shaders/relight.wgsl`.

#[cfg(target_arch = "wasm32")]
pub mod backend;
pub mod cpu;
mod light;
mod picture;
pub mod reference;
mod resample;
pub mod texture_layout;
mod tint;
pub mod tone;
#[cfg(target_arch = "wasm32")]
pub mod webgl2;
#[cfg(target_arch = "wasm32")]
pub mod webgpu;

pub use light::{BuiltinLight, Light, LightError, TorchPose};
pub use picture::{LinearPicture, Rgba8Picture};
pub use resample::area_resample;
pub use tint::Tint;

/// The WGSL source of both GPU back ends.
pub const SHADER: &str = include_str!("shaders/relight.wgsl");
