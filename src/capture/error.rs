//! Errors of capture folders. Each names the file and the field of the manifest; remedies are left to the caller.

use std::path::PathBuf;

use thiserror::Error;

use crate::calibrate::LightPlaneAxis;
use crate::transport::Extent;

/// Formats of photographs; pages read PNG only.
#[cfg(not(target_arch = "wasm32"))]
const PHOTO_FORMATS: &str = "PNG or TIFF, or a linear RGB TIFF of floating-point numbers";
#[cfg(target_arch = "wasm32")]
const PHOTO_FORMATS: &str = "PNG";

/// The manifest's file name.
pub const MANIFEST_NAME: &str = "capture.json";

/// Why a capture cannot be used.
#[derive(Debug, Error)]
#[error("{}{}: {problem}", path.display(), named_by(field))]
pub struct CaptureError {
    /// The file or folder.
    pub path: PathBuf,
    /// The field of the manifest that names the file, if any.
    pub field: Option<String>,
    /// The problem of the file.
    pub problem: CaptureErrorKind,
}

impl CaptureError {
    pub(crate) fn new(path: impl Into<PathBuf>, problem: CaptureErrorKind) -> Self {
        Self {
            path: path.into(),
            field: None,
            problem,
        }
    }
}

/// The problem of a file in a capture, or of a field of its manifest.
#[derive(Debug, Error)]
pub enum CaptureErrorKind {
    /// The path is no capture folder.
    #[error("{0}")]
    NotACapture(&'static str),
    /// The file does not exist.
    #[error("there is no such file")]
    Missing,
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Io(std::io::Error),
    /// The manifest is not JSON, or not an object with a version.
    #[error("is not a capture manifest: {0}")]
    NotAManifest(serde_json::Error),
    /// The manifest has an unknown version.
    #[error("\"version\" is {0}; this program reads version 1")]
    UnknownVersion(u64),
    /// A field of the manifest that must be there is not.
    #[error("\"{field}\" is missing")]
    MissingField {
        /// The field, as a path into the JSON.
        field: String,
        /// Paths of unknown fields: one may be this field, misspelt.
        unknown: Vec<String>,
    },
    /// A field of the manifest, given as a path into the JSON, has the wrong type.
    #[error("\"{0}\" is invalid: {1}")]
    FieldType(String, serde_json::Error),
    /// A number or string in the manifest is outside its range.
    #[error("\"{field}\" is {value}; it must be {allowed}")]
    OutOfRange {
        /// The field, as a path into the JSON.
        field: String,
        /// The value, as JSON.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// Neither gamma nor the monitor's response is given.
    #[error("\"light.gamma\" is missing, and so is \"light.response\"")]
    MissingResponse {
        /// Paths of unknown fields: one may be either of these, misspelt.
        unknown: Vec<String>,
    },
    /// Both gamma and the monitor's response are given.
    #[error("\"light.response\" and \"light.gamma\" are both given, but exclude each other")]
    ConflictingResponse,
    /// The table of the monitor's response is not usable.
    #[error(
        "\"light.response\" must be two or more [code, emitted] pairs, both rising, up to code 255"
    )]
    InvalidResponse,
    /// The manifest lists no shot.
    #[error("\"shots\" is empty")]
    NoShots,
    /// The correspondence has no inverse.
    #[error("\"correspondence.affine\" is not an invertible map of finite numbers")]
    NotInvertible,
    /// The displacement is that of pictures of another size.
    #[error(
        "\"correspondence.displacement\" has control points for pictures of another size than \"camera\""
    )]
    DisplacementOfOtherPicture,
    /// A bit of the Gray code was not photographed.
    #[error("\"graycode\" has no photograph of axis {axis}, bit {bit}, inverted {inverted}")]
    MissingGrayCode {
        /// The axis of the light plane.
        axis: LightPlaneAxis,
        /// Number of the bit, 0 the least significant.
        bit: u32,
        /// Whether the missing photograph is that of the inverted pattern.
        inverted: bool,
    },
    /// The file does not have the format given first, or is damaged.
    #[error("is not a readable {0}: {1}")]
    Unreadable(&'static str, String),
    /// An ingested photograph was damaged after it was written, in the place that is given.
    #[error("has a wrong checksum in {0}")]
    WrongChecksum(String),
    /// The size of a picture differs from the manifest's.
    #[error("is {found} pixels; {MANIFEST_NAME} says {expected}")]
    WrongExtent {
        /// Size of the picture.
        found: Extent,
        /// Size by the manifest.
        expected: Extent,
    },
    /// A photograph has another sample type.
    #[error("is {0}; a photograph must be a 16-bit linear RGB {PHOTO_FORMATS}")]
    PhotoType(String),
    /// A pattern has another sample type.
    #[error("is {0}; a pattern must be an 8-bit grey or RGB PNG")]
    PatternType(String),
    /// A photograph is interlaced and cannot be read row by row.
    #[error("is interlaced; photographs are read row by row")]
    Interlaced,
    /// A TIFF has the samples of each channel in a plane of their own.
    #[error("has a plane for each channel; photographs are read row by row, from whole pixels")]
    Planar,
    /// A TIFF has strips or tiles of so many rows that they take too much memory.
    #[error("has strips or tiles of {0} rows, which take too much memory")]
    LargeStrips(u32),
    /// A file of known transport has the wrong form.
    #[error("{0}")]
    InvalidTruth(String),
}

#[cfg(feature = "capture")]
impl CaptureErrorKind {
    /// A file that cannot be opened.
    pub(crate) fn of_opening(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::NotFound => Self::Missing,
            _ => Self::Io(error),
        }
    }
}

/// Where the manifest names a file, in brackets.
fn named_by(field: &Option<String>) -> String {
    let name = |field: &String| format!(" ({field} in {MANIFEST_NAME})");
    field.as_ref().map(name).unwrap_or_default()
}
