//! The `.ltm` file, version 0: a header, a tile directory, then the tiles.
//!
//! ```text
//! offset  bytes  field (little endian)
//!      0     12  magic  AB 4C 54 4D 20 30 30 BB 0D 0A 1A 0A  ("«LTM 00»\r\n^Z\n")
//!     12      4  version: major u16, minor u16
//!     16     16  camera width, height, light width, height   u32 each
//!     32      8  window side, tile side                      u32 each
//!     40     48  correspondence, 2 x 3 f64, row by row
//!     88      8  file length u64
//!     96      4  metadata length u32 (JSON, UTF-8, after the directory)
//!    100      4  metadata crc32c
//!    104      4  directory crc32c
//!    108      4  header crc32c, over bytes 0..108
//!    112   32·t  directory: offset u64, length u32, crc32c u32, step R, G, B f32, reserved u32
//!      …         metadata, then the tiles
//! ```
//!
//! A tile is the zstd frame of its codes' low bytes and then their high bytes, each in the order
//! `[channel, element, pixel]`: one small, smooth picture an element, which zstd takes well. A tile
//! of length 0 is all dark.
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
pub use header::{HEADER_BYTES, Header, TileEntry};
pub use limits::Limits;
pub use metadata::Metadata;
pub use reader::{Progress, Reader};
pub use writer::{EncodedTile, write, write_from};
