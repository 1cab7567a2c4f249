//! What JavaScript sees: a thin face on [`format`](crate::format) and [`relight`](crate::relight).
//!
//! Every failure is thrown as a JavaScript `Error` with a `code` (see [`CodedError`]).

mod band_relighter;
mod canvas2d;
mod decoder;
mod display;
mod error;
mod graphics;
mod light;
mod parcel;
mod photo;
mod relighter;

pub use band_relighter::{BandRelighter, cpu_kernel};
pub use decoder::Decoder;
pub use display::Display;
pub use error::CodedError;
pub use graphics::Graphics;
pub use light::Light;
pub use photo::Photo;
pub use relighter::Relighter;
