//! The fixed header.

use super::codec::{checksum, intact};
use super::error::{Part, TextDamage};
use super::fields::Fields;
use super::metadata::MAX_METADATA_BYTES;
use super::scan::MOST_SCANS;
use super::{ChunkEntry, FormatError, Scan};
use crate::transport::{Correspondence, Extent, Geometry, Window};

/// Version of the format that is written. Other minor versions are read, other major ones are not.
pub(super) const MAJOR: u16 = 1;
pub(super) const MINOR: u16 = 0;
/// Shows text-mode damage as PNG's and KTX2's do: a high bit, CR LF, ^Z, LF. The digits are those of
/// version 1.0 and stand for all of major version 1.
const MAGIC: [u8; 12] = *b"\xABLTM 10\xBB\r\n\x1A\n";
/// Bytes of it by which a file is known though it was damaged.
const NAME: usize = 4;
/// Where the version's digits stand in it.
const MAGIC_VERSION: std::ops::Range<usize> = 5..7;
/// Bytes of the fixed header.
pub const HEADER_BYTES: usize = 144;
/// Bytes that hold all a reader needs before the first chunk, for files up to the paper's scale: what
/// to ask for first.
pub const FIRST_BYTES: u64 = 16 << 10;
/// Largest basis: as many functions as any window of up to 31 elements can tell apart.
pub(super) const MAX_RANK: u16 = 1024;
/// Longest extensions a reader accepts.
pub(super) const MAX_EXTENSION_BYTES: u32 = 16 << 20;

/// The fixed header, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Grids, band and tiling.
    pub geometry: Geometry,
    /// Length of the whole file.
    pub file_bytes: u64,
    /// Functions in the basis; 0 for none.
    pub rank: u16,
    /// Number of scans.
    pub scans: u32,
    /// Compressed length of the directory, which follows the header.
    pub directory_bytes: u32,
    pub(super) directory_crc: u32,
    /// Length of the extensions, which follow the directory.
    pub extension_bytes: u32,
    pub(super) extension_crc: u32,
    /// Length of the metadata, which follow the extensions.
    pub metadata_bytes: u32,
    pub(super) metadata_crc: u32,
}

impl Header {
    /// Length of all that comes before the first scan.
    pub fn head_bytes(&self) -> u64 {
        HEADER_BYTES as u64
            + u64::from(self.directory_bytes)
            + u64::from(self.extension_bytes)
            + u64::from(self.metadata_bytes)
    }

    /// Length of the directory before compression.
    pub(super) fn directory_plain_bytes(&self) -> u64 {
        // At most 1024 · (24 + 12 · 2^24): no overflow.
        let tiles = self.geometry.tile_grid().area() as u64;
        u64::from(self.scans) * (Scan::BYTES as u64 + ChunkEntry::BYTES as u64 * tiles)
    }

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
            0, // reserved
            0,
            0,
        ] {
            out.extend(field.to_le_bytes());
        }
        out.extend(checksum(&out).to_le_bytes());
        let mut header = [0; HEADER_BYTES];
        header.copy_from_slice(&out);
        header
    }

    pub(super) fn decode(bytes: &[u8; HEADER_BYTES]) -> Result<Self, FormatError> {
        check_magic(bytes)?;
        let mut fields = Fields(&bytes[MAGIC.len()..]);
        let (major, minor) = (fields.u16(), fields.u16());
        if major != MAJOR {
            return Err(FormatError::Version { major, minor });
        }
        let (fixed, crc) = bytes.split_at(HEADER_BYTES - 4);
        if !intact(fixed, Fields(crc).u32()) {
            return Err(FormatError::Checksum { part: Part::Header });
        }
        let camera = Extent {
            width: fields.u32(),
            height: fields.u32(),
        };
        let light = Extent {
            width: fields.u32(),
            height: fields.u32(),
        };
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
            .ok_or(FormatError::Rank(rank.into()))?;
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
        if header.scans > MOST_SCANS {
            return Err(FormatError::Scans(header.scans));
        }
        if header.extension_bytes > MAX_EXTENSION_BYTES {
            return Err(FormatError::ExtensionLength(header.extension_bytes));
        }
        if header.metadata_bytes > MAX_METADATA_BYTES {
            return Err(FormatError::MetadataLength(header.metadata_bytes.into()));
        }
        if file_bytes < header.head_bytes() {
            return Err(FormatError::Truncated {
                got: file_bytes,
                need: header.head_bytes(),
            });
        }
        Ok(header)
    }
}

/// Tells a wrong file from a damaged one, and from one of another version, from the first bytes,
/// once there are four of them.
pub(super) fn check_magic(bytes: &[u8]) -> Result<(), FormatError> {
    let name = MAGIC_VERSION.start;
    if let Some(digits @ &[b'0'..=b'9', b'0'..=b'9']) = bytes.get(MAGIC_VERSION)
        && bytes[..name] == MAGIC[..name]
        && digits != &MAGIC[MAGIC_VERSION]
    {
        let [major, minor] = [digits[0], digits[1]].map(|digit| u16::from(digit - b'0'));
        return Err(FormatError::Version { major, minor });
    }
    if bytes.len() < NAME {
        return Ok(());
    }
    let looks_like = |damaged: &[u8]| bytes[..NAME] == damaged[..NAME];
    if looks_like(&MAGIC.map(|byte| byte & 0x7F)) {
        return Err(FormatError::TextMode(TextDamage::HighBit));
    }
    if looks_like(b"\xC2\xABLT") || looks_like(b"\xEF\xBF\xBDL") {
        return Err(FormatError::TextMode(TextDamage::Utf8));
    }
    match bytes.iter().zip(&MAGIC).position(|(a, b)| a != b) {
        None => Ok(()),
        // Past the name: only the line ends that are there to catch this.
        Some(8..) => Err(FormatError::TextMode(TextDamage::LineEnds)),
        Some(_) => Err(FormatError::Magic {
            found: bytes[..bytes.len().min(MAGIC.len())].to_vec(),
        }),
    }
}
