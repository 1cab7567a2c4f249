//! Functions of the basis, as the scans bring them.

use super::bytes::{join, split, unzigzag, zigzag};
use super::{PartError, compress, damaged, decompress, zeros};
use crate::format::FormatError;

/// Largest exponent: elements are whole multiples of at least `2⁻³⁰`.
const MOST_EXPONENT: u8 = 30;

/// Bytes of so many functions before compression.
pub fn plain_bytes(functions: usize, area: usize) -> usize {
    functions * (1 + 2 * area)
}

/// Functions rounded to multiples of a power of two each, and what is left of them.
#[derive(Clone, Debug, Default)]
pub struct Rounded {
    exponents: Vec<u8>,
    codes: Vec<i16>,
}

impl Rounded {
    /// Rounds each function about as coarsely as its `step` says.
    pub fn new(functions: &[Vec<f32>], steps: &[f32]) -> Self {
        let mut rounded = Self::default();
        for (function, step) in functions.iter().zip(steps) {
            let peak = function.iter().fold(0.0f32, |peak, v| peak.max(v.abs()));
            // As fine as codes allow, where nothing coarser is asked for.
            let finest = (f32::from(i16::MAX) / peak.max(1e-6)).log2().floor();
            let wanted = (-step.log2()).ceil();
            let exponent = wanted.min(finest).clamp(0.0, f32::from(MOST_EXPONENT));
            let scale = exponent.exp2();
            rounded.exponents.push(exponent as u8);
            let codes = function.iter().map(|v| (v * scale).round() as i16);
            rounded.codes.extend(codes); // `as` saturates
        }
        rounded
    }

    /// The sum of the squares of what rounding changed about a function, the `k`th.
    pub fn error(&self, k: usize, function: &[f32]) -> f64 {
        let codes = self.codes.chunks_exact(function.len()).nth(k);
        let pairs = codes.unwrap_or_default().iter().zip(function);
        let off =
            |(&code, v): (&i16, &f32)| f64::from(value(code, self.exponents[k])) - f64::from(*v);
        pairs.map(|pair| off(pair).powi(2)).sum()
    }

    /// The functions as a reader will have them.
    #[cfg(test)]
    pub fn functions(&self, area: usize) -> Vec<Vec<f32>> {
        let codes = self.codes.chunks_exact(area).zip(&self.exponents);
        codes
            .map(|(codes, &exponent)| codes.iter().map(|&code| value(code, exponent)).collect())
            .collect()
    }

    /// Compresses functions `from` and on, `count` of them.
    pub fn encode(&self, from: usize, count: usize, area: usize) -> Result<Vec<u8>, FormatError> {
        let mut plain = self.exponents[from..from + count].to_vec();
        let codes = &self.codes[from * area..(from + count) * area];
        plain.extend(split(codes.iter().map(|&code| zigzag(code))));
        compress(&plain)
    }
}

fn value(code: i16, exponent: u8) -> f32 {
    f32::from(code) / (1u32 << exponent) as f32
}

/// Decompresses `count` functions of `area` elements.
pub fn decode(frame: &[u8], count: usize, area: usize) -> Result<Vec<Vec<f32>>, PartError> {
    let plain = decompress(frame, plain_bytes(count, area))?;
    let (exponents, planes) = plain.split_at(count);
    if exponents.iter().any(|&exponent| exponent > MOST_EXPONENT) {
        return Err(damaged(format!("an exponent is above {MOST_EXPONENT}")));
    }
    let mut codes = join(planes);
    let mut functions = Vec::new();
    for &exponent in exponents {
        let mut function: Vec<f32> = zeros(area)?;
        for (v, code) in function.iter_mut().zip(&mut codes) {
            *v = value(unzigzag(code), exponent);
        }
        functions.push(function);
    }
    Ok(functions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_come_back_to_within_their_step() {
        let function = |k: usize| (0..25).map(|s| ((s * k + s) as f32).sin() * 0.3).collect();
        let functions: Vec<Vec<f32>> = (0..4).map(function).collect();
        let steps = [1e-4, 1e-3, 1e-2, 1e-9];
        let rounded = Rounded::new(&functions, &steps);
        let want = rounded.functions(25);
        let frames = [
            rounded.encode(0, 1, 25).unwrap(),
            rounded.encode(1, 3, 25).unwrap(),
        ];
        let got = [
            decode(&frames[0], 1, 25).unwrap(),
            decode(&frames[1], 3, 25).unwrap(),
        ]
        .concat();
        assert_eq!(got, want);
        for (k, (got, given)) in got.iter().zip(&functions).enumerate() {
            let square = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2);
            let squares: f64 = got.iter().zip(given).map(square).sum();
            assert!((rounded.error(k, given) - squares).abs() <= 1e-12 * squares);
        }
        for ((got, given), step) in got.iter().zip(&functions).zip(steps) {
            let off = got.iter().zip(given).map(|(a, b)| (a - b).abs());
            let bound = 0.5 * step.max(2e-5);
            assert!(off.fold(0.0, f32::max) <= bound, "{step}");
        }
        assert!(decode(&frames[0], 2, 25).is_err());
    }
}
