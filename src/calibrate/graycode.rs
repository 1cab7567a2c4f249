//! Gray code to correspondence.
//!
//! Each bit of an element's column and row number, in Gray code, was shown once as it is and once
//! inverted. A camera pixel brighter in the first saw a 1. On glass that scatters, the finest
//! stripes blur into grey: a pixel's bits count only as far as they are clear, and it then tells its
//! place the more coarsely.

use thiserror::Error;

use super::fit::{Sample, robust_affine};
use crate::transport::{CHANNELS, CameraPx, Correspondence, Extent};

/// Contrast `|p − n| / (p + n)` below which a bit is not clear: scattering lowers it smoothly, and
/// near the border of a stripe, where noise would decide, it passes through zero.
const LEAST_CONTRAST: f32 = 0.15;
/// Brightness `p + n`, as a share of the brightest pixel's, below which a pixel is lead or shadow.
const LEAST_BRIGHTNESS: f32 = 0.05;
/// Fewest pixels to fit six numbers to.
const FEWEST_PIXELS: usize = 100;

/// Which number of an element a bit belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Columns.
    X,
    /// Rows.
    Y,
}

/// Photographs of one bit, `[rows, width]` in units of the measurement; NaN where saturated.
#[derive(Clone, Debug)]
pub struct BitPair {
    /// With the bit shown as it is.
    pub plain: Vec<[f32; CHANNELS]>,
    /// With the bit shown inverted.
    pub inverted: Vec<[f32; CHANNELS]>,
}

/// Why Gray code gives no correspondence.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum CalibrationError {
    /// A bit is not there.
    #[error("\"graycode\" has no bits for axis {0:?}; photograph them, or give \"correspondence\"")]
    NoBits(Axis),
    /// Hardly a pixel has clear bits.
    #[error(
        "only {0} camera pixels see clear Gray code along {1:?}; photograph it again with more light, or give \"correspondence\""
    )]
    FewPixels(usize, Axis),
}

/// Photographed Gray code: the bits of each axis, most significant first, in the camera rows given.
#[derive(Clone, Debug, Default)]
pub struct GrayCode {
    /// Bits of the column number.
    pub x: Vec<BitPair>,
    /// Bits of the row number.
    pub y: Vec<BitPair>,
    /// The camera rows that the bits have, from the top down.
    pub rows: Vec<u32>,
}

impl GrayCode {
    /// Decodes every pixel of the rows at hand and fits an affine map to where they look.
    pub fn correspondence(&self, camera: Extent) -> Result<Correspondence, CalibrationError> {
        let axis = |bits: &[BitPair], axis| {
            if bits.is_empty() {
                return Err(CalibrationError::NoBits(axis));
            }
            let samples = decode(bits, &self.rows, camera.width);
            let fitted = (samples.len() >= FEWEST_PIXELS).then(|| robust_affine(&samples));
            fitted
                .flatten()
                .ok_or(CalibrationError::FewPixels(samples.len(), axis))
        };
        Ok(Correspondence {
            affine: [axis(&self.x, Axis::X)?, axis(&self.y, Axis::Y)?],
        })
    }
}

/// Where each pixel with at least half of its bits clear looks along one axis.
fn decode(bits: &[BitPair], rows: &[u32], width: u32) -> Vec<Sample> {
    let pixels = rows.len() * width as usize;
    // A saturated sample is at least white.
    let full = |v: &f32| if v.is_nan() { 1.0 } else { *v };
    let sum = |p: &[f32; CHANNELS]| p.iter().map(full).sum::<f32>();
    let light = |bit: &BitPair, n: usize| {
        let (plain, inverted) = (sum(&bit.plain[n]), sum(&bit.inverted[n]));
        (plain - inverted, plain + inverted)
    };
    let brightest = (0..pixels)
        .map(|n| light(&bits[0], n).1)
        .fold(0.0f32, f32::max);
    let pixel = |n: usize| {
        let (mut code, mut clear) = (0u32, 0);
        for bit in bits {
            let (difference, total) = light(bit, n);
            let dark = total <= LEAST_BRIGHTNESS * brightest;
            if dark || difference.abs() < LEAST_CONTRAST * total {
                break;
            }
            // Gray to binary: each bit is the one above it, flipped where the Gray bit is set.
            let one = (difference > 0.0) != (code & 1 == 1);
            code = code << 1 | u32::from(one);
            clear += 1;
        }
        let unclear = bits.len() - clear;
        (2 * clear >= bits.len() && clear > 0).then(|| {
            let cell = f64::from(1u32 << unclear.min(31));
            let (x, y) = (n as u32 % width, rows[n / width as usize]);
            Sample {
                pixel: CameraPx { x, y },
                position: (f64::from(code) + 0.5) * cell,
                cell,
            }
        })
    };
    (0..pixels).filter_map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ideal photographs of Gray code through a known map, blurred over `blur` elements.
    fn photograph(camera: Extent, affine: [[f64; 3]; 2], bits: u32, blur: f64) -> GrayCode {
        let map = Correspondence { affine };
        let axis = |along: Axis| {
            let bit = |b: u32| {
                let seen = |n: usize| -> f32 {
                    let (x, y) = (n as u32 % camera.width, n as u32 / camera.width);
                    let at = map.at(CameraPx { x, y });
                    let centre = if along == Axis::X { at.u } else { at.v };
                    let taps = (-8..=8).map(|i| centre + blur * f64::from(i) / 8.0);
                    let lit = taps.filter(|t| {
                        let m = t.floor().max(0.0) as u32;
                        ((m ^ m >> 1) >> b) & 1 == 1
                    });
                    lit.count() as f32 / 17.0
                };
                let plain: Vec<_> = (0..camera.area()).map(|n| [seen(n); 3]).collect();
                BitPair {
                    inverted: plain.iter().map(|p| p.map(|v| 1.0 - v)).collect(),
                    plain,
                }
            };
            (0..bits).rev().map(bit).collect()
        };
        GrayCode {
            x: axis(Axis::X),
            y: axis(Axis::Y),
            rows: (0..camera.height).collect(),
        }
    }

    #[test]
    fn a_known_map_is_found_sharp_or_blurred() {
        let camera = Extent {
            width: 60,
            height: 40,
        };
        let affine = [[0.5, 0.02, 1.3], [-0.03, 0.45, 4.0]];
        for blur in [0.0, 0.8, 2.0] {
            let found = photograph(camera, affine, 5, blur).correspondence(camera);
            let found = Correspondence::at(&found.unwrap(), CameraPx { x: 50, y: 5 });
            let truth = Correspondence { affine }.at(CameraPx { x: 50, y: 5 });
            let apart = (found.u - truth.u).hypot(found.v - truth.v);
            assert!(apart < 0.1, "blur {blur}: {apart} elements off");
        }
    }

    #[test]
    fn nothing_to_see_is_an_error() {
        let camera = Extent {
            width: 20,
            height: 20,
        };
        let mut code = photograph(camera, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]], 4, 0.0);
        for bit in &mut code.y {
            bit.plain.fill([0.0; 3]);
            bit.inverted.fill([0.0; 3]);
        }
        let error = code.correspondence(camera);
        assert_eq!(error, Err(CalibrationError::FewPixels(0, Axis::Y)));
        assert_eq!(
            GrayCode::default().correspondence(camera),
            Err(CalibrationError::NoBits(Axis::X))
        );
    }
}
