//! From a transport and a light to a picture: `y = pT` on the CPU, WebGPU and WebGL2.
//!
//! Every back end computes the same thing from the same bytes: the light seen through each function
//! of the basis from each window's place; for each camera pixel and channel Σ of that times its
//! coefficients, and Σ over its window of `code · step · light` for what it has by element; then what
//! a display makes of it ([`display`]).
//! [`reference`] does it in double precision and is what the others are tested against. The GPU
//! back ends share one WGSL source, `shaders/relight.wgsl`.

pub mod backend;
#[cfg(target_arch = "wasm32")]
pub mod canvas2d;
pub mod cpu;
pub mod display;
mod fire;
mod light;
mod math;
mod picture;
pub mod reference;
mod resample;
pub mod texture_layout;
mod tint;
pub mod tone;
#[cfg(target_arch = "wasm32")]
pub mod webgl2;
#[cfg(any(target_arch = "wasm32", feature = "gpu"))]
pub mod webgpu;

pub use display::{Display, Gamut, ToneCurve};
pub use light::{BuiltinLight, Light, LightError, TorchPose};
pub use picture::{LinearPicture, Rgba8Picture};
pub use resample::area_resample;
pub use tint::Tint;

/// A share, 0 to 1, of a number of things of which there is always one.
fn detailed(all: usize, share: f32) -> usize {
    ((all as f32 * share).ceil() as usize).clamp(all.min(1), all)
}
