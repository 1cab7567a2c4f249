//! The `.ltm` file, version 0.1: a header, a tile directory, metadata, a basis if any tile needs one,
//! then the tiles.
//!
//! ```text
//! offset  bytes  field (little endian)
//!      0     12  magic  AB 4C 54 4D 20 30 31 BB 0D 0A 1A 0A  ("«LTM 01»\r\n^Z\n")
//!     12      4  version: major u16, minor u16
//!     16     16  camera width, height, light width, height   u32 each
//!     32      8  window side, tile side                      u32 each
//!     40     48  correspondence, 2 x 3 f64, row by row
//!     88      8  file length u64
//!     96      4  metadata length u32 (JSON, UTF-8, after the directory)
//!    100      4  metadata crc32c
//!    104      4  rank u32: functions in the basis, 0 if there is none
//!    108      4  basis length u32 (after the metadata)
//!    112      4  basis crc32c
//!    116      4  directory crc32c
//!    120      4  header crc32c, over bytes 0..120
//!    124   32·t  directory: offset u64, length u32, crc32c u32, step R, G, B f32, kind u16,
//!                components u16
//!      …         metadata, then the basis, then the tiles
//! ```
//!
//! All checksums are over the bytes as they stand in the file. Basis and tiles are zstd frames of
//! planes of bytes: the least significant byte of every number, then the next.
//!
//! - basis: f32 in the order `[function, element]`
//! - kind 0, a tile that is all dark: no bytes at all
//! - kind 1, direct: u16 codes in the order `[channel, element, pixel]`, one small, smooth picture
//!   an element, which zstd takes well; a light transport function is code · step
//! - kind 2, factored: zigzag coded i16 in the order `[component, channel, pixel]`; a coefficient is
//!   code · step, and functions past the first `components` of the basis are not used
//!
//! [`Reader`] does no I/O: it is fed bytes, in any pieces, and says what it still wants.

mod codec;
mod error;
mod header;
mod limits;
mod metadata;
mod reader;
mod writer;

pub use error::{FormatError, Part};
pub use header::{HEADER_BYTES, Header, TileEntry, TileKind};
pub use limits::Limits;
pub use metadata::Metadata;
pub use reader::{Progress, Reader};
pub use writer::{EncodedTile, write, write_from};
