//! Chooses the parameters of [`PixelwiseRecovery`]: those by which the training patterns predict the held-out ones with
//! the highest SNR.
//!
//! Chosen are the weight ω of the common mode and, for denoising, the share of the noise that the tolerance ε allows.
//! Each candidate recovers a sample of windows, spread over the picture.

use std::slice::from_ref;

use super::bpdn::{ResidualTolerance, SparsityBasis};
use super::common_mode_weight::CommonModeWeight;
use super::error::RecoverError;
use super::gram_cache::WindowEquations;
use super::holdout_split::HoldoutSplit;
use super::holdout_validation;
use super::pixelwise::{PixelSamples, PixelsByWindow, PixelwiseMethod, PixelwiseRecovery};
use super::preparation_input::RecoveryPreparationInput;
use super::sampling::{self, MAX_SMALL_PICTURE, MIN_PATTERNS};
use crate::job_executor::{Cancelled, Executor};
use crate::linalg::ascending_order;
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{Decibels, SnrAccumulator, TileRect};

/// Largest number of windows in a sample, and of pixels in each: enough to tell candidates apart by hundredths of a
/// decibel, and few enough to take seconds. For least squares each pixel takes as long as the next, so all may have
/// windows of their own. Denoising takes longer, and has seven candidates: fewer windows, whose pixels share their
/// equations.
const LEAST_SQUARES_SAMPLE: [usize; 2] = [48, 1];
const DENOISING_SAMPLE: [usize; 2] = [16, 4];

impl PixelwiseRecovery {
    /// Non-negative least squares, with the best weight of the common mode.
    ///
    /// # Errors
    /// If no sampled pixel sees the light plane, and if the executor is cancelled.
    pub async fn least_squares(
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
    ) -> Result<Self, RecoverError> {
        preparation.executor.check_cancelled()?;
        let sample = sample_windows(preparation, LEAST_SQUARES_SAMPLE)?;
        let candidates = CommonModeWeight::CANDIDATES.map(|common_mode| Self {
            geometry: preparation.geometry.clone(),
            common_mode,
            problem: PixelwiseMethod::LeastSquares,
        });
        Ok(best_of(candidates, preparation, &sample).await?)
    }

    /// Basis pursuit denoising, with the best weight of the common mode and the best tolerance.
    ///
    /// # Errors
    /// If no sampled pixel sees the light plane, and if the executor is cancelled.
    pub async fn denoising(
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        basis: SparsityBasis,
    ) -> Result<Self, RecoverError> {
        let least_squares = Self::least_squares(preparation).await?;
        let sample = sample_windows(preparation, LEAST_SQUARES_SAMPLE)?;
        let noise = least_squares.fit_noise(preparation, &sample).await?;
        preparation.executor.check_cancelled()?;
        let sample = sample_windows(preparation, DENOISING_SAMPLE)?;
        let candidates = ResidualTolerance::CANDIDATE_SHARES.map(|share| Self {
            problem: PixelwiseMethod::Denoising(basis, ResidualTolerance { share, ..noise }),
            ..least_squares.clone()
        });
        Ok(best_of(candidates, preparation, &sample).await?)
    }

    /// Error of the predictions of one window's measurements under the held-out patterns.
    fn prediction_error(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        window: &PixelsByWindow,
    ) -> SnrAccumulator {
        let mut error = SnrAccumulator::default();
        let elements: Vec<_> = self.geometry.elements_of_window(window.0).collect();
        let mut add = |_: &WindowEquations, samples: &PixelSamples, x: &[f64]| {
            for &l in &split.held_out {
                let y = measurements.sample(l, samples.pixel, samples.channel);
                if y.is_finite() {
                    let plane = measurements.patterns[l].plane(samples.channel);
                    let terms = elements.iter().zip(x);
                    error.add(y, terms.map(|(&(_, m), &x)| f64::from(plane[m]) * x).sum());
                }
            }
        };
        self.solve_windows(measurements, from_ref(window), &split.training, &mut add);
        error
    }

