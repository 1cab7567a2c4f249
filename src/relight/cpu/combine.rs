//! Pixels from what their windows see: `y_n = Σ_k c_nk C_k(o_n)`.

use super::lanes::{Pixels, Single, Vector};
use crate::relight::Tint;
use crate::transport::{CHANNELS, CoefficientTile, QUAD, TexelCode};

/// A square of the light, seen through the basis.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// `[origin, channel, quad]`; one channel where the light has one tint.
    pub texels: &'a [[f32; QUAD]],
    /// Texels of an origin and channel: those of a tile, or only the first of them.
    pub quads: usize,
    /// What the channels have in common.
    pub tint: Tint,
}

/// Writes pixels of a tile from `first` on, of which `places` has the origins' numbers.
#[inline(always)]
pub fn combine<V: Vector>(
    tile: &CoefficientTile,
    first: usize,
    places: &[u16],
    seen: Seen<'_>,
    out: &mut [[f32; CHANNELS]],
) {
    let plane = CoefficientTile::plane(tile.rect);
    let channel = tile.codes.len() / CHANNELS;
    let codes = Codes {
        codes: &tile.codes,
        plane,
        channel,
    };
    match seen.tint {
        Tint::One(_, factors) => {
            let gain = std::array::from_fn(|c| tile.step[c] * factors[c]);
            each::<V, 1>(codes, first, places, seen, gain, out);
        }
        Tint::Many => each::<V, CHANNELS>(codes, first, places, seen, tile.step, out),
    }
}

/// Of a tile, `[channel, quad, pixel]`.
#[derive(Clone, Copy)]
struct Codes<'a> {
    codes: &'a [TexelCode],
    /// From one quad to the next.
    plane: usize,
    /// From one channel to the next.
    channel: usize,
}

#[inline(always)]
fn each<V: Vector, const SEEN: usize>(
    codes: Codes<'_>,
    first: usize,
    places: &[u16],
    Seen { texels, quads, .. }: Seen<'_>,
    gain: [f32; CHANNELS],
    out: &mut [[f32; CHANNELS]],
) {
    // What pixels read, checked once and not for each.
    let pixels = places.len();
    assert_eq!(out.len(), pixels, "as many pixels as places");
    let Some(most) = places.iter().copied().max() else {
        return;
    };
    let texels_each = SEEN * quads;
    assert!((usize::from(most) + 1) * texels_each <= texels.len());
    let Codes { plane, channel, .. } = codes;
    let last = (CHANNELS - 1) * channel + quads.saturating_sub(1) * plane + first + pixels;
    assert!(last <= codes.codes.len());
    let whole = pixels - pixels % V::Pixels::COUNT;
    let (pairs, rest) = places.split_at(whole);
    let (out, out_rest) = out.split_at_mut(whole);
    let texels = texels.as_ptr();
    let from = codes.codes.as_ptr();
    let places = pairs.chunks_exact(V::Pixels::COUNT);
    let outs = out.chunks_exact_mut(V::Pixels::COUNT);
    for (i, (places, out)) in places.zip(outs).enumerate() {
        // SAFETY: all places are seen, and there is a code for each of the pixels, as was asserted.
        unsafe {
            let seen = [
                texels.add(usize::from(places[0]) * texels_each),
                texels.add(usize::from(places[V::Pixels::COUNT - 1]) * texels_each),
            ];
            let from = from.add(first + i * V::Pixels::COUNT);
            pixels_of::<V::Pixels, SEEN>(from, seen, quads, codes, gain, out.as_mut_ptr());
        }
    }
    for (i, (place, out)) in rest.iter().zip(out_rest).enumerate() {
        // SAFETY: as above.
        unsafe {
            let seen = [texels.add(usize::from(*place) * texels_each); 2];
            let from = from.add(first + whole + i);
            pixels_of::<Single, SEEN>(from, seen, quads, codes, gain, out);
        }
    }
}

