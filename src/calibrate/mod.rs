//! From calibration photographs to where each camera pixel looks.

mod fit;
mod graycode;

pub use graycode::{Axis, BitPair, CalibrationError, GrayCode};
