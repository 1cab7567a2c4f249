//! Tiles as 16-bit codes, the form in which the CPU and the GPU relight them.
//!
//! `τ_n = Σ_k c_nk v_k + d_n`: coefficients `c` ([`CoefficientTile`]) over the basis of the transport, and direct
//! functions `d` ([`DirectTile`]). Each channel of a tile has one quantisation step.

use super::factored::{BandTile, Basis, FactoredTile};
use super::functions::TransportFunctions;
use super::geometry::{CHANNELS, Geometry, TileRect};

/// Four codes: a texel of an `rgba16sint` texture, and one SIMD load. They are signed, as a truncated sum of basis
/// functions has negative values, and clipping these would brighten the picture.
pub type TexelCode = [i16; 4];

/// Components in one texel of coefficients: a quad.
pub const QUAD: usize = 4;

/// Largest code of a direct tile. With 12 bits the quantisation noise of a pixel whose function is not sparse (S = 225,
/// error step/√12 in each slot) is about 60 dB below the signal, less than the noise of any photograph.
const MAX_DIRECT_CODE: f32 = 4095.0;

/// A tile with the value of every slot of every pixel: `d = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectTile {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// `[pixel, slot]`, both row by row; empty if all are zero.
    pub codes: Vec<TexelCode>,
}

impl DirectTile {
    /// Rounds functions, `[pixel, slot, channel]`, to codes. The largest value of each channel sets its step; values
    /// that are not finite become zero.
    pub fn quantise(rect: TileRect, functions: &[[f32; CHANNELS]]) -> Self {
        Self::quantise_into(rect, functions, Vec::new())
    }

    /// [`quantise`](Self::quantise) into the memory of an empty vector.
    pub(crate) fn quantise_into(
        rect: TileRect,
        functions: &[[f32; CHANNELS]],
        mut codes: Vec<TexelCode>,
    ) -> Self {
        let Some(step) = steps(functions, MAX_DIRECT_CODE) else {
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

    /// A tile that is dark under every light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Whether all values are zero, and so not stored.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }

    /// Value of slot `s` of pixel `p` of the tile, for windows of `area` slots.
    pub fn tau(&self, area: usize, p: usize, s: usize) -> [f32; CHANNELS] {
        let code = self.codes.get(p * area + s).unwrap_or(&[0; 4]);
        std::array::from_fn(|c| f32::from(code[c]) * self.step[c])
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

/// A tile as coefficients over the basis of the transport: `c = code · step`.
///
/// All components share a step: each contributes to the brightness of a pixel in proportion to its coefficient, so
/// equal errors of weak and strong components are equally visible.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientTile {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// `[channel, quad, pixel]`: texels with the codes of [`QUAD`] components, zero beyond the last, in planes of
    /// [`plane`](Self::plane) texels with pixels row by row. Empty if all are zero.
    pub codes: Vec<TexelCode>,
}

impl CoefficientTile {
    /// Rounds coefficients, `[pixel, component, channel]`, to codes. Non-finite ones become zero.
    pub fn quantise(rect: TileRect, coefficients: &[[f32; CHANNELS]], rank: usize) -> Self {
        let codes = vec![[0; 4]; Self::texels(rect, rank)];
        Self::quantise_into(rect, coefficients, rank, codes)
    }

    /// [`quantise`](Self::quantise) into a vector of [`texels`](Self::texels) zeros.
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
        for (p, coefficients) in coefficients.chunks_exact(rank).enumerate() {
            for (k, value) in coefficients.iter().enumerate() {
                for c in 0..CHANNELS {
                    let texel = (c * quads + k / QUAD) * plane + p;
                    codes[texel][k % QUAD] = code(value[c], step[c]);
                }
            }
        }
        Self { rect, step, codes }
    }

    /// A tile with all coefficients zero.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Whether all coefficients are zero, and so not stored.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }

    /// Distance of two planes in texels: the number of pixels, rounded up to whole cache lines, and one line more.
    /// Planes at a distance of a power of two would compete for the same lines of the cache.
    pub fn plane(rect: TileRect) -> usize {
        const LINE: usize = 64 / size_of::<TexelCode>();
        rect.extent.area().next_multiple_of(LINE) + LINE
    }

    /// Number of texels of a tile over a basis of `rank` functions.
    pub fn texels(rect: TileRect, rank: usize) -> usize {
        CHANNELS * rank.div_ceil(QUAD) * Self::plane(rect)
    }

    /// The first `rank` components of this tile over a basis of `all` functions, in `codes`: an empty vector
    /// with room for them.
    pub(crate) fn first_components(
        &self,
        all: usize,
        rank: usize,
        mut codes: Vec<TexelCode>,
    ) -> Self {
        let (plane, quads) = (Self::plane(self.rect), rank.div_ceil(QUAD));
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

    /// Coefficient `k` of pixel `p` of the tile, for a basis of `rank` functions.
    pub fn coefficient(&self, rank: usize, p: usize, k: usize) -> [f32; CHANNELS] {
        let (plane, quads) = (Self::plane(self.rect), rank.div_ceil(QUAD));
        std::array::from_fn(|c| {
            let texel = self.codes.get((c * quads + k / QUAD) * plane + p);
            texel.map_or(0.0, |texel| f32::from(texel[k % QUAD]) * self.step[c])
        })
    }
}

/// A tile as codes: `τ_n = Σ_k c_nk v_k + d_n`. Either part may be dark.
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

    /// A tile that is dark under every light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            coefficients: CoefficientTile::dark(rect),
            functions: DirectTile::dark(rect),
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

    /// Size of the codes in bytes.
    pub fn bytes(&self) -> usize {
        (self.coefficients.codes.len() + self.functions.codes.len()) * size_of::<TexelCode>()
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
