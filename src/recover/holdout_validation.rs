//! Hold-out validation: the SNR of a recovery, and what an encoder loses of it, estimated from patterns that the
//! recovery did not use.
//!
//! The elements of patterns vary independently, with a variance var(p). Between patterns, measurements then vary by
//! `var(p) ‖τ‖²`, and the residuals of functions τ̂ by `var(p) ‖τ − τ̂‖²`, each plus the noise, whose variance is
//! known. With sums over sampled pixels and channels, `SNR = (Σ var y − Σ noise) / (Σ var residual − Σ noise)`.
//! Saturated measurements are left out; all three sums are over the pixels and channels with two held-out measurements
//! or more.
//!
//! The squares are recovered from the training patterns alone. What a method learns from the whole picture, a prior
//! and the weights of a blend, has seen all patterns, the held-out ones included.

use serde::{Deserialize, Serialize};

use super::error::RecoverError;
use super::holdout_split::{HoldoutSplit, pattern_ids};
use super::preparation_input::RecoveryPreparationInput;
use super::{prediction, sampling};
use crate::capture::{Pattern, group_count};
use crate::job_executor::Executor;
use crate::recover::photometry::CalibratedMeasurements;
use crate::transport::{
    Basis, CHANNELS, Decibels, Extent, FloatTile, Geometry, TileRect, TileTransportFunctions,
};

/// Squares of the picture that are validated: at most half of them, as validation takes as long for each as its recovery,
/// but at least so many.
const MAX_SQUARES: usize = 96;
const MIN_SQUARES: usize = 32;
/// Their side in camera pixels: that of a file's blocks.
const SQUARE_SIDE: u32 = 8;
/// Fewest held-out patterns, or unsaturated measurements under them, that have a variance.
const MIN_HELD_OUT: usize = 2;
/// Smallest error that is distinguishable from noise, as a share of the noise, whose variance is known to a few percent.
const ERROR_RESOLUTION: f64 = 0.1;

/// The squares of the picture that are validated.
pub(super) fn sample_squares(camera: Extent) -> Vec<TileRect> {
    let squares = |max| sampling::spread_squares(camera, SQUARE_SIDE, max);
    let half = squares(2 * MAX_SQUARES).len() / 2;
    squares(half.max(MIN_SQUARES))
}

/// Squares of the picture, recovered from the training patterns, with their measurements under the held-out ones.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HoldoutValidation {
    geometry: Geometry,
    patterns: Vec<Pattern>,
    squares: Vec<ValidationRegion>,
    /// Variance of the measurements between patterns, less their noise.
    signal: f64,
    /// Variance of the noise under the held-out patterns.
    noise: f64,
    /// Variance of the residuals of the recovered functions between held-out patterns.
    residual: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct ValidationRegion {
    tile: FloatTile,
    /// Under the held-out patterns, `[pixel, pattern, channel]`.
    measurements: Vec<f64>,
}

impl HoldoutValidation {
    /// Recovers squares of the picture by `recover_from_training`, which uses training patterns only. Returns `None` if
    /// the split has too few distinct held-out patterns.
    ///
    /// # Errors
    /// If the executor is cancelled.
    pub(super) async fn new(
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        basis: Option<&Basis>,
        recover_from_training: impl Fn(TileRect) -> FloatTile + Sync + Send,
    ) -> Result<Option<Self>, RecoverError> {
        let &RecoveryPreparationInput {
            measurements,
            ref geometry,
            split,
            executor,
        } = preparation;
        executor.check_cancelled()?;
        let held_out = split.held_out.iter().map(|&l| &measurements.patterns[l]);
        let held_out: Vec<Pattern> = held_out.cloned().collect();
        // Exposures of one pattern differ by their noise only.
        if group_count(&pattern_ids(&held_out)) < MIN_HELD_OUT {
            return Ok(None);
        }
        let rects = sample_squares(measurements.camera);
        let samples = |i: usize| prediction::samples(measurements, &split.held_out, rects[i]);
        let samples = executor.map(rects.len(), samples);
        let own = executor.own_jobs(rects.len());
        let squares = executor.map(own.len(), |j| {
            let i = own.start + j;
            let tile = recover_from_training(rects[i]);
            let functions = tile.functions(geometry, basis);
            let residual = residual_variance(&samples[i], geometry, &held_out, &functions);
            let (signal, noise) = variances(measurements, split, rects[i]);
            (tile, [signal, noise, residual])
        });
        let square = |i: usize| &squares[i - own.start];
        let variances = executor.all_gather(rects.len(), |i| vec![square(i).1]);
        let variances = variances.await?.concat();
        let [signal, noise, residual] =
            [0, 1, 2].map(|i| variances.iter().map(|variances| variances[i]).sum());
        let coefficients = |i: usize| square(i).0.coefficients.clone();
        let coefficients = executor.all_gather(rects.len(), coefficients).await?;
        let functions = |i: usize| square(i).0.functions.clone();
        let functions = executor.all_gather(rects.len(), functions).await?;
        let tiles = coefficients.into_iter().zip(functions).zip(rects);
        let squares = tiles.zip(samples);
        let squares =
            squares.map(
                |(((coefficients, functions), rect), measurements)| ValidationRegion {
                    tile: FloatTile {
                        rect,
                        coefficients,
                        functions,
                    },
                    measurements,
                },
            );
        Ok(Some(Self {
            geometry: geometry.clone(),
            squares: squares.collect(),
            signal,
            noise,
            residual,
            patterns: held_out,
        }))
    }

