//! The output transform, from linear light to the codes of a canvas: gains (exposure and white balance), gamut, tone
//! curve, transfer function and dither, in this order, for each channel of a pixel.

use std::sync::LazyLock;

use super::srgb::srgb_encode;
use crate::transport::{CHANNELS, CameraPixel};

/// How linear light becomes codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputTransform {
    /// Exposure times white balance, for each channel.
    pub gains: [f32; CHANNELS],
    /// The canvas's gamut.
    pub gamut: Gamut,
    /// The tone curve.
    pub curve: ToneCurve,
    /// Whether to dither: this prevents banding in gradients, and changes a code by one at most.
    pub dither: bool,
}

/// Primaries of a canvas. The linear light has those of sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gamut {
    /// IEC 61966-2-1.
    Srgb,
    /// Display P3, for colours beyond sRGB.
    DisplayP3,
}

/// The tone curve, from linear light to linear light of 0..=1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneCurve {
    /// The identity up to 1, then constant.
    Clip,
    /// The curve of J. Hable, "Filmic tonemapping operators", 2010, with his constants: dark tones a quarter darker,
    /// bright ones compressed; 5.6 becomes 1.
    Filmic,
}

impl OutputTransform {
    /// To sRGB without dither, for comparisons.
    pub fn srgb(exposure: f32) -> Self {
        Self {
            gains: [exposure; CHANNELS],
            gamut: Gamut::Srgb,
            curve: ToneCurve::Clip,
            dither: false,
        }
    }

    /// Linear RGB to encoded values of 0..=1, before dither. NaN becomes 0.
    pub fn encode(&self, linear: [f64; CHANNELS]) -> [f64; CHANNELS] {
        let exposed: [f64; CHANNELS] =
            std::array::from_fn(|c| linear[c] * f64::from(self.gains[c]));
        let converted = match self.gamut {
            Gamut::Srgb => exposed,
            Gamut::DisplayP3 => {
                let matrix = self.gamut.from_srgb();
                matrix.map(|row| (0..CHANNELS).map(|c| f64::from(row[c]) * exposed[c]).sum())
            }
        };
        converted.map(|y| srgb_encode(self.curve.apply(y)))
    }

    /// The codes of the pixel at `at`.
    pub fn codes(&self, linear: [f64; CHANNELS], at: CameraPixel) -> [u8; CHANNELS] {
        let threshold = match self.dither {
            true => (f64::from(bayer(at)) + 0.5) / 64.0,
            false => 0.5,
        };
        self.encode(linear)
            .map(|encoded| (encoded * 255.0 + threshold) as u8)
    }
}

impl Gamut {
    /// The CSS name.
    pub fn color_space(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DisplayP3 => "display-p3",
        }
    }

    /// The matrix from linear sRGB to this gamut, row by row.
    pub fn from_srgb(self) -> [[f32; CHANNELS]; CHANNELS] {
        match self {
            Self::Srgb => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            // CSS Color Module Level 4, both through XYZ.
            Self::DisplayP3 => [
                [0.822_461_97, 0.177_538_03, 0.0],
                [0.033_194_2, 0.966_805_8, 0.0],
                [0.017_082_63, 0.072_397_44, 0.910_519_96],
            ],
        }
    }
}

impl ToneCurve {
    /// The smallest value that becomes 1.
    pub fn white(self) -> f32 {
        match self {
            Self::Clip => 1.0,
            Self::Filmic => 5.6,
        }
    }

