//! The fixed header: 144 bytes, little endian.

use super::checksum::{check_crc, checksum};
use super::constants::{
    HEADER_BYTES, MAX_EXTENSION_BYTES, MAX_FILE_AREA, MAX_METADATA_BYTES, MAX_RANK, MAX_SCANS,
};
use super::error::{FormatError, SectionName, TextModeDamage};
use super::fields::FieldReader;
use super::memory_estimate;
use crate::transport::{Correspondence, Geometry, GeometryError};

/// Version of written files. A reader accepts other minor versions and refuses other major ones.
const MAJOR: u16 = 1;
/// Minor version of a file, and of one with extensions, which version 1.0 may not know.
const MINOR: u16 = 0;
const MINOR_WITH_EXTENSIONS: u16 = 1;
/// The magic number. A high bit, CR LF, ^Z and LF show damage by text mode, as in PNG and KTX2. The
/// digits are those of version 1.0 and stand for major version 1.
const MAGIC: [u8; 12] = *b"\xABLTM 10\xBB\r\n\x1A\n";
/// Bytes of the magic number that identify a damaged `.ltm` file.
const MAGIC_NAME_BYTES: usize = 4;
/// The version's digits in the magic number.
const MAGIC_VERSION: std::ops::Range<usize> = 5..7;

/// The fixed header, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Grids, window, correspondence and tiling. The displacement of the correspondence is that of the extension `DISP`.
    pub geometry: Geometry,
    /// Bytes of the whole file.
    pub file_bytes: u64,
    /// Number of basis functions; 0 for none.
    pub rank: u16,
    /// Number of scans.
    pub scans: u32,
    /// The sections that follow the header, in this order.
    pub(super) directory: SectionEntry,
    pub(super) extensions: SectionEntry,
    pub(super) metadata: SectionEntry,
}

/// The header's entry for a section of the index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SectionEntry {
    /// Bytes in the file.
    pub bytes: u32,
    pub crc: u32,
}

impl SectionEntry {
    pub fn new(section: &[u8]) -> Self {
        Self {
            bytes: u32::try_from(section.len()).unwrap_or(u32::MAX), // more than a header may have
            crc: checksum(section),
        }
    }
}

impl Header {
    /// Bytes before the first scan.
    pub fn index_bytes(&self) -> u64 {
        let sections = [self.directory, self.extensions, self.metadata];
        let bytes = sections.map(|section| u64::from(section.bytes));
        HEADER_BYTES as u64 + bytes.iter().sum::<u64>()
    }

    /// The header's bytes, with their checksum.
    pub(super) fn encode(&self) -> [u8; HEADER_BYTES] {
        let mut out = Vec::with_capacity(HEADER_BYTES);
        out.extend(MAGIC);
        let minor = match self.extensions.bytes {
            0 => MINOR,
            _ => MINOR_WITH_EXTENSIONS,
        };
        out.extend([MAJOR, minor].map(u16::to_le_bytes).as_flattened());
        for side in self.geometry.sides().as_flattened() {
            out.extend(side.to_le_bytes());
        }
        for a in self.geometry.correspondence.affine.as_flattened() {
            out.extend(a.to_le_bytes());
        }
        out.extend(self.file_bytes.to_le_bytes());
        out.extend(
            [self.rank.into(), self.scans]
                .map(u32::to_le_bytes)
                .as_flattened(),
        );
        for SectionEntry { bytes, crc } in [self.directory, self.extensions, self.metadata] {
            out.extend([bytes, crc].map(u32::to_le_bytes).as_flattened());
        }
        out.extend([0; 12]); // reserved
        out.extend(checksum(&out).to_le_bytes());
        std::array::from_fn(|i| out[i])
    }

    pub(super) fn decode(bytes: &[u8; HEADER_BYTES]) -> Result<Self, FormatError> {
        check_magic(bytes)?;
        let mut fields = FieldReader(&bytes[MAGIC.len()..]);
        let [major, minor] = fields.u16s();
        if major != MAJOR {
            return Err(FormatError::UnsupportedVersion { major, minor });
        }
        let (fixed, crc) = bytes.split_at(HEADER_BYTES - 4);
        let [crc] = FieldReader(crc).u32s();
        check_crc(fixed, crc, SectionName::Header)?;
        let sides = std::array::from_fn(|_| fields.u32s());
        let affine = std::array::from_fn(|_| std::array::from_fn(|_| fields.f64()));
        let file_bytes = fields.u64();
        let [rank, scans] = fields.u32s();
        let mut section = || {
            let [bytes, crc] = fields.u32s();
            SectionEntry { bytes, crc }
        };
        let header = Self {
            geometry: Geometry::from_sides(sides, Correspondence::from_affine(affine))
                .map_err(FormatError::InvalidGeometry)?,
            file_bytes,
            rank: rank as u16, // checked below
            scans,
            directory: section(),
            extensions: section(),
            metadata: section(),
        };
        header.geometry.check_area().map_err(invalid_geometry)?;
        // At most 2^30: a tile has 8 x 8 pixels or lies at a border. In WebAssembly the area bounds them nearly as well.
        #[cfg(not(target_arch = "wasm32"))]
        let tiles = header.geometry.tile_grid().area() as u32;
        let (extensions, metadata) = (header.extensions.bytes, header.metadata.bytes);
        for (quantity, value, limit) in [
            ("basis functions", rank, MAX_RANK.into()),
            #[cfg(not(target_arch = "wasm32"))]
            ("tiles", tiles, super::constants::MAX_TILES),
            ("scans", scans, MAX_SCANS),
            ("bytes of extensions", extensions, MAX_EXTENSION_BYTES),
            ("bytes of metadata", metadata, MAX_METADATA_BYTES),
        ] {
            if value > limit {
                return Err(FormatError::TooMany {
                    quantity,
                    value,
                    limit,
                });
            }
        }
        let index_bytes = header.index_bytes();
        match file_bytes < index_bytes {
            true => Err(FormatError::IndexBeyondEnd {
                file_bytes,
                index_bytes,
            }),
            false => Ok(header),
        }
    }
}

/// A valid picture may be larger than a program with 32-bit addresses can hold.
fn invalid_geometry(error: GeometryError) -> FormatError {
    match error {
        GeometryError::Area(cells) if cells <= MAX_FILE_AREA => FormatError::Limit {
            need: memory_estimate::RELIT_CELL_BYTES * cells,
            limit: usize::MAX as u64,
        },
        error => FormatError::InvalidGeometry(error),
    }
}

/// Checks the first bytes of a file, however few have come. Four bytes identify a file of another kind and a
/// transfer in text mode.
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
        return Err(FormatError::TextModeTransfer(TextModeDamage::HighBit));
    }
    if looks_like(b"\xC2\xABLT") || looks_like(b"\xEF\xBF\xBDL") {
        return Err(FormatError::TextModeTransfer(TextModeDamage::Utf8));
    }
    match bytes.iter().zip(&MAGIC).position(|(a, b)| a != b) {
        None => Ok(()),
        // After the name only the line ends can differ.
        Some(8..) => Err(FormatError::TextModeTransfer(TextModeDamage::LineEnds)),
        Some(_) => Err(FormatError::UnknownMagic(
            bytes[..bytes.len().min(MAGIC.len())].to_vec(),
        )),
    }
}
