//! Tiles as 16-bit codes, the form in which the CPU and the GPU relight them.
//!
//! `τ_n = Σ_k c_nk v_k + d_n`: coefficients `c` over the basis of the transport, and direct functions `d`.

use super::float_tile::{Basis, FloatTile, TileTransportFunctions};
use super::function_codes::FunctionCodes;
use super::geometry::{CHANNELS, Geometry, TileRect};
use super::quantisation::{ChannelPeaks, code};

/// Four codes: a texel of an `rgba16sint` texture, and one SIMD load. They are signed, as a truncated sum of basis
/// functions has negative values, and clipping these would brighten the picture.
pub type TexelCodes = [i16; 4];

/// Components in one texel of coefficients: a quad.
pub const TEXEL_COMPONENTS: usize = 4;

/// The coefficients of a tile as codes: `value = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientCodes {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// Value of one code, per channel: the largest value of the channel has the largest code.
    pub step: [f32; CHANNELS],
    /// `c_nk` as `[channel, quad, pixel]`: texels with the codes of [`TEXEL_COMPONENTS`] components, zero beyond the
    /// last, in planes of [`Tile::plane`] texels with pixels row by row. All components share a step: each contributes
    /// to the brightness of a pixel in proportion to its coefficient, so equal errors of weak and strong components are
    /// equally visible. Empty if all values are zero.
    pub codes: Vec<TexelCodes>,
}

impl CoefficientCodes {
    /// All values zero.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Rounds coefficients, `[pixel, component]`, to codes. Values that are not finite become zero. `codes` are
    /// [`Tile::texels`] zeros.
    pub(crate) fn quantise(
        rect: TileRect,
        coefficients: &[[f32; CHANNELS]],
        rank: usize,
        mut codes: Vec<TexelCodes>,
    ) -> Self {
        let peaks = ChannelPeaks::of(coefficients);
        let Some(step) = peaks.steps(i16::MAX.into()).filter(|_| rank > 0) else {
            return Self::dark(rect);
        };
        let (plane, quads) = (Tile::plane(rect), rank.div_ceil(TEXEL_COMPONENTS));
        for (p, coefficients) in coefficients.chunks_exact(rank).enumerate() {
            for (k, value) in coefficients.iter().enumerate() {
                for c in 0..CHANNELS {
                    let texel = (c * quads + k / TEXEL_COMPONENTS) * plane + p;
                    codes[texel][k % TEXEL_COMPONENTS] = code(value[c], step[c]);
                }
            }
        }
        Self { rect, step, codes }
    }

    /// The first `rank` components of coefficients over a basis of `all` functions, in `codes`: an empty vector with
    /// room for them.
    pub(crate) fn first_components(
        &self,
        all: usize,
        rank: usize,
        mut codes: Vec<TexelCodes>,
    ) -> Self {
        let (plane, quads) = (Tile::plane(self.rect), rank.div_ceil(TEXEL_COMPONENTS));
        let all_quads = all.div_ceil(TEXEL_COMPONENTS).max(1);
        for channel in self.codes.chunks_exact(all_quads * plane) {
            codes.extend_from_slice(&channel[..quads * plane]);
            let last = match rank % TEXEL_COMPONENTS {
                0 => codes.len(),
                _ => codes.len() - plane,
            };
            for texel in &mut codes[last..] {
                texel[rank % TEXEL_COMPONENTS..].fill(0);
            }
        }
        let (rect, step) = (self.rect, self.step);
        Self { rect, step, codes }
    }

    /// Whether all values are zero, and so not stored.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }
}

/// A tile as codes: `τ_n = Σ_k c_nk v_k + d_n`. Either part may be dark.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// `c_nk`.
    pub coefficients: CoefficientCodes,
    /// `d_n`.
    pub functions: FunctionCodes,
}

impl Tile {
    /// Rounds a tile over a basis of `rank` functions to codes.
    pub fn quantise(tile: &FloatTile, rank: usize) -> Self {
        let FloatTile {
            rect,
            coefficients,
            functions,
        } = tile;
        let codes = vec![[0; 4]; Self::texels(*rect, rank)];
        let area = functions.len() / rect.extent.area();
        Self {
            coefficients: CoefficientCodes::quantise(*rect, coefficients, rank, codes),
            functions: FunctionCodes::quantise(*rect, functions, area),
        }
    }

    /// A tile that is dark under every light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            coefficients: CoefficientCodes::dark(rect),
            functions: FunctionCodes::dark(rect),
        }
    }

    /// The pixels of the tile.
    pub fn rect(&self) -> TileRect {
        self.functions.rect
    }

    /// Whether both parts are dark.
    pub fn is_dark(&self) -> bool {
        self.coefficients.is_dark() && self.functions.is_dark()
    }

    /// Distance of two planes of coefficients in texels: the number of pixels, rounded up to whole cache lines, and one
    /// line more. Planes at a distance of a power of two would compete for the same lines of the cache.
    pub fn plane(rect: TileRect) -> usize {
        const LINE: usize = 64 / size_of::<TexelCodes>();
        rect.extent.area().next_multiple_of(LINE) + LINE
    }

    /// Number of texels of coefficients over a basis of `rank` functions.
    pub fn texels(rect: TileRect, rank: usize) -> usize {
        CHANNELS * rank.div_ceil(TEXEL_COMPONENTS) * Self::plane(rect)
    }

    /// Coefficient `k` of pixel `p` of the tile, for a basis of `rank` functions.
    pub fn coefficient(&self, rank: usize, p: usize, k: usize) -> [f32; CHANNELS] {
        let CoefficientCodes { rect, step, codes } = &self.coefficients;
        let (plane, quads) = (Self::plane(*rect), rank.div_ceil(TEXEL_COMPONENTS));
        std::array::from_fn(|c| {
            let texel = codes.get((c * quads + k / TEXEL_COMPONENTS) * plane + p);
            texel.map_or(0.0, |texel| {
                f32::from(texel[k % TEXEL_COMPONENTS]) * step[c]
            })
        })
    }

    /// The tile's values.
    pub fn dequantise(&self, geometry: &Geometry, basis: &Basis) -> FloatTile {
        let (rank, rect) = (basis.rank(), self.rect());
        let mut tile = FloatTile::dark(rect);
        if !self.coefficients.is_dark() {
            let coefficient = |i: usize| self.coefficient(rank, i / rank, i % rank);
            tile.coefficients = (0..rect.extent.area() * rank).map(coefficient).collect();
        }
        tile.functions = self.functions.values(geometry.window.area());
        tile
    }

    /// The light transport functions.
    pub fn functions(&self, geometry: &Geometry, basis: &Basis) -> TileTransportFunctions {
        self.dequantise(geometry, basis)
            .functions(geometry, Some(basis))
    }

    /// Size of the codes in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.coefficients.codes[..]) + self.functions.bytes()
    }
}

/// A whole light transport matrix, as codes.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    /// Grids, windows and tiles.
    pub geometry: Geometry,
    /// The basis of all coefficients.
    pub basis: Basis,
    /// One tile for each of [`Geometry::tiles`].
    pub tiles: Vec<Tile>,
}
