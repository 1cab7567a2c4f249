//! The correspondence from photographs of Gray code: an affine map `(x+½, y+½, 1) → (u, v)`.
//!
//! Patterns show each bit of the Gray code of the column and row numbers, once plain and once inverted. The bit is 1 at
//! a camera pixel that is brighter under the plain pattern. Scattering objects blur the finest stripes to grey, so
//! decoding of a pixel stops at its first unclear bit, which leaves a range of light elements instead of one.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::affine_fit::{GrayCodePosition, fit_affine_row};
#[cfg(not(target_arch = "wasm32"))]
use super::graycode_fit::GrayCodeFit;
use crate::linalg;
use crate::transport::{CHANNELS, CameraPixel, Correspondence, Extent};

/// Least contrast `|p − n| / (p + n)` of a clear bit. Scattering lowers the contrast; at the edge of a stripe it passes
/// through zero, and noise would decide.
const MIN_CONTRAST: f32 = 0.15;
/// Least brightness `p + n` of a usable pixel, relative to the brightest.
const MIN_RELATIVE_BRIGHTNESS: f32 = 0.05;
/// Least brightness of a pixel whose contrast counts, relative to the brightest: noise raises the contrast of darker ones.
const MIN_CONTRAST_BRIGHTNESS: f32 = 0.1;
/// Least number of decoded pixels for a reliable fit.
const MIN_DECODED_PIXELS: usize = 100;

/// The axis of the light plane that a bit numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightPlaneAxis {
    /// Columns.
    X,
    /// Rows.
    Y,
}

impl std::fmt::Display for LightPlaneAxis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
        })
    }
}

/// Photographs of one bit, `[rows, width]` in units of the measurement; NaN where saturated.
#[derive(Clone, Debug)]
pub struct BitPair {
    /// Under the plain pattern.
    pub plain: Vec<[f32; CHANNELS]>,
    /// Under the inverted pattern.
    pub inverted: Vec<[f32; CHANNELS]>,
}

impl BitPair {
    /// The contrast of plain and inverted pattern, `|p − n| / (p + n)`, that one in a hundred of the bright camera pixels
    /// exceeds. It is 1 where a pixel sees elements of the same code only. `None` without bright pixels.
    ///
    /// If the display is sharp, the object alone lowers the contrast of its finest stripes.
    pub fn best_contrast(&self) -> Option<f32> {
        let sums = |photo: &[[f32; CHANNELS]]| -> Vec<f32> {
            photo.iter().map(|sample| sample.iter().sum()).collect()
        };
        let pairs: Vec<(f32, f32)> = (sums(&self.plain).into_iter())
            .zip(sums(&self.inverted))
            .filter(|(p, n)| (p + n).is_finite())
            .collect();
        let brightest = pairs.iter().map(|(p, n)| p + n).fold(0.0, f32::max);
        let bright = pairs
            .iter()
            .filter(|(p, n)| p + n > MIN_CONTRAST_BRIGHTNESS * brightest);
        let mut contrasts: Vec<f64> = bright
            .map(|(p, n)| f64::from((p - n).abs() / (p + n)))
            .collect();
        linalg::sort(&mut contrasts);
        contrasts
            .get(contrasts.len() * 99 / 100)
            .map(|contrast| *contrast as f32)
    }
}

/// Why no correspondence can be decoded.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum CalibrationError {
    /// The Gray code has no bits for an axis.
    #[error("\"graycode\" has no photographs for axis {0}")]
    MissingBits(LightPlaneAxis),
    /// Too few pixels have clear bits.
    #[error(
        "only {decoded} camera pixels show clear Gray code along axis {axis}; at least {MIN_DECODED_PIXELS} are needed"
    )]
    TooFewPixels {
        /// Number of decoded pixels.
        decoded: usize,
        /// The axis.
        axis: LightPlaneAxis,
    },
}

/// Photographs of Gray code: the bits of each axis, most significant first.
#[derive(Clone, Debug, Default)]
pub struct GrayCodePhotos {
    /// Bits of the column number.
    pub x: Vec<BitPair>,
    /// Bits of the row number.
    pub y: Vec<BitPair>,
    /// The camera rows that were read, from the top down.
    pub rows: Vec<u32>,
}

