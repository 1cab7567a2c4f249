//! Origin blocks: squares of window origins, each with the camera pixels whose windows begin there.
//!
//! A block is correlated at once, and relit when the light under it has changed. Its *footprint* is the square of light
//! elements that the windows of its origins cover: `side + w - 1` elements along each side.

use std::ops::Range;

use crate::transport::{CameraPixel, Extent, Geometry, LightElement, TileRect, Transport};

/// The side of blocks where no tile is factored.
pub const DIRECT_BLOCK_SIDE: usize = 64;

/// The smallest rectangle of window origins that holds those of all pixels with a window on the light plane.
#[derive(Clone, Debug, Default)]
pub struct OriginBoundingBox {
    pub columns: Range<i32>,
    pub rows: Range<i32>,
}

impl OriginBoundingBox {
    /// Of all pixels, those of dark tiles too: where blocks lie decides how sums are rounded, and workers that
    /// each have a part of the tiles must agree to the bit.
    pub fn new(geometry: &Geometry) -> Self {
        let pixels = geometry.tiles().flat_map(TileRect::pixels);
        let origins = pixels.map(|pixel| geometry.window_origin(pixel));
        let bounds = origins
            .filter(|origin| !geometry.clip_window(*origin).is_empty())
            .map(|LightElement { u, v }| Self {
                columns: u..u + 1,
                rows: v..v + 1,
            });
        let join = |a: Range<i32>, b: Range<i32>| a.start.min(b.start)..a.end.max(b.end);
        let bounds = bounds.reduce(|a, b| Self {
            columns: join(a.columns, b.columns),
            rows: join(a.rows, b.rows),
        });
        bounds.unwrap_or_default()
    }
}

/// Pixels side by side, of one tile and one block.
#[derive(Clone, Debug)]
pub struct PixelSpan {
    pub tile: usize,
    /// Index of the first pixel in the tile.
    pub first: usize,
    pub pixel: CameraPixel,
    /// Index of the first pixel in the block.
    pub begin: usize,
    pub length: usize,
}

impl PixelSpan {
    pub fn range(&self) -> Range<usize> {
        self.begin..self.begin + self.length
    }
}

/// A square of window origins, and the pixels that have them.
#[derive(Clone, Debug, Default)]
pub struct OriginBlock {
    /// Column and row of its first origin, from [`OriginBlocks::origin`].
    pub at: [usize; 2],
    /// Its pixels.
    pub spans: Vec<PixelSpan>,
    /// For each pixel the index of its window origin in the block, row by row.
    pub offsets: Vec<u16>,
}

/// The origin blocks of all pixels that can be lit.
#[derive(Clone, Debug)]
pub struct OriginBlocks {
    /// The first origin of the first block.
    pub origin: LightElement,
    /// Origins along a block's side, at most 256.
    pub side: usize,
    /// Extent of the footprints of all blocks together.
    pub footprint: Extent,
    /// Blocks with at least one pixel.
    pub blocks: Vec<OriginBlock>,
}

impl OriginBlocks {
    /// Assigns the pixels to blocks of `side × side` origins.
    pub fn new(transport: &Transport, bounds: &OriginBoundingBox, side: usize) -> Self {
        let geometry = &transport.geometry;
        let grid = [bounds.columns.len(), bounds.rows.len()].map(|span| span.div_ceil(side));
        // Centred, so that a half of the photograph has half of the blocks.
        let first = |origins: &Range<i32>, blocks: usize| {
            origins.start - ((blocks * side - origins.len()) / 2) as i32
        };
        let grid_origin = LightElement {
            u: first(&bounds.columns, grid[0]),
            v: first(&bounds.rows, grid[1]),
        };
        let mut blocks = vec![OriginBlock::default(); grid[0] * grid[1]];
        let tiles = transport.tiles.iter().enumerate();
        for (i, tile) in tiles.filter(|(_, tile)| !tile.is_dark()) {
            for (p, pixel) in tile.rect().pixels().enumerate() {
                let origin = geometry.window_origin(pixel);
                if geometry.clip_window(origin).is_empty() {
                    continue;
                }
                let u = (origin.u - grid_origin.u) as usize;
                let v = (origin.v - grid_origin.v) as usize;
                let block = &mut blocks[v / side * grid[0] + u / side];
                block.at = [u / side * side, v / side * side];
                block.add(i, p, pixel, v % side * side + u % side);
            }
        }
        blocks.retain(|block| !block.offsets.is_empty());
        // The part of the grid that still has blocks.
        let used = |axis: usize| {
            let first = blocks.iter().map(|block| block.at[axis]);
            let end = first.clone().max().map_or(0, |last| last + side);
            first.min().unwrap_or(0)..end
        };
        let (columns, rows) = (used(0), used(1));
        for block in &mut blocks {
            block.at = [block.at[0] - columns.start, block.at[1] - rows.start];
            block.spans.shrink_to_fit();
            block.offsets.shrink_to_fit();
        }
        Self {
            origin: LightElement {
                u: grid_origin.u + columns.start as i32,
                v: grid_origin.v + rows.start as i32,
            },
            side,
            footprint: Extent::new(
                columns.len() as u32 + geometry.window.side() - 1,
                rows.len() as u32 + geometry.window.side() - 1,
            ),
            blocks,
        }
    }
}

impl OriginBlock {
    /// Adds pixel number `p` of a tile: to the last span if it continues that.
    fn add(&mut self, tile: usize, p: usize, pixel: CameraPixel, offset: usize) {
        let begin = self.offsets.len();
        self.offsets.push(offset as u16); // a side is at most 256
        match self.spans.last_mut() {
            Some(span)
                if span.tile == tile
                    && span.first + span.length == p
                    && span.pixel.y == pixel.y =>
            {
                span.length += 1;
            }
            _ => self.spans.push(PixelSpan {
                tile,
                first: p,
                pixel,
                begin,
                length: 1,
            }),
        }
    }
}
