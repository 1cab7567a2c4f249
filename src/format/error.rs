//! Errors of reading and writing `.ltm` files.

use thiserror::Error;

use super::chunk::ChunkId;
use crate::transport::GeometryError;

/// Why bytes are not a readable `.ltm` file, or a file cannot be written.
#[derive(Debug, Error)]
pub enum FormatError {
    /// The file does not begin with the magic number.
    #[error(
        "this is not an .ltm file: it {}; check that it is the right file",
        describe_beginning(.0)
    )]
    UnknownMagic(Vec<u8>),
    /// A transfer in text mode damaged the magic number.
    #[error("{0} in this .ltm file, as a transfer in text mode does; transfer it again as binary")]
    TextModeTransfer(TextModeDamage),
    /// This reader does not know the version.
    #[error(
        "the file has format version {major}.{minor}, which this reader does not know: get the reader for it, or export the file again; if it is damaged, copy it again"
    )]
    UnsupportedVersion {
        /// Major version found.
        major: u16,
        /// Minor version found.
        minor: u16,
    },
    /// Bytes do not match their checksum.
    #[error("the {0} is damaged: its checksum does not match; copy or export the file again")]
    ChecksumMismatch(SectionName),
    /// The header has an invalid geometry.
    #[error("the header is invalid: {0}")]
    InvalidGeometry(GeometryError),
    /// The directory has an invalid record of this scan.
    #[error(
        "the directory is invalid: scan {0} has an unknown coding, or components, a step or a length outside its range; export the file again"
    )]
    InvalidScan(usize),
    /// The scans do not agree with each other or with the header.
    #[error(
        "the directory is invalid: its scans mix codings that exclude each other, or do not bring all {0} basis functions; export the file again"
    )]
    InconsistentScans(u16),
    /// The header declares a file that is shorter than its own index.
    #[error(
        "the header is invalid: a file of {file_bytes} bytes cannot hold an index of {index_bytes}; export the file again"
    )]
    IndexBeyondEnd {
        /// Length of the file in the header.
        file_bytes: u64,
        /// Length of the index by the header.
        index_bytes: u64,
    },
    /// The header declares more of something than this version allows.
    #[error("the file has {value} {quantity}, more than the {limit} allowed")]
    TooMany {
        /// The unit.
        quantity: &'static str,
        /// The number in the header.
        value: u32,
        /// The largest number allowed.
        limit: u32,
    },
    /// The directory has an invalid chunk entry.
    #[error(
        "the directory is invalid: the {0} has a length outside its range; export the file again"
    )]
    InvalidChunkEntry(ChunkId),
    /// The lengths of the chunks do not add up to the length of the file.
    #[error(
        "the directory is invalid: its chunks end at byte {end}, and the file at byte {file_bytes}; export the file again"
    )]
    LengthMismatch {
        /// End of the last chunk.
        end: u64,
        /// Length in the header.
        file_bytes: u64,
    },
    /// The reader does not know an extension that it must understand.
    #[error(
        "the file needs a reader that knows its extension \"{}\": get a newer one", .0.escape_ascii()
    )]
    UnknownExtension([u8; 4]),
    /// The metadata is not JSON of the expected form, in UTF-8.
    #[error("the metadata is invalid: {0}")]
    InvalidMetadata(String),
    /// A section does not decode.
    #[error("the {section} does not decompress: {reason}; copy or export the file again")]
    DamagedSection {
        /// Where.
        section: SectionName,
        /// zstd's message, or the rule that is broken.
        reason: String,
    },
    /// Decoding would exceed the memory budget.
    #[error(
        "the file decodes to {need} bytes, more than the {limit} this program allows; use a smaller picture or window"
    )]
    Limit {
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// A chunk that is checked by itself is longer than its entry says.
    #[error("the {chunk} has {got} bytes, not {expected}; copy or export the file again")]
    ChunkLength {
        /// The chunk.
        chunk: ChunkId,
        /// Its length.
        got: u64,
        /// Its length by the directory.
        expected: u64,
    },
    /// The system refuses so many bytes of memory.
    #[error(
        "there is no memory for {0} more bytes of light transport; close other programs or tabs, or use a smaller file"
    )]
    Memory(u64),
    /// The file ends early.
    #[error(
        "the file is cut short: it ends after {got} of {need} bytes; copy or download it again"
    )]
    Truncated {
        /// Bytes received.
        got: u64,
        /// Bytes of the file, as far as known.
        need: u64,
    },
    /// The reader was fed bytes that do not follow those it has.
    #[error("the reader got bytes from offset {got} and expected offset {expected}")]
    Gap {
        /// Offset of the bytes.
        got: u64,
        /// Offset of the next byte that the reader can take.
        expected: u64,
    },
    /// Bytes follow the end that the header declares.
    #[error("the file goes on after its end at byte {0}; copy or export it again")]
    TrailingBytes(u64),
    /// Writing: zstd fails.
    #[error("light transport does not compress: {0}")]
    Compress(&'static str),
    /// Writing: the output fails.
    #[error("the file cannot be written: {0}")]
    Write(std::io::Error),
    /// Writing: the source of a tile fails.
    #[error("a tile cannot be read back: {0}")]
    Source(std::io::Error),
    /// Writing: a temporary file fails.
    #[cfg(not(target_arch = "wasm32"))]
    #[error("a temporary file beside it cannot be written or read: {0}")]
    Spool(std::io::Error),
    /// Writing: the coarsest file is larger than asked for.
    #[error("the file takes at least {smallest} bytes, more than the {limit} asked for")]
    TooLarge {
        /// Bytes allowed.
        limit: u64,
        /// Bytes of the smallest file.
        smallest: u64,
    },
}

