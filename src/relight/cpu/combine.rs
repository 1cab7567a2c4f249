//! Pixels from what their windows see: `y_n = Σ_k c_nk C_k(o_n)`.

use super::lanes::{MOST_PIXELS, Pixels, Single, Vector};
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
    match seen.tint {
        Tint::One(_, factors) => {
            let mut gain = tile.step;
            for c in 0..CHANNELS {
                gain[c] *= factors[c];
            }
            each::<V, 1>(tile, first, places, seen, gain, out);
        }
        Tint::Many => each::<V, CHANNELS>(tile, first, places, seen, tile.step, out),
    }
}

#[inline(always)]
fn each<V: Vector, const SEEN: usize>(
    tile: &CoefficientTile,
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
    assert!((usize::from(most) + 1) * SEEN * quads <= texels.len());
    let plane = CoefficientTile::plane(tile.rect);
    let channel = tile.codes.len() / CHANNELS;
    let last = (CHANNELS - 1) * channel + quads.saturating_sub(1) * plane + first + pixels;
    assert!(last <= tile.codes.len());
    let row = Row {
        texels: texels.as_ptr(),
        quads,
        places,
        codes: tile.codes[first..].as_ptr(),
        plane,
        channel,
        gain,
        out: out.as_mut_ptr(),
    };
    let at_once = V::Pixels::COUNT;
    let mut done = 0;
    // SAFETY: there is a place for each of the pixels and all are seen, and a code, as was asserted.
    unsafe {
        while done + at_once <= pixels {
            row.combine::<V::Pixels, SEEN>(done);
            done += at_once;
        }
        if done < pixels && pixels >= at_once {
            // The last, some of them once more.
            row.combine::<V::Pixels, SEEN>(pixels - at_once);
            done = pixels;
        }
        while done < pixels {
            row.combine::<Single, SEEN>(done);
            done += 1;
        }
    }
}

/// Pixels side by side.
struct Row<'a> {
    /// `[origin, channel, quad]`.
    texels: *const [f32; QUAD],
    quads: usize,
    /// Of each pixel.
    places: &'a [u16],
    /// Of each pixel, `[channel, quad, pixel]`.
    codes: *const TexelCode,
    /// From one quad to the next.
    plane: usize,
    /// From one channel to the next.
    channel: usize,
    gain: [f32; CHANNELS],
    /// Of each pixel.
    out: *mut [f32; CHANNELS],
}

impl Row<'_> {
    /// As many pixels as are worked on at once, from `first` on.
    ///
    /// # Safety
    /// There are so many of them, and texels of `SEEN` channels at their places.
    #[inline(always)]
    unsafe fn combine<P: Pixels, const SEEN: usize>(&self, first: usize) {
        const { assert!(P::COUNT <= MOST_PIXELS) };
        // Loops and no closures, which would not be compiled for the vectors' registers.
        let mut seen = [[self.texels; MOST_PIXELS]; SEEN];
        for p in 0..P::COUNT {
            // SAFETY: as above.
            unsafe {
                let place = usize::from(*self.places.get_unchecked(first + p));
                let texels = self.texels.add(place * SEEN * self.quads);
                for (c, seen) in seen.iter_mut().enumerate() {
                    seen[p] = texels.add(c * self.quads);
                }
            }
        }
        let mut sums = [P::zero(); CHANNELS];
        for q in 0..self.quads {
            let mut texels = [P::zero(); SEEN];
            for c in 0..SEEN {
                let mut at = seen[c];
                for at in &mut at {
                    // Of pixels that are not asked for it is not read.
                    *at = at.wrapping_add(q);
                }
                // SAFETY: as above.
                texels[c] = unsafe { P::load(at) };
            }
            for (c, sum) in sums.iter_mut().enumerate() {
                let seen = texels[if SEEN == 1 { 0 } else { c }];
                // SAFETY: as above.
                *sum = unsafe {
                    let codes = self.codes.add(c * self.channel + q * self.plane + first);
                    sum.plus_products(codes, seen)
                };
            }
        }
        // SAFETY: as above.
        unsafe { P::store_sums(sums, self.gain, self.out.add(first)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::lanes::{Kind, Work};
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
                for (first, count) in [(0, 27), (3, 8), (26, 1), (5, 0), (1, 13), (0, 2), (4, 3)] {
                    let places: Vec<u16> = (0..count).map(|i| (i * 5 / 2 % 20) as u16).collect();
                    let seen = Seen {
                        texels: &texels[..20 * used * tint.channels().len()],
                        quads: used,
                        tint,
                    };
                    let combined = |kind: Kind| {
                        // With others on either side, which are not to be touched.
                        let mut out = vec![[7.0; CHANNELS]; count + 2];
                        kind.run(Combine {
                            tile: &tile,
                            first,
                            places: &places,
                            seen,
                            out: &mut out[1..=count],
                        });
                        assert_eq!([out[0], out[count + 1]], [[7.0; CHANNELS]; 2]);
                        out[1..=count].to_vec()
                    };
                    let plain = combined(Kind::Plain);
                    for kind in Kind::all() {
                        assert_eq!(plain, combined(kind), "{kind:?}");
                    }
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
