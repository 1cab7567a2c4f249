//! Metadata of a recovered file.

use crate::capture::{Manifest, group_count, group_ids};
use crate::format::{CaptureMetadata, Metadata};
use crate::recover::Method;

/// Name and version of this package.
const WRITER: &str = concat!("relightable-photo ", env!("CARGO_PKG_VERSION"));
/// Unit of light transport.
const UNITS: &str =
    "camera value where camera.black is 0 and camera.white is 1, per light element at full code";

/// The metadata of a file that is recovered by `method` from `shots` of the capture.
pub fn metadata(manifest: &Manifest, shots: &[usize], method: Method) -> Metadata {
    let patterns = shots.iter().map(|&i| &manifest.shots[i].pattern);
    Metadata {
        title: manifest.title.clone(),
        creator: manifest.creator.clone(),
        rights: manifest.rights.clone(),
        capture: CaptureMetadata {
            patterns: group_count(&group_ids(patterns)),
            photographs: shots.len(),
        },
        writer: WRITER.to_owned(),
        method: method.name().to_owned(),
        units: UNITS.to_owned(),
        shots_used: shots.to_vec(),
    }
}
