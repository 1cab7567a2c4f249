//! Checks that each photograph shows the pattern that it is listed with.
//!
//! The mean light transport function predicts, on average, what a photograph measures: the regression slope of
//! measurements on predictions is the same for all patterns, coarse or fine (1 if the window holds all light). For a
//! photograph of another pattern it is 0. The standard error of a slope comes from how much it differs between squares
//! of the picture (clusters, as in Liang and Zeger 1986). A photograph fails only if its slope is too small with
//! certainty.

use bytemuck::{Pod, Zeroable};

use super::error::RecoverError;
use super::mean_function;
use super::preparation_input::RecoveryPreparationInput;
use super::sampling::{self, PixelsSharingWindow};
use crate::job_executor::Executor;
use crate::linalg;
use crate::transport::LightElement;

/// Smallest slope of a photograph that matches its pattern, relative to [`REFERENCE_PERCENTILE`].
const MIN_SLOPE_RATIO: f64 = 0.4;
/// Percentile of the slopes that stands for photographs that match; it holds unless nine in ten do not.
const REFERENCE_PERCENTILE: usize = 90;
/// Standard errors by which a photograph's slope must be too small.
const MISMATCH_ERRORS: f64 = 3.0;
/// Standard errors by which the common slope of the held-out patterns must be above zero.
const CORRELATION_ERRORS: f64 = 2.0;
/// Fewest squares, and fewest held-out patterns, that give a standard error.
const MIN_SQUARES: usize = 32;
const MIN_HELD_OUT: usize = 2;

/// Checks the photographs on squares of the picture; `mean_function` is `[slot]`.
///
/// # Errors
/// [`RecoverError::MismatchedPatterns`] if some photographs do not match their patterns, and
/// [`RecoverError::UncorrelatedPatterns`] if most do not, or if the held-out patterns together predict nothing;
/// [`RecoverError::Cancelled`].
pub(super) async fn check_patterns(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
) -> Result<(), RecoverError> {
    let squares = mean_function::sample_squares(preparation.measurements.camera);
    if squares.len() < MIN_SQUARES {
        return Ok(());
    }
    let (split, patterns) = (preparation.split, preparation.measurements.patterns.len());
    let square_moments = |i: usize| {
        let mut moments = vec![SlopeMoments::default(); patterns];
        for (origin, pixels) in sampling::pixels_by_window(&preparation.geometry, squares[i]) {
            add_window(&mut moments, preparation, mean_function, origin, &pixels);
        }
        moments
    };
    let executor = preparation.executor;
    let moments = executor.all_gather(squares.len(), square_moments).await?;
    let slope = |&l: &usize| SlopeEstimate::fit(&moments, &[l]);
    let slopes: Vec<Option<SlopeEstimate>> = split.all.iter().map(slope).collect();
    let mut values: Vec<f64> = slopes.iter().flatten().map(|slope| slope.value).collect();
    linalg::sort(&mut values);
    let reference = values.get(values.len() * REFERENCE_PERCENTILE / 100);
    let min_slope = MIN_SLOPE_RATIO * reference.copied().unwrap_or(0.0);
    let is_mismatched =
        |slope: &Option<SlopeEstimate>| slope.is_some_and(|slope| slope.is_below(min_slope));
    let slopes = split.all.iter().zip(&slopes);
    let mismatched = slopes
        .filter(|(_, slope)| is_mismatched(slope))
        .map(|(l, _)| *l);
    let mismatched: Vec<usize> = mismatched.collect();
    let held_out = split.held_out.iter().copied();
    let held_out: Vec<usize> = held_out.filter(|l| !mismatched.contains(l)).collect();
    let is_uncorrelated = split.held_out.len() >= MIN_HELD_OUT
        && SlopeEstimate::fit(&moments, &held_out).is_some_and(SlopeEstimate::may_be_zero);
    if is_uncorrelated || 2 * mismatched.len() > split.all.len() {
        return Err(RecoverError::UncorrelatedPatterns);
    }
    if !mismatched.is_empty() {
        let pattern_indices = mismatched;
        return Err(RecoverError::MismatchedPatterns { pattern_indices });
    }
    Ok(())
}

/// Sums over pixels, both centred over the patterns: of squared predictions, and of predictions times measurements.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct SlopeMoments {
    prediction: f64,
    cross: f64,
}