/// How a transfer in text mode changed a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TextModeDamage {
    /// CR LF became LF, or LF CR LF.
    #[error("line ends were converted")]
    LineEnds,
    /// The highest bit of each byte is 0.
    #[error("the highest bit of bytes was cleared")]
    HighBit,
    /// The bytes were read as Latin-1 or as invalid UTF-8, and written as UTF-8.
    #[error("bytes above 127 were replaced by characters in UTF-8")]
    Utf8,
}

/// What a file that is not an `.ltm` file is, by its first bytes.
fn describe_beginning(found: &[u8]) -> String {
    let known: [(&[u8], &str); 7] = [
        (b"\x89PNG", "is a PNG picture"),
        (b"\xFF\xD8\xFF", "is a JPEG picture"),
        (b"II*\0", "is a TIFF picture"),
        (b"MM\0*", "is a TIFF picture"),
        (b"PK\x03\x04", "is a ZIP archive"),
        (b"\x1F\x8B", "was compressed by gzip"),
        (b"<", "begins like a web page"),
    ];
    match known.iter().find(|(start, _)| found.starts_with(start)) {
        Some((_, kind)) => (*kind).to_owned(),
        None => format!("begins with {found:02x?}"),
    }
}

/// A section of the file, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SectionName {
    /// The fixed header.
    #[error("header")]
    Header,
    /// The directory.
    #[error("directory")]
    Directory,
    /// The extensions.
    #[error("list of extensions")]
    Extensions,
    /// The JSON metadata.
    #[error("metadata")]
    Metadata,
    /// A basis chunk or a tile chunk.
    #[error("{0}")]
    Chunk(ChunkId),
}

/// Why the bytes of a section cannot be decoded, before the section is named.
#[derive(Debug)]
pub(super) enum SectionError {
    /// The bytes are damaged: zstd's message, or the rule that is broken.
    Damaged(String),
    /// The memory budget, or the system, refuses memory.
    NoMemory(FormatError),
}

impl SectionError {
    /// The error with the section's name.
    pub fn in_section(self, section: SectionName) -> FormatError {
        match self {
            Self::Damaged(reason) => FormatError::DamagedSection { section, reason },
            Self::NoMemory(error) => error,
        }
    }

    /// The error with the chunk's name.
    pub fn in_chunk(self, chunk: ChunkId) -> FormatError {
        self.in_section(SectionName::Chunk(chunk))
    }
}

impl From<FormatError> for SectionError {
    fn from(error: FormatError) -> Self {
        Self::NoMemory(error)
    }
}

/// A section that breaks a rule.
pub(super) fn damaged(rule: impl Into<String>) -> SectionError {
    SectionError::Damaged(rule.into())
}
