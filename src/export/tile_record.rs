//! A recovered tile between recovery and encoding, in a checkpoint or a browser's memory: half-precision floats
//! `x / step` with a power of two as step, split into planes of low and high bytes, which compress better.
//!
//! Eleven bits are finer than any `.ltm` file but a lossless one, and fast to write.

use std::io::{self, ErrorKind};

use half::f16;

use crate::transport::{CHANNELS, FloatTile, TileRect};

/// Bytes before the values: whether the tile is direct or factored, and the step.
const HEAD_BYTES: usize = 5;
const DIRECT: u8 = 1;
const FACTORED: u8 = 2;

/// The record of a tile.
pub fn encode(tile: &FloatTile) -> Vec<u8> {
    let (kind, values) = match tile.functions.is_empty() {
        true => (FACTORED, &tile.coefficients),
        false => (DIRECT, &tile.functions),
    };
    let values = values.as_flattened();
    let finite = values.iter().filter(|v| v.is_finite());
    let peak = finite.fold(f32::MIN_POSITIVE, |peak, v| peak.max(v.abs()));
    let step = libm::exp2f((libm::log2f(peak).ceil() - 15.0).clamp(-120.0, 110.0));
    let halves = values.iter().map(|value| {
        let value = if value.is_finite() { value / step } else { 0.0 };
        let [low, high] = f16::from_f32(value).to_le_bytes();
        (low, high)
    });
    let (mut planes, high): (Vec<u8>, Vec<u8>) = halves.unzip();
    planes.extend(high);
    let mut record = vec![kind];
    record.extend(step.to_le_bytes());
    record.extend(planes);
    record
}

/// Decodes the tile at `rect`: `rank` coefficients or `area` elements a pixel and channel.
///
/// # Errors
/// If the record is not one of such a tile.
pub fn decode(rect: TileRect, rank: usize, area: usize, record: &[u8]) -> io::Result<FloatTile> {
    let damaged = || io::Error::from(ErrorKind::InvalidData);
    let (&[kind, a, b, c, d], planes) = record
        .split_first_chunk::<HEAD_BYTES>()
        .ok_or_else(damaged)?;
    let step = f32::from_le_bytes([a, b, c, d]);
    let each = match kind {
        DIRECT => area,
        FACTORED => rank,
        _ => return Err(damaged()),
    };
    let count = rect.extent.area() * each * CHANNELS;
    if planes.len() != 2 * count {
        return Err(damaged());
    }
    let (low, high) = planes.split_at(count);
    let value = |(&low, &high)| f16::from_le_bytes([low, high]).to_f32() * step;
    let values: Vec<f32> = low.iter().zip(high).map(value).collect();
    let values = values.as_chunks().0.to_vec();
    let mut tile = FloatTile::dark(rect);
    match kind {
        DIRECT => tile.functions = values,
        _ => tile.coefficients = values,
    }
    Ok(tile)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Extent;

    #[test]
    fn tiles_round_trip_to_eleven_bits() {
        let rect = TileRect {
            x: 3,
            y: 5,
            extent: Extent::new(4, 2),
        };
        for size in [1e-30f32, 0.2, 1e20] {
            let value = |i: usize| [0.2, -1.0, 0.01].map(|c| c * size * (i as f32).cos());
            let values = |each: usize| -> Vec<_> { (0..8 * each).map(value).collect() };
            let (mut direct, mut factored) = (FloatTile::dark(rect), FloatTile::dark(rect));
            direct.functions = values(9);
            factored.coefficients = values(5);
            for tile in [direct, factored] {
                let record = encode(&tile);
                let got = decode(rect, 5, 9, &record).unwrap();
                for (got, want) in [
                    (got.coefficients, tile.coefficients),
                    (got.functions, tile.functions),
                ] {
                    assert_eq!(got.len(), want.len());
                    for (got, want) in got.as_flattened().iter().zip(want.as_flattened()) {
                        assert!((got - want).abs() <= want.abs() / 2048.0 + size * 1e-7);
                    }
                }
                assert!(decode(rect, 6, 10, &record).is_err());
                for cut in 0..record.len() {
                    assert!(decode(rect, 5, 9, &record[..cut]).is_err());
                }
            }
        }
    }
}
