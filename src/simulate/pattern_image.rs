//! The 8-bit codes that the monitor shows: random patterns and Gray code.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use serde::{Deserialize, Serialize};

use crate::calibrate::LightPlaneAxis;
use crate::capture::GrayCodeShot;
use crate::transport::Extent;

/// The monitor emits `(code / 255)^MONITOR_GAMMA`.
pub const MONITOR_GAMMA: f64 = 2.2;

/// The emission of a code, 0 to 1.
pub fn emission(code: u8) -> f64 {
    (f64::from(code) / 255.0).powf(MONITOR_GAMMA)
}

/// The code with the emission nearest to `emission`, which is clamped to 0..=1.
pub(super) fn code_for(emission: f64) -> u8 {
    (emission.clamp(0.0, 1.0).powf(1.0 / MONITOR_GAMMA) * 255.0).round() as u8
}

/// A code for each light element, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PatternImage {
    /// The same code for all three primaries.
    Grey(Vec<u8>),
    /// Red, green, blue.
    Rgb(Vec<[u8; 3]>),
}

impl PatternImage {
    /// The codes of primary `c`, `[M]`.
    pub fn plane(&self, c: usize) -> Vec<u8> {
        match self {
            Self::Grey(codes) => codes.clone(),
            Self::Rgb(codes) => codes.iter().map(|code| code[c]).collect(),
        }
    }

    /// The same grey code for all elements.
    pub fn uniform(light: Extent, code: u8) -> Self {
        Self::Grey(vec![code; light.area()])
    }
}

/// A distribution of random patterns. The command line shows the variants' descriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    all(feature = "cli", not(target_arch = "wasm32")),
    derive(clap::ValueEnum)
)]
pub enum PatternEnsemble {
    /// Clipped Gaussian around half brightness
    Gaussian,
    /// Each element on or off
    Bernoulli,
}

impl PatternEnsemble {
    /// A random pattern from the numbers of `stream`.
    pub fn draw(self, light: Extent, stream: &mut ChaCha8Rng) -> PatternImage {
        let mut codes = vec![0; light.area()];
        match self {
            // N(0.5, 0.17²): 0.3 % of the elements are clipped.
            Self::Gaussian => codes.fill_with(|| {
                let deviation: f64 = StandardNormal.sample(stream);
                code_for(0.5 + 0.17 * deviation)
            }),
            Self::Bernoulli => codes.fill_with(|| match StandardUniform.sample(stream) {
                true => 255,
                false => 0,
            }),
        }
        PatternImage::Grey(codes)
    }
}

/// One pattern of the Gray code of all columns or of all rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GrayCodePattern {
    /// Whether it codes columns or rows.
    pub axis: LightPlaneAxis,
    /// Index of the bit, 0 for the least significant.
    pub bit: u32,
    /// Whether dark and bright are exchanged.
    pub inverted: bool,
}

impl GrayCodePattern {
    /// All patterns of a light plane: columns, then rows, most significant bit first, each followed by its inverse.
    pub fn all(light: Extent) -> Vec<Self> {
        let mut patterns = Vec::new();
        for (axis, side) in [
            (LightPlaneAxis::X, light.width),
            (LightPlaneAxis::Y, light.height),
        ] {
            for bit in (0..u32::BITS - (side - 1).leading_zeros()).rev() {
                patterns.extend([false, true].map(|inverted| Self {
                    axis,
                    bit,
                    inverted,
                }));
            }
        }
        patterns
    }

    /// The manifest's entry of the pattern, with the name of its photograph.
    pub fn shot(self) -> GrayCodeShot {
        let Self {
            axis,
            bit,
            inverted,
        } = self;
        let sign = if inverted { 'n' } else { 'p' };
        GrayCodeShot {
            photo: format!("graycode/{axis}{bit}{sign}.png"),
            axis,
            bit,
            inverted,
        }
    }

    /// Whether column or row `n` is bright.
    pub fn is_lit(self, n: u32) -> bool {
        let is_set = (n ^ (n >> 1)) >> self.bit & 1 == 1;
        is_set != self.inverted
    }

    /// The codes of the pattern.
    pub fn codes(self, light: Extent) -> PatternImage {
        let code = |(u, v): (u32, u32)| {
            let n = match self.axis {
                LightPlaneAxis::X => u,
                LightPlaneAxis::Y => v,
            };
            if self.is_lit(n) { 255 } else { 0 }
        };
        PatternImage::Grey(light.cells().map(code).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_columns_differ_in_one_gray_bit() {
        let light = Extent::new(20, 3);
        let patterns: Vec<_> = GrayCodePattern::all(light)
            .into_iter()
            .filter(|g| g.axis == LightPlaneAxis::X && !g.inverted)
            .collect();
        assert_eq!(
            patterns.iter().map(|g| g.bit).collect::<Vec<_>>(),
            [4, 3, 2, 1, 0]
        );
        let column = |u: usize| -> Vec<u8> {
            let code = |g: &GrayCodePattern| match g.codes(light) {
                PatternImage::Grey(c) => c[u],
                PatternImage::Rgb(_) => unreachable!(),
            };
            patterns.iter().map(code).collect()
        };
        for u in 1..20 {
            let changed = column(u - 1)
                .iter()
                .zip(column(u))
                .filter(|(a, b)| **a != *b)
                .count();
            assert_eq!(changed, 1, "column {u}");
        }
    }

    #[test]
    fn codes_invert_the_gamma() {
        for code in 0..=255 {
            assert_eq!(code_for(emission(code)), code);
        }
    }
}
