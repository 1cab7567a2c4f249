//! The `.ltm` file, version 1.0: `docs/format.md` is its specification.
//!
//! A head, then scans: passes over all tiles, of which the first gives a coarse picture under any
//! light and each later one a better one. Every prefix of a file relights.
//!
//! ```text
//! header        144 bytes, little endian: grids, window, correspondence, lengths and checksums
//! directory     zstd frame: what each scan holds; length and checksum of each of its chunks
//! extensions    what later versions add
//! metadata      JSON
//! scans         each: the functions of the basis that it brings, then a chunk for each tile
//! ```
//!
//! [`Reader`] does no I/O: it is fed bytes, in any pieces, and says what it wants. [`EncodedFile`] is
//! the way back.

mod chunk;
mod codec;
mod encode;
mod error;
mod extension;
mod fields;
mod head;
mod header;
mod limits;
mod metadata;
mod quality;
mod reader;
mod scan;
mod tile;
mod turn;
mod verify;

use chunk::Chunk;

pub use chunk::ChunkEntry;
pub use encode::{EncodedFile, Judge, Quality, Source};
pub use error::{FormatError, Part, TextDamage};
pub use extension::Extension;
pub use head::{Head, PartNumber};
pub use header::{FIRST_BYTES, HEADER_BYTES, Header};
pub use limits::Limits;
pub use metadata::{CaptureNote, Metadata, MetadataJson};
pub use reader::{Interest, Progress, Reader};
pub use scan::{Coding, Scan};
pub use tile::{decode_basis, decode_tile};
pub use verify::check;
