//! From a capture folder to linear measurements.
//!
//! `capture.json` ([`Manifest`]) names the photographs, the patterns shown while each was taken and
//! what is known of camera and display. [`CaptureFolder`] opens and checks them one by one, so that
//! whoever has threads can read them at once; a [`Photo`] is read by rows, from the top down, so that
//! those of many megapixels need not be in memory whole. [`Measurements`] is what recovery works on.

mod alike;
mod error;
#[cfg(not(target_arch = "wasm32"))]
mod folder;
#[cfg(not(target_arch = "wasm32"))]
mod images;
mod manifest;
mod measurements;
mod noise;
#[cfg(not(target_arch = "wasm32"))]
mod photo;
mod rows;
#[cfg(not(target_arch = "wasm32"))]
mod truth;

pub(crate) use alike::{distinct, numbers};
pub use error::CaptureError;
#[cfg(not(target_arch = "wasm32"))]
pub use folder::{CaptureFolder, DarkFrame};
pub use manifest::{
    AffineSpec, CameraSpec, GrayCodeShot, LightSpec, MANIFEST_NAME, Manifest, Shot,
};
pub use measurements::{Measurements, Pattern, Picture};
pub use noise::Noise;
#[cfg(not(target_arch = "wasm32"))]
pub use photo::Photo;
pub use rows::Rows;
#[cfg(not(target_arch = "wasm32"))]
pub use truth::{RELIT_FULL_SCALE, Truth};
