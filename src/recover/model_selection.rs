//! Chooses the parameters of [`PixelwiseRecovery`]: those by which the training patterns predict the held-out ones with
//! the highest SNR.
//!
//! Chosen are the weight ω of the common mode and, for denoising, the share of the noise that the tolerance ε allows.
//! Each candidate recovers a sample of windows, spread over the picture.

use std::collections::BTreeMap;

use super::bpdn::{SparsityBasis, Tolerance};
use super::common_mode::CommonMode;
use super::error::RecoverError;
use super::gram_cache::GramCache;
use super::holdout::HoldoutSplit;
use super::nnls::Nnls;
use super::pixelwise::{self, PixelProblem, PixelwiseRecovery};
use super::sampling::{self, MIN_PATTERNS};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::transport::{CHANNELS, CameraPx, Decibels, Element, Geometry, TransportError};

/// Size of a sample: enough to tell candidates apart by hundredths of a decibel, and few enough to take seconds.
#[derive(Clone, Copy, Debug)]
struct SampleSize {
    max_windows: usize,
    pixels_per_window: usize,
}

/// For least squares each pixel takes as long as the next, so all may have windows of their own.
const LEAST_SQUARES_SAMPLE: SampleSize = SampleSize {
    max_windows: 48,
    pixels_per_window: 1,
};
/// Denoising takes longer, and has seven candidates: fewer windows, whose pixels share their equations.
const DENOISING_SAMPLE: SampleSize = SampleSize {
    max_windows: 16,
    pixels_per_window: 4,
};

impl PixelwiseRecovery {
    /// Non-negative least squares, with the best weight of the common mode.
    ///
    /// # Errors
    /// If no pixel in memory sees the light plane, and if the executor is cancelled.
    pub fn least_squares(
        measurements: &Measurements,
        geometry: Geometry,
        split: &HoldoutSplit,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        executor.check_cancelled()?;
        let sample = WindowSample::new(measurements, geometry, split, LEAST_SQUARES_SAMPLE)?;
        let candidates = CommonMode::CANDIDATES.map(|common_mode| Self {
            geometry,
            common_mode,
            problem: PixelProblem::LeastSquares,
        });
        Ok(sample.best_of(candidates, executor))
    }

    /// Basis pursuit denoising, with the best weight of the common mode and the best tolerance.
    ///
    /// # Errors
    /// If no pixel in memory sees the light plane, and if the executor is cancelled.
    pub fn denoising(
        measurements: &Measurements,
        geometry: Geometry,
        basis: SparsityBasis,
        split: &HoldoutSplit,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let least_squares = Self::least_squares(measurements, geometry, split, executor)?;
        let sample = WindowSample::new(measurements, geometry, split, LEAST_SQUARES_SAMPLE)?;
        let noise = sample.fit_noise(least_squares.common_mode, executor);
        executor.check_cancelled()?;
        let sample = WindowSample::new(measurements, geometry, split, DENOISING_SAMPLE)?;
        let candidates = Tolerance::CANDIDATE_SHARES.map(|share| Self {
            problem: PixelProblem::Denoising(basis, Tolerance { share, ..noise }),
            ..least_squares
        });
        Ok(sample.best_of(candidates, executor))
    }
}

/// Windows spread over the picture, with some of their pixels.
struct WindowSample<'a> {
    measurements: &'a Measurements,
    geometry: Geometry,
    split: &'a HoldoutSplit,
    windows: Vec<(Element, Vec<CameraPx>)>,
}

impl<'a> WindowSample<'a> {
    fn new(
        measurements: &'a Measurements,
        geometry: Geometry,
        split: &'a HoldoutSplit,
        size: SampleSize,
    ) -> Result<Self, RecoverError> {
        let mut windows: BTreeMap<_, Vec<_>> = BTreeMap::new();
        let covered = geometry.tiles().filter(|&tile| measurements.has_tile(tile));
        for (origin, pixels) in covered.flat_map(|rect| sampling::pixels_by_window(&geometry, rect))
        {
            if !geometry.clip_window(origin).is_empty() {
                let pixels = pixels.into_iter().take(size.pixels_per_window);
                windows.insert(origin, pixels.map(|(_, pixel)| pixel).collect());
            }
        }
        if windows.is_empty() {
            return Err(RecoverError::CorrespondenceOffLightPlane);
        }
        let step = windows.len().div_ceil(size.max_windows);
        Ok(Self {
            measurements,
            geometry,
            split,
            windows: windows.into_iter().step_by(step).collect(),
        })
    }

