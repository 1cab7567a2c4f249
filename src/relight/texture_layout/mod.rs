//! A transport as the textures that both GPU backends sample and the WGSL in `shaders/` reads.
//!
//! | texture | format | texel |
//! |---|---|---|
//! | coefficients | `rgba16sint`, 2D array, camera grid | four components of one channel |
//! | basis response | `rgba32float`, 2D array, window origins | the response of four basis functions |
//! | codes | `rgba16sint`, 2D array | entries of direct functions, folded into rows and layers |
//! | origins | `rg16sint`, camera grid | window origin u, v |
//! | steps | `rgba32float`, tile grid twice | value of one code in R, G, B: of coefficients, then of τ |
//! | light | `rgba32float`, light plane | linear emission in R, G, B |
//! | functions | `rg32sint`, camera grid | index of a pixel's first entry, and one past its last |
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
use crate::transport::{CHANNELS, Extent, Geometry, TEXEL_COMPONENTS, Transport};

pub use texels::TextureRegion;
pub use uniforms::{BasisFunctionUniforms, FrameUniforms};

/// Largest width and height of the codes' texture: every WebGL2 and WebGPU implementation allows it.
const MAX_FOLD_SIDE: u32 = 2048;

/// Bytes of the basis response, at most: for a light plane of 1024² and 16 components it takes 0.2 GB.
const MAX_RESPONSE_BYTES: u64 = 256 << 20;

/// Bytes for downsampling a light image, at most: for 8K video it takes 0.2 GB.
const MAX_LIGHT_IMAGE_BYTES: u64 = 256 << 20;

/// Slots of a window that fit the uniforms of a pass: every device allows 16 KiB.
const MAX_SLOTS: usize = (16 << 10) / (2 * TEXEL_COMPONENTS * size_of::<f32>());

/// Number of a photograph's textures.
pub const TEXTURES: usize = 7;

/// Bindings of a photograph's textures, in the order of the table above.
#[allow(missing_docs)]
pub mod binding {
    pub const COEFFICIENTS: usize = 0;
    pub const BASIS_RESPONSE: usize = 1;
    pub const CODES: usize = 2;
    pub const ORIGINS: usize = 3;
    pub const STEPS: usize = 4;
    pub const LIGHT: usize = 5;
    pub const FUNCTIONS: usize = 6;
}

/// A device's limits on textures.
#[derive(Clone, Copy, Debug)]
pub struct TextureLimits {
    /// Width and height, at most.
    pub max_side: u32,
    /// Layers of an array, at most.
    pub max_layers: u32,
}

/// The format of a texture or canvas, by WebGPU's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the specification has them
pub enum TextureFormat {
    Rgba8Unorm,
    Bgra8Unorm,
    Rg16Sint,
    Rg32Sint,
    Rgba16Sint,
    Rgba32Float,
}

/// A texture to create.
#[derive(Clone, Debug)]
pub struct TextureDescriptor {
    /// The name in graphics debuggers.
    pub label: &'static str,
    /// The texels' format.
    pub format: TextureFormat,
    /// Width and height of a layer.
    pub extent: Extent,
    /// `Some` for an array: also one of a single layer is an array in the shader.
    pub layers: Option<u32>,
}

impl TextureDescriptor {
    /// A texture that is no array.
    pub fn flat(label: &'static str, format: TextureFormat, extent: Extent) -> Self {
        Self {
            label,
            format,
            extent,
            layers: None,
        }
    }
}

/// Where the values of one transport lie in textures.
#[derive(Clone, Debug)]
pub struct TextureLayout {
    geometry: Geometry,
    /// Quads of components; 0 if no tile is factored.
    quads: u32,
    /// The photograph's textures, by binding.
    pub textures: [TextureDescriptor; TEXTURES],
}

/// A photograph that exceeds a device's limits.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("the photograph needs {need} {quantity}, more than the graphics device's limit of {limit}")]
pub struct TextureLayoutError {
    quantity: &'static str,
    need: u64,
    limit: u64,
}

