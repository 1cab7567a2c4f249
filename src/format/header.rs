//! The fixed header: 144 bytes, little endian.

use super::checksum::{checksum, crc_matches};
use super::constants::{
    HEADER_BYTES, MAX_EXTENSION_BYTES, MAX_METADATA_BYTES, MAX_RANK, MAX_SCANS,
};
use super::error::{FileSection, FormatError, TextDamage};
use super::fields::FieldReader;
use crate::transport::{Correspondence, Extent, Geometry, Window};

/// Version of written files. A reader accepts other minor versions and refuses other major ones.
const MAJOR: u16 = 1;
const MINOR: u16 = 0;
/// The magic number. A high bit, CR LF, ^Z and LF show damage by text mode, as in PNG and KTX2. The
/// digits are those of version 1.0 and stand for major version 1.
const MAGIC: [u8; 12] = *b"\xABLTM 10\xBB\r\n\x1A\n";
/// Bytes of the magic number that identify a damaged `.ltm` file.
const MAGIC_NAME_BYTES: usize = 4;
/// The version's digits in the magic number.
const MAGIC_VERSION: std::ops::Range<usize> = 5..7;

/// The fixed header, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Grids, window, correspondence and tiling.
    pub geometry: Geometry,
    /// Bytes of the whole file.
    pub file_bytes: u64,
    /// Number of basis functions; 0 for none.
    pub rank: u16,
    /// Number of scans.
    pub scans: u32,
    /// Bytes of the compressed directory, which follows the header.
    pub directory_bytes: u32,
    pub(super) directory_crc: u32,
    /// Bytes of the extensions, which follow the directory.
    pub extension_bytes: u32,
    pub(super) extension_crc: u32,
    /// Bytes of the metadata, which follows the extensions.
    pub metadata_bytes: u32,
    pub(super) metadata_crc: u32,
}

impl Header {
    /// A header for `geometry`; the encoder of the index sets lengths and checksums.
    pub(super) fn new(geometry: Geometry, rank: u16) -> Self {
        Self {
            geometry,
            file_bytes: 0,
            rank,
            scans: 0,
            directory_bytes: 0,
            directory_crc: 0,
            extension_bytes: 0,
            extension_crc: 0,
            metadata_bytes: 0,
            metadata_crc: 0,
        }
    }

    /// Bytes before the first scan.
    pub fn index_bytes(&self) -> u64 {
        HEADER_BYTES as u64
            + u64::from(self.directory_bytes)
            + u64::from(self.extension_bytes)
            + u64::from(self.metadata_bytes)
    }

    /// The header's bytes, with their checksum.
    pub(super) fn encode(&self) -> [u8; HEADER_BYTES] {
        let g = &self.geometry;
        let mut out = Vec::with_capacity(HEADER_BYTES);
        out.extend(MAGIC);
        out.extend(MAJOR.to_le_bytes());
        out.extend(MINOR.to_le_bytes());
        for side in [
            g.camera.width,
            g.camera.height,
            g.light.width,
            g.light.height,
            g.window.side(),
            g.tile_side,
        ] {
            out.extend(side.to_le_bytes());
        }
        for a in g.correspondence.affine.iter().flatten() {
            out.extend(a.to_le_bytes());
        }
        out.extend(self.file_bytes.to_le_bytes());
        for field in [
            u32::from(self.rank),
            self.scans,
            self.directory_bytes,
            self.directory_crc,
            self.extension_bytes,
            self.extension_crc,
            self.metadata_bytes,
            self.metadata_crc,
        ] {
            out.extend(field.to_le_bytes());
        }
        out.extend([0; 12]); // reserved
        out.extend(checksum(&out).to_le_bytes());
        let mut header = [0; HEADER_BYTES];
        header.copy_from_slice(&out);
        header
    }

