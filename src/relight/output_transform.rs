//! The output transform, from linear light to the codes of a canvas: the photograph's colour matrix with exposure and
//! white balance, gamut, tone curve, transfer function and dither, in this order, for each pixel.

use std::sync::LazyLock;

use super::srgb::srgb_encode;
use crate::transport::{CHANNELS, CameraPixel, ColorMatrix, convert_color, single_precision};

/// How linear light becomes codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputTransform {
    /// From the photograph's linear RGB to linear sRGB, row by row, times exposure and white balance.
    pub matrix: OutputMatrix,
    /// The canvas's gamut.
    pub gamut: Gamut,
    /// The tone curve.
    pub curve: ToneCurve,
    /// Whether to dither: this prevents banding in gradients, and changes a code by one at most.
    pub dither: bool,
}

/// From linear RGB to linear RGB, row by row, in single precision.
pub type OutputMatrix = [[f32; CHANNELS]; CHANNELS];

/// Primaries of a canvas.
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
    /// To sRGB without dither, for a photograph whose primaries are those of sRGB.
    pub fn srgb(exposure: f32) -> Self {
        Self {
            matrix: Self::diagonal([exposure; CHANNELS]),
            gamut: Gamut::Srgb,
            curve: ToneCurve::Clip,
            dither: false,
        }
    }

    /// The same for a photograph with this colour matrix. Coloured lights need one of their own, too:
    /// [`light_color_matrix`](crate::transport::light_color_matrix).
    pub fn with_color_matrix(self, color_matrix: &ColorMatrix) -> Self {
        Self {
            matrix: product(&self.matrix, &single_precision(color_matrix)),
            ..self
        }
    }

    /// The matrix of one factor for each channel.
    pub fn diagonal(factors: [f32; CHANNELS]) -> OutputMatrix {
        let mut matrix = [[0.0; CHANNELS]; CHANNELS];
        for (c, factor) in factors.into_iter().enumerate() {
            matrix[c][c] = factor;
        }
        matrix
    }

    /// The matrix from the photograph's linear RGB to linear RGB of the gamut.
    pub(super) fn gamut_matrix(&self) -> OutputMatrix {
        product(&self.gamut.from_srgb(), &self.matrix)
    }

    /// Linear RGB to encoded values of 0..=1, before dither. NaN becomes 0.
    pub fn encode(&self, linear: [f64; CHANNELS]) -> [f64; CHANNELS] {
        let converted = |row: [f32; CHANNELS]| {
            // A factor of 0 excludes its channel, even if the channel is not finite.
            let terms = row
                .into_iter()
                .zip(linear)
                .filter(|(factor, _)| *factor != 0.0);
            terms.map(|(factor, y)| f64::from(factor) * y).sum()
        };
        let converted: [f64; CHANNELS] = self.gamut_matrix().map(converted);
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

/// The matrix of the conversion by `first`, followed by that of `second`.
fn product(second: &OutputMatrix, first: &OutputMatrix) -> OutputMatrix {
    second.map(|row| std::array::from_fn(|c| (0..CHANNELS).map(|k| row[k] * first[k][c]).sum()))
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
    pub fn from_srgb(self) -> OutputMatrix {
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
    /// The matrix's diagonal, repeated for each pixel of a batch.
    gains: [f32; CHANNELS * BATCH_PIXELS],
    /// `None` if it has nothing beside the diagonal.
    matrix: Option<OutputMatrix>,
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
        let matrix = output.gamut_matrix();
        let diagonal: [f32; CHANNELS] = std::array::from_fn(|c| matrix[c][c]);
        Self {
            table: &TABLES[usize::from(output.curve == ToneCurve::Filmic)],
            gains: std::array::from_fn(|i| diagonal[i % CHANNELS]),
            matrix: (matrix != OutputTransform::diagonal(diagonal)).then_some(matrix),
            dither: output.dither,
            scale: TABLE_ENTRIES as f32 / output.curve.white().sqrt(),
        }
    }

    /// Writes RGBA of pixels side by side, of which `at` is the first.
    ///
    /// # Panics
    /// If `out` has another length than `linear`.
    pub fn encode(&self, linear: &[[f32; CHANNELS]], at: CameraPixel, out: &mut [[u8; 4]]) {
        // Not `assert_eq`, whose formatting code modules would have to carry.
        assert!(linear.len() == out.len(), "as many codes as pixels");
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
            match &self.matrix {
                None => {
                    let values = linear.as_flattened();
                    for ((exposed, value), gain) in exposed.iter_mut().zip(values).zip(&self.gains)
                    {
                        *exposed = value * gain;
                    }
                }
                Some(matrix) => {
                    let exposed = exposed.as_chunks_mut::<CHANNELS>().0;
                    for (exposed, linear) in exposed.iter_mut().zip(linear) {
                        *exposed = convert_color(matrix, *linear);
                    }
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
                    let mixing = [[1.9, -0.7, -0.2], [-0.2, 1.5, -0.3], [0.0, -0.6, 1.6]];
                    for matrix in [OutputTransform::diagonal([1.5, 1.0, 0.7]), mixing] {
                        all.push(OutputTransform {
                            matrix,
                            gamut,
                            curve,
                            dither,
                        });
                    }
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
                    if encoder.matrix.is_some() && linear.iter().any(|y| !y.is_finite()) {
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
                matrix: output.matrix.map(|row| row.map(|factor| 9.0 * factor)),
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
