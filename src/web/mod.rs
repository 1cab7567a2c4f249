//! What JavaScript sees: a thin face on [`format`](crate::format) and [`relight`](crate::relight).
//!
//! Each feature is a module of its own that browsers load when they need it: the decoder, and what relights
//! on the CPU, by WebGL2 and by WebGPU. A photograph goes from one to another as parcels, as each has a memory
//! of its own. Every failure is thrown as a JavaScript `Error` with a `code` (see [`CodedError`]).

#[cfg(feature = "cpu")]
mod band_relighter;
#[cfg(feature = "cpu")]
mod canvas2d;
#[cfg(feature = "decoder")]
mod decoder;
mod error;
#[cfg(any(feature = "webgl2", feature = "webgpu"))]
mod graphics;
mod parcel;
mod photo;
/// What every module that draws has.
#[cfg(feature = "drawing")]
mod drawing {
    pub mod display;
    pub mod light;
    pub mod relighter;
}

#[cfg(feature = "cpu")]
pub use band_relighter::{BandRelighter, cpu_kernel};
#[cfg(feature = "decoder")]
pub use decoder::Decoder;
#[cfg(feature = "drawing")]
pub use drawing::{display::Display, light::Light, relighter::Relighter};
pub use error::CodedError;
#[cfg(any(feature = "webgl2", feature = "webgpu"))]
pub use graphics::Graphics;
pub use photo::Photo;
