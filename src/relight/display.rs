//! From linear light to the codes of a display: brightness and white balance, the display's primaries,
//! a tone curve, the transfer function that sRGB and Display P3 share, and dithering.

use std::sync::LazyLock;

use super::tone::srgb_encode;
use crate::transport::{CHANNELS, CameraPx};

/// How a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Factor on each channel: exposure times white balance.
    pub gains: [f32; CHANNELS],
    /// What its pixels can show.
    pub gamut: Gamut,
    /// How brightness is rendered.
    pub curve: ToneCurve,
    /// Whether codes are dithered: gradients do not band, and a pixel is a code off at most.
    pub dither: bool,
}

/// Primaries of a display. Pictures are taken to have those of sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gamut {
    /// IEC 61966-2-1.
    Srgb,
    /// Display P3: what is brighter than sRGB can show may be more colourful too.
    DisplayP3,
}

/// What becomes of brightness before the transfer function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneCurve {
    /// Shown as it is up to full brightness, and cut off there.
    Clip,
    /// Dark tones by a quarter darker, brighter ones rolled off until 5.6 times full brightness: the curve of
    /// J. Hable, "Filmic tonemapping operators", 2010, with the constants given there.
    Filmic,
}

impl Display {
    /// An sRGB display without dithering: what measurements are made on.
    pub fn srgb(exposure: f32) -> Self {
        Self {
            gains: [exposure; CHANNELS],
            gamut: Gamut::Srgb,
            curve: ToneCurve::Clip,
            dither: false,
        }
    }

    /// Linear RGB to the display's signal, 0 to 1. NaN is black.
    pub fn encode(&self, linear: [f64; CHANNELS]) -> [f64; CHANNELS] {
        let given: [f64; CHANNELS] = std::array::from_fn(|c| linear[c] * f64::from(self.gains[c]));
        let shown = match self.gamut {
            Gamut::Srgb => given,
            Gamut::DisplayP3 => {
                let matrix = self.gamut.from_srgb();
                matrix.map(|row| (0..CHANNELS).map(|c| f64::from(row[c]) * given[c]).sum())
            }
        };
        shown.map(|y| srgb_encode(self.curve.apply(y)))
    }

    /// The codes of the pixel at `at`.
    pub fn codes(&self, linear: [f64; CHANNELS], at: CameraPx) -> [u8; CHANNELS] {
        let threshold = match self.dither {
            true => (f64::from(bayer(at)) + 0.5) / 64.0,
            false => 0.5,
        };
        self.encode(linear)
            .map(|signal| (signal * 255.0 + threshold) as u8)
    }
}

impl Gamut {
    /// What CSS calls it.
    pub fn color_space(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DisplayP3 => "display-p3",
        }
    }

    /// Linear RGB of this gamut from that of sRGB, row by row.
    pub fn from_srgb(self) -> [[f32; CHANNELS]; CHANNELS] {
        match self {
            Self::Srgb => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            // CSS Color Module Level 4, both over XYZ.
            Self::DisplayP3 => [
                [0.822_461_97, 0.177_538_03, 0.0],
                [0.033_194_2, 0.966_805_8, 0.0],
                [0.017_082_63, 0.072_397_44, 0.910_519_96],
            ],
        }
    }
}

impl ToneCurve {
    /// The brightness that is shown as full.
    pub fn white(self) -> f32 {
        match self {
            Self::Clip => 1.0,
            Self::Filmic => 5.6,
        }
    }

