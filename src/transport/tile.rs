//! Tiles as 16-bit codes, the form in which the CPU and the GPU relight them.
//!
//! `τ_n = Σ_k c_nk v_k + d_n`: coefficients `c` over the basis of the transport, and direct functions `d`.

use super::float_tile::{Basis, FloatTile, TileTransportFunctions};
use super::geometry::{CHANNELS, Geometry, TileRect};

/// Four codes: a texel of an `rgba16sint` texture, and one SIMD load. They are signed, as a truncated sum of basis
/// functions has negative values, and clipping these would brighten the picture.
pub type TexelCodes = [i16; 4];

/// Components in one texel of coefficients: a quad.
pub const TEXEL_COMPONENTS: usize = 4;

/// Largest code of direct functions. With 12 bits the quantisation noise of a pixel whose function is not sparse (S =
/// 225, error step/√12 in each slot) is about 60 dB below the signal, less than the noise of any photograph.
const MAX_DIRECT_CODE: f32 = 4095.0;

/// One part of a tile as codes: `value = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct TileCodes {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// Value of one code, per channel: the largest value of the channel has the largest code.
    pub step: [f32; CHANNELS],
    /// Empty if all values are zero.
    pub codes: Vec<TexelCodes>,
}

impl TileCodes {
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
    pub(crate) fn of_coefficients(
        rect: TileRect,
        coefficients: &[[f32; CHANNELS]],
        rank: usize,
        mut codes: Vec<TexelCodes>,
    ) -> Self {
        let Some(step) = steps(coefficients, i16::MAX.into()).filter(|_| rank > 0) else {
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

    /// Rounds direct functions, `[pixel, slot]`, to codes. Values that are not finite become zero. `codes` is empty.
    pub(crate) fn of_functions(
        rect: TileRect,
        functions: &[[f32; CHANNELS]],
        mut codes: Vec<TexelCodes>,
    ) -> Self {
        let Some(step) = steps(functions, MAX_DIRECT_CODE) else {
            return Self::dark(rect);
        };
        let [r, g, b] = step;
        let texel = |t: &[f32; CHANNELS]| [code(t[0], r), code(t[1], g), code(t[2], b), 0];
        codes.extend(functions.iter().map(texel));
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

/// For each channel the step by which its largest value has the code `max_code`; `None` if all are dark.
fn steps(values: &[[f32; CHANNELS]], max_code: f32) -> Option<[f32; CHANNELS]> {
    let mut peak = [0.0f32; CHANNELS];
    for value in values {
        for c in 0..CHANNELS {
            if value[c].is_finite() {
                peak[c] = peak[c].max(value[c].abs());
            }
        }
    }
    // A channel whose step would be subnormal is dark.
    let is_lit = |step: &f32| *step >= f32::MIN_POSITIVE;
    let steps = peak.map(|peak| peak / max_code);
    let any_lit = steps.iter().any(is_lit);
    any_lit.then(|| steps.map(|step| if is_lit(&step) { step } else { 1.0 }))
}

/// The code nearest to a value; 0 for a value that is not finite.
fn code(value: f32, step: f32) -> i16 {
    match value.is_finite() {
        true => (value / step + 0.5f32.copysign(value)) as i16, // rounds; `as` saturates
        false => 0,
    }
}

/// A tile as codes: `τ_n = Σ_k c_nk v_k + d_n`. Either part may be dark.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// `c_nk` as `[channel, quad, pixel]`: texels with the codes of [`TEXEL_COMPONENTS`] components, zero beyond the
    /// last, in planes of [`plane`](Self::plane) texels with pixels row by row. All components share a step: each
    /// contributes to the brightness of a pixel in proportion to its coefficient, so equal errors of weak and strong
    /// components are equally visible.
    pub coefficients: TileCodes,
    /// `d_n` as `[pixel, slot]`, both row by row.
    pub functions: TileCodes,
}

impl Tile {
    /// Rounds a tile over a basis of `rank` functions to codes.
    pub fn quantise(tile: &FloatTile, rank: usize) -> Self {
        let codes = vec![[0; 4]; Self::texels(tile.rect, rank)];
        Self {
            coefficients: TileCodes::of_coefficients(tile.rect, &tile.coefficients, rank, codes),
            functions: TileCodes::of_functions(tile.rect, &tile.functions, Vec::new()),
        }
    }

    /// A tile that is dark under every light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            coefficients: TileCodes::dark(rect),
            functions: TileCodes::dark(rect),
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
        let TileCodes { rect, step, codes } = &self.coefficients;
        let (plane, quads) = (Self::plane(*rect), rank.div_ceil(TEXEL_COMPONENTS));
        std::array::from_fn(|c| {
            let texel = codes.get((c * quads + k / TEXEL_COMPONENTS) * plane + p);
            texel.map_or(0.0, |texel| {
                f32::from(texel[k % TEXEL_COMPONENTS]) * step[c]
            })
        })
    }

    /// Direct value of slot `s` of pixel `p` of the tile, for windows of `area` slots.
    pub fn tau(&self, area: usize, p: usize, s: usize) -> [f32; CHANNELS] {
        let TileCodes { step, codes, .. } = &self.functions;
        let code = codes.get(p * area + s).unwrap_or(&[0; 4]);
        std::array::from_fn(|c| f32::from(code[c]) * step[c])
    }

    /// The tile's values.
    pub fn dequantise(&self, geometry: &Geometry, basis: &Basis) -> FloatTile {
        let (rank, area) = (basis.rank(), geometry.window.area());
        let (pixels, mut tile) = (self.rect().extent.area(), FloatTile::dark(self.rect()));
        if !self.coefficients.is_dark() {
            let coefficient = |i: usize| self.coefficient(rank, i / rank, i % rank);
            tile.coefficients = (0..pixels * rank).map(coefficient).collect();
        }
        if !self.functions.is_dark() {
            let tau = |i: usize| self.tau(area, i / area, i % area);
            tile.functions = (0..pixels * area).map(tau).collect();
        }
        tile
    }

    /// The light transport functions.
    pub fn functions(&self, geometry: &Geometry, basis: &Basis) -> TileTransportFunctions {
        self.dequantise(geometry, basis)
            .functions(geometry, Some(basis))
    }

    /// Size of the codes in bytes.
    pub fn bytes(&self) -> usize {
        (self.coefficients.codes.len() + self.functions.codes.len()) * size_of::<TexelCodes>()
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
