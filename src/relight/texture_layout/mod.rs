//! A transport as the textures that both GPU backends sample and the WGSL in `shaders/` reads.
//!
//! | texture | format | texel |
//! |---|---|---|
//! | coefficients | `rgba16sint`, 2D array, camera grid | four components of one channel |
//! | basis response | `rgba32float`, 2D array, window origins | the response of four basis functions |
//! | codes | `rgba16sint`, 2D array | τ in one slot: pixel by pixel, folded into rows and layers |
//! | origins | `rg16sint`, camera grid | window origin u, v |
//! | steps | `rgba32float`, tile grid twice | value of one code in R, G, B: of coefficients, then of τ |
//! | light | `rgba32float`, light plane | linear emission in R, G, B |
//! | tiles | `rgba32sint`, tile grid | index of the first code or -1; first column and row; width |
//!
//! Layers of coefficients and of the basis response are `[channel, quad]`; one pass correlates a pair of quads, so the
//! response has an even number of them. Everything that takes double precision or knowledge of tiles is computed here,
//! once for both backends.

#[cfg(test)]
mod tests;
mod texels;
mod uniforms;

use thiserror::Error;

use super::used_count;
use crate::transport::{CHANNELS, Extent, Geometry, QUAD, Transport};

pub use texels::TextureRegion;
pub use uniforms::{BasisUniforms, CorrelationPass, DispatchUniforms, FrameUniforms};

/// Largest width and height of the codes' texture: every WebGL2 and WebGPU implementation allows it.
const MAX_FOLD_SIDE: u32 = 2048;

/// Bytes of the basis response, at most: for a light plane of 1024² and 16 components it takes 0.2 GB.
const MAX_RESPONSE_BYTES: u64 = 256 << 20;

/// Bytes for downsampling a light image, at most: for 8K video it takes 0.2 GB.
const MAX_LIGHT_IMAGE_BYTES: u64 = 256 << 20;

/// Slots of a window that fit the uniforms of a pass: every device allows 16 KiB.
const MAX_SLOTS: usize = (16 << 10) / (2 * QUAD * size_of::<f32>());

/// A device's limits on textures.
#[derive(Clone, Copy, Debug)]
pub struct TextureLimits {
    /// Width and height, at most.
    pub max_side: u32,
    /// Layers of an array, at most.
    pub max_layers: u32,
}

/// Extent of a texture array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayExtent {
    /// Width and height of a layer.
    pub extent: Extent,
    /// Number of layers.
    pub layers: u32,
}

/// Where the values of one transport lie in textures.
#[derive(Clone, Copy, Debug)]
pub struct TextureLayout {
    geometry: Geometry,
    /// Quads of components; 0 if no tile is factored.
    quads: u32,
    codes: ArrayExtent,
}

/// A photograph that exceeds a device's limits.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum LayoutError {
    /// A grid is larger than a texture.
    #[error(
        "the {grid} is {extent}, more than the graphics device's limit of {limit} along a side"
    )]
    GridTooLarge {
        /// Name of the grid.
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
    TooManyLayers {
        /// Layers needed.
        need: u32,
        /// Layers allowed.
        limit: u32,
    },
    /// The basis response would take too much memory, and time.
    #[error(
        "the basis response needs {need} bytes of graphics memory, more than the limit of {limit}"
    )]
    ResponseTooLarge {
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The window has more slots than fit the uniforms.
    #[error(
        "the window of side {side} has more than the {limit} slots that a graphics device correlates"
    )]
    WindowTooLarge {
        /// The window's side.
        side: u32,
        /// Slots allowed.
        limit: usize,
    },
    /// The transport functions are larger than a texture array.
    #[error(
        "the light transport has {need} values a channel, more than the {limit} the graphics device can hold"
    )]
    TooManyCodes {
        /// Texels needed.
        need: u64,
        /// Texels allowed.
        limit: u64,
    },
}

