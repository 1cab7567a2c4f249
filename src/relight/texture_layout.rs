//! A transport as the textures that both GPU back ends sample, and `shaders/relight.wgsl` reads.
//!
//! | texture | format | texel |
//! |---|---|---|
//! | codes | `rgba16sint`, 2D array | τ of one pixel and element, window after window, folded |
//! | pixels | `rgba32sint`, camera grid | window origin u, v; index of the first code; tile |
//! | steps | `rgba32float`, tile grid | value of one code in R, G, B |
//! | light | `rgba32float`, light grid | linear emission in R, G, B |
//!
//! All that takes double precision or knowledge of tiles is computed here, once, so that no two
//! back ends can disagree about it.

use thiserror::Error;

use crate::transport::{Element, Extent, Geometry, TexelCode, Transport};

/// Sides of the codes' texture: what every WebGL2 and WebGPU implementation allows.
const FOLD: u32 = 2048;
/// Rows of the codes' texture in one block: 4 MiB, enough to make calls rare and too little to
/// notice.
const BLOCK_ROWS: u32 = 256;

/// What a device allows.
#[derive(Clone, Copy, Debug)]
pub struct TextureLimits {
    /// Largest width and height of a texture, and of a canvas.
    pub side: u32,
    /// Most layers in a texture array.
    pub layers: u32,
}

/// Width, height and layers of a texture array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fold {
    /// Width and height of a layer, in texels.
    pub extent: Extent,
    /// Number of layers.
    pub layers: u32,
}

/// Where everything of one transport lies in textures.
#[derive(Clone, Copy, Debug)]
pub struct TextureLayout {
    geometry: Geometry,
    codes: Fold,
}

/// Whole rows of one layer of the codes' texture.
pub struct CodeBlock<'a> {
    /// The layer.
    pub layer: u32,
    /// First row.
    pub row: u32,
    /// Number of rows.
    pub rows: u32,
    /// Their texels.
    pub texels: &'a [TexelCode],
}

/// The shader's uniforms.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Params {
    window: i32,
    exposure: f32,
    reserved: [f32; 2],
}

/// A photograph that a device's textures cannot hold.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum LayoutError {
    /// A grid is larger than a texture.
    #[error(
        "the {grid} is {extent}, more than the graphics device's limit of {limit} along a side"
    )]
    Side {
        /// Which grid.
        grid: &'static str,
        /// Its extent.
        extent: Extent,
        /// The device's limit.
        limit: u32,
    },
    /// The transport is larger than a texture array.
    #[error(
        "the light transport has {need} values a channel, more than the {limit} the graphics device can hold"
    )]
    Codes {
        /// Texels needed.
        need: u64,
        /// Texels allowed.
        limit: u64,
    },
}

impl TextureLayout {
    /// Lays out a transport of this geometry, if the device can hold it.
    pub fn new(geometry: Geometry, limits: TextureLimits) -> Result<Self, LayoutError> {
        for (grid, extent) in [
            ("camera grid", geometry.camera),
            ("light grid", geometry.light),
        ] {
            if extent.width.max(extent.height) > limits.side {
                return Err(LayoutError::Side {
                    grid,
                    extent,
                    limit: limits.side,
                });
            }
        }
        let need = geometry.camera.area() as u64 * geometry.window.area() as u64;
        let side = FOLD.min(limits.side);
        let layer = u64::from(side) * u64::from(side);
        // The shader counts texels in an i32.
        let limit = (layer * u64::from(limits.layers)).min(i32::MAX as u64);
        if need > limit {
            return Err(LayoutError::Codes { need, limit });
        }
        // As many layers as it takes, then only as high as that many have to be.
        let width = u64::from(side).min(need);
        let lines = need.div_ceil(width);
        let layers = lines.div_ceil(u64::from(side));
        Ok(Self {
            geometry,
            codes: Fold {
                extent: Extent {
                    width: width as u32,
                    height: lines.div_ceil(layers) as u32,
                },
                layers: layers as u32,
            },
        })
    }

    /// Extent of the codes' texture.
    pub fn codes(&self) -> Fold {
        self.codes
    }

    /// Extent of the pixels' texture.
    pub fn pixels(&self) -> Extent {
        self.geometry.camera
    }

    /// Extent of the steps' texture.
    pub fn steps(&self) -> Extent {
        self.geometry.tile_grid()
    }

    /// Extent of the light's texture.
    pub fn light(&self) -> Extent {
        self.geometry.light
    }