/// A regression slope of measurements on predictions.
#[derive(Clone, Copy, Debug)]
struct SlopeEstimate {
    value: f64,
    standard_error: f64,
}

impl SlopeEstimate {
    /// The common slope of `patterns`, from moments `[square][pattern]`; `None` if the predictions do not vary.
    fn fit(moments: &[Vec<SlopeMoments>], patterns: &[usize]) -> Option<Self> {
        let squares = moments.iter().map(|square| {
            let of_patterns = patterns.iter().map(|&l| square[l]);
            of_patterns.fold(SlopeMoments::default(), |a, b| SlopeMoments {
                prediction: a.prediction + b.prediction,
                cross: a.cross + b.cross,
            })
        });
        let squares: Vec<SlopeMoments> = squares.collect();
        let prediction: f64 = squares.iter().map(|m| m.prediction).sum();
        let value = squares.iter().map(|m| m.cross).sum::<f64>() / prediction;
        let residual = |m: &SlopeMoments| (m.cross - value * m.prediction).powi(2);
        let residuals = squares.iter().map(residual);
        let standard_error = residuals.sum::<f64>().sqrt() / prediction;
        (value.is_finite() && standard_error.is_finite()).then_some(Self {
            value,
            standard_error,
        })
    }

    fn is_below(self, value: f64) -> bool {
        self.value + MISMATCH_ERRORS * self.standard_error < value
    }

    fn may_be_zero(self) -> bool {
        self.value < CORRELATION_ERRORS * self.standard_error
    }
}

fn add_window(
    moments: &mut [SlopeMoments],
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
    origin: LightElement,
    pixels: &PixelsSharingWindow,
) {
    let (measurements, split) = (preparation.measurements, preparation.split);
    let elements: Vec<_> = preparation.geometry.elements_of_window(origin).collect();
    for (plane, channels) in measurements.planes() {
        let predict = |l: usize| {
            let pattern = measurements.patterns[l].plane(plane);
            let term = |&(slot, m): &(usize, usize)| mean_function[slot] * f64::from(pattern[m]);
            elements.iter().map(term).sum::<f64>()
        };
        let predictions: Vec<f64> = (0..measurements.patterns.len()).map(predict).collect();
        let pixels = pixels.iter();
        for (pixel, c) in pixels.flat_map(|p| channels.clone().map(move |c| (p.1, c))) {
            let [mut predicted, mut measured, mut count] = [0.0; 3];
            let training = measurements.samples(&split.training, pixel, c);
            for (&l, y) in split.training.iter().zip(training) {
                if y.is_finite() {
                    predicted += predictions[l];
                    measured += y;
                    count += 1.0;
                }
            }
            if !(predicted > 0.0 && measured > 0.0) {
                continue;
            }
            let all = measurements.samples(&split.all, pixel, c);
            for (&l, y) in split.all.iter().zip(all) {
                let (moments, deviation) = (&mut moments[l], y - measured / count);
                if deviation.is_finite() {
                    let prediction = measured / predicted * (predictions[l] - predicted / count);
                    moments.prediction += prediction * prediction;
                    moments.cross += prediction * deviation;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(squares: &[(f64, f64)]) -> Option<SlopeEstimate> {
        let moments = squares
            .iter()
            .map(|&(prediction, cross)| vec![SlopeMoments { prediction, cross }]);
        SlopeEstimate::fit(&moments.collect::<Vec<_>>(), &[0])
    }

    #[test]
    fn slopes_are_tested_against_their_standard_errors() {
        let matched = slope(&[(1.0, 0.9), (2.0, 2.1), (1.0, 1.1)]).unwrap();
        assert!((matched.value - 1.025).abs() < 1e-9 && matched.standard_error < 0.1);
        assert!(!matched.is_below(0.5) && !matched.may_be_zero());
        let mismatched = slope(&[(1.0, 0.1), (2.0, -0.1), (1.0, 0.05)]).unwrap();
        assert!(mismatched.is_below(0.5) && mismatched.may_be_zero());
        let noisy = slope(&[(1.0, 3.0), (2.0, -4.0), (1.0, 1.5)]).unwrap();
        assert!(!noisy.is_below(0.5) && noisy.may_be_zero());
        assert!(slope(&[(0.0, 0.0), (0.0, 0.0)]).is_none());
    }
}