impl GrayCodePhotos {
    /// The photographs of every bit of a light plane; `photo` gives that of an axis, a bit, and whether its pattern was
    /// inverted. None may be missing: a gap would shift the bits below it.
    ///
    /// # Errors
    /// The first of `photo`.
    pub fn collect<E>(
        light: Extent,
        rows: Vec<u32>,
        photo: impl Fn(LightPlaneAxis, u32, bool) -> Result<Vec<[f32; CHANNELS]>, E>,
    ) -> Result<Self, E> {
        let bits = |axis, side: u32| {
            let pair = |bit| {
                Ok(BitPair {
                    plain: photo(axis, bit, false)?,
                    inverted: photo(axis, bit, true)?,
                })
            };
            let bits = side.next_power_of_two().ilog2().max(1);
            (0..bits).rev().map(pair).collect::<Result<_, E>>()
        };
        Ok(Self {
            x: bits(LightPlaneAxis::X, light.width)?,
            y: bits(LightPlaneAxis::Y, light.height)?,
            rows,
        })
    }

    /// Decodes all pixels and fits a correspondence to their positions: an affine map, and a displacement if the
    /// correspondence bends. `camera` is the size of the camera grid.
    ///
    /// # Errors
    /// If an axis has no bits or too few pixels can be decoded.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn fit(&self, camera: Extent) -> Result<GrayCodeFit, CalibrationError> {
        let [(u, u_row), (v, v_row)] = self.decode(camera)?;
        let pixels = self.rows.len() * camera.width as usize;
        Ok(GrayCodeFit::new(camera, pixels, [&u, &v], [u_row, v_row]))
    }

    /// Decodes all pixels and fits an affine correspondence to their positions, for modules that pages load: they have no room
    /// for more.
    ///
    /// # Errors
    /// Those of `fit`.
    pub fn fit_affine(&self, camera: Extent) -> Result<Correspondence, CalibrationError> {
        let [(_, u_row), (_, v_row)] = self.decode(camera)?;
        Ok(Correspondence::from_affine([u_row, v_row]))
    }

    /// The positions along u and v, each with the row of the affine map.
    fn decode(&self, camera: Extent) -> Result<[DecodedAxis; 2], CalibrationError> {
        let axis = |bits: &[BitPair], axis| {
            if bits.is_empty() {
                return Err(CalibrationError::MissingBits(axis));
            }
            let pixels = decode(bits, &self.rows, camera.width);
            let decoded = pixels.len();
            let row = (decoded >= MIN_DECODED_PIXELS).then(|| fit_affine_row(&pixels));
            let row = row.flatten();
            let row = row.ok_or(CalibrationError::TooFewPixels { decoded, axis })?;
            Ok((pixels, row))
        };
        Ok([
            axis(&self.x, LightPlaneAxis::X)?,
            axis(&self.y, LightPlaneAxis::Y)?,
        ])
    }
}

/// The positions along an axis, and the row of the affine map that fits them.
type DecodedAxis = (Vec<GrayCodePosition>, [f64; 3]);

