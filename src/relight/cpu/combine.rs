//! Pixels from what their windows see: `y_n = Σ_k c_nk C_k(o_n)`.

use crate::relight::Tint;
use crate::transport::{CHANNELS, CoefficientTile, QUAD, TexelCode};

/// A square of the light, seen through the basis.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// `[origin, channel, quad]`; one channel where the light has one tint.
    pub texels: &'a [[f32; QUAD]],
    /// Texels of an origin and channel.
    pub quads: usize,
    /// What the channels have in common.
    pub tint: Tint,
}

/// Writes pixels of a tile from `first` on, of which `places` has the origins' numbers.
#[inline(always)]
pub fn combine(
    tile: &CoefficientTile,
    first: usize,
    places: &[u16],
    seen: Seen<'_>,
    out: &mut [[f32; CHANNELS]],
) {
    let plane = CoefficientTile::plane(tile.rect);
    match seen.tint {
        Tint::One(_, factors) => {
            let gain = std::array::from_fn(|c| tile.step[c] * factors[c]);
            each::<1>(&tile.codes, plane, first, places, seen, gain, out);
        }
        Tint::Many => each::<CHANNELS>(&tile.codes, plane, first, places, seen, tile.step, out),
    }
}

#[inline(always)]
fn each<const SEEN: usize>(
    codes: &[TexelCode],
    plane: usize,
    first: usize,
    places: &[u16],
    Seen { texels, quads, .. }: Seen<'_>,
    gain: [f32; CHANNELS],
    out: &mut [[f32; CHANNELS]],
) {
    let texels_each = SEEN * quads;
    for (i, (place, y)) in places.iter().zip(out).enumerate() {
        let at = usize::from(*place) * texels_each;
        let seen = &texels[at..at + texels_each];
        let mut sums = [[0.0f32; QUAD]; CHANNELS];
        for (c, sum) in sums.iter_mut().enumerate() {
            let seen = &seen[if SEEN == 1 { 0 } else { c * quads }..][..quads];
            for (q, seen) in seen.iter().enumerate() {
                let code = codes[(c * quads + q) * plane + first + i];
                for lane in 0..QUAD {
                    sum[lane] += f32::from(code[lane]) * seen[lane];
                }
            }
        }
        for c in 0..CHANNELS {
            let [a, b, d, e] = sums[c];
            y[c] = ((a + d) + (b + e)) * gain[c];
        }
    }
}
