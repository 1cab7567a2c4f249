//! Writing a transport as an `.ltm` file.

use std::borrow::Borrow;
use std::io::{self, Write};

use super::codec::{basis, direct, factored};
use super::error::Part;
use super::header::{ENTRY_BYTES, HEADER_BYTES, Header, MAX_RANK, TileEntry, TileKind};
use super::metadata::MAX_METADATA_BYTES;
use super::{FormatError, Metadata};
use crate::transport::{Basis, CHANNELS, DirectTile, Geometry, RecoveredTile};

/// A tile ready to be written: compress tiles wherever there are threads, then [`write`] them.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedTile {
    kind: TileKind,
    step: [f32; CHANNELS],
    bytes: Vec<u8>,
}

impl EncodedTile {
    /// Rounds and compresses one tile of a transport with this geometry.
    pub fn new(geometry: &Geometry, tile: &RecoveredTile) -> Result<Self, FormatError> {
        match tile {
            RecoveredTile::Direct(functions) => {
                let tile = DirectTile::quantise(functions);
                if tile.is_dark() {
                    return Ok(Self::dark());
                }
                Ok(Self {
                    kind: TileKind::Direct,
                    step: tile.step,
                    bytes: direct::encode(&tile, geometry.window.area())?,
                })
            }
            RecoveredTile::Factored(tile) => Ok(factored::encode(tile)?.map_or_else(
                Self::dark,
                |encoded| Self {
                    kind: TileKind::Factored {
                        components: encoded.components,
                    },
                    step: encoded.step,
                    bytes: encoded.bytes,
                },
            )),
        }
    }

    fn dark() -> Self {
        Self {
            kind: TileKind::Dark,
            step: [1.0; CHANNELS],
            bytes: Vec::new(),
        }
    }

    /// What the tile holds.
    pub fn kind(&self) -> TileKind {
        self.kind
    }

    /// The tile by itself, to be kept for a while: its directory entry, at offset 0, and its bytes.
    pub fn to_bytes(&self) -> Result<Vec<u8>, FormatError> {
        let entry = self.entry(0).ok_or(FormatError::TooLarge { tile: 0 })?;
        Ok([&entry.encode()[..], &self.bytes].concat())
    }

    /// Tile number `tile` of a transport with this geometry from what [`to_bytes`](Self::to_bytes)
    /// made of it; refused if not whole, or if it cannot be that tile over a basis of `rank`
    /// functions.
    pub fn from_bytes(
        geometry: &Geometry,
        rank: u16,
        tile: usize,
        bytes: &[u8],
    ) -> Result<Self, FormatError> {
        let cut = |need: u64| FormatError::Truncated {
            got: bytes.len() as u64,
            need,
        };
        let (entry, rest) = bytes.split_first_chunk().ok_or(cut(ENTRY_BYTES as u64))?;
        let entry = TileEntry::decode(entry, tile, geometry, rank)?;
        let end = ENTRY_BYTES as u64 + u64::from(entry.bytes);
        match (bytes.len() as u64).cmp(&end) {
            std::cmp::Ordering::Less => return Err(cut(end)),
            std::cmp::Ordering::Greater => return Err(FormatError::TrailingBytes { end }),
            std::cmp::Ordering::Equal => {}
        }
        if crc32c::crc32c(rest) != entry.crc {
            return Err(FormatError::Checksum {
                part: Part::Tile(tile),
            });
        }
        Ok(Self {
            kind: entry.kind,
            step: entry.step,
            bytes: rest.to_vec(),
        })
    }

    /// The tile's directory entry; `None` if it is too large for one.
    fn entry(&self, offset: u64) -> Option<TileEntry> {
        Some(TileEntry {
            offset,
            bytes: u32::try_from(self.bytes.len()).ok()?,
            crc: crc32c::crc32c(&self.bytes),
            step: self.step,
            kind: self.kind,
        })
    }
}

/// Writes a whole file. `tiles` are in row-major order, one for each of [`Geometry::tiles`];
/// factored ones need the `basis` they were made for. The same input gives the same bytes.
///
/// # Panics
/// If there is not one tile for each of the geometry's, or a kernel is not of the window's area.
pub fn write(
    geometry: &Geometry,
    metadata: &Metadata,
    basis: Option<&Basis>,
    tiles: &[EncodedTile],
    out: &mut impl Write,
) -> Result<(), FormatError> {
    assert_eq!(tiles.len(), geometry.tile_grid().area(), "one of each tile");
    write_from(geometry, metadata, basis, |i| Ok(&tiles[i]), out)
}

/// Writes a whole file as [`write`] does, of tiles that `tile` fetches by number from wherever they
/// are kept. Each is asked for twice: for the directory, and for its bytes.
///
/// # Panics
/// If a kernel is not of the window's area.
pub fn write_from<T: Borrow<EncodedTile>>(
    geometry: &Geometry,
    metadata: &Metadata,
    basis: Option<&Basis>,
    mut tile: impl FnMut(usize) -> io::Result<T>,
    out: &mut impl Write,
) -> Result<(), FormatError> {
    let tiles = geometry.tile_grid().area();
    let metadata = serde_json::to_vec(metadata).map_err(FormatError::Metadata)?;
    let metadata_bytes = u32::try_from(metadata.len())
        .ok()
        .filter(|bytes| *bytes <= MAX_METADATA_BYTES)
        .ok_or(FormatError::MetadataLength(metadata.len() as u64))?;
    let (rank, basis) = match basis.filter(|basis| basis.rank() > 0) {
        None => (0, Vec::new()),
        Some(basis) => {
            let area = geometry.window.area();
            let fits = basis.kernels.iter().all(|kernel| kernel.len() == area);
            assert!(fits, "kernels of the window's area");
            let rank = u16::try_from(basis.rank())
                .ok()
                .filter(|rank| *rank <= MAX_RANK)
                .ok_or(FormatError::Rank(basis.rank() as u64))?;
            (rank, basis::encode(basis)?)
        }
    };
    let first = HEADER_BYTES + tiles * ENTRY_BYTES + metadata.len() + basis.len();
    let mut offset = first as u64;
    let mut directory = Vec::with_capacity(tiles * ENTRY_BYTES);
    for i in 0..tiles {
        let tile = tile(i).map_err(FormatError::Write)?;
        let tile: &EncodedTile = tile.borrow();
        if let TileKind::Factored { components } = tile.kind
            && components > rank
        {
            return Err(FormatError::Components {
                tile: i,
                components,
                rank,
            });
        }
        let entry = tile
            .entry(offset)
            .ok_or(FormatError::TooLarge { tile: i })?;
        directory.extend(entry.encode());
        offset += u64::from(entry.bytes);
    }
    let header = Header {
        geometry: *geometry,
        file_bytes: offset,
        metadata_bytes,
        metadata_crc: crc32c::crc32c(&metadata),
        rank,
        basis_bytes: basis.len() as u32, // at most 1024 · 63² · 4, about
        basis_crc: crc32c::crc32c(&basis),
        directory_crc: crc32c::crc32c(&directory),
    };
    let mut put = |bytes: &[u8]| -> io::Result<()> { out.write_all(bytes) };
    put(&header.encode())
        .and_then(|()| put(&directory))
        .and_then(|()| put(&metadata))
        .and_then(|()| put(&basis))
        .and_then(|()| (0..tiles).try_for_each(|i| put(&tile(i)?.borrow().bytes)))
        .map_err(FormatError::Write)
}
