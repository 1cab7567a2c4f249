//! Basis chunks: functions v_k `[function, slot]`, each rounded to 16-bit multiples of 2^-e.
//!
//! Content of the frame: e `[function]` as u8, then all codes as [byte planes](super::byte_planes).

use serde::{Deserialize, Serialize};

use super::byte_planes::{join, split, unzigzag, zigzag};
use super::zstd_frame::{compress, decompress};
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::memory_budget::MemoryBudget;

/// Largest exponent: values are multiples of `2⁻³⁰` or coarser.
const MAX_EXPONENT: u8 = 30;

/// Bytes of `functions` functions of `area` slots before compression.
pub fn content_bytes(functions: usize, area: usize) -> usize {
    functions * (1 + 2 * area)
}

/// Basis functions, each rounded to multiples of a power of two.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct QuantisedBasis {
    exponents: Vec<u8>,
    codes: Vec<i16>,
}

impl QuantisedBasis {
    /// Rounds each function to the power of two at or below its step.
    pub fn new(functions: &[Vec<f32>], steps: &[f32]) -> Self {
        let mut quantised = Self::default();
        for (function, step) in functions.iter().zip(steps) {
            let peak = function.iter().fold(0.0f32, |peak, v| peak.max(v.abs()));
            let finest = libm::log2f(f32::from(i16::MAX) / peak.max(1e-6)).floor();
            let wanted = (-libm::log2f(*step)).ceil();
            let exponent = wanted.min(finest).clamp(0.0, f32::from(MAX_EXPONENT));
            let scale = libm::exp2f(exponent);
            quantised.exponents.push(exponent as u8);
            let codes = function.iter().map(|v| (v * scale).round() as i16);
            quantised.codes.extend(codes); // `as` saturates
        }
        quantised
    }

    /// Squared rounding error of function `k`.
    pub fn error(&self, k: usize, function: &[f32]) -> f64 {
        let codes = self.codes.chunks_exact(function.len()).nth(k);
        let pairs = codes.unwrap_or_default().iter().zip(function);
        let square = |(&code, v): (&i16, &f32)| {
            (f64::from(value(code, self.exponents[k])) - f64::from(*v)).powi(2)
        };
        pairs.map(square).sum()
    }

    /// The basis chunk of functions `from` to `from + count - 1`.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn encode(&self, from: usize, count: usize, area: usize) -> Result<Vec<u8>, FormatError> {
        let mut content = self.exponents[from..from + count].to_vec();
        let codes = &self.codes[from * area..(from + count) * area];
        content.extend(split(codes.iter().map(|&code| zigzag(code))));
        compress(&content)
    }
}

fn value(code: i16, exponent: u8) -> f32 {
    f32::from(code) / (1u32 << exponent) as f32
}

/// Decodes a basis chunk into `functions`, all of `area` slots.
///
/// # Errors
/// [`SectionError`] if the chunk is damaged, or the budget refuses memory.
pub fn decode(
    frame: &[u8],
    functions: &mut [Vec<f32>],
    area: usize,
    budget: &MemoryBudget,
) -> Result<(), SectionError> {
    let content = decompress(frame, content_bytes(functions.len(), area), budget)?;
    let (exponents, planes) = content.split_at(functions.len());
    if exponents.iter().any(|&exponent| exponent > MAX_EXPONENT) {
        return Err(damaged(format!("an exponent is above {MAX_EXPONENT}")));
    }
    let mut codes = join(planes);
    for (function, &exponent) in functions.iter_mut().zip(exponents) {
        for (v, code) in function.iter_mut().zip(&mut codes) {
            *v = value(unzigzag(code), exponent);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoded_functions_are_within_their_step() {
        let function = |k: usize| (0..25).map(|s| ((s * k + s) as f32).sin() * 0.3).collect();
        let functions: Vec<Vec<f32>> = (0..4).map(function).collect();
        let steps = [1e-4, 1e-3, 1e-2, 1e-9];
        let quantised = QuantisedBasis::new(&functions, &steps);
        let codes = quantised.codes.chunks_exact(25);
        let functions_of = |(codes, &exponent): (&[i16], &u8)| -> Vec<f32> {
            codes.iter().map(|&code| value(code, exponent)).collect()
        };
        let want: Vec<_> = codes.zip(&quantised.exponents).map(functions_of).collect();
        let frames = [
            quantised.encode(0, 1, 25).unwrap(),
            quantised.encode(1, 3, 25).unwrap(),
        ];
        let decode = |frame: &[u8], count: usize| {
            let budget = MemoryBudget::unlimited();
            let mut functions = vec![vec![0.0; 25]; count];
            decode(frame, &mut functions, 25, &budget).map(|()| functions)
        };
        let got = [
            decode(&frames[0], 1).unwrap(),
            decode(&frames[1], 3).unwrap(),
        ]
        .concat();
        assert_eq!(got, want);
        for (k, (got, given)) in got.iter().zip(&functions).enumerate() {
            let square = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2);
            let squares: f64 = got.iter().zip(given).map(square).sum();
            assert!((quantised.error(k, given) - squares).abs() <= 1e-12 * squares);
        }
        for ((got, given), step) in got.iter().zip(&functions).zip(steps) {
            let off = got.iter().zip(given).map(|(a, b)| (a - b).abs());
            let bound = 0.5 * step.max(2e-5);
            assert!(off.fold(0.0, f32::max) <= bound, "{step}");
        }
        assert!(decode(&frames[0], 2).is_err());
    }
}
