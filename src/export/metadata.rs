//! Metadata of a recovered file.

use serde::{Deserialize, Serialize};

use crate::capture::{Manifest, group_count, group_ids};
use crate::format::{CaptureMetadata, Metadata};
use crate::recover::Method;
use crate::transport::ColorMatrix;

/// Name and version of this package.
const WRITER: &str = concat!("relightable-photo ", env!("CARGO_PKG_VERSION"));
/// Unit of light transport.
const UNITS: &str =
    "camera value where camera.black is 0 and camera.white is 1, per light element at full code";

/// What a recovery needs to know of its capture beside the measurements: for the file's metadata and for messages.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// Title of the object.
    pub title: String,
    /// Author of the photographs.
    pub creator: String,
    /// Licence or other terms of use.
    pub rights: String,
    /// From linear RGB of the photographs to linear sRGB.
    pub color_matrix: Option<ColorMatrix>,
    /// Indices of the shots that the measurements are of.
    pub shots: Vec<usize>,
    /// The names of their photographs; empty for pictures without names.
    pub photographs: Vec<String>,
    /// Number of different patterns among them.
    pub patterns: usize,
}

impl Provenance {
    /// Of the `shots` of a capture folder.
    pub fn new(manifest: &Manifest, shots: &[usize]) -> Self {
        let listed = || shots.iter().map(|&i| &manifest.shots[i]);
        Self {
            title: manifest.title.clone(),
            creator: manifest.creator.clone(),
            rights: manifest.rights.clone(),
            color_matrix: manifest.camera.color_matrix,
            shots: shots.to_vec(),
            photographs: listed().map(|shot| shot.photo.clone()).collect(),
            patterns: group_count(&group_ids(listed().map(|shot| &shot.pattern))),
        }
    }
}

/// The metadata of a file that is recovered by `method`.
pub fn metadata(provenance: &Provenance, method: Method) -> Metadata {
    Metadata {
        title: provenance.title.clone(),
        creator: provenance.creator.clone(),
        rights: provenance.rights.clone(),
        capture: CaptureMetadata {
            patterns: provenance.patterns,
            photographs: provenance.shots.len(),
        },
        writer: WRITER.to_owned(),
        method: method.name().to_owned(),
        units: UNITS.to_owned(),
        color_matrix: provenance.color_matrix,
        shots_used: provenance.shots.clone(),
        #[cfg(not(target_arch = "wasm32"))]
        origin: None,
    }
}
