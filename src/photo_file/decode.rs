//! Decodes a photograph by the format that its first bytes say.

use std::fmt;
use std::io::{BufRead, Read, Seek, SeekFrom};

use super::error::PhotoFileError;
use super::samples::PhotoSamples;
use super::{openexr, png, tiff};
use crate::tiff_signature::is_tiff;

/// Bytes that tell the format.
const SIGNATURE_BYTES: u64 = 8;

/// A format of photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotoFormat {
    /// Portable Network Graphics.
    Png,
    /// Tag Image File Format, BigTIFF included.
    Tiff,
    /// OpenEXR.
    OpenExr,
}

impl PhotoFormat {
    /// The format of a file that begins so.
    pub fn of(signature: &[u8]) -> Option<Self> {
        let begins = |bytes: &[u8]| signature.starts_with(bytes);
        if begins(b"\x89PNG\r\n\x1a\n") {
            Some(Self::Png)
        } else if is_tiff(signature) {
            Some(Self::Tiff)
        } else {
            begins(b"\x76\x2f\x31\x01").then_some(Self::OpenExr)
        }
    }
}

impl fmt::Display for PhotoFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Tiff => "TIFF",
            Self::OpenExr => "OpenEXR",
        })
    }
}

/// Decodes a PNG, TIFF or OpenEXR picture, whose samples take `max_bytes` of memory at most. Decoders may need as much again
/// while they work.
///
/// # Errors
/// If `source` cannot be read, is damaged or too large, or has samples or channels that photographs do not have.
pub fn decode_photo(
    mut source: impl BufRead + Seek,
    max_bytes: u64,
) -> Result<PhotoSamples, PhotoFileError> {
    let mut signature = Vec::new();
    source
        .by_ref()
        .take(SIGNATURE_BYTES)
        .read_to_end(&mut signature)?;
    source.seek(SeekFrom::Start(0))?;
    match PhotoFormat::of(&signature) {
        Some(PhotoFormat::Png) => png::decode(source, max_bytes),
        Some(PhotoFormat::Tiff) => tiff::decode(source, max_bytes),
        Some(PhotoFormat::OpenExr) => openexr::decode(source, max_bytes),
        None => Err(PhotoFileError::UnknownFormat),
    }
}
