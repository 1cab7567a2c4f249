//! The fixed header and the tile directory.

use super::FormatError;
use super::error::Part;
use super::metadata::MAX_METADATA_BYTES;
use crate::transport::{CHANNELS, Correspondence, Extent, Geometry, Window};

/// Shows text-mode damage as PNG's and KTX2's do: a high bit, CR LF, ^Z, LF.
const MAGIC: [u8; 12] = *b"\xABLTM 00\xBB\r\n\x1A\n";
/// Bytes of the fixed header.
pub const HEADER_BYTES: usize = 112;
/// Bytes of one directory entry.
pub(super) const ENTRY_BYTES: usize = 32;
const MAJOR: u16 = 0;
const MINOR: u16 = 0;

/// The fixed header, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Grids, band and tiling.
    pub geometry: Geometry,
    /// Length of the whole file.
    pub file_bytes: u64,
    /// Length of the metadata.
    pub metadata_bytes: u32,
    pub(super) metadata_crc: u32,
    pub(super) directory_crc: u32,
}

/// Where one tile lies and how to read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileEntry {
    /// Offset in the file.
    pub offset: u64,
    /// Compressed bytes; 0 for a tile that is all dark.
    pub bytes: u32,
    /// crc32c of the compressed bytes.
    pub crc: u32,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
}

impl Header {
    /// Bytes of the directory.
    pub fn directory_bytes(&self) -> u64 {
        self.geometry.tile_grid().area() as u64 * ENTRY_BYTES as u64
    }

    /// Offset of the first tile: what comes before it opens the file.
    pub fn tiles_offset(&self) -> u64 {
        HEADER_BYTES as u64 + self.directory_bytes() + u64::from(self.metadata_bytes)
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
        out.extend(self.metadata_bytes.to_le_bytes());
        out.extend(self.metadata_crc.to_le_bytes());
        out.extend(self.directory_crc.to_le_bytes());
        out.extend(crc32c::crc32c(&out).to_le_bytes());
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
        let (file_bytes, metadata_bytes) = (fields.u64(), fields.u32());
        let (metadata_crc, directory_crc) = (fields.u32(), fields.u32());
        if fields.u32() != crc32c::crc32c(&bytes[..HEADER_BYTES - 4]) {
            return Err(FormatError::Checksum { part: Part::Header });
        }
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
            metadata_bytes,
            metadata_crc,
            directory_crc,
        };
        if metadata_bytes > MAX_METADATA_BYTES {
            return Err(FormatError::MetadataLength(metadata_bytes.into()));
        }
        if file_bytes < header.tiles_offset() {
            return Err(FormatError::Truncated {
                got: file_bytes,
                need: header.tiles_offset(),
            });
        }
        Ok(header)
    }
}

/// Tells a wrong file from a damaged one from the first bytes, however few.
pub(super) fn check_magic(bytes: &[u8]) -> Result<(), FormatError> {
    match bytes.iter().zip(&MAGIC).position(|(a, b)| a != b) {
        None => Ok(()),
        // Past the name: only the line ends that are there to catch this.
        Some(8..) => Err(FormatError::TextMode),
        Some(_) => Err(FormatError::Magic {
            found: bytes[..bytes.len().min(MAGIC.len())].to_vec(),
        }),
    }
}

impl TileEntry {
    pub(super) fn encode(&self) -> [u8; ENTRY_BYTES] {
        let mut out = [0; ENTRY_BYTES];
        out[..8].copy_from_slice(&self.offset.to_le_bytes());
        out[8..12].copy_from_slice(&self.bytes.to_le_bytes());
        out[12..16].copy_from_slice(&self.crc.to_le_bytes());
        for (at, s) in (16..).step_by(4).zip(self.step) {
            out[at..at + 4].copy_from_slice(&s.to_le_bytes());
        }
        out
    }

    fn decode(bytes: &[u8]) -> Self {
        let mut fields = Fields(bytes);
        Self {
            offset: fields.u64(),
            bytes: fields.u32(),
            crc: fields.u32(),
            step: std::array::from_fn(|_| fields.f32()),
        }
    }
}

/// Reads the directory. Tiles must lie one after the other up to the end of the file: nothing is
/// hidden between them, nothing read twice, and a stream of the whole file can be decoded as it
/// arrives.
pub(super) fn decode_directory(
    header: &Header,
    bytes: &[u8],
) -> Result<Vec<TileEntry>, FormatError> {
    if crc32c::crc32c(bytes) != header.directory_crc {
        return Err(FormatError::Checksum {
            part: Part::Directory,
        });
    }
    let mut next = header.tiles_offset();
    let mut entries = Vec::with_capacity(bytes.len() / ENTRY_BYTES);
    for (tile, bytes) in bytes.chunks_exact(ENTRY_BYTES).enumerate() {
        let entry = TileEntry::decode(bytes);
        let steps_ok = entry.step.iter().all(|s| s.is_finite() && *s > 0.0);
        let end = entry.offset.checked_add(u64::from(entry.bytes));
        match end {
            Some(end) if entry.offset == next && end <= header.file_bytes && steps_ok => next = end,
            _ => return Err(FormatError::Entry { tile }),
        }
        entries.push(entry);
    }
    if next == header.file_bytes {
        Ok(entries)
    } else {
        Err(FormatError::TrailingBytes { end: next })
    }
}

/// Takes little-endian fields from the front. The caller knows that there are enough bytes.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const K: usize>(&mut self) -> [u8; K] {
        let (field, rest) = self.0.split_at(K);
        self.0 = rest;
        std::array::from_fn(|i| field[i])
    }
    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }
    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }
    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }
    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}
