//! What a file says about where it came from.

use serde::{Deserialize, Serialize};

/// Longest metadata a reader accepts: room for any caption, none for an attack.
pub(super) const MAX_METADATA_BYTES: u32 = 1 << 20;

/// JSON metadata. Unknown fields are ignored, so that later writers may add some.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Program and version that wrote the file.
    #[serde(default)]
    pub writer: String,
    /// Recovery method.
    #[serde(default)]
    pub method: String,
    /// Indices of the capture's shots that the transport was recovered from. The others can be held
    /// against it.
    #[serde(default)]
    pub shots_used: Vec<usize>,
}
