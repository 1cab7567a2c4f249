//! The WebAssembly surface: thin wrappers of [`format`](crate::format) and [`relight`](crate::relight) for JavaScript.
//!
//! Each feature is a module that browsers load when they need it: the decoder, the reader of captures, the recovery,
//! the simulation of the site, and the backends CPU, WebGL2 and WebGPU. Each module has its own memory, so a photograph is decoded in one and
//! transferred to others. Every failure is thrown as a JavaScript `Error` with a `code` ([`CodedError`]).

#[cfg(feature = "cpu")]
mod canvas2d;
#[cfg(feature = "capture_reader")]
mod capture_reader;
#[cfg(feature = "decoder")]
mod decoder;
mod error;
#[cfg(any(feature = "webgl2", feature = "webgpu"))]
mod graphics_device;
#[cfg(any(feature = "decoder", feature = "drawing", feature = "recovery"))]
mod photo;
#[cfg(any(feature = "decoder", feature = "drawing", feature = "recovery"))]
mod photo_transfer;
#[cfg(any(feature = "recovery", feature = "simulation"))]
mod progress;
#[cfg(feature = "recovery")]
mod recovery;
#[cfg(any(feature = "capture_reader", feature = "recovery"))]
mod recovery_error;
#[cfg(feature = "cpu")]
mod row_range_relighter;
#[cfg(feature = "simulation")]
mod simulation;
/// What every module with a backend has.
#[cfg(feature = "drawing")]
mod drawing {
    pub mod canvas_relighter;
    pub mod light;
    pub mod output_transform;
}

#[cfg(feature = "capture_reader")]
pub use capture_reader::{CaptureReader, LinearPng, read_pattern, read_photograph};
#[cfg(feature = "decoder")]
pub use decoder::Decoder;
#[cfg(feature = "drawing")]
pub use drawing::{
    canvas_relighter::CanvasRelighter, light::WebLight, output_transform::WebOutputTransform,
};
pub use error::CodedError;
#[cfg(any(feature = "webgl2", feature = "webgpu"))]
pub use graphics_device::GraphicsDevice;
#[cfg(any(feature = "decoder", feature = "drawing", feature = "recovery"))]
pub use photo::Photo;
#[cfg(feature = "recovery")]
pub use recovery::{
    CaptureBuilder, MeasurementBuilder, MeasurementInput, RecoveredTransport, Recovery,
    TileRecovery, emission_of_codes,
};
#[cfg(feature = "cpu")]
pub use row_range_relighter::{RowRangeRelighter, cpu_kernel};
#[cfg(feature = "simulation")]
pub use simulation::{Simulation, TransportAnalysis};
