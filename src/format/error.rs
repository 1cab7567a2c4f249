//! What can be wrong with an `.ltm` file.

use thiserror::Error;

use super::header::{MAX_EXTENSION_BYTES, MAX_RANK};
use super::metadata::MAX_METADATA_BYTES;
use super::scan::MOST_SCANS;
use crate::transport::GeometryError;

/// Why bytes are not a readable `.ltm` file.
#[derive(Debug, Error)]
pub enum FormatError {
    /// The magic is not there.
    #[error(
        "this is not an .ltm file: it {}; see whether it is the file that was meant",
        beginning(found)
    )]
    Magic {
        /// First bytes found.
        found: Vec<u8>,
    },
    /// The magic was damaged by a transfer in text mode.
    #[error("{0} in this .ltm file, as a transfer in text mode does; transfer it again as binary")]
    TextMode(TextDamage),
    /// A version this reader does not know.
    #[error(
        "the file has format version {major}.{minor}, which this reader does not know: get the reader for it, or export the file again; if it is damaged, copy it again"
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
    /// A scan that this file cannot have.
    #[error(
        "the directory is invalid: scan {scan} is of unknown coding, or has components, a step or a length that it cannot have"
    )]
    Scan {
        /// Scan number; the number of scans if they do not go together.
        scan: usize,
    },
    /// Too many scans.
    #[error("the file has {0} scans, more than the {MOST_SCANS} allowed")]
    Scans(u32),
    /// A chunk that this file cannot have.
    #[error(
        "the directory is invalid: scan {scan} of tile {tile} has a length that it cannot have"
    )]
    Entry {
        /// Scan number.
        scan: usize,
        /// Tile number.
        tile: usize,
    },
    /// The parts do not add up to the file.
    #[error(
        "the directory is invalid: its parts end at byte {end}, and the file at byte {file_bytes}"
    )]
    Length {
        /// End of the last part.
        end: u64,
        /// Length in the header.
        file_bytes: u64,
    },
    /// The extensions are too long.
    #[error("the file has {0} bytes of extensions, more than the {MAX_EXTENSION_BYTES} allowed")]
    ExtensionLength(u32),
    /// An extension that must be understood and is not.
    #[error(
        "the file needs a reader that knows its extension \"{}\": get a newer one", tag.escape_ascii()
    )]
    Extension {
        /// Its name.
        tag: [u8; 4],
    },
    /// Too large a basis.
    #[error("the basis has {0} functions, more than the {MAX_RANK} allowed")]
    Rank(u64),
    /// The metadata is too long.
    #[error("the file has {0} bytes of metadata, more than the {MAX_METADATA_BYTES} allowed")]
    MetadataLength(u64),
    /// The metadata is not JSON of the expected form.
    #[error("the metadata is invalid: {0}")]
    Metadata(String),
    /// The metadata is not text.
    #[error("the metadata is invalid: {0}")]
    MetadataText(std::str::Utf8Error),
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
    /// Writing: a tile cannot be had.
    #[error("a tile cannot be read back: {0}")]
    Source(std::io::Error),
    /// Writing: not even the coarsest file is small enough.
    #[error("the file takes at least {least} bytes, more than the {most} asked for")]
    TooLarge {
        /// Bytes allowed.
        most: u64,
        /// Bytes of the smallest file.
        least: u64,
    },
}

/// What a transfer in text mode did to a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TextDamage {
    /// CR LF became LF, or LF CR LF.
    #[error("line ends were converted")]
    LineEnds,
    /// Seven bits of each byte are left.
    #[error("the highest bit of bytes was cleared")]
    HighBit,
    /// Bytes were taken for Latin-1 characters, or for UTF-8 that they are not, and written as UTF-8.
    #[error("bytes above 127 were replaced by characters in UTF-8")]
    Utf8,
}

/// What bytes that are no `.ltm` file are, as far as their beginning tells.
fn beginning(found: &[u8]) -> String {
    let known: [(&[u8], &str); 7] = [
        (b"\x89PNG", "is a PNG picture"),
        (b"\xFF\xD8\xFF", "is a JPEG picture"),
        (b"II*\0", "is a TIFF picture"),
        (b"MM\0*", "is a TIFF picture"),
        (b"PK\x03\x04", "is a ZIP archive"),
        (b"\x1F\x8B", "was compressed by gzip"),
        (b"<", "begins like a web page"),
    ];
    let kind = known.iter().find(|(start, _)| found.starts_with(start));
    kind.map_or_else(
        || format!("begins with {found:02x?}"),
        |(_, kind)| (*kind).to_owned(),
    )
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
    /// The extensions.
    Extensions,
    /// The JSON metadata.
    Metadata,
    /// Functions of the basis.
    Basis {
        /// The scan that brings them.
        scan: usize,
    },
    /// A tile's share of a scan.
    Chunk {
        /// Scan number.
        scan: usize,
        /// Tile number.
        tile: usize,
    },
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Header => f.write_str("header"),
            Self::Directory => f.write_str("directory"),
            Self::Extensions => f.write_str("list of extensions"),
            Self::Metadata => f.write_str("metadata"),
            Self::Basis { scan } => write!(f, "basis (scan {scan})"),
            Self::Chunk { scan, tile } => write!(f, "picture data (scan {scan}, tile {tile})"),
        }
    }
}
