//! Writing a transport as an `.ltm` file.

use std::borrow::Borrow;
use std::io::{self, Write};

use super::header::{ENTRY_BYTES, HEADER_BYTES, Header, TileEntry};
use super::metadata::MAX_METADATA_BYTES;
use super::{FormatError, Metadata, codec};
use crate::transport::{CHANNELS, DirectTile, Geometry};

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

    /// The tile as bytes for [`from_record`](Self::from_record): to keep it somewhere for a while,
    /// not a format for exchange.
    pub fn to_record(&self) -> Vec<u8> {
        let steps = self.step.iter().flat_map(|step| step.to_le_bytes());
        steps.chain(self.bytes.iter().copied()).collect()
    }

    /// Takes back what [`to_record`](Self::to_record) gave; `None` where it is too short.
    pub fn from_record(record: &[u8]) -> Option<Self> {
        let (steps, bytes) = record.split_at_checked(STEP_BYTES)?;
        let mut step = [0.0; CHANNELS];
        for (step, bytes) in step.iter_mut().zip(steps.chunks_exact(4)) {
            *step = f32::from_le_bytes(bytes.try_into().ok()?);
        }
        Some(Self {
            bytes: bytes.to_vec(),
            step,
        })
    }
}

/// Bytes of a tile's steps.
const STEP_BYTES: usize = 4 * CHANNELS;

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
    write_from(geometry, metadata, |i| Ok(&tiles[i]), out)
}

/// Like [`write()`], with tiles that need not be in memory all at once: `tile` is asked twice for
/// each by its number, once for the directory and once for its bytes.
pub fn write_from<T: Borrow<EncodedTile>>(
    geometry: &Geometry,
    metadata: &Metadata,
    mut tile: impl FnMut(usize) -> io::Result<T>,
    out: &mut impl Write,
) -> Result<(), FormatError> {
    let tiles = geometry.tile_grid().area();
    let metadata = serde_json::to_vec(metadata).map_err(FormatError::Metadata)?;
    let metadata_bytes = u32::try_from(metadata.len())
        .ok()
        .filter(|bytes| *bytes <= MAX_METADATA_BYTES)
        .ok_or(FormatError::MetadataLength(metadata.len() as u64))?;
    let first = HEADER_BYTES + tiles * ENTRY_BYTES + metadata.len();
    let mut offset = first as u64;
    let mut directory = Vec::with_capacity(tiles * ENTRY_BYTES);
    for i in 0..tiles {
        let tile = tile(i).map_err(FormatError::Write)?;
        let tile: &EncodedTile = tile.borrow();
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
        .and_then(|()| (0..tiles).try_for_each(|i| put(&tile(i)?.borrow().bytes)))
        .map_err(FormatError::Write)
}