    /// Reads the bytes of a header.
    ///
    /// # Errors
    /// The [`FormatError`] of the first field that is out of its range.
    pub(super) fn decode(bytes: &[u8; HEADER_BYTES]) -> Result<Self, FormatError> {
        check_magic(bytes)?;
        let mut fields = FieldReader(&bytes[MAGIC.len()..]);
        let (major, minor) = (fields.u16(), fields.u16());
        if major != MAJOR {
            return Err(FormatError::UnsupportedVersion { major, minor });
        }
        let (fixed, crc) = bytes.split_at(HEADER_BYTES - 4);
        if !crc_matches(fixed, FieldReader(crc).u32()) {
            return Err(FormatError::ChecksumMismatch {
                section: FileSection::Header,
            });
        }
        let camera = Extent::new(fields.u32(), fields.u32());
        let light = Extent::new(fields.u32(), fields.u32());
        let (window, tile_side) = (fields.u32(), fields.u32());
        let mut affine = [[0.0; 3]; 2];
        for a in affine.iter_mut().flatten() {
            *a = fields.f64();
        }
        let file_bytes = fields.u64();
        let rank = fields.u32();
        let rank = u16::try_from(rank)
            .ok()
            .filter(|rank| *rank <= MAX_RANK)
            .ok_or(FormatError::RankTooLarge(rank.into()))?;
        let header = Self {
            geometry: Geometry {
                camera,
                light,
                window: Window::new(window)?,
                correspondence: Correspondence { affine },
                tile_side,
            }
            .validate()?,
            file_bytes,
            rank,
            scans: fields.u32(),
            directory_bytes: fields.u32(),
            directory_crc: fields.u32(),
            extension_bytes: fields.u32(),
            extension_crc: fields.u32(),
            metadata_bytes: fields.u32(),
            metadata_crc: fields.u32(),
        };
        if header.scans > MAX_SCANS {
            return Err(FormatError::TooManyScans(header.scans));
        }
        if header.extension_bytes > MAX_EXTENSION_BYTES {
            return Err(FormatError::ExtensionsTooLong(header.extension_bytes));
        }
        if header.metadata_bytes > MAX_METADATA_BYTES {
            return Err(FormatError::MetadataTooLong(header.metadata_bytes.into()));
        }
        if file_bytes < header.index_bytes() {
            return Err(FormatError::Truncated {
                got: file_bytes,
                need: header.index_bytes(),
            });
        }
        Ok(header)
    }
}

/// Checks the first bytes of a file, however few have come. Four bytes identify a file of another kind and a
/// transfer in text mode.
///
/// # Errors
/// [`FormatError::UnknownMagic`], [`FormatError::UnsupportedVersion`] or
/// [`FormatError::TextModeTransfer`].
pub(super) fn check_magic(bytes: &[u8]) -> Result<(), FormatError> {
    let name = MAGIC_VERSION.start;
    if let Some(digits @ &[b'0'..=b'9', b'0'..=b'9']) = bytes.get(MAGIC_VERSION)
        && bytes[..name] == MAGIC[..name]
        && digits != &MAGIC[MAGIC_VERSION]
    {
        let [major, minor] = [digits[0], digits[1]].map(|digit| u16::from(digit - b'0'));
        return Err(FormatError::UnsupportedVersion { major, minor });
    }
    if bytes.len() < MAGIC_NAME_BYTES {
        return Ok(());
    }
    let looks_like = |damaged: &[u8]| bytes[..MAGIC_NAME_BYTES] == damaged[..MAGIC_NAME_BYTES];
    if looks_like(&MAGIC.map(|byte| byte & 0x7F)) {
        return Err(FormatError::TextModeTransfer(TextDamage::HighBit));
    }
    if looks_like(b"\xC2\xABLT") || looks_like(b"\xEF\xBF\xBDL") {
        return Err(FormatError::TextModeTransfer(TextDamage::Utf8));
    }
    match bytes.iter().zip(&MAGIC).position(|(a, b)| a != b) {
        None => Ok(()),
        // After the name only the line ends can differ.
        Some(8..) => Err(FormatError::TextModeTransfer(TextDamage::LineEnds)),
        Some(_) => Err(FormatError::UnknownMagic {
            found: bytes[..bytes.len().min(MAGIC.len())].to_vec(),
        }),
    }
}
