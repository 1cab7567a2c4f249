//! What can be wrong with an `.ltm` file.

use thiserror::Error;

use super::header::{MAJOR, MAX_RANK, MINOR};
use super::metadata::MAX_METADATA_BYTES;
use crate::transport::GeometryError;

/// Why bytes are not a readable `.ltm` file.
#[derive(Debug, Error)]
pub enum FormatError {
    /// The magic is not there.
    #[error("this is not an .ltm file: it begins with {found:02x?}")]
    Magic {
        /// First bytes found.
        found: Vec<u8>,
    },
    /// The magic was damaged by a transfer in text mode.
    #[error(
        "line ends in this .ltm file were converted, as a text-mode transfer does; transfer it again as binary"
    )]
    TextMode,
    /// A version this reader does not know.
    #[error(
        "the file has format version {major}.{minor}; this reader knows {MAJOR}.{MINOR} alone: get the reader for it, or export the file again"
    )]
    Version {
        /// Major version found.
        major: u16,
        /// Minor version found.
        minor: u16,
    },
    /// Bytes do not match their checksum.
    #[error("the {part} is damaged: its checksum does not match; copy or export the file again")]
    Checksum {
        /// Which part.
        part: Part,
    },
    /// The geometry cannot be.
    #[error("the header is invalid: {0}")]
    Geometry(GeometryError),
    /// A directory entry does not fit the file.
    #[error("the directory is invalid: tile {tile} lies outside the file or over other data")]
    Entry {
        /// Tile number.
        tile: usize,
    },
    /// A tile that this file cannot have.
    #[error(
        "the directory is invalid: tile {tile} is of unknown kind, or has a length, step or number of components that its kind cannot have"
    )]
    Kind {
        /// Tile number.
        tile: usize,
    },
    /// Too large a basis.
    #[error("the basis has {0} functions, more than the {MAX_RANK} allowed")]
    Rank(u64),
    /// A basis whose length cannot be.
    #[error("the header is invalid: {bytes} bytes cannot hold a basis of {rank} functions")]
    BasisLength {
        /// Functions it is to have.
        rank: u16,
        /// Compressed bytes.
        bytes: u32,
    },
    /// The metadata is too long.
    #[error("the file has {0} bytes of metadata, more than the {MAX_METADATA_BYTES} allowed")]
    MetadataLength(u64),
    /// The metadata is not JSON of the expected form.
    #[error("the metadata is invalid: {0}")]
    Metadata(serde_json::Error),
    /// A part does not decompress to what the header asks for.
    #[error("the {part} does not decompress: {reason}")]
    Decompress {
        /// Basis or which tile.
        part: Part,
        /// zstd's word for it, or what is wrong with what it gave.
        reason: String,
    },
    /// Decoding would take more memory than allowed.
    #[error(
        "the file decodes to {need} bytes, more than the {limit} this program allows; use a smaller picture or window"
    )]
    Limit {
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The system refuses memory.
    #[error(
        "there is no memory for {need} more bytes of light transport; close other programs or tabs, or use a smaller file"
    )]
    Memory {
        /// Bytes asked for.
        need: usize,
    },
    /// The file ended early.
    #[error(
        "the file is cut short: it ends after {got} of {need} bytes; copy or download it again"
    )]
    Truncated {
        /// Bytes received.
        got: u64,
        /// Bytes the file has, as far as is known.
        need: u64,
    },
    /// Bytes were fed that were not next.
    #[error("bytes from offset {got} were fed where {wanted} was wanted")]
    Offset {
        /// Where they came from.
        got: u64,
        /// What was next.
        wanted: u64,
    },
    /// Bytes follow the end that the header declares.
    #[error("the file goes on after its end at byte {end}; copy or export it again")]
    TrailingBytes {
        /// Length in the header.
        end: u64,
    },
    /// Writing: zstd failed.
    #[error("light transport does not compress: {0}")]
    Compress(std::io::Error),
    /// Writing: the output failed.
    #[error("the file cannot be written: {0}")]
    Write(std::io::Error),
    /// Writing: the tile is factored over another basis.
    #[error("tile {tile} has {components} components, but there is a basis of {rank} functions")]
    Components {
        /// Tile number.
        tile: usize,
        /// What it has.
        components: u16,
        /// What there is; 0 if there is no basis.
        rank: u16,
    },
    /// Writing: the transport has more data than the format can address.
    #[error("tile {tile} takes more than 4 GiB; use smaller tiles")]
    TooLarge {
        /// Tile number.
        tile: usize,
    },
}

// By hand, as its text holds all of the source's: a chain of causes would say it twice.
impl From<GeometryError> for FormatError {
    fn from(error: GeometryError) -> Self {
        Self::Geometry(error)
    }
}

/// A part of the file, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The fixed header.
    Header,
    /// The tile directory.
    Directory,
    /// The JSON metadata.
    Metadata,
    /// The basis of factored tiles.
    Basis,
    /// A tile, by number.
    Tile(usize),
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Header => f.write_str("header"),
            Self::Directory => f.write_str("directory"),
            Self::Metadata => f.write_str("metadata"),
            Self::Basis => f.write_str("basis"),
            Self::Tile(i) => write!(f, "picture data (tile {i})"),
        }
    }
}