    /// What is shown of a brightness, 0 to 1. NaN is black.
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

/// A number from 0 to 63 for every pixel, each of them once in any 8 by 8 (B. E. Bayer, "An optimum
/// method for two-level rendition of continuous-tone pictures", 1973).
pub fn bayer(at: CameraPx) -> u32 {
    let (x, y) = (at.x ^ at.y, at.y);
    let bits = |n: u32| ((n & 1) << 4) | ((n & 2) << 1) | ((n & 4) >> 2);
    bits(x) << 1 | bits(y)
}

/// [`Display::codes`] by table, for whole rows, to within one code.
#[derive(Debug)]
pub struct Encoder {
    curve: &'static Curve,
    /// Of a pixel after the other.
    gains: [f32; CHANNELS * BLOCK],
    matrix: Option<[[f32; CHANNELS]; CHANNELS]>,
    dither: bool,
    /// Table entries to the root of a brightness.
    scale: f32,
}

/// Signal of 0 to 255 in parts of 256, by the root of brightness, in which the curves are so even that
/// an entry is a quarter of a code at most.
#[derive(Debug)]
struct Curve([u16; (MASK + 1) as usize]);

const ENTRIES: usize = 4096;
/// Of a table of twice that, in which a number under it lies whatever it is.
const MASK: u32 = 2 * ENTRIES as u32 - 1;
/// Pixels that are encoded together.
const BLOCK: usize = 32;

impl Encoder {
    /// For a display.
    pub fn new(display: &Display) -> Self {
        static CURVES: [LazyLock<Curve>; 2] = [
            LazyLock::new(|| Curve::new(ToneCurve::Clip)),
            LazyLock::new(|| Curve::new(ToneCurve::Filmic)),
        ];
        let root = display.curve.white().sqrt();
        Self {
            curve: &CURVES[usize::from(display.curve == ToneCurve::Filmic)],
            gains: std::array::from_fn(|i| display.gains[i % CHANNELS]),
            matrix: (display.gamut != Gamut::Srgb).then(|| display.gamut.from_srgb()),
            dither: display.dither,
            scale: ENTRIES as f32 / root,
        }
    }

    /// Pixels of a row, from the one at `at` on, as RGBA.
    ///
    /// # Panics
    /// If `out` has another length.
    pub fn encode(&self, linear: &[[f32; CHANNELS]], at: CameraPx, out: &mut [[u8; 4]]) {
        assert_eq!(linear.len(), out.len(), "as many codes as pixels");
        // 128 in 256 rounds.
        let thresholds: [u32; 8] = std::array::from_fn(|i| match self.dither {
            true => {
                4 * bayer(CameraPx {
                    x: at.x + i as u32,
                    y: at.y,
                }) + 2
            }
            false => 128,
        });
        for (linear, out) in linear.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            // Apart from the table, so that it can be done by vectors.
            let mut entries = [0.0f32; CHANNELS * BLOCK];
            let values = linear.as_flattened();
            for ((entry, value), gain) in entries.iter_mut().zip(values).zip(&self.gains) {
                *entry = value * gain;
            }
            if let Some(matrix) = &self.matrix {
                for pixel in entries.as_chunks_mut::<CHANNELS>().0 {
                    let [r, g, b] = *pixel;
                    *pixel = matrix.map(|row| row[0] * r + row[1] * g + row[2] * b);
                }
            }
            let indices = entries.map(|entry| {
                // NaN is neither more nor less, so this makes it 0.
                let root = if entry > 0.0 { entry } else { 0.0 }.sqrt();
                // Of such a sum the last bits are the number, rounded.
                const ROUNDING: f32 = (1 << 23) as f32;
                ((root * self.scale).min(ENTRIES as f32) + ROUNDING).to_bits() & MASK
            });
            let indices = indices.as_chunks::<CHANNELS>().0;
            for (i, (indices, out)) in indices.iter().zip(out).enumerate() {
                let [r, g, b] = indices.map(|index| {
                    let signal = u32::from(self.curve.0[index as usize]);
                    ((signal + thresholds[i % 8]) >> 8) as u8
                });
                *out = [r, g, b, 255];
            }
        }
    }
}

