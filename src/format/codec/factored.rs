//! Factored tiles: coefficients over the file's basis.
//!
//! `c = code · step`, one step a channel for all components: kernels are of unit norm, so an error
//! in any coefficient weighs the same, and a uniform step spends no bits on the noise of the weak
//! ones. (On a path-traced glass slab at rank 48, codes of 15 bits and a sign took 29 % less than
//! half-precision floats, with 6 dB less noise.) Codes are zigzag coded, so that the high bytes of
//! small ones are all zero.

use super::{PartError, compress, decompress, zeros};
use crate::format::FormatError;
use crate::transport::{
    Basis, CHANNELS, DirectTile, FactoredTile, Geometry, TexelCode, TileRect, TransportFunctions,
};

/// Largest code: rounding noise is then some 80 dB below the coefficients, well below what
/// [`DirectTile::quantise`] adds.
const TOP_CODE: f32 = 32767.0;

/// A tile's codes and what they are in units of.
pub struct Encoded {
    /// Components up to the last that is not all zero, at least one.
    pub components: u16,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// zstd frame.
    pub bytes: Vec<u8>,
}

/// Bytes of a tile's planes before compression.
pub fn plain_bytes(rect: TileRect, components: u16) -> usize {
    rect.extent.area() * usize::from(components) * CHANNELS * 2
}

/// Rounds and compresses a tile's coefficients; `None` for a tile that is all dark. Numbers that
/// are not finite, which no solver should yield, become zero.
pub fn encode(tile: &FactoredTile) -> Result<Option<Encoded>, FormatError> {
    let pixels = tile.rect.extent.area();
    let rank = tile.coefficients.len() / pixels;
    let mut peak = [0.0f32; CHANNELS];
    let mut components = 0;
    for (i, coefficients) in tile.coefficients.iter().enumerate() {
        for c in 0..CHANNELS {
            let size = coefficients[c].abs();
            if size > 0.0 && size.is_finite() {
                peak[c] = peak[c].max(size);
                components = components.max(i % rank + 1);
            }
        }
    }
    if components == 0 {
        return Ok(None);
    }
    let components = u16::try_from(components).map_err(|_| FormatError::Rank(components as u64))?;
    // Of a peak so small that its step is no number at all, nothing is left to keep.
    let step = peak.map(|p| (p / TOP_CODE).max(f32::MIN_POSITIVE));
    let half = pixels * usize::from(components) * CHANNELS;
    let mut planes = vec![0u8; 2 * half];
    let (low, high) = planes.split_at_mut(half);
    for p in 0..pixels {
        let of_pixel = &tile.coefficients[p * rank..][..usize::from(components)];
        for (k, coefficients) in of_pixel.iter().enumerate() {
            for c in 0..CHANNELS {
                let value = coefficients[c] / step[c];
                let code = match value.is_finite() {
                    true => value.round() as i16, // `as` saturates
                    false => 0,
                };
                let at = (k * CHANNELS + c) * pixels + p;
                [low[at], high[at]] = zigzag(code).to_le_bytes();
            }
        }
    }
    Ok(Some(Encoded {
        components,
        step,
        bytes: compress(&planes)?,
    }))
}

/// Decompresses a tile's coefficients over a basis of `rank` functions.
pub fn decode(
    bytes: &[u8],
    rect: TileRect,
    components: u16,
    rank: usize,
    step: [f32; CHANNELS],
) -> Result<FactoredTile, PartError> {
    let pixels = rect.extent.area();
    let planes = decompress(bytes, plain_bytes(rect, components))?;
    let mut coefficients: Vec<[f32; CHANNELS]> = zeros(pixels * rank)?;
    let (low, high) = planes.split_at(planes.len() / 2);
    for k in 0..usize::from(components) {
        for c in 0..CHANNELS {
            let at = (k * CHANNELS + c) * pixels;
            let plane = low[at..at + pixels].iter().zip(&high[at..at + pixels]);
            for (p, (&low, &high)) in plane.enumerate() {
                let code = unzigzag(u16::from_le_bytes([low, high]));
                coefficients[p * rank + k][c] = f32::from(code) * step[c];
            }
        }
    }
    Ok(FactoredTile { rect, coefficients })
}

/// The direct tile that a factored one stands for, as relighting works on direct tiles.
pub fn multiply_out(
    tile: &FactoredTile,
    geometry: &Geometry,
    basis: &Basis,
) -> Result<DirectTile, PartError> {
    let values = tile.rect.extent.area() * geometry.window.area();
    let mut functions = TransportFunctions {
        rect: tile.rect,
        tau: zeros(values)?,
    };
    tile.expand_into(geometry, basis, &mut functions.tau);
    let mut codes: Vec<TexelCode> = zeros(values)?;
    codes.clear();
    Ok(DirectTile::quantise_into(&functions, codes))
}

/// 0, -1, 1, -2, 2, … as 0, 1, 2, 3, 4, …
fn zigzag(code: i16) -> u16 {
    ((code << 1) ^ (code >> 15)) as u16
}

fn unzigzag(code: u16) -> i16 {
    (code >> 1) as i16 ^ -((code & 1) as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zigzag_takes_every_code_there_and_back() {
        for code in i16::MIN..=i16::MAX {
            assert_eq!(unzigzag(zigzag(code)), code);
        }
        assert_eq!([0, -1, 1, -2, 2].map(zigzag), [0, 1, 2, 3, 4]);
    }
    #[test]
    fn rounding_is_seventy_decibels_below_the_coefficients() {
        let extent = crate::transport::Extent {
            width: 9,
            height: 7,
        };
        let rect = TileRect { x: 0, y: 0, extent };
        let rank = 12;
        // Late components are a hundredth of the first, every other pixel a tenth as bright as its
        // neighbours, and one channel nearly dark.
        let coefficient = |i: usize| {
            let size = [1.0, 0.1, 0.01][i % rank / 4] * [1.0, 0.1][i / rank % 2];
            [0.3, 2.0, 1e-30].map(|c| c * size * (0.7 + i as f32).sin())
        };
        let tile = FactoredTile {
            rect,
            coefficients: (0..rect.extent.area() * rank).map(coefficient).collect(),
        };
        let encoded = encode(&tile).unwrap().unwrap();
        let components = encoded.components;
        assert_eq!(usize::from(components), rank);
        let decoded = decode(&encoded.bytes, rect, components, rank, encoded.step).unwrap();
        for c in 0..CHANNELS {
            let (mut signal, mut error) = (0.0, 0.0);
            for (got, want) in decoded.coefficients.iter().zip(&tile.coefficients) {
                let [got, want] = [got, want].map(|coefficient| f64::from(coefficient[c]));
                signal += want * want;
                error += (got - want) * (got - want);
            }
            let snr = 10.0 * (signal / error).log10();
            assert!(snr > 70.0, "channel {c}: {snr} dB");
        }
    }
}
