//! A transport as the textures that both GPU back ends sample, and `shaders/relight.wgsl` reads.
//!
//! | texture | format | texel |
//! |---|---|---|
//! | coefficients | `rgba16sint`, 2D array, camera grid | four components of one channel |
//! | seen | `rgba32float`, 2D array, window origins | the light through four components of the basis |
//! | codes | `rgba16sint`, 2D array | τ of one pixel and element, window after window, folded |
//! | origins | `rg16sint`, camera grid | window origin u, v |
//! | steps | `rgba32float`, tile grid twice | value of one code in R, G, B: coefficients', then τ's |
//! | light | `rgba32float`, light grid | linear emission in R, G, B |
//! | tiles | `rgba32sint`, tile grid | index of the first code, or -1; first column and row; width |
//!
//! Layers of coefficients and of what is seen are `[channel, quad]`, quads in pairs: one pass of the
//! shader fills two layers. All that takes double precision or knowledge of tiles is computed here,
//! once, so that no two back ends can disagree about it.

use thiserror::Error;

use super::{Display, Tint, ToneCurve, detailed};
use crate::transport::{
    Basis, CHANNELS, CameraPx, CoefficientTile, DirectTile, Element, Extent, Geometry, QUAD,
    TexelCode, Tile, TileRect, Transport,
};

/// Sides of the codes' texture: what every WebGL2 and WebGPU implementation allows.
const FOLD: u32 = 2048;
/// Rows of the codes' texture in one block: 4 MiB, enough to make calls rare and too little to
/// notice.
const BLOCK_ROWS: u32 = 256;

/// What a device allows.
#[derive(Clone, Copy, Debug)]
pub struct TextureLimits {
    /// Largest width and height of a texture.
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
    /// Quads of components.
    quads: u32,
    codes: Fold,
}

/// Values of two quads of the basis, slot by slot, as one pass has them: what every device allows
/// for uniforms.
pub type PairOfQuads = [[[f32; QUAD]; 2]; BASIS_SLOTS];

/// Most bytes for what is seen: of a light of 1024² by 16 components it is 0.2 GB.
const MOST_SEEN: u64 = 256 << 20;

/// Most bytes for a picture on its way to be the light: film of 8K takes 0.2 GB.
const MOST_PICTURE: u64 = 256 << 20;

/// Slots of a window that a pass has room for.
const BASIS_SLOTS: usize = (16 << 10) / (2 * QUAD * size_of::<f32>());

/// A draw that fills two layers of what is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// The light's channel.
    pub channel: usize,
    /// The part of the basis.
    pub pair: usize,
    /// The first of the layers.
    pub layer: u32,
}

/// The uniforms of a dispatch that sees, which the shader describes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Part {
    share: [f32; 4],
    layer: i32,
    unused: [i32; 3],
}

/// Rows of one tile's coefficients in one layer.
pub struct CoefficientBlock<'a> {
    /// The layer.
    pub layer: u32,
    /// First column and row.
    pub at: [u32; 2],
    /// Columns and rows.
    pub extent: Extent,
    /// Their texels.
    pub texels: &'a [TexelCode],
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

