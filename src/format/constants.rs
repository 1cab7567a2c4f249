//! Bounds and record sizes of the format, version 1.1 (`docs/format.md`, appendix A).

/// Bytes of the fixed header.
pub const HEADER_BYTES: usize = 144;
/// Bytes that hold the index of most files, up to 512 x 512 pixels: the first request of a reader.
pub const FIRST_BYTES: u64 = 16 << 10;
/// Bytes of a scan's record in the directory.
pub(super) const SCAN_RECORD_BYTES: usize = 24;
/// Bytes of a tile chunk's entry in the directory.
pub(super) const CHUNK_ENTRY_BYTES: usize = 12;
/// Maximum number of basis functions: those that a window of 31 x 31 elements can distinguish.
pub const MAX_RANK: u16 = 1024;
/// Maximum number of camera pixels, and of light elements. A program with 32-bit addresses reads fewer
/// ([`MAX_AREA`](crate::transport::MAX_AREA)).
pub(super) const MAX_FILE_AREA: u64 = 1 << 36;
/// Maximum number of tiles.
#[cfg(not(target_arch = "wasm32"))]
pub(super) const MAX_TILES: u32 = 1 << 24;
/// Maximum number of scans.
pub(super) const MAX_SCANS: u32 = 1024;
/// Maximum bytes of all extensions.
pub(super) const MAX_EXTENSION_BYTES: u32 = 16 << 20;
/// Maximum bytes of the metadata.
pub(super) const MAX_METADATA_BYTES: u32 = 1 << 20;
/// Maximum content of a zstd frame outside the directory, tokens of a chunk, and zstd window.
pub(super) const MAX_CONTENT_BYTES: u64 = 8 << 20;