    /// Whether measurements vary between patterns by more than their noise.
    pub fn has_signal(&self) -> bool {
        self.signal > 0.0
    }

    /// Estimated SNR of the recovery; `None` without signal.
    pub fn snr(&self) -> Option<Decibels> {
        let error = self.error(self.residual);
        (error > 0.0 && self.signal > 0.0)
            .then(|| Decibels(10.0 * libm::log10(self.signal / error)))
    }

    /// The recovered squares.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &FloatTile> {
        self.squares.iter().map(|square| &square.tile)
    }

    /// Estimated loss of SNR if `functions` replace those of the [squares](Self::tiles). It is negative if the
    /// replacement removes noise.
    pub fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels {
        let before = self.error(self.residual);
        // An error in the variance of the noise is in both residuals and cancels.
        let after = before + self.residual_variance(functions) - self.residual;
        Decibels(10.0 * libm::log10(after.max(f64::MIN_POSITIVE) / before.max(f64::MIN_POSITIVE)))
    }

    /// Error of functions by the variance of their residuals.
    fn error(&self, residual: f64) -> f64 {
        (residual - self.noise).max(ERROR_RESOLUTION * self.noise)
    }

    /// Variance of the residuals of `functions` between held-out patterns, summed over pixels and channels.
    fn residual_variance(&self, functions: &[TileTransportFunctions]) -> f64 {
        let squares = self.squares.iter().zip(functions);
        let variances = squares.map(|(square, functions)| {
            residual_variance(
                &square.measurements,
                &self.geometry,
                &self.patterns,
                functions,
            )
        });
        variances.sum()
    }
}

/// Variance of the residuals of `functions` between held-out `patterns`, summed over pixels and channels; `measurements` are
/// `[pixel, pattern, channel]`.
fn residual_variance(
    measurements: &[f64],
    geometry: &Geometry,
    patterns: &[Pattern],
    functions: &TileTransportFunctions,
) -> f64 {
    let predictions = prediction::predictions(geometry, patterns, functions);
    let residuals = measurements.iter().zip(&predictions);
    let residuals: Vec<f64> = residuals.map(|(y, predicted)| y - predicted).collect();
    let pixels = residuals.chunks_exact(patterns.len() * CHANNELS);
    let variances = pixels.flat_map(|residuals| {
        let of_channel = |c| residuals.iter().skip(c).step_by(CHANNELS).copied();
        (0..CHANNELS).filter_map(move |c| variance(of_channel(c)))
    });
    variances.sum()
}

/// Variances between patterns, summed over pixels and channels: of the measurements less their noise, and of the noise
/// under the held-out patterns.
fn variances(
    measurements: &CalibratedMeasurements<'_>,
    split: &HoldoutSplit,
    rect: TileRect,
) -> (f64, f64) {
    let (mut signal, mut noise) = (0.0, 0.0);
    for pixel in rect.pixels() {
        for c in 0..CHANNELS {
            // The variance of samples, and the mean variance of their noise.
            let of_patterns = |l: &[usize]| {
                let y = measurements.samples(l, pixel, c);
                let samples = l.iter().zip(&y);
                let noise = samples.map(|(&l, &y)| measurements.variance(l, c, y));
                (variance(y.iter().copied()), finite_mean(noise))
            };
            let ((Some(_), of_held_out), (total, of_all)) =
                (of_patterns(&split.held_out), of_patterns(&split.all))
            else {
                continue;
            };
            signal += total.unwrap_or_default() - of_all;
            noise += of_held_out;
        }
    }
    (signal, noise)
}

/// The mean of the finite values.
fn finite_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values.filter(|value| value.is_finite()) {
        sum += value;
        count += 1.0;
    }
    sum / count
}

