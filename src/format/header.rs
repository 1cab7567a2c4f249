//! The fixed header and the tile directory.

use super::FormatError;
use super::codec::{basis, compressed_bound, direct, factored};
use super::error::Part;
use super::metadata::MAX_METADATA_BYTES;
use crate::transport::{CHANNELS, Correspondence, Extent, Geometry, Window};

/// Version of the format. Before 1.0, every minor version is a format of its own.
pub(super) const MAJOR: u16 = 0;
pub(super) const MINOR: u16 = 1;
/// Shows text-mode damage as PNG's and KTX2's do: a high bit, CR LF, ^Z, LF. The digits are the
/// version's.
const MAGIC: [u8; 12] = *b"\xABLTM 01\xBB\r\n\x1A\n";
/// Where the version's digits stand in it.
const MAGIC_VERSION: std::ops::Range<usize> = 5..7;
/// Bytes of the fixed header.
pub const HEADER_BYTES: usize = 124;
/// Bytes of one directory entry.
pub(super) const ENTRY_BYTES: usize = 32;
/// Largest basis: as many functions as any window of up to 31 elements can tell apart.
pub(super) const MAX_RANK: u16 = 1024;

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
    /// Functions in the basis of factored tiles; 0 for none.
    pub rank: u16,
    /// Length of the basis, compressed.
    pub basis_bytes: u32,
    pub(super) basis_crc: u32,
    pub(super) directory_crc: u32,
}

/// Where one tile lies and how to read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileEntry {
    /// Offset in the file.
    pub offset: u64,
    /// Compressed bytes.
    pub bytes: u32,
    /// crc32c of the compressed bytes.
    pub crc: u32,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// What the bytes are.
    pub kind: TileKind,
}

/// What a tile holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileKind {
    /// Nothing: no light comes from it, whatever the light.
    Dark,
    /// Every element of every pixel's window.
    Direct,
    /// Coefficients over the file's basis.
    Factored {
        /// How many of the basis's functions are used: the first so many.
        components: u16,
    },
}

impl TileKind {
    /// As in the directory: kind, then components.
    fn encode(self) -> [u16; 2] {
        match self {
            Self::Dark => [0, 0],
            Self::Direct => [1, 0],
            Self::Factored { components } => [2, components],
        }
    }

    fn decode(fields: [u16; 2]) -> Option<Self> {
        match fields {
            [0, 0] => Some(Self::Dark),
            [1, 0] => Some(Self::Direct),
            [2, components] if components > 0 => Some(Self::Factored { components }),
            _ => None,
        }
    }
}

impl Header {
    /// Bytes of the directory.
    pub fn directory_bytes(&self) -> u64 {
        self.geometry.tile_grid().area() as u64 * ENTRY_BYTES as u64
    }

    /// Offset of the first tile: what comes before it opens the file.
    pub fn tiles_offset(&self) -> u64 {
        HEADER_BYTES as u64
            + self.directory_bytes()
            + u64::from(self.metadata_bytes)
            + u64::from(self.basis_bytes)
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
        out.extend(u32::from(self.rank).to_le_bytes());
        out.extend(self.basis_bytes.to_le_bytes());
        out.extend(self.basis_crc.to_le_bytes());
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
        if (major, minor) != (MAJOR, MINOR) {
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
        let metadata_crc = fields.u32();
        let (rank, basis_bytes, basis_crc) = (fields.u32(), fields.u32(), fields.u32());
        let directory_crc = fields.u32();
        if fields.u32() != crc32c::crc32c(&bytes[..HEADER_BYTES - 4]) {
            return Err(FormatError::Checksum { part: Part::Header });
        }
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
            metadata_bytes,
            metadata_crc,
            rank,
            basis_bytes,
            basis_crc,
            directory_crc,
        };
        if metadata_bytes > MAX_METADATA_BYTES {
            return Err(FormatError::MetadataLength(metadata_bytes.into()));
        }
        let plain = basis::plain_bytes(rank, header.geometry.window.area()) as u64;
        if !could_hold(basis_bytes, plain) {
            return Err(FormatError::BasisLength {
                rank,
                bytes: basis_bytes,
            });
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

/// Whether so many compressed bytes can be what `plain` bytes became: none are none.
fn could_hold(compressed: u32, plain: u64) -> bool {
    match plain {
        0 => compressed == 0,
        _ => compressed > 0 && u64::from(compressed) <= compressed_bound(plain),
    }
}

/// Tells a wrong file from a damaged one, and from one of another version, from the first bytes,
/// however few.
pub(super) fn check_magic(bytes: &[u8]) -> Result<(), FormatError> {
    let name = MAGIC_VERSION.start;
    if let Some(digits @ &[b'0'..=b'9', b'0'..=b'9']) = bytes.get(MAGIC_VERSION)
        && bytes[..name] == MAGIC[..name]
        && digits != &MAGIC[MAGIC_VERSION]
    {
        let [major, minor] = [digits[0], digits[1]].map(|digit| u16::from(digit - b'0'));
        return Err(FormatError::Version { major, minor });
    }
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
        let [kind, components] = self.kind.encode();
        out[28..30].copy_from_slice(&kind.to_le_bytes());
        out[30..].copy_from_slice(&components.to_le_bytes());
        out
    }

    /// The entry of tile number `tile`, whose kind, step and length go together.
    pub(super) fn decode(
        bytes: &[u8; ENTRY_BYTES],
        tile: usize,
        geometry: &Geometry,
        rank: u16,
    ) -> Result<Self, FormatError> {
        let mut fields = Fields(bytes);
        let (offset, bytes, crc) = (fields.u64(), fields.u32(), fields.u32());
        let step = std::array::from_fn(|_| fields.f32());
        let kind = TileKind::decode([fields.u16(), fields.u16()]);
        let plain = |kind| {
            let rect = geometry.tile(tile);
            match kind {
                TileKind::Dark => Some(0),
                TileKind::Direct => Some(direct::plain_bytes(rect, geometry.window.area())),
                TileKind::Factored { components } if components <= rank => {
                    Some(factored::plain_bytes(rect, components))
                }
                TileKind::Factored { .. } => None,
            }
        };
        match kind {
            Some(kind)
                if plain(kind).is_some_and(|plain| could_hold(bytes, plain as u64))
                    && step.iter().all(|s: &f32| s.is_finite() && *s > 0.0) =>
            {
                Ok(Self {
                    offset,
                    bytes,
                    crc,
                    step,
                    kind,
                })
            }
            _ => Err(FormatError::Kind { tile }),
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
    for (tile, bytes) in bytes.as_chunks().0.iter().enumerate() {
        let entry = TileEntry::decode(bytes, tile, &header.geometry, header.rank)?;
        let end = entry.offset.checked_add(u64::from(entry.bytes));
        match end {
            Some(end) if entry.offset == next && end <= header.file_bytes => next = end,
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
