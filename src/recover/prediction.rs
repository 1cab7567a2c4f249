//! What light transport functions predict of measurements: `y = pT`, restricted to each pixel's window.

use crate::capture::{Measurements, Pattern};
use crate::transport::{CHANNELS, Geometry, TransportFunctions};

use super::sampling;

/// The measurements that the functions of a region predict for `patterns`, `[pixel, pattern, channel]`.
pub(super) fn predictions<'a>(
    geometry: &Geometry,
    patterns: impl IntoIterator<Item = &'a Pattern, IntoIter: Clone>,
    functions: &TransportFunctions,
) -> Vec<f64> {
    let (area, patterns) = (geometry.window.area(), patterns.into_iter());
    let mut predictions = Vec::new();
    for (pixel, tau) in functions
        .rect
        .pixels()
        .zip(functions.tau.chunks_exact(area))
    {
        let elements = sampling::elements_of_window(geometry, geometry.window_origin(pixel));
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

/// Measurements less predictions under the patterns `pattern_indices`, `[pixel, pattern, channel]`; NaN where a
/// measurement is saturated.
pub(super) fn residuals(
    geometry: &Geometry,
    measurements: &Measurements,
    pattern_indices: &[usize],
    functions: &TransportFunctions,
) -> Vec<f64> {
    let patterns = pattern_indices.iter().map(|&l| &measurements.patterns[l]);
    let mut residuals = predictions(geometry, patterns, functions);
    let pixels = residuals.chunks_exact_mut(pattern_indices.len() * CHANNELS);
    for (pixel, residuals) in functions.rect.pixels().zip(pixels) {
        for (residuals, &l) in residuals.chunks_exact_mut(CHANNELS).zip(pattern_indices) {
            for (c, residual) in residuals.iter_mut().enumerate() {
                *residual = measurements.sample(l, pixel, c) - *residual;
            }
        }
    }
    residuals
}
