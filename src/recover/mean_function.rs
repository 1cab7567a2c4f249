//! The mean light transport function of the picture, from the measurements of many pixels together.
//!
//! With every pixel and channel n scaled by its brightness `f_n`, one function h is taken for all:
//! `min_h Σ_n q_n ‖W(y_n / f_n − P̂_n h)‖²`, `h ≥ 0`, where `P̂_n` are the patterns on the pixel's window and `q_n` is
//! the certainty of the pixel. Brightness and function are found in turn: given h, `f_n = ȳ_n / p̄_n h`. That no pixel
//! sees exactly h hardly matters: [`super::pattern_check`] and the learned prior start from it.

use std::ops::Range;

use super::common_mode_weight::CommonModeWeight;
use super::error::RecoverError;
use super::nnls::Nnls;
use super::normal_equations::{EquationWeights, NormalEquations, WeightedColumns};
use super::photometry::CalibratedMeasurements;
use super::preparation_input::RecoveryPreparationInput;
use super::sampling::{self, PixelsSharingWindow};
use crate::job_executor::{Cancelled, Executor, PARTS};
use crate::linalg::{self, add_scaled, vectorise};
use crate::transport::{CHANNELS, Extent, LightElement, TileRect, Window};

/// Rounds of brightness and function. A brightness that is a few per cent off, as it is while the function is unknown,
/// shows as light from far off.
const ROUNDS: usize = 3;
/// Standard deviation of a pixel's measurements from those that the mean function predicts, relative to its brightness;
/// what limits a pixel's certainty where noise is low.
const MODEL_DEVIATION: f64 = 0.1;

/// Squares of the picture that are used, one in so many of them in the rounds before the last, and their side in camera
/// pixels.
const MAX_SQUARES: usize = 128;
const EARLY_SAMPLING: usize = 4;
const SQUARE_SIDE: u32 = 4;
/// Upper bound on the pixels and channels in these squares.
pub(super) const MAX_SAMPLES: usize = MAX_SQUARES * (SQUARE_SIDE * SQUARE_SIDE) as usize * CHANNELS;

/// Standard deviation, in elements, of the Gaussian that smooths the noisy mean function.
const SMOOTHING_SIGMA: f64 = 1.0;

/// Upper bound on the memory that [`mean_function`] takes, in bytes.
pub(super) fn max_bytes(window: Window) -> usize {
    (2 * PARTS + 2) * window.area() * window.area() * size_of::<f64>()
}

/// The squares of the picture that are used.
pub(super) fn sample_squares(camera: Extent) -> Vec<TileRect> {
    sampling::spread_squares(camera, SQUARE_SIDE, MAX_SQUARES)
}

/// Returns the mean light transport function, `[slot]`, non-negative and of sum 1.
///
/// # Errors
/// If the photographs are dark or overexposed, and if the executor is cancelled.
pub(super) async fn mean_function(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
) -> Result<Vec<f64>, RecoverError> {
    let squares = sample_squares(preparation.measurements.camera);
    let area = preparation.geometry.window.area();
    let mut mean = vec![1.0 / area as f64; area];
    let sample: Vec<_> = squares.iter().step_by(EARLY_SAMPLING).copied().collect();
    for round in 1..=ROUNDS {
        preparation.executor.check_cancelled()?;
        // A small picture needs all of its few squares.
        let is_early = round < ROUNDS && squares.len() == MAX_SQUARES;
        let used = if is_early { &sample } else { &squares };
        let function = fit_round(preparation, used, &mean).await?;
        let sum: f64 = function.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return Err(dark_or_overexposed(preparation.measurements, &squares));
        }
        mean = function.iter().map(|m| m / sum).collect();
    }
    Ok(mean)
}