impl TextureLayout {
    /// Lays out a transport for a device.
    ///
    /// # Errors
    /// [`TextureLayoutError`] if the transport exceeds the device's limits.
    pub fn new(transport: &Transport, limits: TextureLimits) -> Result<Self, TextureLayoutError> {
        use TextureFormat::{Rg16Sint, Rg32Sint, Rgba16Sint, Rgba32Float};
        let (geometry, tiles) = (&transport.geometry, &transport.tiles);
        let Geometry { camera, light, .. } = *geometry;
        let is_factored = tiles.iter().any(|tile| !tile.coefficients.is_dark());
        let quads = match is_factored {
            true => transport.basis.rank().div_ceil(TEXEL_COMPONENTS) as u32,
            false => 0,
        };
        let [layers, response_layers] =
            [quads, quads.next_multiple_of(2)].map(|quads| CHANNELS as u32 * quads);
        // Window origins with a part of their window on the light plane, and a border of one for all others.
        let response = Extent::new(
            light.width + geometry.window.side() + 1,
            light.height + geometry.window.side() + 1,
        );
        let max_side = u64::from(limits.max_side);
        let side = |extent: Extent| u64::from(extent.width.max(extent.height));
        let light_side = side(if is_factored { response } else { light });
        check_limit("columns or rows of camera pixels", side(camera), max_side)?;
        // Window origins have 16 bits.
        let max_light_side = max_side.min(i16::MAX as u64);
        check_limit(
            "columns or rows of light elements",
            light_side,
            max_light_side,
        )?;
        let max_layers = u64::from(limits.max_layers);
        check_limit("layers of components", response_layers.into(), max_layers)?;
        let bytes = response.area() as u64 * u64::from(response_layers) * 16;
        check_limit("bytes for the basis response", bytes, MAX_RESPONSE_BYTES)?;
        if is_factored {
            let slots = geometry.window.area() as u64;
            check_limit("slots in a window", slots, MAX_SLOTS as u64)?;
        }
        let entries = tiles.iter().map(|tile| tile.functions.entries.len() as u64);
        let entries = entries.sum();
        let (fold, fold_layers) = fold(entries, limits)?;
        // A single texel of zeros stands for no functions.
        let functions = if entries == 0 { TEXEL } else { camera };

        let flat = TextureDescriptor::flat;
        // A single texel where there are no layers.
        let array = |label, format, extent, layers: u32| TextureDescriptor {
            layers: Some(layers.max(1)),
            ..flat(label, format, if layers == 0 { TEXEL } else { extent })
        };
        let grid = geometry.tile_grid();
        let (width, height) = (grid.width, 2 * grid.height);
        Ok(Self {
            geometry: geometry.clone(),
            quads,
            textures: [
                array("coefficients", Rgba16Sint, camera, layers),
                array("basis response", Rgba32Float, response, response_layers),
                array("codes", Rgba16Sint, fold, fold_layers),
                flat("origins", Rg16Sint, camera),
                flat("steps", Rgba32Float, Extent { width, height }),
                flat("light", Rgba32Float, light),
                flat("functions", Rg32Sint, functions),
            ],
        })
    }

    /// Pairs of quads of components.
    pub fn quad_pairs(&self) -> u32 {
        self.quads.div_ceil(2)
    }

    /// Pairs of quads that a quality uses.
    pub fn used_quad_pairs(&self, quality: f32) -> usize {
        self.used_quads(quality).div_ceil(2)
    }

    /// The passes that compute the basis response of `channels` at a quality: the channel, the pair of quads, and the
    /// pair of layers that the pass fills.
    pub fn correlation_passes(
        &self,
        channels: &[usize],
        quality: f32,
    ) -> impl Iterator<Item = [usize; 3]> {
        let (used, pairs) = (self.used_quad_pairs(quality), self.quad_pairs() as usize);
        let passes = channels.iter().enumerate();
        passes.flat_map(move |(n, &channel)| (0..used).map(move |i| [channel, i, n * pairs + i]))
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

const TEXEL: Extent = Extent::new(1, 1);

fn check_limit(quantity: &'static str, need: u64, limit: u64) -> Result<(), TextureLayoutError> {
    match need <= limit {
        true => Ok(()),
        false => Err(TextureLayoutError {
            quantity,
            need,
            limit,
        }),
    }
}

/// Extent and layers of the array that holds `need` texels in rows: as few and as low layers as possible.
fn fold(need: u64, limits: TextureLimits) -> Result<(Extent, u32), TextureLayoutError> {
    let side = u64::from(MAX_FOLD_SIDE.min(limits.max_side));
    // The shader counts texels in an i32.
    let limit = (side * side * u64::from(limits.max_layers)).min(i32::MAX as u64);
    check_limit("direct transport values", need, limit)?;
    let width = side.min(need).max(1);
    let rows = need.div_ceil(width).max(1);
    let layers = rows.div_ceil(side);
    let extent = Extent::new(width as u32, rows.div_ceil(layers) as u32);
    Ok((extent, layers as u32))
}
