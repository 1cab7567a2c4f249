//! Writing a transport as an `.ltm` file.

use std::io::{self, Write};

use super::header::{ENTRY_BYTES, HEADER_BYTES, Header, TileEntry};
use super::metadata::MAX_METADATA_BYTES;
use super::{FormatError, Metadata, codec};
use crate::transport::{DirectTile, Geometry};

/// A tile ready to be written: compress tiles wherever there are threads, then [`write`] them.
pub struct EncodedTile {
    bytes: Vec<u8>,
    step: [f32; 3],
}

impl EncodedTile {
    /// Compresses one tile of a transport with this geometry.
    pub fn new(geometry: &Geometry, tile: &DirectTile) -> Result<Self, FormatError> {
        Ok(Self {
            bytes: codec::encode(tile, geometry.window.area())?,
            step: tile.step,
        })
    }
}

/// Writes a whole file. `tiles` are in row-major order, one for each of [`Geometry::tiles`].
/// The same input gives the same bytes.
///
/// # Panics
/// If there is not one tile for each of the geometry's.
pub fn write(
    geometry: &Geometry,
    metadata: &Metadata,
    tiles: &[EncodedTile],
    out: &mut impl Write,
) -> Result<(), FormatError> {
    assert_eq!(tiles.len(), geometry.tile_grid().area(), "one of each tile");
    let metadata = serde_json::to_vec(metadata).map_err(FormatError::Metadata)?;
    let metadata_bytes = u32::try_from(metadata.len())
        .ok()
        .filter(|bytes| *bytes <= MAX_METADATA_BYTES)
        .ok_or(FormatError::MetadataLength(metadata.len() as u64))?;
    let first = HEADER_BYTES + tiles.len() * ENTRY_BYTES + metadata.len();
    let mut offset = first as u64;
    let mut directory = Vec::with_capacity(tiles.len() * ENTRY_BYTES);
    for (i, tile) in tiles.iter().enumerate() {
        let bytes =
            u32::try_from(tile.bytes.len()).map_err(|_| FormatError::TooLarge { tile: i })?;
        let entry = TileEntry {
            offset,
            bytes,
            crc: crc32c::crc32c(&tile.bytes),
            step: tile.step,
        };
        directory.extend(entry.encode());
        offset += u64::from(bytes);
    }
    let header = Header {
        geometry: *geometry,
        file_bytes: offset,
        metadata_bytes,
        metadata_crc: crc32c::crc32c(&metadata),
        directory_crc: crc32c::crc32c(&directory),
    };
    let mut put = |bytes: &[u8]| -> io::Result<()> { out.write_all(bytes) };
    put(&header.encode())
        .and_then(|()| put(&directory))
        .and_then(|()| put(&metadata))
        .and_then(|()| tiles.iter().try_for_each(|tile| put(&tile.bytes)))
        .map_err(FormatError::Write)
}