/// The shader's uniforms, which it describes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Params {
    display: [[f32; 4]; CHANNELS],
    tint: [f32; 4],
    window: i32,
    tile_side: i32,
    quads: i32,
    channel_quads: i32,
    seen_quads: i32,
    filmic: i32,
    dither: i32,
    unused: i32,
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
    /// There are more components than layers.
    #[error(
        "the light transport has {need} layers of components, more than the {limit} the graphics device can hold"
    )]
    Layers {
        /// Layers needed.
        need: u32,
        /// Layers allowed.
        limit: u32,
    },
    /// What is seen of the light takes more memory, and time, than a graphics device should be asked
    /// for.
    #[error(
        "the light seen through all components takes {need} bytes of graphics memory; {limit} at most are asked for"
    )]
    Seen {
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The window has more elements than uniforms have room for.
    #[error(
        "the window of {side} has more elements than a graphics device correlates with a basis: {limit}"
    )]
    Window {
        /// Its side.
        side: u32,
        /// Elements allowed.
        limit: usize,
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
    /// Lays out a transport, if the device can hold it.
    pub fn new(transport: &Transport, limits: TextureLimits) -> Result<Self, LayoutError> {
        let geometry = transport.geometry;
        let tiles = &transport.tiles;
        let factored = tiles.iter().any(|tile| !tile.coefficients.is_dark());
        let quads = match factored {
            true => transport.basis.rank().div_ceil(QUAD) as u32,
            false => 0,
        };
        let seen = seen(&geometry);
        let light = match factored {
            true => ("light grid with its border", seen),
            false => ("light grid", geometry.light),
        };
        for (grid, extent) in [("camera grid", geometry.camera), light] {
            if extent.width.max(extent.height) > limits.side {
                return Err(LayoutError::Side {
                    grid,
                    extent,
                    limit: limits.side,
                });
            }
        }
        let need = CHANNELS as u32 * quads.next_multiple_of(2);
        if need > limits.layers {
            return Err(LayoutError::Layers {
                need,
                limit: limits.layers,
            });
        }
        let bytes = seen.area() as u64 * u64::from(need) * size_of::<[f32; 4]>() as u64;
        if bytes > MOST_SEEN {
            return Err(LayoutError::Seen {
                need: bytes,
                limit: MOST_SEEN,
            });
        }
        if factored && geometry.window.area() > BASIS_SLOTS {
            return Err(LayoutError::Window {
                side: geometry.window.side(),
                limit: BASIS_SLOTS,
            });
        }
        let direct = tiles.iter().map(|tile| tile.functions.codes.len() as u64);
        let codes = Self::fold(direct.sum(), limits)?;
        Ok(Self {
            geometry,
            quads,
            codes,
        })
    }

    /// As many layers as so many codes take, then only as high as that many have to be.
    fn fold(need: u64, limits: TextureLimits) -> Result<Fold, LayoutError> {
        let side = FOLD.min(limits.side);
        let layer = u64::from(side) * u64::from(side);
        // The shader counts texels in an i32.
        let limit = (layer * u64::from(limits.layers)).min(i32::MAX as u64);
        if need > limit {
            return Err(LayoutError::Codes { need, limit });
        }
        let width = u64::from(side).min(need).max(1);
        let lines = need.div_ceil(width).max(1);
        let layers = lines.div_ceil(u64::from(side));
        Ok(Fold {
            extent: Extent {
                width: width as u32,
                height: lines.div_ceil(layers) as u32,
            },
            layers: layers as u32,
        })
    }

    /// Extent of the coefficients' texture: of one texel where there are none.
    pub fn coefficients(&self) -> Fold {
        self.layered(self.geometry.camera, self.quads)
    }

    /// Extent of the texture of what is seen.
    pub fn seen(&self) -> Fold {
        self.layered(seen(&self.geometry), 2 * self.pairs())
    }

    fn layered(&self, extent: Extent, quads: u32) -> Fold {
        let one = Extent {
            width: 1,
            height: 1,
        };
        Fold {
            extent: if quads == 0 { one } else { extent },
            layers: (CHANNELS as u32 * quads).max(1),
        }
    }

    /// Parts that the basis is seen in, of two quads each.
    pub fn pairs(&self) -> u32 {
        self.quads.div_ceil(2)
    }

    /// The basis, pass by pass.
    pub fn basis(&self, basis: &Basis) -> Vec<PairOfQuads> {
        let pair = |functions: &[Vec<f32>]| {
            let mut pair = [[[0.0; QUAD]; 2]; BASIS_SLOTS];
            for (k, function) in functions.iter().enumerate() {
                for (slot, value) in pair.iter_mut().zip(function) {
                    slot[k / QUAD][k % QUAD] = *value;
                }
            }
            pair
        };
        let pairs = basis.kernels.chunks(2 * QUAD).take(self.pairs() as usize);
        pairs.map(pair).collect()
    }

    /// Quads that are used of all.
    fn used(&self, detail: f32) -> u32 {
        detailed(self.quads as usize, detail) as u32
    }

    /// Uniforms that tell a pass which channel it sees.
    pub const CHANNELS: [[f32; 4]; CHANNELS] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];

    /// Whether a picture of this extent may become the light on the device: its texels of 4 bytes, and means
    /// of its columns, of 16.
    pub fn takes(&self, picture: Extent, limits: TextureLimits) -> bool {
        let columns = u64::from(picture.height) * u64::from(self.geometry.light.width);
        let bytes = 4 * picture.area() as u64 + 16 * columns;
        picture.width.max(picture.height) <= limits.side && bytes <= MOST_PICTURE
    }

    /// Uniforms of each dispatch that sees a light of one tint by this channel, pair of quads by pair; a light
    /// of many tints takes those of any.
    pub fn parts(&self, channel: usize) -> impl Iterator<Item = Part> {
        (0..self.pairs() as i32).map(move |pair| Part {
            share: Self::CHANNELS[channel],
            layer: 2 * pair,
            unused: [0; 3],
        })
    }

    /// Pairs of quads that are used of all.
    pub fn used_pairs(&self, detail: f32) -> usize {
        self.used(detail).div_ceil(2) as usize
    }

    /// Passes for a light: the channel and the pair of quads each sees, and the first of the two
    /// layers it fills.
    pub fn passes(&self, tint: Tint, detail: f32) -> Vec<Pass> {
        let channels = (0..).zip(tint.channels());
        let (all, used) = (self.pairs(), self.used_pairs(detail));
        let passes = channels.flat_map(|(i, &channel)| {
            (0..used).map(move |pair| Pass {
                channel,
                pair,
                layer: 2 * (i * all + pair as u32),
            })
        });
        passes.collect()
    }

    /// The coefficients' texels, tile by tile; all others are zero. Stops at the first error of
    /// `put`.
    pub fn for_each_coefficient_block<E>(
        &self,
        transport: &Transport,
        mut put: impl FnMut(CoefficientBlock<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        for Tile { coefficients, .. } in &transport.tiles {
            let rect = coefficients.rect;
            let planes = coefficients
                .codes
                .chunks_exact(CoefficientTile::plane(rect));
            for (i, plane) in (0..).zip(planes) {
                put(CoefficientBlock {
                    layer: i,
                    at: [rect.x, rect.y],
                    extent: rect.extent,
                    texels: &plane[..rect.extent.area()],
                })?;
            }
        }
        Ok(())
    }

    /// Extent of the codes' texture.
    pub fn codes(&self) -> Fold {
        self.codes
    }

    /// Extent of the origins' texture.
    pub fn origins(&self) -> Extent {
        self.geometry.camera
    }

    /// Extent of the steps' texture.
    pub fn steps(&self) -> Extent {
        let Extent { width, height } = self.geometry.tile_grid();
        Extent {
            width,
            height: 2 * height,
        }
    }

    /// Extent of the tiles' texture.
    pub fn tiles(&self) -> Extent {
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
        let mut tiles = transport.tiles.iter().map(|tile| &tile.functions);
        let mut source: &[TexelCode] = &[];
        let mut texels = Vec::new();
        for layer in 0..layers {
            for row in (0..extent.height).step_by(BLOCK_ROWS as usize) {
                let rows = BLOCK_ROWS.min(extent.height - row);
                let need = (rows * extent.width) as usize;
                texels.clear();
                while texels.len() < need {
                    if source.is_empty() {
                        match tiles.next() {
                            Some(DirectTile { codes, .. }) => source = codes,
                            // Past the last code, where nothing is ever read.
                            None => texels.resize(need, [0; 4]),
                        }
                    }
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

    /// The origins' texels.
    pub fn origin_texels(&self) -> Vec<[i16; 2]> {
        let Geometry {
            camera,
            light,
            window,
            ..
        } = self.geometry;
        // A window off the display sees nothing however far off it is; nearer, it can't overflow.
        let near = |at: i32, side: u32| at.clamp(-(window.side() as i32), side as i32) as i16;
        let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
        let origin = |(x, y)| {
            let Element { u, v } = self.geometry.window_origin(CameraPx { x, y });
            [near(u, light.width), near(v, light.height)]
        };
        pixels.map(origin).collect()
    }

    /// The tiles' texels.
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

    /// The steps' texels.
    pub fn step_texels(&self, transport: &Transport) -> Vec<[f32; 4]> {
        let texel = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        let tiles = &transport.tiles;
        let coefficients = tiles.iter().map(|tile| tile.coefficients.step);
        let functions = tiles.iter().map(|tile| tile.functions.step);
        coefficients.chain(functions).map(texel).collect()
    }

    /// The uniforms for a frame.
    pub fn params(&self, tint: Tint, display: &Display, detail: f32) -> Params {
        let (seen_quads, [r, g, b]) = match tint {
            Tint::One(_, factors) => (0, factors),
            Tint::Many => (2 * self.pairs() as i32, [1.0; CHANNELS]),
        };
        let [red, green, blue] = display.gains;
        let row = |row: [f32; CHANNELS]| [row[0] * red, row[1] * green, row[2] * blue, 0.0];
        Params {
            display: display.gamut.from_srgb().map(row),
            tint: [r, g, b, 0.0],
            window: self.geometry.window.side() as i32,
            tile_side: self.geometry.tile_side as i32,
            quads: self.used(detail) as i32,
            channel_quads: self.quads as i32,
            seen_quads,
            filmic: (display.curve == ToneCurve::Filmic).into(),
            dither: display.dither.into(),
            unused: 0,
        }
    }
}

/// Window origins that see any of the display, and one around them for all others.
fn seen(geometry: &Geometry) -> Extent {
    let Geometry { light, window, .. } = geometry;
    let span = |side: u32| side + window.side() + 1;
    Extent {
        width: span(light.width),
        height: span(light.height),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{CameraPx, Correspondence, Window};

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

    /// Codes that tell pixel and element, or pixel, channel and component; every third tile has no
    /// functions, and every fourth no coefficients.
    fn transport(geometry: Geometry, rank: usize) -> Transport {
        let area = geometry.window.area();
        let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
            let mut tile = Tile::dark(rect);
            tile.functions.step = [1.0, 2.0, rect.x as f32];
            if i % 3 != 2 {
                let codes = rect
                    .pixels()
                    .flat_map(|p| (0..area).map(move |s| [p.x as i16, p.y as i16, s as i16, 0]));
                tile.functions.codes = codes.collect();
            }
            if i % 4 != 3 && rank > 0 {
                let plane = CoefficientTile::plane(rect);
                let mut codes = vec![[0; 4]; CoefficientTile::texels(rect, rank)];
                for (i, codes) in codes.chunks_exact_mut(plane).enumerate() {
                    for (p, code) in rect.pixels().zip(codes) {
                        *code = [p.x as i16, p.y as i16, i as i16, 7];
                    }
                }
                tile.coefficients.codes = codes;
            }
            tile
        });
        Transport {
            geometry,
            basis: Basis {
                kernels: vec![vec![1.0; area]; rank],
            },
            tiles: tiles.collect(),
        }
    }

    #[test]
    fn every_code_is_where_its_pixel_says() {
        // 150 * 141 * 225 texels fill more than one layer.
        for (camera, window) in [((150, 141), 15), ((37, 23), 3), ((8, 1), 1)] {
            let geometry = geometry(camera, window);
            let transport = transport(geometry, 0);
            let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
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
            let origins = layout.origin_texels();
            let tiles = layout.tile_texels(&transport);
            let steps = layout.step_texels(&transport);
            for y in 0..camera.1 {
                for x in 0..camera.0 {
                    let [u, v] = origins[(y * camera.0 + x) as usize].map(i32::from);
                    let origin = geometry.window_origin(CameraPx { x, y });
                    assert_eq!((u, v), (origin.u, origin.v));
                    let tile = (y / 16 * camera.0.div_ceil(16) + x / 16) as usize;
                    assert_eq!(steps[tiles.len() + tile][2], (x / 16 * 16) as f32);
                    let [first, left, top, width] = tiles[tile];
                    if transport.tiles[tile].functions.is_dark() {
                        assert_eq!(first, -1);
                        continue;
                    }
                    let pixel = (y as i32 - top) * width + (x as i32 - left);
                    let first = first + pixel * geometry.window.area() as i32;
                    for s in 0..geometry.window.area() {
                        let code = texture[first as usize + s];
                        assert_eq!(code, [x as i16, y as i16, s as i16, 0]);
                    }
                }
            }
        }
    }

    #[test]
    fn every_coefficient_is_where_its_pixel_lies() {
        let geometry = geometry((37, 23), 3);
        for rank in [1, 4, 9, 16] {
            let transport = transport(geometry, rank);
            let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
            let (quads, pairs) = (rank.div_ceil(4) as u32, rank.div_ceil(8) as u32);
            assert_eq!(layout.pairs(), pairs);
            let Fold { extent, layers } = layout.coefficients();
            assert_eq!((extent, layers), (geometry.camera, 3 * quads));
            let mut found = 0;
            let Ok(()) = layout.for_each_coefficient_block(&transport, |block| {
                let (channel, quad) = (block.layer / quads, block.layer % quads);
                assert!(channel < 3 && block.texels.len() == block.extent.area());
                for (i, texel) in block.texels.iter().enumerate() {
                    let (x, y) = (i as u32 % block.extent.width, i as u32 / block.extent.width);
                    let at = [(block.at[0] + x) as i16, (block.at[1] + y) as i16];
                    assert_eq!(*texel, [at[0], at[1], (channel * quads + quad) as i16, 7]);
                    found += 1;
                }
                Ok::<_, std::convert::Infallible>(())
            });
            let tiles = transport
                .tiles
                .iter()
                .filter(|tile| !tile.coefficients.is_dark());
            let pixels: usize = tiles.map(|tile| tile.rect().extent.area()).sum();
            assert_eq!(found, pixels * 3 * quads as usize);
            let layers = layout.seen().layers;
            let passes = layout.passes(Tint::Many, 1.0);
            let filled: Vec<_> = passes.iter().map(|pass| pass.layer).collect();
            assert!(filled.iter().copied().eq((0..layers).step_by(2)));
            let one = layout.passes(Tint::One(1, [0.5, 1.0, 0.25]), 1.0);
            assert!(one.iter().all(|pass| pass.channel == 1) && one[0].layer == 0);
            assert_eq!(one.len(), pairs as usize);
            let less = layout.passes(Tint::Many, 0.5);
            let used = rank.div_ceil(4).div_ceil(2).div_ceil(2); // half the quads, in pairs
            assert_eq!(less.len(), 3 * used);
            let first: Vec<_> = passes.iter().filter(|pass| pass.pair < used).collect();
            assert!(less.iter().eq(first));
        }
    }

    #[test]
    fn windows_far_off_the_display_stay_off_it_and_small() {
        for (shift, expected) in [(1e300, [20, 10]), (-1e300, [-15, -15])] {
            let mut geometry = geometry((8, 8), 15);
            geometry.correspondence.affine = [[0.0, 0.0, shift]; 2];
            let transport = transport(geometry, 0);
            let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
            for [u, v] in layout.origin_texels() {
                assert_eq!([u, v], expected);
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let refused = |camera, window, rank, limits| {
            let transport = transport(geometry(camera, window), rank);
            TextureLayout::new(&transport, limits).unwrap_err()
        };
        assert!(matches!(
            refused((2049, 8), 1, 0, WEBGL2_MINIMUM),
            LayoutError::Side {
                grid: "camera grid",
                limit: 2048,
                ..
            }
        ));
        let small = TextureLimits {
            side: 64,
            layers: 2,
        };
        assert_eq!(
            refused((64, 64), 3, 0, small),
            LayoutError::Codes {
                need: 11 * 256 * 9,
                limit: 2 * 64 * 64,
            }
        );
        assert_eq!(
            refused((8, 8), 1, 1, small),
            LayoutError::Layers { need: 6, limit: 2 }
        );
        let mut wide = transport(geometry((8, 8), 1), 64);
        wide.geometry.light = Extent {
            width: 1500,
            height: 1500,
        };
        let seen = TextureLayout::new(&wide, WEBGL2_MINIMUM).unwrap_err();
        assert!(matches!(seen, LayoutError::Seen { need, .. } if need == 1502 * 1502 * 48 * 16));
        let window = refused((8, 8), 25, 1, WEBGL2_MINIMUM);
        assert_eq!(
            window,
            LayoutError::Window {
                side: 25,
                limit: 512
            }
        );
        let large = transport(geometry((512, 512), 15), 0);
        let fits = TextureLayout::new(&large, WEBGL2_MINIMUM).unwrap();
        assert!(fits.codes().layers <= 256);
    }
}