impl TextureLayout {
    /// Lays out a transport for a device.
    ///
    /// # Errors
    /// [`LayoutError`] if the transport exceeds the device's limits.
    pub fn new(transport: &Transport, limits: TextureLimits) -> Result<Self, LayoutError> {
        let geometry = transport.geometry;
        let tiles = &transport.tiles;
        let is_factored = tiles.iter().any(|tile| !tile.coefficients.is_dark());
        let quads = match is_factored {
            true => transport.basis.rank().div_ceil(QUAD) as u32,
            false => 0,
        };
        let response = response_extent(&geometry);
        let light = match is_factored {
            true => ("light plane with its border", response),
            false => ("light plane", geometry.light),
        };
        for (grid, extent) in [("camera grid", geometry.camera), light] {
            let limit = limits.max_side;
            if extent.width.max(extent.height) > limit {
                return Err(LayoutError::GridTooLarge {
                    grid,
                    extent,
                    limit,
                });
            }
        }
        let (need, limit) = (
            CHANNELS as u32 * quads.next_multiple_of(2),
            limits.max_layers,
        );
        if need > limit {
            return Err(LayoutError::TooManyLayers { need, limit });
        }
        let need = response.area() as u64 * u64::from(need) * size_of::<[f32; 4]>() as u64;
        if need > MAX_RESPONSE_BYTES {
            let limit = MAX_RESPONSE_BYTES;
            return Err(LayoutError::ResponseTooLarge { need, limit });
        }
        if is_factored && geometry.window.area() > MAX_SLOTS {
            return Err(LayoutError::WindowTooLarge {
                side: geometry.window.side(),
                limit: MAX_SLOTS,
            });
        }
        let codes = tiles.iter().map(|tile| tile.functions.codes.len() as u64);
        let codes = fold(codes.sum(), limits)?;
        Ok(Self {
            geometry,
            quads,
            codes,
        })
    }

    /// Extent of the coefficients: one texel where no tile is factored.
    pub fn coefficients(&self) -> ArrayExtent {
        layered(self.geometry.camera, self.quads)
    }

    /// Extent of the basis response: one texel where no tile is factored.
    pub fn basis_response(&self) -> ArrayExtent {
        layered(response_extent(&self.geometry), 2 * self.quad_pairs())
    }

    /// Extent of the codes.
    pub fn codes(&self) -> ArrayExtent {
        self.codes
    }

    /// Extent of the origins.
    pub fn origins(&self) -> Extent {
        self.geometry.camera
    }

    /// Extent of the steps.
    pub fn steps(&self) -> Extent {
        let Extent { width, height } = self.geometry.tile_grid();
        Extent {
            width,
            height: 2 * height,
        }
    }

    /// Extent of the tiles.
    pub fn tiles(&self) -> Extent {
        self.geometry.tile_grid()
    }

    /// Extent of the light.
    pub fn light(&self) -> Extent {
        self.geometry.light
    }

    /// Pairs of quads of components.
    pub fn quad_pairs(&self) -> u32 {
        self.quads.div_ceil(2)
    }

    /// Pairs of quads that a quality uses.
    pub fn used_quad_pairs(&self, quality: f32) -> usize {
        self.used_quads(quality).div_ceil(2)
    }

    fn used_quads(&self, quality: f32) -> usize {
        used_count(self.quads as usize, quality)
    }

    /// Whether the device can downsample a light image: 4 bytes a pixel, and 16 for each mean along columns.
    pub fn is_light_image_allowed(&self, image: Extent, limits: TextureLimits) -> bool {
        let means = u64::from(image.height) * u64::from(self.geometry.light.width);
        let bytes = 4 * image.area() as u64 + 16 * means;
        image.width.max(image.height) <= limits.max_side && bytes <= MAX_LIGHT_IMAGE_BYTES
    }
}

/// Window origins with a part of their window on the light plane, and a border of one for all others.
fn response_extent(geometry: &Geometry) -> Extent {
    let Geometry { light, window, .. } = geometry;
    let span = |side: u32| side + window.side() + 1;
    Extent {
        width: span(light.width),
        height: span(light.height),
    }
}

/// Layers for each channel and quad, or a single texel where there are none.
fn layered(extent: Extent, quads: u32) -> ArrayExtent {
    let texel = Extent {
        width: 1,
        height: 1,
    };
    ArrayExtent {
        extent: if quads == 0 { texel } else { extent },
        layers: (CHANNELS as u32 * quads).max(1),
    }
}

/// The array that holds `need` texels in rows: as few layers as possible, each only as high as needed.
fn fold(need: u64, limits: TextureLimits) -> Result<ArrayExtent, LayoutError> {
    let side = u64::from(MAX_FOLD_SIDE.min(limits.max_side));
    // The shader counts texels in an i32.
    let limit = (side * side * u64::from(limits.max_layers)).min(i32::MAX as u64);
    if need > limit {
        return Err(LayoutError::TooManyCodes { need, limit });
    }
    let width = side.min(need).max(1);
    let rows = need.div_ceil(width).max(1);
    let layers = rows.div_ceil(side);
    Ok(ArrayExtent {
        extent: Extent {
            width: width as u32,
            height: rows.div_ceil(layers) as u32,
        },
        layers: layers as u32,
    })
}
