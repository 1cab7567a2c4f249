//! Tiles as relighting wants them, in memory and on the GPU: 16-bit codes.

use super::{BandTile, Basis, FactoredTile, Geometry, TileRect, TransportFunctions};

/// Camera channels: red, green, blue.
pub const CHANNELS: usize = 3;

/// Four codes: a texel of an `rgba16sint` texture, and one SIMD load. Signed: light transport has no
/// negative elements, but a truncated sum of basis functions has, and to clip them would brighten the
/// picture.
pub type TexelCode = [i16; 4];

/// Components in one texel of coefficients.
pub const QUAD: usize = 4;

/// Largest code written. 12 bits put the quantisation noise of an unsparse pixel (S = 225, all
/// elements off by step/√12) some 60 dB below it, under what any photograph can tell; 16 would
/// store noise.
const TOP_CODE: f32 = 4095.0;

/// A tile that keeps every element of every pixel's window: `τ = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectTile {
    /// The pixels covered.
    pub rect: TileRect,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// `[pixel, element]`, pixels row by row, window rows (v) then columns (u); empty for a tile
    /// that is all dark.
    pub codes: Vec<TexelCode>,
}

impl DirectTile {
    /// Rounds functions, `[pixel, element, channel]`, to codes, with a step per channel set by the tile's largest element.
    /// Non-finite values, which no light transport function has, become zero.
    pub fn quantise(rect: TileRect, functions: &[[f32; CHANNELS]]) -> Self {
        Self::quantise_into(rect, functions, Vec::new())
    }

    /// [`quantise`](Self::quantise) into memory the caller has: a vector that is empty.
    pub(crate) fn quantise_into(
        rect: TileRect,
        functions: &[[f32; CHANNELS]],
        mut codes: Vec<TexelCode>,
    ) -> Self {
        let Some(step) = steps(functions, TOP_CODE) else {
            return Self::dark(rect);
        };
        let codes_of = |t: &[f32; CHANNELS]| {
            [
                code(t[0], step[0]),
                code(t[1], step[1]),
                code(t[2], step[2]),
                0,
            ]
        };
        codes.extend(functions.iter().map(codes_of));
        Self { rect, step, codes }
    }

    /// A tile from which no light comes, whatever the light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Whether the tile is all dark and so holds no codes.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }

    /// τ of element `s` of pixel `p` (both in tile order), given the window's area.
    pub fn tau(&self, area: usize, p: usize, s: usize) -> [f32; CHANNELS] {
        let code = self.codes.get(p * area + s).unwrap_or(&[0; 4]);
        std::array::from_fn(|c| f32::from(code[c]) * self.step[c])
    }
}

/// Steps by which the largest value of each channel is `top` codes; none if all are dark.
fn steps(values: &[[f32; CHANNELS]], top: f32) -> Option<[f32; CHANNELS]> {
    let mut peak = [0.0f32; CHANNELS];
    for value in values {
        for c in 0..CHANNELS {
            if value[c].is_finite() {
                peak[c] = peak[c].max(value[c].abs());
            }
        }
    }
    // A step below this would not be a normal number; so dim a channel is dark.
    let lit = |step: &f32| *step >= f32::MIN_POSITIVE;
    let step = peak.map(|peak| peak / top);
    let some = step.iter().any(lit);
    some.then(|| step.map(|step| if lit(&step) { step } else { 1.0 }))
}

/// The code next to a value; of what is no number, 0.
fn code(value: f32, step: f32) -> i16 {
    match value.is_finite() {
        true => (value / step + 0.5f32.copysign(value)) as i16, // rounds; `as` saturates
        false => 0,
    }
}

/// A tile kept as coefficients over the transport's basis: `c = code · step`.
///
/// All components share a step. The pixels' brightness is what an eye compares, and to that each
/// contributes in proportion to its coefficient: a code of a weak component is worth no more than one
/// of a strong one.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientTile {
    /// The pixels covered.
    pub rect: TileRect,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// `[channel, quad, pixel]`, each the codes of [`QUAD`] components, zero beyond the last; planes
    /// of [`plane`](Self::plane) texels, pixels row by row. Empty for a tile without coefficients.
    pub codes: Vec<TexelCode>,
}

impl CoefficientTile {
    /// Rounds coefficients, `[pixel, component, channel]`, to codes. Non-finite ones become zero.
    pub fn quantise(rect: TileRect, coefficients: &[[f32; CHANNELS]], rank: usize) -> Self {
        let codes = vec![[0; 4]; Self::texels(rect, rank)];
        Self::quantise_into(rect, coefficients, rank, codes)
    }

    /// [`quantise`](Self::quantise) into memory the caller has: as many zeros as there are
    /// [`texels`](Self::texels).
    pub(crate) fn quantise_into(
        rect: TileRect,
        coefficients: &[[f32; CHANNELS]],
        rank: usize,
        mut codes: Vec<TexelCode>,
    ) -> Self {
        let Some(step) = steps(coefficients, i16::MAX.into()).filter(|_| rank > 0) else {
            return Self::dark(rect);
        };
        let (plane, quads) = (Self::plane(rect), rank.div_ceil(QUAD));
        for (p, of_pixel) in coefficients.chunks_exact(rank).enumerate() {
            for (k, value) in of_pixel.iter().enumerate() {
                for c in 0..CHANNELS {
                    let texel = (c * quads + k / QUAD) * plane + p;
                    codes[texel][k % QUAD] = code(value[c], step[c]);
                }
            }
        }
        Self { rect, step, codes }
    }

