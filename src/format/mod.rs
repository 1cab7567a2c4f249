//! The `.ltm` file, version 1.1, as `docs/format.md` specifies it.
//!
//! ```text
//! index         header       144 bytes, little endian: grids, window, correspondence, lengths, checksums
//!               directory    zstd frame: a record for each scan, length and checksum of each chunk
//!               extensions   the displacement of a correspondence that bends; data of later versions
//!               metadata     JSON
//! scans         each a basis chunk, then a tile chunk for each tile
//! ```
//!
//! A scan is a pass over all tiles: the first gives a coarse picture under any light, each later one
//! a better picture. Every prefix of a file relights.
//!
//! [`LtmReader`] does no I/O: it is fed bytes in any pieces and lists the byte ranges that it needs.
//! [`EncodedFile`] is the inverse.

mod checksum;
mod chunk;
mod chunk_store;
mod codec;
mod constants;
mod directory;
mod displacement;
mod encode;
mod error;
mod extension;
mod fields;
mod header;
mod index;
#[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
mod levels;
mod memory_budget;
mod memory_estimate;
mod metadata;
mod partial_file;
mod partial_functions;
mod reader;
mod scan;
#[cfg(not(target_arch = "wasm32"))]
mod spool;
mod tile_decoder;

pub use chunk::{ChunkEntry, ChunkId};
pub use chunk_store::ChunkStore;
#[cfg(not(target_arch = "wasm32"))]
pub use chunk_store::SpooledChunks;
pub use constants::{FIRST_BYTES, HEADER_BYTES, MAX_RANK};
#[cfg(not(target_arch = "wasm32"))]
pub use encode::{CodingPlan, EncodedTile, EncodedTileHead, TileEncoder, TileSample};
pub use encode::{DistortionMetric, EncodedFile, EncoderInput, EncodingTarget};
pub use error::{FormatError, SectionName, TextModeDamage};
pub use extension::FormatExtension;
pub use header::Header;
pub use index::FileIndex;
#[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
pub use levels::{LevelTable, ShardId, ShardPlace};
pub use memory_budget::Limits;
pub use metadata::{CaptureMetadata, Metadata, MetadataText};
pub use partial_file::ChunkSelection;
pub use reader::{LtmReader, ReadProgress};
pub use scan::{ProgressiveScan, ScanCoding};
#[cfg(not(target_arch = "wasm32"))]
pub use spool::Spool;
pub use tile_decoder::{check, decode_basis, decode_tile};
