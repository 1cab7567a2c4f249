//! What JavaScript sees: a thin face on [`format`](crate::format) and [`relight`](crate::relight).
//!
//! Every failure is thrown as a JavaScript `Error` with a `code` (see [`CodedError`]).

mod canvas2d;
mod decoder;
mod error;
mod light;
mod parcel;
mod photo;
mod relighter;

pub use decoder::Decoder;
pub use error::CodedError;
pub use light::Light;
pub use photo::Photo;
pub use relighter::Relighter;