    /// The noise of the measurements, by the residuals of least squares and the degrees of freedom that it leaves.
    async fn fit_noise(
        &self,
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        sample: &[PixelsByWindow],
    ) -> Result<ResidualTolerance, Cancelled> {
        let (measurements, all) = (preparation.measurements, &preparation.split.all);
        let pairs_of_window = |i: usize| {
            let mut pairs = Vec::new();
            let mut add = |equations: &WindowEquations, samples: &PixelSamples, x: &[f64]| {
                let y = measurements.samples(all, samples.pixel, samples.channel);
                let count = y.iter().filter(|y| y.is_finite()).count();
                let residual_freedom = count as f64 - x.iter().filter(|&&x| x > 0.0).count() as f64;
                if count >= MIN_PATTERNS && residual_freedom >= 1.0 {
                    let y = equations.weight(&samples.y);
                    let residual = equations.columns.squared_residual(&y, x);
                    pairs.push([sampling::mean(&samples.y), residual / residual_freedom]);
                }
            };
            self.solve_windows(measurements, from_ref(&sample[i]), all, &mut add);
            pairs
        };
        let executor = preparation.executor;
        let pairs = executor.all_gather(sample.len(), pairs_of_window).await?;
        Ok(ResidualTolerance::fit(&pairs.concat()))
    }
}

/// More than the columns of a light plane, to order its elements row by row.
const ROW_STRIDE: f64 = (1u64 << 32) as f64;

/// Windows spread over the picture, with some of their pixels; of a large picture, over the squares that are validated.
fn sample_windows(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    [max_windows, max_pixels]: [usize; 2],
) -> Result<Vec<PixelsByWindow>, RecoverError> {
    let geometry = &preparation.geometry;
    let mut windows: Vec<PixelsByWindow> = Vec::new();
    let squares: Vec<TileRect> = match geometry.camera.area() <= MAX_SMALL_PICTURE {
        true => geometry.tiles().collect(),
        false => holdout_validation::sample_squares(geometry.camera),
    };
    for square in squares {
        for (origin, mut pixels) in sampling::pixels_by_window(geometry, square) {
            if !geometry.clip_window(origin).is_empty() {
                pixels.truncate(max_pixels);
                windows.push((origin, pixels));
            }
        }
    }
    if windows.is_empty() {
        return Err(RecoverError::CorrespondenceOffLightPlane);
    }
    // Windows across the border of squares are in the list of each.
    let position =
        |(origin, _): &PixelsByWindow| f64::from(origin.v) * ROW_STRIDE + f64::from(origin.u);
    let order = ascending_order(windows.iter().map(position));
    let is_last = |i: &usize| {
        let next = order.get(i + 1).map(|&next| windows[next].0);
        next != Some(windows[order[*i]].0)
    };
    let order: Vec<usize> = (0..order.len()).filter(is_last).map(|i| order[i]).collect();
    let step = order.len().div_ceil(max_windows);
    let chosen = order.into_iter().step_by(step);
    Ok(chosen.map(|i| windows[i].clone()).collect())
}

/// The candidate that predicts the held-out patterns of the sample best; the first if no pattern is held out.
async fn best_of<const N: usize>(
    candidates: [PixelwiseRecovery; N],
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    sample: &[PixelsByWindow],
) -> Result<PixelwiseRecovery, Cancelled> {
    let (measurements, split) = (preparation.measurements, preparation.split);
    let mut best = candidates[0].clone();
    if split.held_out.is_empty() {
        return Ok(best);
    }
    let errors = |i: usize| {
        let error = |candidate: &PixelwiseRecovery| {
            candidate.prediction_error(measurements, split, &sample[i])
        };
        candidates.iter().map(error).collect::<Vec<_>>()
    };
    let executor = preparation.executor;
    let errors = executor.all_gather(sample.len(), errors).await?;
    let mut best_snr: Option<Decibels> = None;
    for (n, candidate) in candidates.into_iter().enumerate() {
        let error: SnrAccumulator = errors.iter().map(|errors| errors[n]).sum();
        if let Some(snr) = error.snr()
            && best_snr.is_none_or(|best_snr| snr > best_snr)
        {
            (best_snr, best) = (Some(snr), candidate);
        }
    }
    Ok(best)
}