/// The unbiased variance of the finite values; `None` if they are fewer than [`MIN_HELD_OUT`].
fn variance(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let finite = values.filter(|value| value.is_finite());
    let count = finite.clone().count();
    if count < MIN_HELD_OUT {
        return None;
    }
    let mean = finite.clone().sum::<f64>() / count as f64;
    let squares = finite.map(|value| (value - mean).powi(2));
    Some(squares.sum::<f64>() / (count - 1) as f64)
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::super::test_problems::SyntheticCapture;
    use super::*;
    use crate::job_executor::SequentialExecutor;

    /// Validates functions that are the true ones times `factor`.
    fn validate(capture: &SyntheticCapture, factor: f64) -> Option<HoldoutValidation> {
        let functions = capture.functions(factor);
        let preparation = RecoveryPreparationInput {
            measurements: &CalibratedMeasurements::uncorrected(&capture.measurements),
            geometry: capture.geometry.clone(),
            split: &HoldoutSplit::new(&capture.measurements.patterns),
            executor: &SequentialExecutor,
        };
        let recover = |rect| FloatTile::from(cropped(&functions, rect));
        pollster::block_on(HoldoutValidation::new(&preparation, None, recover)).ok()?
    }

    fn cropped(functions: &TileTransportFunctions, rect: TileRect) -> TileTransportFunctions {
        let (area, extent) = (
            functions.tau.len() / functions.rect.extent.area(),
            functions.rect.extent,
        );
        let mut crop = TileTransportFunctions::zeros(rect, area);
        for (pixel, tau) in rect.pixels().zip(crop.tau.chunks_exact_mut(area)) {
            let n = extent.index(pixel);
            tau.copy_from_slice(&functions.tau[n * area..(n + 1) * area]);
        }
        crop
    }

    #[test]
    fn snr_is_that_of_the_recovered_functions() {
        let mut capture = SyntheticCapture::new(60);
        for (factor, expected) in [(1.1, 20.0), (0.9, 20.0), (1.01, 40.0)] {
            let validation = validate(&capture, factor).unwrap();
            assert!(validation.has_signal());
            let snr = validation.snr().unwrap().0;
            assert!((snr - expected).abs() < 1.0, "{snr} dB, not {expected}");
        }
        // Residuals that the noise explains are no error beyond the noise's resolution.
        capture.measurements.noise.floor = [1e-3; CHANNELS];
        let validation = validate(&capture, 1.01).unwrap();
        assert_eq!(
            validation.error(validation.residual),
            ERROR_RESOLUTION * validation.noise
        );
    }

    #[test]
    fn loss_compares_replacements_with_the_recovered_functions() {
        let capture = SyntheticCapture::new(60);
        let validation = validate(&capture, 1.05).unwrap();
        let loss = |factor| {
            let functions = capture.functions(factor);
            let squares = validation
                .tiles()
                .map(|tile| cropped(&functions, tile.rect));
            validation.loss(&squares.collect::<Vec<_>>()).0
        };
        assert!(loss(1.05).abs() < 1e-9);
        // Twice the error is 6 dB, half of it −6 dB.
        assert!((loss(1.1) - 6.02).abs() < 0.01, "{}", loss(1.1));
        assert!((loss(1.025) + 6.02).abs() < 0.01, "{}", loss(1.025));
    }

    #[test]
    fn constant_photographs_have_no_signal_and_few_patterns_no_validation() {
        let mut capture = SyntheticCapture::new(60);
        capture.measurements.noise.floor = [1e-6; CHANNELS];
        capture
            .measurements
            .photos
            .iter_mut()
            .for_each(|picture| picture.fill([0.2; CHANNELS]));
        let validation = validate(&capture, 1.0).unwrap();
        assert!(!validation.has_signal() && validation.snr().is_none());
        assert!(validate(&SyntheticCapture::new(15), 1.0).is_none());
    }

    #[test]
    fn exposures_of_one_pattern_are_no_validation() {
        // Of 12 patterns, each twice, two exposures of one pattern are held out.
        let mut capture = SyntheticCapture::new(24);
        for l in (0..24).step_by(2) {
            capture.measurements.patterns[l + 1] = capture.measurements.patterns[l].clone();
            capture.measurements.photos[l + 1] = capture.measurements.photos[l].clone();
        }
        assert!(validate(&capture, 1.1).is_none());
    }

    #[test]
    fn saturated_measurements_are_left_out() {
        let mut capture = SyntheticCapture::new(60);
        // Each pixel is saturated under some patterns, held-out ones among them.
        for (l, photo) in capture.measurements.photos.iter_mut().enumerate() {
            for (n, colour) in photo.iter_mut().enumerate() {
                if (l + n) % 4 == 0 {
                    colour.fill(f32::NAN);
                }
            }
        }
        let validation = validate(&capture, 1.1).unwrap();
        assert!(validation.has_signal());
        let snr = validation.snr().unwrap().0;
        assert!((snr - 20.0).abs() < 1.5, "{snr} dB, not 20");
    }
}
