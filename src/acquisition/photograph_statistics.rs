//! What a photograph says by itself: how bright it is, how sharp, and whether it is in the same place as another.

use crate::transport::{CHANNELS, Extent};

/// Bins of a histogram, from black to white.
pub const HISTOGRAM_BINS: usize = 64;
/// Share of the samples that may be brighter than the brightest part: a few are of highlights and defective pixels.
const BRIGHTEST_SHARE: f64 = 0.001;
/// Times that a shift is refined.
const SHIFT_STEPS: usize = 4;

/// Statistics of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotographStatistics {
    /// Samples of each channel from black to white; those outside count in the first and the last bin.
    pub histogram: [[u32; HISTOGRAM_BINS]; CHANNELS],
    /// Measurement that one sample in a thousand exceeds.
    pub brightest: f64,
    /// Mean squared difference of neighbouring pixels, relative to the mean square of the picture.
    pub sharpness: f64,
}

impl PhotographStatistics {
    /// Of codes `[N]`, where `black` and `white` are those of the measurements 0 and 1.
    pub fn new(camera: Extent, codes: &[[u16; CHANNELS]], black: f64, white: f64) -> Self {
        let measurement = |code: u16| (f64::from(code) - black) / (white - black);
        let mut histogram = [[0; HISTOGRAM_BINS]; CHANNELS];
        for code in codes {
            for c in 0..CHANNELS {
                let bin = measurement(code[c]) * HISTOGRAM_BINS as f64;
                // A conversion to integers clips below 0.
                histogram[c][(bin as usize).min(HISTOGRAM_BINS - 1)] += 1;
            }
        }
        let plane = luminance(codes, black, white);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut differences = 0.0;
        for y in 1..height {
            for x in 1..width {
                let at = plane[y * width + x];
                let (left, above) = (plane[y * width + x - 1], plane[(y - 1) * width + x]);
                differences += f64::from((at - left).powi(2) + (at - above).powi(2));
            }
        }
        let square: f64 = plane.iter().map(|y| f64::from(*y).powi(2)).sum();
        Self {
            histogram,
            brightest: brightest(codes, measurement),
            sharpness: differences / square.max(f64::MIN_POSITIVE),
        }
    }
}

fn brightest(codes: &[[u16; CHANNELS]], measurement: impl Fn(u16) -> f64) -> f64 {
    let mut counts = vec![0u32; usize::from(u16::MAX) + 1];
    let samples = codes.as_flattened();
    samples
        .iter()
        .for_each(|code| counts[usize::from(*code)] += 1);
    let mut left = (samples.len() as f64 * BRIGHTEST_SHARE) as u32;
    for (code, count) in counts.iter().enumerate().rev() {
        if *count > left {
            return measurement(code as u16);
        }
        left -= count;
    }
    measurement(0)
}

/// Mean measurement of the channels of each pixel, `[N]`.
pub fn luminance(codes: &[[u16; CHANNELS]], black: f64, white: f64) -> Vec<f32> {
    let scale = 1.0 / (CHANNELS as f64 * (white - black));
    let mean = |code: &[u16; CHANNELS]| {
        let sum: f64 = code.iter().map(|code| f64::from(*code)).sum();
        ((sum - CHANNELS as f64 * black) * scale) as f32
    };
    codes.iter().map(mean).collect()
}

/// By how many pixels to the right and down `moved` shows the object beside `first`, both `[N]`, of shifts up to about two
/// pixels. A difference in brightness does not matter. `None` of pictures without detail.
///
/// Least squares over the gradient of the first (Lucas and Kanade, "An iterative image registration technique", 1981).
pub fn shift_between(camera: Extent, first: &[f32], moved: &[f32]) -> Option<[f64; 2]> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let sum = |plane: &[f32]| plane.iter().map(|y| f64::from(*y)).sum::<f64>();
    let gain = sum(moved) / sum(first).max(f64::MIN_POSITIVE);
    let smooth = |plane: &[f32]| blurred(camera, plane);
    let (first, moved) = (smooth(first), smooth(moved));
    let at = |x: usize, y: usize| f64::from(first[y * width + x]);
    let mut shift = [0.0f64; 2];
    for _ in 0..SHIFT_STEPS {
        let (mut xx, mut xy, mut yy, mut xr, mut yr) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for y in 4..height.saturating_sub(4) {
            for x in 4..width.saturating_sub(4) {
                let gx = (at(x + 1, y) - at(x - 1, y)) / 2.0;
                let gy = (at(x, y + 1) - at(x, y - 1)) / 2.0;
                let shown = bilinear(&moved, width, x as f64 + shift[0], y as f64 + shift[1]);
                // The gradient points to where the picture came from.
                let residual = at(x, y) - shown / gain;
                xx += gx * gx;
                xy += gx * gy;
                yy += gy * gy;
                xr += gx * residual;
                yr += gy * residual;
            }
        }
        let determinant = xx * yy - xy * xy;
        if determinant <= 1e-3 * xx * yy || determinant.is_nan() {
            return None;
        }
        shift[0] += (yy * xr - xy * yr) / determinant;
        shift[1] += (xx * yr - xy * xr) / determinant;
        shift = shift.map(|s| s.clamp(-3.0, 3.0));
    }
    Some(shift)
}