    /// A tile without coefficients.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Whether there are no coefficients.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }

    /// Texels from the beginning of one plane to that of the next. A cache line more than there are
    /// pixels: planes a power of two apart would all lie in the same lines of a cache.
    pub fn plane(rect: TileRect) -> usize {
        const LINE: usize = 64 / size_of::<TexelCode>();
        rect.extent.area().next_multiple_of(LINE) + LINE
    }

    /// Texels of a tile over a basis of `rank` functions.
    pub fn texels(rect: TileRect, rank: usize) -> usize {
        CHANNELS * rank.div_ceil(QUAD) * Self::plane(rect)
    }

    /// The first `rank` components of all that a tile over a basis of `all` functions has.
    pub(crate) fn first_components(&self, all: usize, rank: usize) -> Self {
        let (plane, quads) = (Self::plane(self.rect), rank.div_ceil(QUAD));
        let mut codes = Vec::with_capacity(self.codes.len().min(CHANNELS * quads * plane));
        for channel in self.codes.chunks_exact(all.div_ceil(QUAD).max(1) * plane) {
            codes.extend_from_slice(&channel[..quads * plane]);
            let last = match rank % QUAD {
                0 => codes.len(),
                _ => codes.len() - plane,
            };
            for texel in &mut codes[last..] {
                texel[rank % QUAD..].fill(0);
            }
        }
        Self {
            rect: self.rect,
            step: self.step,
            codes,
        }
    }

    /// Coefficient `k` of pixel `p` (in tile order), for a basis of `rank` functions.
    pub fn coefficient(&self, rank: usize, p: usize, k: usize) -> [f32; CHANNELS] {
        let (plane, quads) = (Self::plane(self.rect), rank.div_ceil(QUAD));
        std::array::from_fn(|c| {
            let texel = self.codes.get((c * quads + k / QUAD) * plane + p);
            texel.map_or(0.0, |texel| f32::from(texel[k % QUAD]) * self.step[c])
        })
    }
}

/// A tile in memory: `τ_n = Σ_k c_nk v_k + d_n`, either part of which may be dark.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// `c_nk`.
    pub coefficients: CoefficientTile,
    /// `d_n`.
    pub functions: DirectTile,
}

impl Tile {
    /// Rounds a tile over a basis of `rank` functions to codes.
    pub fn quantise(tile: &BandTile, rank: usize) -> Self {
        let functions = match tile.functions.is_empty() {
            true => DirectTile::dark(tile.rect),
            false => DirectTile::quantise(tile.rect, &tile.functions),
        };
        Self {
            coefficients: CoefficientTile::quantise(tile.rect, &tile.coefficients, rank),
            functions,
        }
    }

    /// A tile from which no light comes, whatever the light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            coefficients: CoefficientTile::dark(rect),
            functions: DirectTile::dark(rect),
        }
    }

    /// The pixels covered.
    pub fn rect(&self) -> TileRect {
        self.functions.rect
    }

    /// Whether neither part is there.
    pub fn is_dark(&self) -> bool {
        self.coefficients.is_dark() && self.functions.is_dark()
    }

    /// The light transport functions.
    pub fn functions(&self, geometry: &Geometry, basis: &Basis) -> TransportFunctions {
        let (rect, area) = (self.rect(), geometry.window.area());
        let mut functions = TransportFunctions::zeros(rect, area);
        if !self.functions.is_dark() {
            for (i, tau) in functions.tau.iter_mut().enumerate() {
                *tau = self.functions.tau(area, i / area, i % area);
            }
        }
        if !self.coefficients.is_dark() {
            let rank = basis.rank();
            let coefficient = |i: usize| self.coefficients.coefficient(rank, i / rank, i % rank);
            let tile = FactoredTile {
                rect,
                coefficients: (0..rect.extent.area() * rank).map(coefficient).collect(),
            };
            tile.expand_into(geometry, basis, &mut functions.tau);
        }
        functions
    }

    /// The tile by the first `rank` components of a basis of `all` functions.
    pub(crate) fn first_components(&self, all: usize, rank: usize) -> Self {
        Self {
            coefficients: self.coefficients.first_components(all, rank),
            functions: self.functions.clone(),
        }
    }

    /// Bytes of its codes.
    pub fn bytes(&self) -> usize {
        (self.coefficients.codes.len() + self.functions.codes.len()) * size_of::<TexelCode>()
    }
}

/// A whole transport in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    /// Grids, band and tiling.
    pub geometry: Geometry,
    /// What coefficients are over.
    pub basis: Basis,
    /// One tile for each of [`Geometry::tiles`].
    pub tiles: Vec<Tile>,
}
