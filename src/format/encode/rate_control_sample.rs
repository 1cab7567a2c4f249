//! Parts of some tiles, spread over the picture, from which the rate control predicts the whole file.

use std::io;

use super::encoder_input::EncoderInput;
use super::source_analysis::AnalysedSource;
use crate::format::error::FormatError;
use crate::job_executor::Executor;
use crate::transport::{CHANNELS, Extent, FloatTile, TileRect};

/// Maximum number of sampled tiles, and maximum memory of their values.
const MAX_SAMPLED_TILES: usize = 64;
const MAX_SAMPLE_BYTES: usize = 48 << 20;
/// The side of a part is a multiple of this, so that cosine blocks stay whole.
const PART_SIDE: u32 = 8;

/// A part of a tile.
pub struct SampledTilePart {
    /// Over the file's basis, with the components that are dropped later.
    pub tile: FloatTile,
    /// Number of parts that it represents.
    pub weight: f64,
}

/// Samples tiles that are not dark.
///
/// # Errors
/// [`FormatError::Source`] if a tile cannot be read.
pub fn sample(
    analysed: &AnalysedSource<'_, impl Executor>,
    source: &EncoderInput<'_>,
) -> Result<Vec<SampledTilePart>, FormatError> {
    let lit_tiles = &analysed.lit_tiles;
    let pixel_bytes = ((analysed.rank() + analysed.slots()) * CHANNELS * size_of::<f32>()).max(1);
    let max_count = MAX_SAMPLE_BYTES / (PART_SIDE.pow(2) as usize * pixel_bytes);
    let count = max_count.clamp(1, MAX_SAMPLED_TILES).min(lit_tiles.len());
    let tile_side = analysed.geometry.tile_side;
    let side = (MAX_SAMPLE_BYTES / (count.max(1) * pixel_bytes)).isqrt() as u32;
    let side = match side >= tile_side {
        true => tile_side,
        false => (side / PART_SIDE * PART_SIDE).max(PART_SIDE),
    };
    let part = |n: usize| -> io::Result<SampledTilePart> {
        // One of each of `count` equal groups, at a pseudo-random place that follows no grid.
        let [from, to] = [n, n + 1].map(|n| n * lit_tiles.len() / count);
        let tile = lit_tiles[from + hash(n) % (to - from)];
        let tile = (source.tile)(tile)?;
        let (tile, lit_parts) = lit_part(tile, side, hash(n + MAX_SAMPLED_TILES));
        Ok(SampledTilePart {
            tile: analysed.rotated(tile),
            weight: (lit_parts * (to - from)) as f64,
        })
    };
    let parts: io::Result<_> = (0..count).map(part).collect();
    parts.map_err(FormatError::Source)
}

/// Cuts a tile into squares of `side`. Returns one of those that are not dark, chosen by `hash`, and the number
/// of these.
fn lit_part(tile: FloatTile, side: u32, hash: usize) -> (FloatTile, usize) {
    let Extent { width, height } = tile.rect.extent;
    let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
    if columns * rows == 1 {
        return (tile, 1);
    }
    let parts = (0..columns * rows).map(|i| {
        let (left, top) = (i % columns * side, i / columns * side);
        tile.crop(TileRect {
            x: tile.rect.x + left,
            y: tile.rect.y + top,
            extent: Extent::new(side.min(width - left), side.min(height - top)),
        })
    });
    let mut lit_parts: Vec<FloatTile> = parts.filter(is_lit).collect();
    match lit_parts.len() {
        0 => (FloatTile::dark(tile.rect), 0),
        count => (lit_parts.swap_remove(hash % count), count),
    }
}

fn is_lit(tile: &FloatTile) -> bool {
    let mut values = tile.coefficients.iter().chain(&tile.functions).flatten();
    values.any(|v| v.is_finite() && *v != 0.0)
}

/// A multiplicative hash (Knuth).
fn hash(n: usize) -> usize {
    (n as u32).wrapping_mul(0x9E37_79B9).rotate_left(16) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_lit_and_counts_the_lit_parts() {
        let rect = TileRect {
            x: 32,
            y: 16,
            extent: Extent::new(20, 13),
        };
        let lit_at = |pixels: &[usize]| {
            let mut tile = FloatTile::dark(rect);
            tile.functions = vec![[0.0; CHANNELS]; rect.extent.area() * 9];
            for p in pixels {
                tile.functions[p * 9 + 4][1] = 1.0;
            }
            tile
        };
        for hash in 0..7 {
            // The last pixel, alone in a part of four by five.
            let (part, count) = lit_part(lit_at(&[259]), 8, hash);
            assert_eq!(count, 1);
            assert_eq!((part.rect.x, part.rect.y), (48, 24));
            assert_eq!((part.rect.extent.width, part.rect.extent.height), (4, 5));
            assert!(is_lit(&part));
            // The first pixel, one beside it, and the last.
            let (part, count) = lit_part(lit_at(&[0, 3, 259]), 8, hash);
            assert_eq!(count, 2);
            assert_eq!(part.rect.x, [32, 48][hash % 2]);
            assert_eq!(lit_part(lit_at(&[]), 8, hash).1, 0);
            let (whole, count) = lit_part(lit_at(&[7]), 24, hash);
            assert_eq!((whole.rect, count), (rect, 1));
        }
    }
}
