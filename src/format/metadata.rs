//! What a file says about where it came from.

use serde::{Deserialize, Serialize};

/// Longest metadata a reader accepts: room for any caption, none for an attack.
pub(super) const MAX_METADATA_BYTES: u32 = 1 << 20;

/// JSON metadata. Unknown fields are ignored, so that later writers may add some; fields that say
/// nothing are left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// What the picture shows.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Who made the photographs.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub creator: String,
    /// Who may do what with it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub rights: String,
    /// What the object's light transport was measured with.
    pub capture: CaptureNote,
    /// Program and version that wrote the file.
    pub writer: String,
    /// Recovery method.
    pub method: String,
    /// What a coefficient or element of 1 stands for.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub units: String,
    /// Indices of the capture's shots that the transport was recovered from. The others can be held
    /// against it.
    pub shots_used: Vec<usize>,
}

/// How an object was captured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CaptureNote {
    /// Different patterns that were shown.
    pub patterns: usize,
    /// Photographs that the transport was recovered from.
    pub photographs: usize,
}
