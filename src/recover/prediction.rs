//! What light transport functions predict of measurements: `y = pT`, restricted to each pixel's window.

use crate::capture::Pattern;
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{CHANNELS, Geometry, TileRect, TileTransportFunctions};

/// The measurements that the functions of a region predict for `patterns`, `[pixel, pattern, channel]`.
pub(super) fn predictions<'a>(
    geometry: &Geometry,
    patterns: impl IntoIterator<Item = &'a Pattern, IntoIter: Clone>,
    functions: &TileTransportFunctions,
) -> Vec<f64> {
    let (area, patterns) = (geometry.window.area(), patterns.into_iter());
    let mut predictions = Vec::new();
    let pixels = functions.rect.pixels();
    for (pixel, tau) in pixels.zip(functions.tau.chunks_exact(area)) {
        let origin = geometry.window_origin(pixel);
        let elements: Vec<_> = geometry.elements_of_window(origin).collect();
        for pattern in patterns.clone() {
            let planes = std::array::from_fn::<_, CHANNELS, _>(|c| pattern.plane(c));
            let mut y = [0.0; CHANNELS];
            for &(slot, m) in &elements {
                for c in 0..CHANNELS {
                    y[c] += f64::from(planes[c][m] * tau[slot][c]);
                }
            }
            predictions.extend(y);
        }
    }
    predictions
}

/// The measurements of a region under the patterns `pattern_indices`, `[pixel, pattern, channel]`; NaN where saturated.
pub(super) fn samples(
    measurements: &CalibratedMeasurements<'_>,
    pattern_indices: &[usize],
    rect: TileRect,
) -> Vec<f64> {
    let mut samples = Vec::new();
    for pixel in rect.pixels() {
        for &l in pattern_indices {
            samples.extend((0..CHANNELS).map(|c| measurements.sample(l, pixel, c)));
        }
    }
    samples
}

/// Measurements less predictions under the patterns `pattern_indices`, `[pixel, pattern, channel]`; NaN where a
/// measurement is saturated.
pub(super) fn residuals(
    geometry: &Geometry,
    measurements: &CalibratedMeasurements<'_>,
    pattern_indices: &[usize],
    functions: &TileTransportFunctions,
) -> Vec<f64> {
    let patterns = pattern_indices.iter().map(|&l| &measurements.patterns[l]);
    let predicted = predictions(geometry, patterns, functions);
    let samples = samples(measurements, pattern_indices, functions.rect);
    samples.iter().zip(predicted).map(|(y, p)| y - p).collect()
}