    /// The curve's value, 0 to 1. NaN becomes 0.
    pub fn apply(self, linear: f64) -> f64 {
        let y = linear.max(0.0).min(f64::from(self.white()));
        match self {
            Self::Clip => y,
            Self::Filmic => {
                let hable = |x: f64| {
                    (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3
                };
                hable(2.0 * y) / hable(11.2)
            }
        }
    }
}

/// The threshold matrix of ordered dither, 0 to 63, each once in every 8 × 8 pixels (B. E. Bayer, "An optimum method
/// for two-level rendition of continuous-tone pictures", 1973).
pub fn bayer(at: CameraPixel) -> u32 {
    let (x, y) = (at.x ^ at.y, at.y);
    let bits = |n: u32| ((n & 1) << 4) | ((n & 2) << 1) | ((n & 4) >> 2);
    bits(x) << 1 | bits(y)
}

/// [`OutputTransform::codes`] by table, for whole rows, to within one code.
#[derive(Debug)]
pub struct TabulatedOutputTransform {
    table: &'static OutputCodeTable,
    /// The gains, repeated for each pixel of a batch.
    gains: [f32; CHANNELS * BATCH_PIXELS],
    /// `None` for sRGB.
    matrix: Option<[[f32; CHANNELS]; CHANNELS]>,
    dither: bool,
    /// Table entries per square root of a linear value.
    scale: f32,
}

/// Codes in units of 1/256, by the square root of the linear value: over the root the curves are so even that
/// neighbours differ by a quarter of a code at most.
type OutputCodeTable = [u16; (INDEX_MASK + 1) as usize];

const TABLE_ENTRIES: usize = 4096;
/// Twice the entries, so that a masked index needs no bounds check; the second half repeats the last entry.
const INDEX_MASK: u32 = 2 * TABLE_ENTRIES as u32 - 1;
/// Pixels that are encoded together.
const BATCH_PIXELS: usize = 32;

impl TabulatedOutputTransform {
    /// For one output transform.
    pub fn new(output: &OutputTransform) -> Self {
        static TABLES: [LazyLock<OutputCodeTable>; 2] = [
            LazyLock::new(|| output_code_table(ToneCurve::Clip)),
            LazyLock::new(|| output_code_table(ToneCurve::Filmic)),
        ];
        Self {
            table: &TABLES[usize::from(output.curve == ToneCurve::Filmic)],
            gains: std::array::from_fn(|i| output.gains[i % CHANNELS]),
            matrix: (output.gamut != Gamut::Srgb).then(|| output.gamut.from_srgb()),
            dither: output.dither,
            scale: TABLE_ENTRIES as f32 / output.curve.white().sqrt(),
        }
    }

