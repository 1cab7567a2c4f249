//! Errors of photograph files. The caller adds the file.

use std::io;

use thiserror::Error;

use super::decode::PhotoFormat;

/// Why the bytes of a photograph cannot be read.
#[derive(Debug, Error)]
pub enum PhotoFileError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    /// The bytes begin like none of the formats.
    #[error("cannot be decoded: it is no PNG, TIFF or OpenEXR picture")]
    UnknownFormat,
    /// The file is damaged, or uses a part of its format that is not supported.
    #[error("cannot be decoded as {format}: {reason}")]
    Undecodable {
        /// The format by its first bytes.
        format: PhotoFormat,
        /// The decoder's reason.
        reason: String,
    },
    /// The picture takes more memory than allowed.
    #[error("takes more than {} MiB of memory to decode; crop or shrink it in the raw converter", max_bytes >> 20)]
    TooLarge {
        /// The limit.
        max_bytes: u64,
    },
    /// The channels are neither grey nor RGB.
    #[error("has {0}; export grey or RGB, with or without alpha channel")]
    ColorType(String),
    /// The samples have a type that photographs do not have.
    #[error(
        "has samples of {0}; export 16 or 32 bits, integers without sign or floating-point numbers"
    )]
    SampleType(String),
    /// The pixels of an OpenEXR picture are not those that it shows.
    #[error("has a data window that differs from its display window; export the whole picture")]
    DataWindow,
}

impl PhotoFileError {
    /// The error of a decoder that reads: the file ends too early, or cannot be read.
    pub(super) fn of_reading(format: PhotoFormat, error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::incomplete(format),
            _ => Self::Io(error),
        }
    }

    /// Data are missing: at the end of the file, or where it says that they are.
    pub(super) fn incomplete(format: PhotoFormat) -> Self {
        let reason = "it is cut off or damaged; copy or export it again".to_owned();
        Self::Undecodable { format, reason }
    }
}
