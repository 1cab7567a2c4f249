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

/// Writes a region; one function for all textures, as modules are downloaded.
pub(super) type WriteRegion<'a, E> = dyn FnMut(TextureRegion<'_>) -> Result<(), E> + 'a;

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
        let write: &mut WriteRegion<'_, E> = &mut write;
        self.for_each_coefficient_region(transport, write)?;
        self.for_each_code_region(transport, write)?;
        self.for_each_function_region(transport, write)?;
        let (origins, steps) = (self.origin_texels(), self.step_texels(transport));
        let textures: [(usize, &[u8]); 2] = [
            (binding::ORIGINS, bytemuck::cast_slice(&origins)),
            (binding::STEPS, bytemuck::cast_slice(&steps)),
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
        write: &mut WriteRegion<'_, E>,
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
        write: &mut WriteRegion<'_, E>,
    ) -> Result<(), E> {
        let TextureDescriptor { extent, layers, .. } = self.textures[binding::CODES];
        let Extent { width, height } = extent;
        let mut tiles = transport.tiles.iter().map(|tile| &tile.functions.entries);
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
                            Some(entries) => source = entries,
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

    pub(super) fn for_each_function_region<E>(
        &self,
        transport: &Transport,
        write: &mut WriteRegion<'_, E>,
    ) -> Result<(), E> {
        let mut next = 0;
        for Tile { functions, .. } in &transport.tiles {
            if functions.is_dark() {
                continue;
            }
            let TileRect { x, y, extent } = functions.rect;
            let mut texels = Vec::with_capacity(extent.area());
            for entries in functions.pixels() {
                let first = next;
                next += entries.len() as i32; // `TextureLayout::new` bounds the sum
                texels.push([first, next]);
            }
            write(TextureRegion {
                binding: binding::FUNCTIONS,
                origin: [x, y, 0],
                extent,
                texels: bytemuck::cast_slice(&texels),
            })?;
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
        let mut texels = Vec::with_capacity(camera.area());
        for y in 0..camera.height {
            for x in 0..camera.width {
                let LightElement { u, v } = self.geometry.window_origin(CameraPixel { x, y });
                texels.push([clamp(u, light.width), clamp(v, light.height)]);
            }
        }
        texels
    }

    pub(super) fn step_texels(&self, transport: &Transport) -> Vec<[f32; 4]> {
        let tiles = &transport.tiles;
        let mut texels = vec![[0.0; 4]; 2 * tiles.len()];
        for (i, tile) in tiles.iter().enumerate() {
            let steps = [tile.coefficients.step, tile.functions.step];
            for (part, [r, g, b]) in steps.into_iter().enumerate() {
                texels[part * tiles.len() + i] = [r, g, b, 0.0];
            }
        }
        texels
    }
}
