//! Filters of pictures along rows, then along columns. The border repeats.

use crate::capture::LinearPhoto;
use crate::linalg::cubic_convolution_weights;
use crate::transport::Extent;

/// An offset along an axis, and the weight of the sample there.
type Tap = (i64, f64);

/// Standard deviations at which a Gaussian is cut off, at least.
const MIN_GAUSSIAN_RADIUS: f64 = 3.0;

/// The picture shifted to the right and down by so many pixels, by the cubic convolution of Keys (1981).
pub(super) fn shifted(picture: &LinearPhoto, camera: Extent, shift: [f64; 2]) -> LinearPhoto {
    let taps = shift.map(|d| {
        let cell = (-d).floor();
        let offsets = (cell as i64 - 1)..;
        let weights = cubic_convolution_weights(-d - cell);
        offsets.zip(weights).collect::<Vec<Tap>>()
    });
    filtered(picture, camera, [&taps[0], &taps[1]])
}

/// The emissions `[M]` on the `light` plane, blurred by a Gaussian with a standard deviation of so many elements.
pub(super) fn blurred(emissions: &[f32], light: Extent, deviation: f64) -> Vec<f32> {
    let radius = (MIN_GAUSSIAN_RADIUS * deviation).ceil() as i64;
    let weight = |d: i64| match d {
        0 => 1.0, // without a deviation too
        d => (-0.5 * (d as f64 / deviation).powi(2)).exp(),
    };
    let sum: f64 = (-radius..=radius).map(weight).sum();
    let taps: Vec<Tap> = (-radius..=radius).map(|d| (d, weight(d) / sum)).collect();
    filtered(emissions.as_chunks::<1>().0, light, [&taps, &taps]).into_flattened()
}

/// Filters a picture by the taps along x and along y. Negative sums become zero, as light is not negative.
fn filtered<const C: usize>(
    picture: &[[f32; C]],
    extent: Extent,
    [x_taps, y_taps]: [&[Tap]; 2],
) -> Vec<[f32; C]> {
    let (width, height) = (extent.width as usize, extent.height as usize);
    let rows = filtered_lines(picture, width, x_taps, |row, x| row * width + x);
    filtered_lines(&rows, height, y_taps, |column, y| y * width + column)
}

/// Filters lines of `length` samples; `index` is that of a line and of a position on it.
fn filtered_lines<const C: usize>(
    picture: &[[f32; C]],
    length: usize,
    taps: &[Tap],
    index: impl Fn(usize, usize) -> usize,
) -> Vec<[f32; C]> {
    let mut filtered = picture.to_vec();
    for line in 0..picture.len() / length {
        for i in 0..length {
            let mut sum = [0.0; C];
            for &(offset, weight) in taps {
                let from = (i as i64 + offset).clamp(0, length as i64 - 1);
                let from = picture[index(line, from as usize)];
                (0..C).for_each(|c| sum[c] += weight * f64::from(from[c]));
            }
            filtered[index(line, i)] = sum.map(|y: f64| y.max(0.0) as f32);
        }
    }
    filtered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::CHANNELS;

    #[test]
    fn a_picture_is_shifted_to_the_right_and_down() {
        let camera = Extent::new(12, 9);
        let value = |x: f64, y: f64| (1.0 + 0.5 * (0.5 * x).sin() + 0.3 * (0.4 * y).cos()) as f32;
        let picture: LinearPhoto = camera
            .cells()
            .map(|(x, y)| [value(f64::from(x), f64::from(y)); CHANNELS])
            .collect();
        let moved = shifted(&picture, camera, [1.25, -0.5]);
        for (x, y) in camera
            .cells()
            .filter(|(x, y)| (4..9).contains(x) && (3..6).contains(y))
        {
            let expected = value(f64::from(x) - 1.25, f64::from(y) + 0.5);
            let found = moved[(y * 12 + x) as usize][0];
            assert!(
                (found - expected).abs() < 0.01,
                "{x} {y}: {found} {expected}"
            );
        }
    }

    #[test]
    fn a_blur_keeps_light_and_has_its_deviation() {
        let light = Extent::new(25, 21);
        let mut spot = vec![0.0; light.area()];
        spot[10 * 25 + 12] = 1.0;
        assert_eq!(blurred(&spot, light, 0.0), spot);
        let blurred = blurred(&spot, light, 2.0);
        let moment = |power: i32| -> f64 {
            let cells = light.cells().zip(&blurred);
            cells
                .map(|((x, _), e)| (f64::from(x) - 12.0).powi(power) * f64::from(*e))
                .sum()
        };
        assert!((moment(0) - 1.0).abs() < 1e-6);
        assert!(moment(1).abs() < 1e-6);
        // The Gaussian is cut off.
        assert!((moment(2).sqrt() - 2.0).abs() < 0.05, "{}", moment(2));
    }
}
