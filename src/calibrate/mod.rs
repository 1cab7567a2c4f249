//! Calibration of the set-up: the correspondence from photographs of Gray code.

mod affine_fit;
mod graycode;

pub use graycode::{BitPair, CalibrationError, GrayCodePhotos, LightPlaneAxis};
