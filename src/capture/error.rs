//! What can be wrong with a capture folder.

use std::path::PathBuf;

use thiserror::Error;

/// Why a capture cannot be used: which file, which field, what to do.
#[derive(Debug, Error)]
pub enum CaptureError {
    /// A file that is not there.
    #[error("{path}: there is no such file{named_by}; add it or correct its name")]
    Missing {
        /// The file looked for.
        path: PathBuf,
        /// Where the manifest names it, as " (shots[3].photo in capture.json)"; may be empty.
        named_by: String,
    },
    /// Not a capture folder.
    #[error("{path}: {problem}; give the folder that holds capture.json")]
    NotACapture {
        /// What was given.
        path: PathBuf,
        /// What it is instead.
        problem: &'static str,
    },
    /// A file that cannot be read.
    #[error("{path}: cannot be read")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The manifest is not JSON of the expected form.
    #[error("{path}: is not a capture manifest")]
    Json {
        /// The manifest.
        path: PathBuf,
        /// Where and what.
        source: serde_json::Error,
    },
    /// A part of the manifest is not of the expected form.
    #[error("{path}: \"{field}\" is not as it must be")]
    Form {
        /// The manifest.
        path: PathBuf,
        /// The part, as a path into the JSON.
        field: String,
        /// Where and what.
        source: serde_json::Error,
    },
    /// The manifest is of another version.
    #[error("{path}: \"version\" is {version}; this program reads version 1: get a newer one")]
    Version {
        /// The manifest.
        path: PathBuf,
        /// The version found.
        version: u64,
    },
    /// A field of the manifest cannot be.
    #[error("{path}: \"{field}\" {problem}")]
    Field {
        /// The manifest.
        path: PathBuf,
        /// The field, as a path into the JSON.
        field: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A picture is not what it must be.
    #[error("{path}{named_by}: {problem}")]
    Image {
        /// The picture.
        path: PathBuf,
        /// Where the manifest names it, as for [`Missing`](Self::Missing).
        named_by: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The truth folder is not what it must be.
    #[error("{path}: {problem}")]
    Truth {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}