    /// The codes' texels, in blocks that cover the texture; stops at the first error of `put`.
    pub fn for_each_code_block<E>(
        &self,
        transport: &Transport,
        mut put: impl FnMut(CodeBlock<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let Fold { extent, layers } = self.codes;
        let area = self.geometry.window.area();
        let mut tiles = transport.tiles.iter();
        let mut source: &[TexelCode] = &[];
        // Texels of dark tiles still to be written: they hold no codes, but have their place.
        let mut dark = 0;
        let mut texels = Vec::new();
        for layer in 0..layers {
            for row in (0..extent.height).step_by(BLOCK_ROWS as usize) {
                let rows = BLOCK_ROWS.min(extent.height - row);
                let need = (rows * extent.width) as usize;
                texels.clear();
                while texels.len() < need {
                    if source.is_empty() && dark == 0 {
                        match tiles.next() {
                            Some(tile) if tile.is_dark() => dark = tile.rect.extent.area() * area,
                            Some(tile) => source = &tile.codes,
                            // Past the last code, where nothing is ever read.
                            None => dark = need - texels.len(),
                        }
                    }
                    let zeros = dark.min(need - texels.len());
                    texels.resize(texels.len() + zeros, [0; 4]);
                    dark -= zeros;
                    let (now, later) = source.split_at(source.len().min(need - texels.len()));
                    texels.extend_from_slice(now);
                    source = later;
                }
                put(CodeBlock {
                    layer,
                    row,
                    rows,
                    texels: &texels,
                })?;
            }
        }
        Ok(())
    }

    /// The pixels' texels.
    pub fn pixel_texels(&self) -> Vec<[i32; 4]> {
        let Geometry {
            camera,
            light,
            window,
            ..
        } = self.geometry;
        // A window off the display sees nothing however far off it is; nearer, it can't overflow.
        let near = |origin: i32, side: u32| origin.clamp(-(window.side() as i32), side as i32);
        let mut texels = vec![[0; 4]; camera.area()];
        let mut first_code = 0;
        for (i, tile) in self.geometry.tiles().enumerate() {
            for pixel in tile.pixels() {
                let Element { u, v } = self.geometry.window_origin(pixel);
                texels[camera.index(pixel)] = [
                    near(u, light.width),
                    near(v, light.height),
                    first_code,
                    i as i32,
                ];
                first_code += window.area() as i32;
            }
        }
        texels
    }

    /// The steps' texels.
    pub fn step_texels(&self, transport: &Transport) -> Vec<[f32; 4]> {
        let texel = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        transport
            .tiles
            .iter()
            .map(|tile| texel(tile.step))
            .collect()
    }

    /// The uniforms for a frame.
    pub fn params(&self, exposure: f32) -> Params {
        Params {
            window: self.geometry.window.side() as i32,
            exposure,
            reserved: [0.0; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{CameraPx, Correspondence, DirectTile, Window};

    const WEBGL2_MINIMUM: TextureLimits = TextureLimits {
        side: 2048,
        layers: 256,
    };

    fn geometry(camera: (u32, u32), window: u32) -> Geometry {
        Geometry {
            camera: Extent {
                width: camera.0,
                height: camera.1,
            },
            light: Extent {
                width: 20,
                height: 10,
            },
            window: Window::new(window).unwrap(),
            correspondence: Correspondence {
                affine: [[0.12, 0.0, -0.75], [0.0, 0.06, 1.0]],
            },
            tile_side: 16,
        }
    }

    /// Codes that tell pixel and element; every third tile is dark.
    fn transport(geometry: Geometry) -> Transport {
        let area = geometry.window.area();
        let tiles = geometry.tiles().enumerate().map(|(i, rect)| DirectTile {
            rect,
            step: [1.0, 2.0, rect.x as f32],
            codes: match i % 3 {
                2 => Vec::new(),
                _ => rect
                    .pixels()
                    .flat_map(|p| (0..area).map(move |s| [p.x as i16, p.y as i16, s as i16, 0]))
                    .collect(),
            },
        });
        Transport {
            geometry,
            tiles: tiles.collect(),
        }
    }

    #[test]
    fn every_code_is_where_its_pixel_says() {
        // 150 * 141 * 225 texels fill more than one layer.
        for (camera, window) in [((150, 141), 15), ((37, 23), 3), ((8, 1), 1)] {
            let geometry = geometry(camera, window);
            let transport = transport(geometry);
            let layout = TextureLayout::new(geometry, WEBGL2_MINIMUM).unwrap();
            let Fold { extent, layers } = layout.codes();
            let mut texture = Vec::new();
            layout
                .for_each_code_block(&transport, |block| {
                    let before = block.layer as usize * extent.area();
                    assert_eq!(texture.len(), before + (block.row * extent.width) as usize);
                    assert_eq!(block.texels.len(), (block.rows * extent.width) as usize);
                    texture.extend_from_slice(block.texels);
                    Ok::<_, ()>(())
                })
                .unwrap();
            assert_eq!(texture.len(), extent.area() * layers as usize);
            let pixels = layout.pixel_texels();
            let steps = layout.step_texels(&transport);
            for y in 0..camera.1 {
                for x in 0..camera.0 {
                    let [u, v, first, tile] = pixels[(y * camera.0 + x) as usize];
                    let origin = geometry.window_origin(CameraPx { x, y });
                    assert_eq!((u, v), (origin.u, origin.v));
                    assert_eq!(steps[tile as usize][2], (x / 16 * 16) as f32);
                    for s in 0..geometry.window.area() {
                        let code = texture[first as usize + s];
                        let expected = match transport.tiles[tile as usize].is_dark() {
                            true => [0; 4],
                            false => [x as i16, y as i16, s as i16, 0],
                        };
                        assert_eq!(code, expected);
                    }
                }
            }
        }
    }

    #[test]
    fn windows_far_off_the_display_stay_off_it_and_small() {
        for (shift, expected) in [(1e300, [20, 10]), (-1e300, [-15, -15])] {
            let mut geometry = geometry((8, 8), 15);
            geometry.correspondence.affine = [[0.0, 0.0, shift]; 2];
            let layout = TextureLayout::new(geometry, WEBGL2_MINIMUM).unwrap();
            for [u, v, ..] in layout.pixel_texels() {
                assert_eq!([u, v], expected);
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let refused = |camera, window, limits| {
            TextureLayout::new(geometry(camera, window), limits).unwrap_err()
        };
        assert!(matches!(
            refused((2049, 8), 1, WEBGL2_MINIMUM),
            LayoutError::Side {
                grid: "camera grid",
                limit: 2048,
                ..
            }
        ));
        let two_layers = TextureLimits {
            side: 2048,
            layers: 2,
        };
        assert_eq!(
            refused((512, 512), 15, two_layers),
            LayoutError::Codes {
                need: 512 * 512 * 225,
                limit: 2 * 2048 * 2048,
            }
        );
        let fits = TextureLayout::new(geometry((512, 512), 15), WEBGL2_MINIMUM).unwrap();
        assert!(fits.codes().layers <= 256);
    }
}
