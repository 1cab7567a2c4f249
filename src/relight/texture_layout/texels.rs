//! The contents of the textures.

use super::{TextureDescriptor, TextureLayout, binding};
use crate::transport::{
    CameraPixel, Extent, Geometry, LightElement, TexelCodes, Tile, TileRect, Transport,
};

/// Rows of codes in one region: up to 4 MiB, which makes uploads few and their copies small.
const REGION_ROWS: u32 = 256;

/// A rectangle of texels to write.
pub struct TextureRegion<'a> {
    /// The texture's binding.
    pub binding: usize,
    /// First column and row, and the layer.
    pub origin: [u32; 3],
    /// Columns and rows.
    pub extent: Extent,
    /// The texels, row by row.
    pub texels: &'a [u8],
}

impl TextureLayout {
    /// Calls `write` with all regions that do not depend on the light and are not zero.
    ///
    /// # Errors
    /// The first error of `write`.
    pub fn for_each_region<E>(
        &self,
        transport: &Transport,
        mut write: impl FnMut(TextureRegion<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.for_each_coefficient_region(transport, &mut write)?;
        self.for_each_code_region(transport, &mut write)?;
        let (origins, tiles) = (self.origin_texels(), self.tile_texels(transport));
        let steps = self.step_texels(transport);
        let textures: [(usize, &[u8]); 3] = [
            (binding::ORIGINS, bytemuck::cast_slice(&origins)),
            (binding::STEPS, bytemuck::cast_slice(&steps)),
            (binding::TILES, bytemuck::cast_slice(&tiles)),
        ];
        for (binding, texels) in textures {
            write(TextureRegion {
                binding,
                origin: [0; 3],
                extent: self.textures[binding].extent,
                texels,
            })?;
        }
        Ok(())
    }

    pub(super) fn for_each_coefficient_region<E>(
        &self,
        transport: &Transport,
        mut write: impl FnMut(TextureRegion<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        for Tile { coefficients, .. } in &transport.tiles {
            let TileRect { x, y, extent } = coefficients.rect;
            let plane = Tile::plane(coefficients.rect);
            for (layer, texels) in (0..).zip(coefficients.codes.chunks_exact(plane)) {
                write(TextureRegion {
                    binding: binding::COEFFICIENTS,
                    origin: [x, y, layer],
                    extent,
                    texels: bytemuck::cast_slice(&texels[..extent.area()]),
                })?;
            }
        }
        Ok(())
    }

    pub(super) fn for_each_code_region<E>(
        &self,
        transport: &Transport,
        mut write: impl FnMut(TextureRegion<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let TextureDescriptor { extent, layers, .. } = self.textures[binding::CODES];
        let Extent { width, height } = extent;
        let mut tiles = transport.tiles.iter().map(|tile| &tile.functions.codes);
        let mut source: &[TexelCodes] = &[];
        let mut texels = Vec::new();
        for layer in 0..layers.unwrap_or(1) {
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
                    binding: binding::CODES,
                    origin: [0, row, layer],
                    extent: Extent::new(width, rows),
                    texels: bytemuck::cast_slice(&texels),
                })?;
            }
        }
        Ok(())
    }

    pub(super) fn origin_texels(&self) -> Vec<[i16; 2]> {
        let Geometry {
            camera,
            light,
            window,
            ..
        } = self.geometry;
        // All windows off the light plane are dark alike; clamped, their origins fit 16 bits.
        let clamp = |at: i32, side: u32| at.clamp(-(window.side() as i32), side as i32) as i16;
        let origin = |(x, y)| {
            let LightElement { u, v } = self.geometry.window_origin(CameraPixel { x, y });
            [clamp(u, light.width), clamp(v, light.height)]
        };
        camera.cells().map(origin).collect()
    }

    pub(super) fn tile_texels(&self, transport: &Transport) -> Vec<[i32; 4]> {
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

    pub(super) fn step_texels(&self, transport: &Transport) -> Vec<[f32; 4]> {
        let texel = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        let tiles = &transport.tiles;
        let coefficients = tiles.iter().map(|tile| tile.coefficients.step);
        let functions = tiles.iter().map(|tile| tile.functions.step);
        coefficients.chain(functions).map(texel).collect()
    }
}