/// Positions along one axis of the pixels with at least half of their bits clear.
pub(super) fn decode(bits: &[BitPair], rows: &[u32], width: u32) -> Vec<GrayCodePosition> {
    let width = width as usize;
    let pixels = rows.len() * width;
    // A saturated sample is at least white, which is 1.
    let value = |v: &f32| if v.is_nan() { 1.0 } else { *v };
    let sum = |p: &[f32; CHANNELS]| p.iter().map(value).sum::<f32>();
    let difference_and_sum = |bit: &BitPair, n: usize| {
        let (plain, inverted) = (sum(&bit.plain[n]), sum(&bit.inverted[n]));
        (plain - inverted, plain + inverted)
    };
    let brightest = (0..pixels)
        .map(|n| difference_and_sum(&bits[0], n).1)
        .fold(0.0f32, f32::max);
    let pixel = |n: usize| {
        let (mut code, mut clear) = (0u32, 0);
        for bit in bits {
            let (difference, total) = difference_and_sum(bit, n);
            let is_dark = total <= MIN_RELATIVE_BRIGHTNESS * brightest;
            if is_dark || difference.abs() < MIN_CONTRAST * total {
                break;
            }
            // Gray to binary: each bit is the XOR of the Gray bit and the next higher bit.
            let bit_is_set = (difference > 0.0) != (code & 1 == 1);
            code = code << 1 | u32::from(bit_is_set);
            clear += 1;
        }
        let unclear = bits.len() - clear;
        (2 * clear >= bits.len() && clear > 0).then(|| {
            let range = f64::from(1u32 << unclear.min(31));
            let (x, y) = ((n % width) as u32, rows[n / width]);
            GrayCodePosition {
                pixel: CameraPixel { x, y },
                position: (f64::from(code) + 0.5) * range,
                width: range,
            }
        })
    };
    (0..pixels).filter_map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ideal photographs of Gray code through a known map, blurred over `blur` elements.
    fn photograph(camera: Extent, affine: [[f64; 3]; 2], bits: u32, blur: f64) -> GrayCodePhotos {
        let map = Correspondence::from_affine(affine);
        let axis = |along: LightPlaneAxis| {
            let bit = |b: u32| {
                let brightness = |n: usize| -> f32 {
                    let (x, y) = (n as u32 % camera.width, n as u32 / camera.width);
                    let at = map.at(CameraPixel { x, y });
                    let centre = if along == LightPlaneAxis::X {
                        at.u
                    } else {
                        at.v
                    };
                    let taps = (-8..=8).map(|i| centre + blur * f64::from(i) / 8.0);
                    let lit = taps.filter(|t| {
                        let m = t.floor().max(0.0) as u32;
                        ((m ^ m >> 1) >> b) & 1 == 1
                    });
                    lit.count() as f32 / 17.0
                };
                let plain: Vec<_> = (0..camera.area()).map(|n| [brightness(n); 3]).collect();
                BitPair {
                    inverted: plain.iter().map(|p| p.map(|v| 1.0 - v)).collect(),
                    plain,
                }
            };
            (0..bits).rev().map(bit).collect()
        };
        GrayCodePhotos {
            x: axis(LightPlaneAxis::X),
            y: axis(LightPlaneAxis::Y),
            rows: (0..camera.height).collect(),
        }
    }

    #[test]
    fn a_known_map_is_recovered_sharp_or_blurred() {
        let camera = Extent::new(60, 40);
        let affine = [[0.5, 0.02, 1.3], [-0.03, 0.45, 4.0]];
        for blur in [0.0, 0.8, 2.0] {
            let found = photograph(camera, affine, 5, blur).fit_affine(camera);
            let found = found.unwrap().at(CameraPixel { x: 50, y: 5 });
            let truth = Correspondence::from_affine(affine).at(CameraPixel { x: 50, y: 5 });
            let apart = (found.u - truth.u).hypot(found.v - truth.v);
            assert!(apart < 0.1, "blur {blur}: {apart} elements off");
        }
    }

    #[test]
    fn contrast_of_the_finest_stripes_is_that_of_the_sharpest_pixels() {
        let camera = Extent::new(60, 40);
        let affine = [[0.5, 0.0, 1.0], [0.0, 0.5, 1.0]];
        let contrast = |blur| {
            let photos = photograph(camera, affine, 5, blur);
            photos.x.last().and_then(BitPair::best_contrast).unwrap()
        };
        assert!(contrast(0.0) > 0.99);
        // A blur over three elements leaves a third of stripes of two.
        assert!((contrast(1.5) - 0.33).abs() < 0.1, "{}", contrast(1.5));
        let dark = BitPair {
            plain: vec![[0.0; CHANNELS]; 4],
            inverted: vec![[f32::NAN; CHANNELS]; 4],
        };
        assert_eq!(dark.best_contrast(), None);
    }

    #[test]
    fn dark_photographs_and_missing_bits_are_errors() {
        let camera = Extent::new(20, 20);
        let mut code = photograph(camera, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]], 4, 0.0);
        for bit in &mut code.y {
            bit.plain.fill([0.0; 3]);
            bit.inverted.fill([0.0; 3]);
        }
        let error = code.fit_affine(camera);
        assert_eq!(
            error,
            Err(CalibrationError::TooFewPixels {
                decoded: 0,
                axis: LightPlaneAxis::Y
            })
        );
        assert_eq!(
            GrayCodePhotos::default().fit_affine(camera),
            Err(CalibrationError::MissingBits(LightPlaneAxis::X))
        );
    }
}
