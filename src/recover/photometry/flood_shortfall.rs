//! Whether the display dims bright pictures.
//!
//! Many displays limit their power: the more elements are lit, the less each emits. Random patterns are all about equally
//! bright, so that this shows in one photograph only, the flood: it is darker than the patterns predict. Its brightness
//! relative to its prediction is found by regression over sampled pixels.

use super::equations::{for_scaled_pixels, predict};
use super::resampling::ResamplingInput;
use super::window_covariance::WindowModel;
use crate::job_executor::Executor;
use crate::recover::mean_function;
use crate::transport::TileRect;

/// Least and largest share that is dimming; beyond that, the flood photograph has another exposure.
const MIN_DIMMING: f64 = 0.02;
const MAX_DIMMING: f64 = 0.5;
/// Standard errors by which the flood photograph must be darker.
const MIN_SIGNIFICANCE: f64 = 5.0;
/// Sums of products of prediction p, stray light u and measurement: pp, pu, uu, py, uy.
type Sums = [f64; 5];

/// Share by which the display dims a picture with all elements lit, and others in proportion to their mean emission.
/// `None` if the flood photograph is as bright as the patterns predict, brighter, or missing.
pub(in crate::recover) fn estimate(
    input: ResamplingInput<'_>,
    executor: &impl Executor,
) -> Option<f64> {
    let measurements = input.measurements;
    if measurements.flood.is_none() || input.mean_function.is_empty() {
        return None;
    }
    let squares = mean_function::sample_squares(measurements);
    let sums = executor.map(squares.len(), |i| square_sums(input, squares[i]));
    let total = |left_out: Option<usize>| {
        let mut total = [0.0; 5];
        for (_, sums) in sums
            .iter()
            .enumerate()
            .filter(|(i, _)| Some(*i) != left_out)
        {
            (0..5).for_each(|k| total[k] += sums[k]);
        }
        total
    };
    let ratio = relative_brightness(total(None));
    // Jackknife over squares.
    let deviations = (0..sums.len()).map(|i| (relative_brightness(total(Some(i))) - ratio).powi(2));
    let error = deviations.sum::<f64>().sqrt();
    let mean = mean_emission(input);
    let dimming = (1.0 - ratio) / (1.0 - ratio * mean);
    let is_significant = 1.0 - ratio > MIN_SIGNIFICANCE * error;
    (is_significant && (MIN_DIMMING..=MAX_DIMMING).contains(&dimming)).then_some(dimming)
}

/// The weight of the prediction in the regression of the flood photograph on it and on stray light.
fn relative_brightness([pp, pu, uu, py, uy]: Sums) -> f64 {
    (py * uu - uy * pu) / (pp * uu - pu * pu)
}

fn square_sums(input: ResamplingInput<'_>, square: TileRect) -> Sums {
    let mut sums = [0.0; 5];
    for_scaled_pixels(input, square, |origin, window, pixels| {
        let flood = WindowModel::of_flood(input.geometry, input.mean_function, origin);
        for scaled in pixels {
            let measured = input
                .measurements
                .flood_sample(scaled.pixel, scaled.channel);
            if measured.is_nan() {
                continue;
            }
            let (p, u, y) = (
                predict(window, &flood, scaled)[0],
                scaled.unit,
                scaled.unit * measured,
            );
            for (sum, product) in sums.iter_mut().zip([p * p, p * u, u * u, p * y, u * y]) {
                *sum += product;
            }
        }
    });
    sums
}

/// Mean emission of the patterns.
fn mean_emission(input: ResamplingInput<'_>) -> f64 {
    let means = input.used.iter().map(|&l| {
        let rgb = input.measurements.patterns[l].rgb();
        rgb.iter().map(|&e| f64::from(e)).sum::<f64>() / rgb.len() as f64
    });
    means.sum::<f64>() / input.used.len() as f64
}