    /// Writes RGBA of pixels side by side, of which `at` is the first.
    ///
    /// # Panics
    /// If `out` has another length than `linear`.
    pub fn encode(&self, linear: &[[f32; CHANNELS]], at: CameraPixel, out: &mut [[u8; 4]]) {
        assert_eq!(linear.len(), out.len(), "as many codes as pixels");
        // In units of 1/256; 128 rounds.
        let thresholds: [u32; 8] = std::array::from_fn(|i| match self.dither {
            true => {
                4 * bayer(CameraPixel {
                    x: at.x + i as u32,
                    y: at.y,
                }) + 2
            }
            false => 128,
        });
        for (linear, out) in linear
            .chunks(BATCH_PIXELS)
            .zip(out.chunks_mut(BATCH_PIXELS))
        {
            // A separate loop before the table look-ups, which the compiler vectorises.
            let mut exposed = [0.0f32; CHANNELS * BATCH_PIXELS];
            let values = linear.as_flattened();
            for ((exposed, value), gain) in exposed.iter_mut().zip(values).zip(&self.gains) {
                *exposed = value * gain;
            }
            if let Some(matrix) = &self.matrix {
                for pixel in exposed.as_chunks_mut::<CHANNELS>().0 {
                    let [r, g, b] = *pixel;
                    *pixel = matrix.map(|row| row[0] * r + row[1] * g + row[2] * b);
                }
            }
            let indices = exposed.map(|value| {
                // The comparison is false for NaN, which becomes 0.
                let root = if value > 0.0 { value } else { 0.0 }.sqrt();
                // Adding 2²³ leaves the rounded integer in the last bits.
                const ROUNDING: f32 = (1 << 23) as f32;
                ((root * self.scale).min(TABLE_ENTRIES as f32) + ROUNDING).to_bits() & INDEX_MASK
            });
            let indices = indices.as_chunks::<CHANNELS>().0;
            for (i, (indices, out)) in indices.iter().zip(out).enumerate() {
                let [r, g, b] = indices.map(|index| {
                    let encoded = u32::from(self.table[index as usize]);
                    ((encoded + thresholds[i % 8]) >> 8) as u8
                });
                *out = [r, g, b, 255];
            }
        }
    }
}

fn output_code_table(curve: ToneCurve) -> OutputCodeTable {
    std::array::from_fn(|i| {
        let root = i.min(TABLE_ENTRIES) as f64 / TABLE_ENTRIES as f64;
        let encoded = srgb_encode(curve.apply(f64::from(curve.white()) * root * root));
        (encoded * 255.0 * 256.0).round() as u16
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::srgb::srgb8;

    fn outputs() -> Vec<OutputTransform> {
        let mut all = Vec::new();
        for gamut in [Gamut::Srgb, Gamut::DisplayP3] {
            for curve in [ToneCurve::Clip, ToneCurve::Filmic] {
                for dither in [false, true] {
                    let gains = [1.5, 1.0, 0.7];
                    all.push(OutputTransform {
                        gains,
                        gamut,
                        curve,
                        dither,
                    });
                }
            }
        }
        all
    }

    #[test]
    fn the_table_is_within_one_code_of_the_formula() {
        for output in outputs() {
            let encoder = TabulatedOutputTransform::new(&output);
            for y in 0..9 {
                let linear: Vec<[f32; 3]> = (0..3000)
                    .map(|i| {
                        [0.0, 0.31, 0.62]
                            .map(|o| ((i as f32 / 3000.0 + o) % 1.0).powi(3) * 7.0 - 0.01)
                    })
                    .chain([
                        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY],
                        [-0.0, 1e-40, 1e38],
                    ])
                    .collect();
                let mut out = vec![[0; 4]; linear.len()];
                let at = CameraPixel { x: 5, y };
                encoder.encode(&linear, at, &mut out);
                for (i, (linear, out)) in linear.iter().zip(&out).enumerate() {
                    if output.gamut != Gamut::Srgb && linear.iter().any(|y| !y.is_finite()) {
                        continue; // the matrix makes NaN of infinities
                    }
                    let at = CameraPixel { x: 5 + i as u32, y };
                    let want = output.codes(linear.map(f64::from), at);
                    for c in 0..CHANNELS {
                        assert!(
                            out[c].abs_diff(want[c]) <= 1,
                            "{output:?}, {linear:?}: {out:?}, not {want:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn without_dither_codes_are_srgb() {
        for i in 0..=4000 {
            let linear = f64::from(i) / 3000.0;
            let codes = OutputTransform::srgb(0.5).codes([linear; 3], CameraPixel { x: 3, y: 4 });
            assert_eq!(codes, [srgb8(linear * 0.5); 3]);
        }
    }

    #[test]
    fn dither_keeps_the_mean_and_leaves_black_and_white_alone() {
        let output = OutputTransform {
            dither: true,
            ..OutputTransform::srgb(1.0)
        };
        for linear in [0.0, 0.001, 0.01, 0.2, 0.7, 1.0] {
            let encoded = output.encode([linear; 3])[0] * 255.0;
            let pixels = (0..64).map(|i| CameraPixel {
                x: i % 8 + 16,
                y: i / 8,
            });
            let codes: Vec<u8> = pixels.map(|at| output.codes([linear; 3], at)[0]).collect();
            let mean = codes.iter().map(|code| f64::from(*code)).sum::<f64>() / 64.0;
            assert!(
                (mean - encoded).abs() <= 1.0 / 64.0,
                "{linear}: {mean}, not {encoded}"
            );
            assert!(
                codes
                    .iter()
                    .all(|code| (f64::from(*code) - encoded).abs() < 1.0)
            );
        }
    }

    #[test]
    fn each_threshold_occurs_once_in_eight_by_eight() {
        let mut thresholds: Vec<u32> = (0..64)
            .map(|i| bayer(CameraPixel { x: i % 8, y: i / 8 }))
            .collect();
        thresholds.sort_unstable();
        assert!(thresholds.into_iter().eq(0..64));
    }

    #[test]
    fn white_stays_white_and_tone_curves_are_monotonic() {
        for output in outputs() {
            let white = OutputTransform {
                gains: [9.0; 3],
                ..output
            };
            assert_eq!(white.codes([1.0; 3], CameraPixel { x: 0, y: 0 }), [255; 3]);
        }
        for curve in [ToneCurve::Clip, ToneCurve::Filmic] {
            assert_eq!(curve.apply(0.0), 0.0);
            assert!((curve.apply(1e9) - 1.0).abs() < 1e-7);
            let tones: Vec<f64> = (0..600)
                .map(|i| curve.apply(f64::from(i) / 100.0))
                .collect();
            assert!(tones.is_sorted());
        }
        // In a wider gamut, the red of sRGB takes less of its primary.
        let p3 = OutputTransform {
            gamut: Gamut::DisplayP3,
            ..OutputTransform::srgb(1.0)
        };
        let [r, g, b] = p3.encode([1.0, 0.0, 0.0]);
        assert!(
            (r - 0.9175).abs() < 1e-3 && (g - 0.2003).abs() < 1e-3 && (b - 0.1387).abs() < 1e-3
        );
    }
}
