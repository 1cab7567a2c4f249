//! Capture folders and the linear measurements they hold.
//!
//! Input: a [`Manifest`] (`capture.json`) that lists patterns, their photographs, and the calibration of camera and
//! light plane. Output: [`Measurements`], the linear system `Y = PT` that recovery solves, in units of the measurement,
//! `(code − black) / (white − black)`.
//!
//! Reading files needs the feature `capture`. Photographs are read row by row from the top, so that captures larger
//! than memory can be recovered strip by strip ([`CameraPixelSet`]).

mod camera_pixel_set;
mod camera_row_set;
#[cfg(feature = "capture")]
mod code_statistics;
#[cfg(not(target_arch = "wasm32"))]
mod defective_pixels;
mod error;
#[cfg(feature = "capture")]
mod folder;
mod group_ids;
mod manifest;
mod measurements;
mod noise_estimate;
mod noise_model;

pub use camera_pixel_set::CameraPixelSet;
pub use camera_row_set::CameraRowSet;
#[cfg(feature = "capture")]
pub use code_statistics::CodeStatistics;
#[cfg(not(target_arch = "wasm32"))]
pub use defective_pixels::DefectivePixels;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use defective_pixels::MARGIN as DEFECT_MARGIN;
pub use error::{CaptureError, CaptureErrorKind, MANIFEST_NAME};
#[cfg(feature = "capture")]
pub use folder::{
    CaptureFiles, CaptureFolder, DarkFrame, DarkFrameReader, DiskFiles, PhotographRowReader,
    read_unlisted_pattern, read_unlisted_photo,
};
#[cfg(all(feature = "capture", not(target_arch = "wasm32")))]
pub use folder::{
    GroundTruth, IngestError, IngestSource, IngestedPhotograph, PhotographScan, RELIT_FULL_SCALE,
};
pub(crate) use group_ids::{group_count, group_ids};
pub use manifest::{
    CameraResponse, GrayCodeShot, ListedPhotograph, Manifest, ManifestCamera, ManifestLight,
    PhotographRole, Shot,
};
pub use measurements::{LinearPhoto, Measurements, Pattern};
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use noise_estimate::sample_squares as noise_sample_squares;
pub use noise_model::NoiseModel;