/// Smooths a function on the window, `[side²]`, by a Gaussian and scales it to sum 1.
pub(super) fn smooth(function: &[f64], side: usize) -> Vec<f64> {
    let radius = (3.0 * SMOOTHING_SIGMA).ceil() as i64;
    let tap = |d: i64| libm::exp(-0.5 * (d as f64 / SMOOTHING_SIGMA).powi(2));
    let norm: f64 = (-radius..=radius).map(tap).sum();
    // Along one axis, `[side, side]`.
    let blur = (0..side * side).map(|i| match (i / side).abs_diff(i % side) as i64 {
        distance if distance <= radius => tap(distance) / norm,
        _ => 0.0,
    });
    let blur: Vec<f64> = blur.collect();
    let rows = linalg::multiply(function, &blur, side, side);
    let smoothed = linalg::multiply(&blur, &rows, side, side);
    let sum: f64 = smoothed.iter().sum();
    smoothed.iter().map(|m| m / sum).collect()
}

/// Estimates every pixel's brightness with the function `mean`, then the function of all pixels, `[slot]`.
async fn fit_round(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    squares: &[TileRect],
    mean: &[f64],
) -> Result<Vec<f64>, Cancelled> {
    let geometry = &preparation.geometry;
    let area = geometry.window.area();
    let is_whole = |origin: LightElement| geometry.clip_window(origin).area() == area;
    let whole_squares = squares.iter().filter(|square| {
        let mut pixels = square.pixels();
        pixels.all(|pixel| is_whole(geometry.window_origin(pixel)))
    });
    // Windows across the border say little of the elements off the light plane: they are left out if there are enough
    // others.
    let only_whole = 4 * whole_squares.count() >= squares.len();
    let add_part = |part: usize, sums: &mut NormalEquations| {
        for square in squares.iter().skip(part).step_by(PARTS) {
            for (origin, pixels) in sampling::pixels_by_window(geometry, *square) {
                if only_whole && !is_whole(origin) {
                    continue;
                }
                vectorise(
                    #[cfg_attr(target_arch = "x86_64", inline(always))]
                    || add_window(sums, preparation, mean, origin, &pixels),
                );
            }
        }
    };
    let executor = preparation.executor;
    let total = executor.all_reduce(|| NormalEquations::zeros(area), add_part);
    let total = total.await?;
    let (gram, right) = total.into_parts();
    Ok(Nnls::new(&gram, area).solve(&right))
}

#[cfg_attr(target_arch = "x86_64", inline(always))]
fn add_window(
    sums: &mut NormalEquations,
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean: &[f64],
    origin: LightElement,
    pixels: &PixelsSharingWindow,
) {
    let (measurements, training) = (preparation.measurements, &preparation.split.training);
    let elements: Vec<_> = preparation.geometry.elements_of_window(origin).collect();
    let slots: Vec<usize> = elements.iter().map(|&(slot, _)| slot).collect();
    for (plane, channels) in measurements.planes() {
        let indices = sampling::unsaturated(measurements, training, pixels, channels.clone());
        let mut columns = vec![0.0; elements.len() * indices.len()];
        for (i, &l) in indices.iter().enumerate() {
            let pattern = measurements.patterns[l].plane(plane);
            for (j, &(_, m)) in elements.iter().enumerate() {
                columns[j * indices.len() + i] = f64::from(pattern[m]);
            }
        }
        let weights = EquationWeights::uniform(indices.len(), CommonModeWeight::POOLED);
        let columns = WeightedColumns::new(columns, weights);
        let levels = slots.iter().zip(&columns.means);
        let level: f64 = levels.map(|(&slot, p)| mean[slot] * p).sum();
        if level > 0.0 {
            let mut pooled =
                PooledMeasurements::new(measurements, &indices, pixels, channels, level);
            columns.weights.apply(&mut pooled.y);
            sums.add(&columns, &slots, pooled.certainty, &pooled.y);
        }
    }
}

/// The measurements of a window's pixels and channels as those of a single pixel of brightness 1.
pub(super) struct PooledMeasurements {
    /// `Σ q_n`.
    pub certainty: f64,
    /// `Σ q_n y_n / f_n`, `[pattern]`.
    pub y: Vec<f64>,
}

