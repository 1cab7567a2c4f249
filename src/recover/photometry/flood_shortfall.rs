//! Why the flood photograph is darker than the patterns predict.
//!
//! Random patterns are all about equally bright, so that two faults hardly show in their photographs, only in the flood's.
//! Many displays limit their power: the more elements are lit, the less each emits; then all pixels are darker by one
//! ratio, which follows by regression over sampled pixels. Or the photographs have compressed highlights; then bright
//! pixels fall short by a larger share than dim ones. Bisection finds the compression with which the ratio is 1. It is the
//! cause if it leaves less of the flood photograph unexplained.

use super::PhotographCorrection;
use super::equations::{for_scaled_pixels, predict};
use super::resampling::{ResampledPhotographs, ResamplingInput};
use super::window_covariance::{ScaledPixel, WindowCovariance, WindowModel};
use crate::bisect::bisect;
use crate::capture::CameraResponse;
use crate::job_executor::Executor;
use crate::recover::{mean_function, sampling};
use crate::transport::TileRect;

/// Least and largest share that is dimming; beyond that, the flood photograph has another exposure.
const MIN_DIMMING: f64 = 0.02;
const MAX_DIMMING: f64 = 0.5;
/// Standard errors by which the flood photograph must be darker.
const MIN_SIGNIFICANCE: f64 = 5.0;
/// Range of the ratio of slopes of compressed highlights, and the halvings that find it.
const SLOPES: [f64; 2] = [1.0, 4.0];
const HALVINGS: usize = 10;
/// Sums of products of prediction p, stray light u and measurement y: pp, pu, uu, py, uy, yy.
type Sums = [f64; 6];

/// What may make the flood photograph darker than the patterns predict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloodShortfall {
    /// Share by which the display dims a picture with all elements lit, and others in proportion to their mean emission.
    pub dimming: f64,
    /// Ratio of slopes of [`CameraResponse::Compression`], if compressed highlights explain the flood photograph better.
    pub compression: Option<f64>,
}

/// `None` if the flood photograph is as bright as the patterns predict, brighter, or missing. `flood_white` is the
/// measurement at which its samples are white.
pub(in crate::recover) fn find(
    input: ResamplingInput<'_>,
    flood_white: f64,
    executor: &impl Executor,
) -> Option<FloodShortfall> {
    let measurements = input.measurements;
    if measurements.flood.is_none() || input.mean_function.is_empty() {
        return None;
    }
    let squares = mean_function::sample_squares(measurements.camera);
    let picture = ResampledPhotographs::of_small_picture(input, squares.len());
    let sums = |response| {
        let picture = picture.as_ref();
        let sums_of = |i: usize| square_sums(input, picture, squares[i], flood_white, response);
        executor.map(squares.len(), sums_of)
    };
    let declared = sums(CameraResponse::Linear);
    let ratio = relative_brightness(total(&declared, None));
    // Jackknife over squares.
    let without = |i| relative_brightness(total(&declared, Some(i)));
    let deviations = (0..squares.len()).map(|i| (without(i) - ratio).powi(2));
    let error = deviations.sum::<f64>().sqrt();
    let dimming = (1.0 - ratio) / (1.0 - ratio * mean_emission(input));
    let is_significant = 1.0 - ratio > MIN_SIGNIFICANCE * error;
    if !is_significant || !(MIN_DIMMING..=MAX_DIMMING).contains(&dimming) {
        return None;
    }
    let compressed = |slope| total(&sums(CameraResponse::Compression(slope)), None);
    let is_too_dark = |slope| Ok::<_, ()>(relative_brightness(compressed(slope)) < 1.0);
    // The search has no errors.
    let [_, slope] = bisect(SLOPES, HALVINGS, is_too_dark).unwrap_or(SLOPES);
    let unexplained = unexplained_share(compressed(slope));
    let is_cause = slope < SLOPES[1] && unexplained < unexplained_share(total(&declared, None));
    Some(FloodShortfall {
        dimming,
        compression: is_cause.then_some(slope),
    })
}

/// The sums over all squares, or all but one.
fn total(sums: &[Sums], left_out: Option<usize>) -> Sums {
    let mut total = [0.0; 6];
    for (i, sums) in sums.iter().enumerate() {
        if Some(i) != left_out {
            (0..6).for_each(|k| total[k] += sums[k]);
        }
    }
    total
}

/// The weight of the prediction in the regression of the flood photograph on it and on stray light.
fn relative_brightness([pp, pu, uu, py, uy, _]: Sums) -> f64 {
    (py * uu - uy * pu) / (pp * uu - pu * pu)
}

/// The share of the flood photograph's energy that the regression leaves.
fn unexplained_share(sums: Sums) -> f64 {
    let [_, pu, uu, py, uy, yy] = sums;
    let ratio = relative_brightness(sums);
    let stray_light = (uy - ratio * pu) / uu;
    1.0 - (ratio * py + stray_light * uy) / yy
}

/// Sums over a square of photographs that are linearised by `response`.
fn square_sums(
    input: ResamplingInput<'_>,
    picture: Option<&ResampledPhotographs<'_>>,
    square: TileRect,
    flood_white: f64,
    response: CameraResponse,
) -> Sums {
    let mut sums = [0.0; 6];
    for_scaled_pixels(input, picture, square, |origin, window, pixels| {
        let flood = WindowModel::of_flood(input.geometry, input.mean_function, origin);
        for scaled in pixels {
            let measured = input
                .measurements
                .flood_sample(scaled.pixel, scaled.channel);
            if measured.is_nan() {
                continue;
            }
            let linear = linearised(input, window, scaled, response);
            let (p, u) = (predict(window, &flood, &linear)[0], linear.unit);
            let y = u * flood_white * response.linearise(measured / flood_white);
            let products = [p * p, p * u, u * u, p * y, u * y, y * y];
            (0..6).for_each(|k| sums[k] += products[k]);
        }
    });
    sums
}

/// The pixel as if its photographs had been linearised before they were corrected: to first order, as corrections are those
/// of photographs as declared, and changes by shifts are linearised with them.
fn linearised(
    input: ResamplingInput<'_>,
    window: &WindowCovariance,
    scaled: &ScaledPixel,
    response: CameraResponse,
) -> ScaledPixel {
    let mut linear = scaled.clone();
    if response == CameraResponse::Linear {
        return linear;
    }
    for (y, &l) in linear.y.iter_mut().zip(input.used) {
        let correction = PhotographCorrection::of(input.corrections, l);
        let white = f64::from(input.measurements.full_scale[l]);
        let code = correction.invert(*y / scaled.unit) / white;
        *y = correction.apply(white * response.linearise(code));
    }
    let level = sampling::mean(&window.model.means);
    linear.unit = linear.weight * level / sampling::mean(&linear.y);
    linear.y.iter_mut().for_each(|y| *y *= linear.unit);
    linear
}

/// Mean emission of the patterns.
fn mean_emission(input: ResamplingInput<'_>) -> f64 {
    let means = input.used.iter().map(|&l| {
        let rgb = input.measurements.patterns[l].rgb();
        rgb.iter().map(|&e| f64::from(e)).sum::<f64>() / rgb.len() as f64
    });
    means.sum::<f64>() / input.used.len() as f64
}
