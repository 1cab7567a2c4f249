//! Values as half-precision floats: for archives.

use half::f16;

use super::bytes::{join, split};
use super::colour::Pixel;
use super::{PartError, compress, damaged, decompress};
use crate::format::FormatError;
use crate::transport::CHANNELS;

/// Bytes of so many values before compression.
pub fn plain_bytes(values: usize) -> usize {
    2 * values
}

/// The largest power of two by which values of this peak can be divided to be as precise as half
/// precision allows.
pub fn step_for(peak: f32) -> f32 {
    // Halves reach to 65504; a few binades are left for what other tiles have.
    match peak.is_normal() {
        true => (peak.log2().ceil() - 14.0).clamp(-120.0, 100.0).exp2(),
        false => 1.0,
    }
}

/// Compresses values in units of `step`. Those that are not finite become zero, those too large the
/// largest there are.
pub fn encode(values: &[f32], step: f32) -> Result<Vec<u8>, FormatError> {
    compress(&split(
        values.iter().map(|value| half(*value, step).to_bits()),
    ))
}

/// The sum of the squares of what [`encode`] changes about finite values.
pub fn error(values: &[f32], step: f32) -> f64 {
    let off =
        |value: &f32| f64::from(half(*value, step).to_f32()) * f64::from(step) - f64::from(*value);
    values.iter().map(|value| off(value).powi(2)).sum()
}

fn half(value: f32, step: f32) -> f16 {
    let value = value / step;
    match value.is_finite() {
        true => f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32())),
        false => f16::ZERO,
    }
}

/// Adds values in the order `[place, channel, pixel]` to `values` as `[pixel, place]`, of which
/// there are `each` a pixel.
pub fn add(
    values: &mut [Pixel],
    each: usize,
    places: &[u16],
    step: f32,
    frame: &[u8],
) -> Result<(), PartError> {
    let pixels = values.len() / each;
    let plain = decompress(frame, plain_bytes(pixels * places.len() * CHANNELS))?;
    let mut halves = join(&plain).map(f16::from_bits);
    for &place in places {
        for c in 0..CHANNELS {
            let of_place = values.iter_mut().skip(place.into()).step_by(each);
            for (value, half) in of_place.zip(&mut halves) {
                if !half.is_finite() {
                    return Err(damaged("a value is not a finite number"));
                }
                value[c] += half.to_f32() * step;
            }
        }
    }
    Ok(())
}

/// The values that [`add`] takes.
pub fn gather(values: &[Pixel], each: usize, places: &[u16]) -> Vec<f32> {
    let mut gathered = Vec::with_capacity(values.len() / each * places.len() * CHANNELS);
    for &place in places {
        for c in 0..CHANNELS {
            let of_place = values.iter().skip(place.into()).step_by(each);
            gathered.extend(of_place.map(|value| value[c]));
        }
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_to_eleven_bits() {
        for peak in [1e-6f32, 0.3, 7e5] {
            let value = |i: usize| [1.0, 0.5, -0.7].map(|c| c * peak * (i as f32 * 0.37).sin());
            let values: Vec<Pixel> = (0..5 * 40).map(value).collect();
            let step = step_for(peak);
            let mut got = vec![[0.0; CHANNELS]; values.len()];
            let mut said = 0.0;
            for places in [&[3, 0][..], &[1, 2, 4]] {
                let gathered = gather(&values, 5, places);
                let frame = encode(&gathered, step).unwrap();
                add(&mut got, 5, places, step, &frame).unwrap();
                said += error(&gathered, step);
            }
            let off = |(got, want): (&f32, &f32)| f64::from(got - want).powi(2);
            let pairs = got.as_flattened().iter().zip(values.as_flattened());
            let off: f64 = pairs.map(off).sum();
            assert!((off / said - 1.0).abs() < 1e-3, "{off:e}, not {said:e}");
            for (got, want) in got.as_flattened().iter().zip(values.as_flattened()) {
                assert!((got - want).abs() <= want.abs() / 2048.0 + peak * 1e-7);
            }
        }
    }

    #[test]
    fn what_is_no_number_is_refused_and_not_written() {
        let mut got = [[1.0; CHANNELS]];
        let frame = encode(&[f32::NAN, f32::INFINITY, f32::MAX], 1.0).unwrap();
        add(&mut got, 1, &[0], 1.0, &frame).unwrap();
        assert_eq!(got, [[1.0, 1.0, 65505.0]]);
        let frame = compress(&[0, 0, 0, 0, 0, 0x7C]).unwrap();
        assert!(add(&mut got, 1, &[0], 1.0, &frame).is_err());
    }
}
