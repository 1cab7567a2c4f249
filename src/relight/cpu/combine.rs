//! Factored pixels from the basis response: `y_n = Σ_k c_nk C_k(o_n)`, in each channel.

use super::simd::{MAX_PIXELS, ScalarFallback, Simd};
use crate::relight::LightChroma;
use crate::transport::{CHANNELS, CoefficientCodes, TEXEL_COMPONENTS, TexelCodes, Tile};

/// The basis response of an origin block, `C`.
#[derive(Clone, Copy, Debug)]
pub struct OriginBlockResponse<'a> {
    /// `[origin, channel, quad]`; one channel where the light has a uniform chroma.
    pub texels: &'a [[f32; TEXEL_COMPONENTS]],
    /// Quads of components of each origin and channel: the tiles' first ones.
    pub quads: usize,
    pub chroma: LightChroma,
}

/// Writes the pixels of a tile from number `first` on. `offsets` has the origin of each, as an index in the block.
#[inline(always)]
pub fn combine<S: Simd>(
    simd: S,
    tile: &CoefficientCodes,
    first: usize,
    offsets: &[u16],
    response: OriginBlockResponse<'_>,
    out: &mut [[f32; CHANNELS]],
) {
    match response.chroma {
        LightChroma::Uniform { factors, .. } => {
            let mut gain = tile.step;
            for c in 0..CHANNELS {
                gain[c] *= factors[c];
            }
            combine_span::<S, 1>(simd, tile, first, offsets, response, gain, out);
        }
        LightChroma::Varying => {
            combine_span::<S, CHANNELS>(simd, tile, first, offsets, response, tile.step, out);
        }
    }
}

#[inline(always)]
fn combine_span<S: Simd, const LIGHT_CHANNELS: usize>(
    simd: S,
    tile: &CoefficientCodes,
    first: usize,
    offsets: &[u16],
    OriginBlockResponse { texels, quads, .. }: OriginBlockResponse<'_>,
    gain: [f32; CHANNELS],
    out: &mut [[f32; CHANNELS]],
) {
    // Bounds are checked once for all pixels, not in the inner loop.
    let pixels = offsets.len();
    // Not `assert_eq`, whose formatting code modules would have to carry.
    assert!(out.len() == pixels, "as many pixels as offsets");
    let Some(largest) = offsets.iter().copied().max() else {
        return;
    };
    assert!((usize::from(largest) + 1) * LIGHT_CHANNELS * quads <= texels.len());
    let quad_stride = Tile::plane(tile.rect);
    let channel_stride = tile.codes.len() / CHANNELS;
    let last_quad = (CHANNELS - 1) * channel_stride + quads.saturating_sub(1) * quad_stride;
    assert!(last_quad + first + pixels <= tile.codes.len());
    let span = CombineOperands {
        texels: texels.as_ptr(),
        quads,
        offsets,
        codes: tile.codes[first..].as_ptr(),
        quad_stride,
        channel_stride,
        gain,
        out: out.as_mut_ptr(),
    };
    let mut done = 0;
    // SAFETY: all offsets lie within the response and all pixels within the tile, as was just asserted.
    unsafe {
        while done + S::PIXELS <= pixels {
            span.combine::<S, LIGHT_CHANNELS>(simd, done);
            done += S::PIXELS;
        }
        if done < pixels && pixels >= S::PIXELS {
            // The last vector overlaps the one before: some pixels are computed twice.
            span.combine::<S, LIGHT_CHANNELS>(simd, pixels - S::PIXELS);
            done = pixels;
        }
        while done < pixels {
            span.combine::<ScalarFallback, LIGHT_CHANNELS>(ScalarFallback, done);
            done += 1;
        }
    }
}

/// Input and output of the inner loop, for pixels side by side.
struct CombineOperands<'a> {
    /// `[origin, channel, quad]`.
    texels: *const [f32; TEXEL_COMPONENTS],
    quads: usize,
    /// Each pixel's origin.
    offsets: &'a [u16],
    /// `[channel, quad, pixel]`.
    codes: *const TexelCodes,
    quad_stride: usize,
    channel_stride: usize,
    gain: [f32; CHANNELS],
    out: *mut [f32; CHANNELS],
}