/// One or two pixels.
///
/// # Safety
/// `from` points at codes of the pixels in the first of `quads` planes of each channel, `seen` at as
/// many texels of `SEEN` channels; there is room in `out`.
#[inline(always)]
unsafe fn pixels_of<P: Pixels, const SEEN: usize>(
    from: *const TexelCode,
    seen: [*const [f32; QUAD]; 2],
    quads: usize,
    Codes { plane, channel, .. }: Codes<'_>,
    gain: [f32; CHANNELS],
    out: *mut [f32; CHANNELS],
) {
    // Loops and no closures, which would not be compiled for the vectors' registers.
    let mut sums = [P::zero(); CHANNELS];
    for q in 0..quads {
        let mut texels = [P::zero(); SEEN];
        for (c, texels) in texels.iter_mut().enumerate() {
            let at = c * quads + q;
            // SAFETY: as above.
            *texels = unsafe { P::load([seen[0].add(at), seen[1].add(at)]) };
        }
        for (c, sum) in sums.iter_mut().enumerate() {
            let seen = texels[if SEEN == 1 { 0 } else { c }];
            // SAFETY: as above.
            *sum = unsafe { sum.plus_products(from.add(c * channel + q * plane), seen) };
        }
    }
    // SAFETY: as above.
    unsafe { P::store_sums(sums, gain, out) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::lanes::{Plain, Work, widest};
    use crate::transport::{Extent, TileRect};

    struct Combine<'a> {
        tile: &'a CoefficientTile,
        first: usize,
        places: &'a [u16],
        seen: Seen<'a>,
        out: &'a mut [[f32; CHANNELS]],
    }

    impl Work for Combine<'_> {
        #[inline(always)]
        fn run<V: Vector>(self) {
            combine::<V>(self.tile, self.first, self.places, self.seen, self.out);
        }
    }

    #[test]
    fn pixels_are_their_sums_and_the_same_bits_by_all_kinds_of_vectors() {
        let extent = Extent {
            width: 9,
            height: 3,
        };
        let rect = TileRect { x: 0, y: 0, extent };
        let number = |i: usize| ((i * 7919) % 1009) as f32 / 504.0 - 1.0;
        for (rank, tint) in [
            (1usize, Tint::Many),
            (9, Tint::Many),
            (16, Tint::One(1, [0.5, 1.0, 0.25])),
        ] {
            let quads = rank.div_ceil(QUAD);
            let values: Vec<_> = (0..27 * rank)
                .map(|i| [0, 1, 2].map(|c| number(3 * i + c)))
                .collect();
            let tile = CoefficientTile::quantise(rect, &values, rank);
            let texels: Vec<_> = (0..20 * 3 * quads)
                .map(|i| [0, 1, 2, 3].map(|l| number(4 * i + l + 5)))
                .collect();
            for used in 1..=quads {
                for (first, count) in [(0, 27), (3, 8), (26, 1), (5, 0), (1, 13)] {
                    let places: Vec<u16> = (0..count).map(|i| (i * 5 / 2 % 20) as u16).collect();
                    let seen = Seen {
                        texels: &texels[..20 * used * tint.channels().len()],
                        quads: used,
                        tint,
                    };
                    let combined = |by: &dyn Fn(Combine<'_>)| {
                        let mut out = vec![[7.0; CHANNELS]; count];
                        by(Combine {
                            tile: &tile,
                            first,
                            places: &places,
                            seen,
                            out: &mut out,
                        });
                        out
                    };
                    let plain = combined(&|work| work.run::<Plain>());
                    assert_eq!(plain, combined(&|work| widest(work)));
                    for (i, got) in plain.iter().enumerate() {
                        for c in 0..CHANNELS {
                            let (channels, of_channel, gain) = match tint {
                                Tint::One(_, factors) => (1, 0, factors[c]),
                                Tint::Many => (3, c, 1.0),
                            };
                            let at = (usize::from(places[i]) * channels + of_channel) * used;
                            let products = (0..rank.min(QUAD * used)).map(|k| {
                                let coefficient = tile.coefficient(rank, first + i, k)[c];
                                f64::from(coefficient * texels[at + k / QUAD][k % QUAD])
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
