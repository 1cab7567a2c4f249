//! Calibration of the set-up: the correspondence from photographs of Gray code, and the camera's colours.

mod affine_fit;
#[cfg(not(target_arch = "wasm32"))]
mod camera_colors;
#[cfg(not(target_arch = "wasm32"))]
mod displacement_fit;
mod gray_code_quality;
mod graycode;
#[cfg(not(target_arch = "wasm32"))]
mod graycode_fit;

#[cfg(not(target_arch = "wasm32"))]
pub use camera_colors::{color_matrix, primaries_from_photographs, white_of};
pub use gray_code_quality::GrayCodeQuality;
pub use graycode::{BitPair, CalibrationError, GrayCodePhotos, LightPlaneAxis};
#[cfg(not(target_arch = "wasm32"))]
pub use graycode_fit::{GrayCodeFit, ResidualSummary};
