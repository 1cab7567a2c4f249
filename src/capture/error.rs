//! Errors of capture folders. Each names the file and the field of the manifest; remedies are left to the caller.

use std::path::PathBuf;

use thiserror::Error;

use crate::transport::Extent;

/// The manifest's file name.
pub const MANIFEST_NAME: &str = "capture.json";

/// Why a capture cannot be used.
#[derive(Debug, Error)]
pub enum CaptureError {
    /// The path is no capture folder.
    #[error("{path}: {problem}")]
    NotACapture {
        /// The path given.
        path: PathBuf,
        /// Why not.
        problem: &'static str,
    },
    /// A file does not exist.
    #[error("{path}: there is no such file{}", named_by(field))]
    Missing {
        /// The file.
        path: PathBuf,
        /// The field of the manifest that names it, if any.
        field: Option<String>,
    },
    /// A file cannot be read.
    #[error("{path}: cannot be read")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The manifest is not JSON, or not an object with a version.
    #[error("{path}: is not a capture manifest")]
    Json {
        /// The manifest.
        path: PathBuf,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// A field of the manifest has the wrong type or lacks a member.
    #[error("{path}: \"{field}\" is invalid")]
    FieldType {
        /// The manifest.
        path: PathBuf,
        /// The field, as a path into the JSON.
        field: String,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// The manifest has an unknown version.
    #[error("{path}: \"version\" is {version}; this program reads version 1")]
    UnknownVersion {
        /// The manifest.
        path: PathBuf,
        /// The version found.
        version: u64,
    },
    /// A field of the manifest has an invalid value.
    #[error("{path}: \"{field}\" {problem}")]
    Field {
        /// The manifest.
        path: PathBuf,
        /// The field, as a path into the JSON.
        field: String,
        /// The problem of its value.
        problem: FieldProblem,
    },
    /// A picture has the wrong size or type, or is damaged.
    #[error("{path}{}: {problem}", named_by(field))]
    Image {
        /// The picture.
        path: PathBuf,
        /// The field of the manifest that names it, if any.
        field: Option<String>,
        /// The problem.
        problem: ImageProblem,
    },
    /// A file of known transport has the wrong form.
    #[error("{path}: {problem}")]
    Truth {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}

/// A problem of a field of the manifest. Its text continues the name of the field.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FieldProblem {
    /// A number or string outside its range.
    #[error("is {value}; it must be {allowed}")]
    OutOfRange {
        /// The value, as JSON.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// Neither of two fields is given.
    #[error("is missing, and so is \"{alternative}\"")]
    Missing {
        /// The field that may be given instead.
        alternative: &'static str,
    },
    /// Two fields that exclude each other are given.
    #[error("and \"{other}\" are both given, but exclude each other")]
    Conflict {
        /// The other field.
        other: &'static str,
    },
    /// The list has no entry.
    #[error("is empty")]
    Empty,
    /// The table of the monitor's response is not usable.
    #[error("must be two or more [code, emitted] pairs, both rising, up to code 255")]
    InvalidResponse,
    /// The affine map has no inverse.
    #[error("is not an invertible map of finite numbers")]
    NotInvertible,
    /// A bit of the Gray code was not photographed.
    #[error("has no photograph of axis {axis}, bit {bit}, inverted {inverted}")]
    MissingGrayCode {
        /// `x` or `y`.
        axis: &'static str,
        /// Number of the bit, 0 the least significant.
        bit: u32,
        /// Whether the missing photograph is that of the inverted pattern.
        inverted: bool,
    },
}

/// A problem of a picture.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ImageProblem {
    /// Not a PNG, or damaged.
    #[error("is not a readable PNG: {0}")]
    Unreadable(String),
    /// The size differs from the manifest's.
    #[error("is {found} pixels; {MANIFEST_NAME} says {expected}")]
    WrongExtent {
        /// Size of the picture.
        found: Extent,
        /// Size by the manifest.
        expected: Extent,
    },
    /// A photograph of another sample type.
    #[error("is {0}; a photograph must be a 16-bit linear RGB PNG")]
    PhotoType(String),
    /// A pattern of another sample type.
    #[error("is {0}; a pattern must be an 8-bit grey or RGB PNG")]
    PatternType(String),
    /// An interlaced photograph, which cannot be read row by row.
    #[error("is interlaced; photographs are read row by row")]
    Interlaced,
}

/// Where the manifest names a file, in brackets.
fn named_by(field: &Option<String>) -> String {
    let field = field.as_ref();
    field.map_or_else(String::new, |field| {
        format!(" ({field} in {MANIFEST_NAME})")
    })
}