impl CombineOperands<'_> {
    /// Combines `S::PIXELS` pixels from number `first` of the span on.
    ///
    /// # Safety
    /// The span has so many pixels, codes for each, and texels of `LIGHT_CHANNELS` channels at their origins.
    #[inline(always)]
    unsafe fn combine<S: Simd, const LIGHT_CHANNELS: usize>(&self, simd: S, first: usize) {
        const { assert!(S::PIXELS <= MAX_PIXELS) };
        // Loops, no closures: the compiler would not use the instruction set for these.
        let mut origins = [[self.texels; MAX_PIXELS]; LIGHT_CHANNELS];
        for p in 0..S::PIXELS {
            // SAFETY: the caller vouches for the offset and its texels.
            unsafe {
                let offset = usize::from(*self.offsets.get_unchecked(first + p));
                let texels = self.texels.add(offset * LIGHT_CHANNELS * self.quads);
                for (c, origins) in origins.iter_mut().enumerate() {
                    origins[p] = texels.add(c * self.quads);
                }
            }
        }
        let mut sums = [simd.zero_texels(); CHANNELS];
        for q in 0..self.quads {
            let mut responses = [simd.zero_texels(); LIGHT_CHANNELS];
            for c in 0..LIGHT_CHANNELS {
                let mut texels = origins[c];
                for texel in &mut texels {
                    // Pointers past `S::PIXELS` are not read.
                    *texel = texel.wrapping_add(q);
                }
                // SAFETY: the caller vouches for the texels.
                responses[c] = unsafe { simd.load_texels(texels) };
            }
            for (c, sum) in sums.iter_mut().enumerate() {
                let response = responses[if LIGHT_CHANNELS == 1 { 0 } else { c }];
                let at = c * self.channel_stride + q * self.quad_stride + first;
                // SAFETY: the caller vouches for the codes.
                let codes = unsafe { simd.load_codes(self.codes.add(at)) };
                *sum = *sum + codes * response;
            }
        }
        // SAFETY: the caller vouches for the pixels.
        unsafe { simd.store_sums(sums, self.gain, self.out.add(first)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::simd::{SimdKernel, SimdLevel};
    use crate::transport::{Extent, FloatTile, TileRect};

    struct CombineKernel<'a> {
        tile: &'a CoefficientCodes,
        first: usize,
        offsets: &'a [u16],
        response: OriginBlockResponse<'a>,
        out: &'a mut [[f32; CHANNELS]],
    }

    impl SimdKernel for CombineKernel<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            combine(
                simd,
                self.tile,
                self.first,
                self.offsets,
                self.response,
                self.out,
            );
        }
    }

    #[test]
    fn pixels_match_the_sums_and_all_simd_levels_agree_to_the_bit() {
        let extent = Extent::new(9, 3);
        let rect = TileRect { x: 0, y: 0, extent };
        let test_value = |i: usize| ((i * 7919) % 1009) as f32 / 504.0 - 1.0;
        for (rank, chroma) in [
            (1usize, LightChroma::Varying),
            (9, LightChroma::Varying),
            (
                16,
                LightChroma::Uniform {
                    base: 1,
                    factors: [0.5, 1.0, 0.25],
                },
            ),
        ] {
            let quads = rank.div_ceil(TEXEL_COMPONENTS);
            let values: Vec<_> = (0..27 * rank)
                .map(|i| [0, 1, 2].map(|c| test_value(3 * i + c)))
                .collect();
            let tile = FloatTile {
                coefficients: values,
                ..FloatTile::dark(rect)
            };
            let tile = Tile::quantise(&tile, rank);
            let texels: Vec<_> = (0..20 * 3 * quads)
                .map(|i| [0, 1, 2, 3].map(|l| test_value(4 * i + l + 5)))
                .collect();
            for used in 1..=quads {
                for (first, count) in [(0, 27), (3, 8), (26, 1), (5, 0), (1, 13), (0, 2), (4, 3)] {
                    let offsets: Vec<u16> = (0..count).map(|i| (i * 5 / 2 % 20) as u16).collect();
                    let response = OriginBlockResponse {
                        texels: &texels[..20 * used * chroma.channels().len()],
                        quads: used,
                        chroma,
                    };
                    let combine_by = |level: SimdLevel| {
                        // The pixels on either side must stay as they are.
                        let mut out = vec![[7.0; CHANNELS]; count + 2];
                        level.run(CombineKernel {
                            tile: &tile.coefficients,
                            first,
                            offsets: &offsets,
                            response,
                            out: &mut out[1..=count],
                        });
                        assert_eq!([out[0], out[count + 1]], [[7.0; CHANNELS]; 2]);
                        out[1..=count].to_vec()
                    };
                    let scalar = combine_by(SimdLevel::ScalarFallback(ScalarFallback));
                    for level in SimdLevel::available() {
                        assert_eq!(scalar, combine_by(level), "{level:?}");
                    }
                    for (i, got) in scalar.iter().enumerate() {
                        for c in 0..CHANNELS {
                            let (channels, channel, gain) = match chroma {
                                LightChroma::Uniform { factors, .. } => (1, 0, factors[c]),
                                LightChroma::Varying => (3, c, 1.0),
                            };
                            let at = (usize::from(offsets[i]) * channels + channel) * used;
                            let products = (0..rank.min(TEXEL_COMPONENTS * used)).map(|k| {
                                let coefficient = tile.coefficient(rank, first + i, k)[c];
                                f64::from(
                                    coefficient
                                        * texels[at + k / TEXEL_COMPONENTS][k % TEXEL_COMPONENTS],
                                )
                            });
                            let want = products.sum::<f64>() * f64::from(gain);
                            assert!((f64::from(got[c]) - want).abs() < 1e-4, "{got:?}: {want}");
                        }
                    }
                }
            }
        }
    }
}
