//! Photographs as cameras and raw converters write them, as samples in memory.
//!
//! Input: the bytes of a PNG, a TIFF of integers or floating-point numbers, or an OpenEXR picture ([`decode_photo`]), or the
//! path of a raw file ([`RawConverter`]). Output: [`PhotoSamples`], the numbers of the file with three channels a pixel. Black,
//! white and tone curve are left to the caller.
//!
//! The bytes are not trusted: every decoder allocates within the caller's limit, and refuses what it cannot read.

mod decode;
mod error;
mod openexr;
mod png;
mod raw_converter;
mod samples;
mod tiff;

pub use decode::{PhotoFormat, decode_photo};
pub use error::PhotoFileError;
pub use raw_converter::{RAW_EXTENSIONS, RawConversionError, RawConverter};
pub use samples::{PhotoSamples, SampleValues};