/// Means of 3 × 3 pixels, so that gradients are those of the picture and not of its noise.
fn blurred(camera: Extent, plane: &[f32]) -> Vec<f32> {
    let (width, height) = (camera.width as i64, camera.height as i64);
    let mean = |(x, y): (u32, u32)| {
        let (x, y) = (i64::from(x), i64::from(y));
        let mut sum = 0.0;
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (x, y) = ((x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1));
                sum += plane[(y * width + x) as usize];
            }
        }
        sum / 9.0
    };
    camera.cells().map(mean).collect()
}

/// A picture between four pixels, which are inside.
fn bilinear(plane: &[f32], width: usize, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (fx, fy) = (x - left, y - top);
    let i = top as usize * width + left as usize;
    let at = |i: usize| f64::from(plane[i]);
    (1.0 - fy) * ((1.0 - fx) * at(i) + fx * at(i + 1))
        + fy * ((1.0 - fx) * at(i + width) + fx * at(i + width + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Extent = Extent::new(60, 50);

    /// Smooth detail, moved by (dx, dy) pixels.
    fn picture(dx: f64, dy: f64) -> Vec<f32> {
        let at = |(x, y): (u32, u32)| {
            let (x, y) = (f64::from(x) - dx, f64::from(y) - dy);
            (0.5 + 0.2 * (0.7 * x + 0.2 * y).sin() + 0.2 * (0.5 * y - 0.1 * x).cos()) as f32
        };
        CAMERA.cells().map(at).collect()
    }

    #[test]
    fn shifts_are_measured_whatever_the_brightness() {
        let first = picture(0.0, 0.0);
        for [dx, dy] in [[0.0, 0.0], [0.3, -0.2], [-0.8, 0.6], [1.7, 1.2]] {
            let moved: Vec<f32> = picture(dx, dy).iter().map(|y| 0.9 * y).collect();
            let [x, y] = shift_between(CAMERA, &first, &moved).unwrap();
            assert!(
                (x - dx).abs() < 0.05 && (y - dy).abs() < 0.05,
                "{dx} {dy}: {x} {y}"
            );
        }
        let flat = vec![0.5; CAMERA.area()];
        assert_eq!(shift_between(CAMERA, &flat, &flat), None);
    }

    #[test]
    fn blurred_pictures_are_less_sharp() {
        let codes = |plane: &[f32]| -> Vec<[u16; CHANNELS]> {
            plane
                .iter()
                .map(|y| [(1000.0 + 50_000.0 * y) as u16; CHANNELS])
                .collect()
        };
        let statistics =
            |plane: &[f32]| PhotographStatistics::new(CAMERA, &codes(plane), 1000.0, 51_000.0);
        let sharp: Vec<f32> = CAMERA
            .cells()
            .map(|(x, y)| if (x / 3 + y / 3) % 2 == 0 { 0.6 } else { 0.1 })
            .collect();
        let soft = statistics(&blurred(CAMERA, &sharp));
        let darker: Vec<f32> = sharp.iter().map(|y| 0.5 * y).collect();
        let (sharp, darker) = (statistics(&sharp), statistics(&darker));
        assert!(soft.sharpness < 0.6 * sharp.sharpness);
        assert!((darker.sharpness / sharp.sharpness - 1.0).abs() < 0.01);
        assert!((sharp.brightest - 0.6).abs() < 0.001);
        let counted: u32 = sharp.histogram[0].iter().sum();
        assert_eq!(counted as usize, CAMERA.area());
        assert_eq!(sharp.histogram[1][38], sharp.histogram[2][38]);
    }
}