impl Curve {
    fn new(tones: ToneCurve) -> Self {
        Self(std::array::from_fn(|i| {
            let root = i.min(ENTRIES) as f64 / ENTRIES as f64;
            let signal = srgb_encode(tones.apply(f64::from(tones.white()) * root * root));
            (signal * 255.0 * 256.0).round() as u16
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::tone::srgb8;

    fn displays() -> Vec<Display> {
        let mut all = Vec::new();
        for gamut in [Gamut::Srgb, Gamut::DisplayP3] {
            for curve in [ToneCurve::Clip, ToneCurve::Filmic] {
                for dither in [false, true] {
                    let gains = [1.5, 1.0, 0.7];
                    all.push(Display {
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
    fn tables_are_within_one_code_of_the_formulas() {
        for display in displays() {
            let encoder = Encoder::new(&display);
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
                let at = CameraPx { x: 5, y };
                encoder.encode(&linear, at, &mut out);
                for (i, (linear, out)) in linear.iter().zip(&out).enumerate() {
                    if display.gamut != Gamut::Srgb && linear.iter().any(|y| !y.is_finite()) {
                        continue; // what infinity is in another gamut nobody knows
                    }
                    let at = CameraPx { x: 5 + i as u32, y };
                    let want = display.codes(linear.map(f64::from), at);
                    for c in 0..CHANNELS {
                        assert!(
                            out[c].abs_diff(want[c]) <= 1,
                            "{display:?}, {linear:?}: {out:?}, not {want:?}"
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
            let codes = Display::srgb(0.5).codes([linear; 3], CameraPx { x: 3, y: 4 });
            assert_eq!(codes, [srgb8(linear * 0.5); 3]);
        }
    }

    #[test]
    fn dither_keeps_brightness_and_leaves_black_and_white_alone() {
        let display = Display {
            dither: true,
            ..Display::srgb(1.0)
        };
        for linear in [0.0, 0.001, 0.01, 0.2, 0.7, 1.0] {
            let signal = display.encode([linear; 3])[0] * 255.0;
            let pixels = (0..64).map(|i| CameraPx {
                x: i % 8 + 16,
                y: i / 8,
            });
            let codes: Vec<u8> = pixels.map(|at| display.codes([linear; 3], at)[0]).collect();
            let mean = codes.iter().map(|code| f64::from(*code)).sum::<f64>() / 64.0;
            assert!(
                (mean - signal).abs() <= 1.0 / 64.0,
                "{linear}: {mean}, not {signal}"
            );
            assert!(
                codes
                    .iter()
                    .all(|code| (f64::from(*code) - signal).abs() < 1.0)
            );
        }
    }

    #[test]
    fn every_threshold_comes_once_in_eight_by_eight() {
        let mut seen: Vec<u32> = (0..64)
            .map(|i| bayer(CameraPx { x: i % 8, y: i / 8 }))
            .collect();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..64));
    }

    #[test]
    fn white_stays_white_and_curves_rise() {
        for display in displays() {
            let white = Display {
                gains: [9.0; 3],
                ..display
            };
            assert_eq!(white.codes([1.0; 3], CameraPx { x: 0, y: 0 }), [255; 3]);
        }
        for curve in [ToneCurve::Clip, ToneCurve::Filmic] {
            assert_eq!(curve.apply(0.0), 0.0);
            assert!((curve.apply(1e9) - 1.0).abs() < 1e-7);
            let tones: Vec<f64> = (0..600)
                .map(|i| curve.apply(f64::from(i) / 100.0))
                .collect();
            assert!(tones.is_sorted());
        }
        // A colour that sRGB holds is the same colour in a wider gamut: less of its primary.
        let p3 = Display {
            gamut: Gamut::DisplayP3,
            ..Display::srgb(1.0)
        };
        let [r, g, b] = p3.encode([1.0, 0.0, 0.0]);
        assert!(
            (r - 0.9175).abs() < 1e-3 && (g - 0.2003).abs() < 1e-3 && (b - 0.1387).abs() < 1e-3
        );
    }
}