impl PooledMeasurements {
    /// Sums over the channels of the pixels that are nowhere saturated. `level` is the mean over the patterns that a
    /// pixel of brightness 1 measures.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        pixels: &PixelsSharingWindow,
        channels: Range<usize>,
        level: f64,
    ) -> Self {
        let mut pooled = Self {
            certainty: 0.0,
            y: vec![0.0; pattern_indices.len()],
        };
        for &(_, pixel) in pixels {
            for c in channels.clone() {
                let y = measurements.samples(pattern_indices, pixel, c);
                let mean = sampling::mean(&y);
                // The mean is NaN if a sample is saturated.
                if mean > 0.0 {
                    let brightness = mean / level;
                    let noise = |&l: &usize| measurements.variance(l, c, mean);
                    let noise: Vec<f64> = pattern_indices.iter().map(noise).collect();
                    let relative_noise = sampling::mean(&noise) / brightness.powi(2);
                    let variance = MODEL_DEVIATION.powi(2) + relative_noise;
                    pooled.certainty += 1.0 / variance;
                    add_scaled(&mut pooled.y, 1.0 / (variance * brightness), &y);
                }
            }
        }
        pooled
    }
}

fn dark_or_overexposed(
    measurements: &CalibratedMeasurements<'_>,
    squares: &[TileRect],
) -> RecoverError {
    let patterns = measurements.patterns.len();
    let saturated = |&square| measurements.count_overexposed_pixels(square, patterns);
    let saturated: usize = squares.iter().map(saturated).sum();
    let all: usize = squares.iter().map(|square| square.extent.area()).sum();
    match 2 * saturated > all {
        true => RecoverError::Overexposed,
        false => RecoverError::NoSignal,
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::super::holdout_split::HoldoutSplit;
    use super::super::test_problems::SyntheticCapture;
    use super::*;
    use crate::job_executor::SequentialExecutor;

    fn fit(capture: &SyntheticCapture) -> Result<Vec<f64>, RecoverError> {
        pollster::block_on(mean_function(&RecoveryPreparationInput {
            measurements: &CalibratedMeasurements::uncorrected(&capture.measurements),
            geometry: capture.geometry.clone(),
            split: &HoldoutSplit::new(&capture.measurements.patterns),
            executor: &SequentialExecutor,
        }))
    }

    #[test]
    fn function_that_all_pixels_share_is_found() {
        let capture = SyntheticCapture::new(60);
        let mean = fit(&capture).unwrap();
        assert!((mean.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for (found, expected) in mean.iter().zip(&capture.function) {
            assert!((found - expected).abs() < 1e-4, "{mean:?}");
        }
    }

    #[test]
    fn certainty_is_the_inverse_variance_of_pixels_scaled_to_brightness_one() {
        let mut capture = SyntheticCapture::new(8);
        capture.measurements.noise.floor = [4e-4; CHANNELS];
        let windows = sampling::pixels_by_window(&capture.geometry, capture.functions(1.0).rect);
        let origin = LightElement { u: 3, v: 3 };
        let (_, pixels) = windows.iter().find(|window| window.0 == origin).unwrap();
        let (all, level) = ((0..8).collect::<Vec<_>>(), 0.5);
        let measurements = CalibratedMeasurements::uncorrected(&capture.measurements);
        let pooled = PooledMeasurements::new(&measurements, &all, &pixels[..1], 1..2, level);
        let y: Vec<f64> = all
            .iter()
            .map(|&l| capture.measurements.sample(l, pixels[0].1, 1))
            .collect();
        let brightness = y.iter().sum::<f64>() / 8.0 / level;
        let variance = MODEL_DEVIATION.powi(2) + 4e-4 / brightness.powi(2);
        assert!((pooled.certainty * variance - 1.0).abs() < 1e-9);
        for (pooled, y) in pooled.y.iter().zip(y) {
            assert!((pooled * variance * brightness - y).abs() < 1e-9);
        }
    }

    #[test]
    fn dark_and_saturated_photographs_are_refused() {
        let mut capture = SyntheticCapture::new(60);
        capture
            .measurements
            .photos
            .iter_mut()
            .for_each(|picture| picture.fill([0.0; CHANNELS]));
        assert!(matches!(fit(&capture), Err(RecoverError::NoSignal)));
        capture
            .measurements
            .photos
            .iter_mut()
            .for_each(|picture| picture.fill([f32::NAN; CHANNELS]));
        assert!(matches!(fit(&capture), Err(RecoverError::Overexposed)));
    }
}