    /// The candidate that predicts the held-out patterns best; the first if no pattern is held out.
    fn best_of<const N: usize>(
        &self,
        candidates: [PixelwiseRecovery; N],
        executor: &impl Executor,
    ) -> PixelwiseRecovery {
        let mut best = candidates[0];
        if self.split.held_out.is_empty() {
            return best;
        }
        let errors = executor.map(self.windows.len(), |i| {
            candidates.map(|candidate| self.prediction_error(&candidate, &self.windows[i]))
        });
        let mut best_snr: Option<Decibels> = None;
        for (n, candidate) in candidates.into_iter().enumerate() {
            let mut error = TransportError::default();
            errors.iter().for_each(|errors| error.merge(errors[n]));
            if let Some(snr) = error.snr()
                && best_snr.is_none_or(|best_snr| snr > best_snr)
            {
                (best_snr, best) = (Some(snr), candidate);
            }
        }
        best
    }

    /// Error of a candidate's predictions of one window's measurements under the held-out patterns.
    fn prediction_error(
        &self,
        candidate: &PixelwiseRecovery,
        (origin, pixels): &(Element, Vec<CameraPx>),
    ) -> TransportError {
        let mut error = TransportError::default();
        let numbered = pixels.iter().copied().enumerate().collect();
        let elements = sampling::elements_of_window(&self.geometry, *origin);
        let mut add = |_, pixel: usize, c: usize, _: &[usize], x: &[f64]| {
            for &l in &self.split.held_out {
                let y = self.measurements.sample(l, pixels[pixel], c);
                if y.is_finite() {
                    let plane = self.measurements.patterns[l].plane(c);
                    let terms = elements.iter().zip(x);
                    error.add(y, terms.map(|(&(_, m), &x)| f64::from(plane[m]) * x).sum());
                }
            }
        };
        candidate.solve_windows(
            self.measurements,
            &BTreeMap::from([(*origin, numbered)]),
            &self.split.training,
            &mut add,
        );
        error
    }

    /// The noise of the measurements, by the residuals of least squares and the degrees of freedom that it leaves.
    fn fit_noise(&self, common_mode: CommonMode, executor: &impl Executor) -> Tolerance {
        let measurements = self.measurements;
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        let weights = measurements.pattern_weights();
        let pairs = executor.map(self.windows.len(), |i| {
            let (origin, pixel) = (self.windows[i].0, self.windows[i].1[0]);
            let mut pairs = Vec::new();
            for channel in 0..CHANNELS {
                let samples = all.iter().map(|&l| measurements.sample(l, pixel, channel));
                let mut y: Vec<f64> = samples.collect();
                let saturated: Vec<usize> = (0..y.len()).filter(|&i| !y[i].is_finite()).collect();
                y.retain(|y| y.is_finite());
                if y.len() < MIN_PATTERNS {
                    continue;
                }
                let cache = GramCache::new(
                    (&measurements.patterns, &weights),
                    &all,
                    channel,
                    self.geometry.light,
                    self.geometry.window,
                    [origin, origin],
                    1,
                );
                let equations = cache.equations(origin, common_mode, &saturated);
                let (mean, y) = (pixelwise::mean(&y), equations.weight(y));
                let mut nnls = Nnls::new(&equations.gram, equations.slots.len());
                let x = nnls.solve(&equations.right_hand_side(&y));
                let spare = y.len() as f64 - nnls.degrees_of_freedom() as f64;
                if spare >= 1.0 {
                    let residual = equations.columns.squared_residual(&y, &x);
                    pairs.push((mean, residual / spare));
                }
            }
            pairs
        });
        Tolerance::fit(&pairs.concat())
    }
}
