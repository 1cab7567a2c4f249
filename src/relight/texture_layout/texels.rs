//! The contents of the textures.

use super::TextureLayout;
use crate::transport::{
    CameraPx, CoefficientTile, Element, Extent, Geometry, TexelCode, Tile, TileRect, Transport,
};

/// Rows of codes in one region: up to 4 MiB, which makes uploads few and their copies small.
const REGION_ROWS: u32 = 256;

/// A rectangle of one layer of coefficients or codes.
pub struct TextureRegion<'a> {
    /// First column and row, and the layer.
    pub origin: [u32; 3],
    /// Columns and rows.
    pub extent: Extent,
    /// The texels, row by row.
    pub texels: &'a [TexelCode],
}

impl TextureLayout {
    /// Calls `write` with each region of coefficients that is not zero.
    ///
    /// # Errors
    /// The first error of `write`.
    pub fn for_each_coefficient_region<E>(
        &self,
        transport: &Transport,
        mut write: impl FnMut(TextureRegion<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        for Tile { coefficients, .. } in &transport.tiles {
            let TileRect { x, y, extent } = coefficients.rect;
            let plane = CoefficientTile::plane(coefficients.rect);
            for (layer, texels) in (0..).zip(coefficients.codes.chunks_exact(plane)) {
                write(TextureRegion {
                    origin: [x, y, layer],
                    extent,
                    texels: &texels[..extent.area()],
                })?;
            }
        }
        Ok(())
    }

    /// Calls `write` with regions that cover the codes.
    ///
    /// # Errors
    /// The first error of `write`.
    pub fn for_each_code_region<E>(
        &self,
        transport: &Transport,
        mut write: impl FnMut(TextureRegion<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let Extent { width, height } = self.codes.extent;
        let mut tiles = transport.tiles.iter().map(|tile| &tile.functions.codes);
        let mut source: &[TexelCode] = &[];
        let mut texels = Vec::new();
        for layer in 0..self.codes.layers {
            for row in (0..height).step_by(REGION_ROWS as usize) {
                let rows = REGION_ROWS.min(height - row);
                let need = (rows * width) as usize;
                texels.clear();
                while texels.len() < need {
                    if source.is_empty() {
                        match tiles.next() {
                            Some(codes) => source = codes,
                            // Texels past the last code are never read.
                            None => texels.resize(need, [0; 4]),
                        }
                    }
                    let (now, rest) = source.split_at(source.len().min(need - texels.len()));
                    texels.extend_from_slice(now);
                    source = rest;
                }
                write(TextureRegion {
                    origin: [0, row, layer],
                    extent: Extent {
                        width,
                        height: rows,
                    },
                    texels: &texels,
                })?;
            }
        }
        Ok(())
    }

    /// The texels of the origins.
    pub fn origin_texels(&self) -> Vec<[i16; 2]> {
        let Geometry {
            camera,
            light,
            window,
            ..
        } = self.geometry;
        // All windows off the light plane are dark alike; clamped, their origins fit 16 bits.
        let clamp = |at: i32, side: u32| at.clamp(-(window.side() as i32), side as i32) as i16;
        let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
        let origin = |(x, y)| {
            let Element { u, v } = self.geometry.window_origin(CameraPx { x, y });
            [clamp(u, light.width), clamp(v, light.height)]
        };
        pixels.map(origin).collect()
    }

    /// The texels of the tiles.
    pub fn tile_texels(&self, transport: &Transport) -> Vec<[i32; 4]> {
        let mut next = 0;
        let texel = |tile: &Tile| {
            let TileRect { x, y, extent } = tile.rect();
            let codes = tile.functions.codes.len() as i32;
            let first = if codes == 0 { -1 } else { next };
            next += codes;
            [first, x as i32, y as i32, extent.width as i32]
        };
        transport.tiles.iter().map(texel).collect()
    }

    /// The texels of the steps.
    pub fn step_texels(&self, transport: &Transport) -> Vec<[f32; 4]> {
        let texel = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        let tiles = &transport.tiles;
        let coefficients = tiles.iter().map(|tile| tile.coefficients.step);
        let functions = tiles.iter().map(|tile| tile.functions.step);
        coefficients.chain(functions).map(texel).collect()
    }
}
