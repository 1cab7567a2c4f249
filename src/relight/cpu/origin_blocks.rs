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
        let mut bounds: Option<Self> = None;
        let join = |a: &Range<i32>, at: i32| a.start.min(at)..a.end.max(at + 1);
        for y in 0..geometry.camera.height {
            for x in 0..geometry.camera.width {
                let origin = geometry.window_origin(CameraPixel { x, y });
                if geometry.clip_window(origin).is_empty() {
                    continue;
                }
                let LightElement { u, v } = origin;
                bounds = Some(match bounds {
                    Some(Self { columns, rows }) => Self {
                        columns: join(&columns, u),
                        rows: join(&rows, v),
                    },
                    None => Self {
                        columns: u..u + 1,
                        rows: v..v + 1,
                    },
                });
            }
        }
        bounds.unwrap_or_default()
    }
}

/// Pixels side by side, of one tile and one block.
#[derive(Clone, Debug)]
pub struct PixelSpan {
    pub tile: usize,
    /// Index of the first pixel in the tile.
    pub first: usize,
    /// Index of its first entry in the tile's direct functions.
    pub first_entry: usize,
    pub pixel: CameraPixel,
    /// Index of the first pixel in the block.
    pub begin: usize,
    pub length: usize,
}

impl PixelSpan {
    pub fn range(&self) -> Range<usize> {
        self.begin..self.begin + self.length
    }

    /// Whether a pixel of it is in `rect`.
    pub fn is_in(&self, rect: &TileRect) -> bool {
        let CameraPixel { x, y } = self.pixel;
        let right = rect.x.saturating_add(rect.extent.width);
        let bottom = rect.y.saturating_add(rect.extent.height);
        (rect.y..bottom).contains(&y) && x < right && rect.x < x + self.length as u32
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
            let (mut entries, mut entry) = (tile.functions.pixels(), 0);
            for (p, pixel) in tile.rect().pixels().enumerate() {
                let first_entry = entry;
                entry += entries.next().map_or(0, <[_]>::len);
                let origin = geometry.window_origin(pixel);
                if geometry.clip_window(origin).is_empty() {
                    continue;
                }
                let u = (origin.u - grid_origin.u) as usize;
                let v = (origin.v - grid_origin.v) as usize;
                let block = &mut blocks[v / side * grid[0] + u / side];
                block.at = [u / side * side, v / side * side];
                block.add([i, p, first_entry], pixel, v % side * side + u % side);
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
    /// Adds pixel number `p` of a tile, whose entries begin at `first_entry`: to the last span if it continues that.
    fn add(&mut self, [tile, p, first_entry]: [usize; 3], pixel: CameraPixel, offset: usize) {
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
                first_entry,
                pixel,
                begin,
                length: 1,
            }),
        }
    }
}
