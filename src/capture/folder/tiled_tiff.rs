//! Encodes an uncompressed TIFF of tiles: the `tiff` crate encodes strips only.

use std::io::{Seek, Write};

use tiff::TiffResult;
use tiff::encoder::{DirectoryEncoder, Rational, TiffKind};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, ResolutionUnit, SampleFormat, Tag};

use crate::transport::{CHANNELS, Extent};

/// Rows of a tile. TIFF demands a multiple of 16 of both sides.
pub(super) const TILE_ROWS: u32 = 16;
/// Most columns of a tile. A square of the preparation's sample lies in one or two tiles, which are read in one piece each, and
/// the places and checksums of tiles take less than a thousandth of the file.
const MAX_TILE_COLUMNS: u32 = 1024;

/// Columns of the tiles of a picture of this width: as many for each, so that there is little padding.
fn tile_columns(width: u32) -> u32 {
    let across = width.div_ceil(MAX_TILE_COLUMNS).max(1);
    width.div_ceil(across).next_multiple_of(16).max(16)
}

/// Bytes of the tiles of a picture, with padding.
pub(super) fn tiles_bytes(picture: Extent) -> u64 {
    let columns = picture.width.next_multiple_of(tile_columns(picture.width));
    let rows = picture.height.next_multiple_of(TILE_ROWS);
    size_of::<[u16; CHANNELS]>() as u64 * u64::from(columns) * u64::from(rows)
}

/// Writes a 16-bit RGB picture from the top down.
pub(super) struct TiledTiffEncoder<'a, W: Write + Seek, K: TiffKind> {
    directory: DirectoryEncoder<'a, W, K>,
    width: u32,
    tile_columns: u32,
    /// Where the tiles begin, row by row.
    offsets: Vec<K::OffsetType>,
}

impl<'a, W: Write + Seek, K: TiffKind> TiledTiffEncoder<'a, W, K> {
    pub fn new(
        mut directory: DirectoryEncoder<'a, W, K>,
        Extent { width, height }: Extent,
    ) -> TiffResult<Self> {
        let tile_columns = tile_columns(width);
        directory.write_tag(Tag::ImageWidth, width)?;
        directory.write_tag(Tag::ImageLength, height)?;
        directory.write_tag(Tag::BitsPerSample, &[16u16; CHANNELS][..])?;
        directory.write_tag(Tag::Compression, CompressionMethod::None.to_u16())?;
        directory.write_tag(
            Tag::PhotometricInterpretation,
            PhotometricInterpretation::RGB.to_u16(),
        )?;
        directory.write_tag(Tag::SamplesPerPixel, CHANNELS as u16)?;
        directory.write_tag(Tag::XResolution, Rational { n: 1, d: 1 })?;
        directory.write_tag(Tag::YResolution, Rational { n: 1, d: 1 })?;
        directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
        directory.write_tag(Tag::TileWidth, tile_columns)?;
        directory.write_tag(Tag::TileLength, TILE_ROWS)?;
        directory.write_tag(
            Tag::SampleFormat,
            &[SampleFormat::Uint.to_u16(); CHANNELS][..],
        )?;
        Ok(Self {
            directory,
            width,
            tile_columns,
            offsets: Vec::new(),
        })
    }

    /// Writes the next row of tiles, `[rows, width]`, which has fewer than [`TILE_ROWS`] rows at the bottom of the picture only.
    /// Appends the CRC-32C of the pixels of each tile, without padding, to `checksums`.
    pub fn write_tiles(
        &mut self,
        rows: &[[u16; CHANNELS]],
        checksums: &mut Vec<u32>,
    ) -> TiffResult<()> {
        let (width, columns) = (self.width as usize, self.tile_columns as usize);
        let mut tile = Vec::new();
        for x in (0..width).step_by(columns) {
            let mut checksum = 0;
            tile.clear();
            for row in rows.chunks_exact(width) {
                let part = &row[x..width.min(x + columns)];
                checksum = crc32c::crc32c_append(checksum, bytemuck::cast_slice(part));
                tile.extend_from_slice(part);
                tile.resize(tile.len().next_multiple_of(columns), [0; CHANNELS]);
            }
            tile.resize(TILE_ROWS as usize * columns, [0; CHANNELS]);
            let offset = self.directory.write_data(tile.as_flattened())?;
            self.offsets.push(K::convert_offset(offset)?);
            checksums.push(checksum);
        }
        Ok(())
    }

    /// The directory of the tags, when all tiles are written.
    pub fn finish(mut self) -> TiffResult<DirectoryEncoder<'a, W, K>> {
        let tile = Extent::new(self.tile_columns, TILE_ROWS);
        let bytes = (size_of::<[u16; CHANNELS]>() * tile.area()) as u32;
        let lengths = vec![bytes; self.offsets.len()];
        let directory = &mut self.directory;
        directory.write_tag(Tag::TileOffsets, K::convert_slice(&self.offsets))?;
        directory.write_tag(Tag::TileByteCounts, lengths.as_slice())?;
        Ok(self.directory)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_little_padding() {
        for (width, columns) in [
            (1, 16),
            (1000, 1008),
            (1024, 1024),
            (1025, 528),
            (2100, 704),
            (16_384, 1024),
            (1 << 20, 1024),
        ] {
            assert_eq!(tile_columns(width), columns, "{width}");
        }
        assert_eq!(tiles_bytes(Extent::new(2100, 33)), 2112 * 48 * 6);
        // Pixels of fewer than 2^32 bytes, but not with padding.
        let picture = Extent::new(1025, 690_000);
        assert!(6 * picture.area() < 1 << 32 && tiles_bytes(picture) > 1 << 32);
    }
}
