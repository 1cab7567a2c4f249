//! Relighting: the picture `y = pT` under a light `p`, on the CPU, by WebGPU and by WebGL2.
//!
//! All backends compute the same two steps from the same codes:
//!
//! 1. the basis response `C_k(o) = Σ_s v_k(s) p(o + s)`: the light correlated with each basis function at every
//!    window origin `o`; it depends on the light alone;
//! 2. for each camera pixel `n` and channel, `y_n = Σ_k c_nk C_k(o_n) + Σ_s τ_n(s) p(o_n + s)` from its coefficients
//!    and its directly stored function, then the output transform ([`output_transform`]).
//!
//! [`reference`] computes the same in double precision; the backends are tested against it. Both GPU backends share
//! the WGSL in `shaders/`.

pub mod backend;
#[cfg(target_arch = "wasm32")]
pub mod canvas2d_context;
pub mod cpu;
mod fire;
mod light;
mod light_chroma;
pub mod output_transform;
mod picture;
mod platform_math;
pub mod reference;
mod resample;
pub mod srgb;
pub mod texture_layout;
#[cfg(target_arch = "wasm32")]
pub mod webgl2;
#[cfg(any(target_arch = "wasm32", feature = "gpu"))]
pub mod webgpu;

pub use light::{BuiltinLight, Light, LightError, TorchSpot};
pub use light_chroma::LightChroma;
pub use output_transform::{Gamut, OutputMatrix, OutputTransform, ToneCurve};
pub use picture::{LinearPicture, Picture, Rgba8Picture};
pub use resample::area_resample;

/// How many of `total` things a quality of 0 to 1 uses: at least one, if there is one.
fn used_count(total: usize, quality: f32) -> usize {
    ((total as f32 * quality).ceil() as usize).clamp(total.min(1), total)
}
