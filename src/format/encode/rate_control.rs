//! Rate control: the quantisation step and the rank for a quality or a size.
//!
//! Both are found by bisection on a sample. Components whose energy is far below the quantisation error
//! are then dropped.

use std::convert::Infallible;

use super::assembly::{self, EncodedFile, QuantisedTile};
use super::encoder_input::{DistortionMetric, EncoderInput, EncodingTarget};
use super::exp2;
use super::rate_control_sample::{SampledTilePart, sample};
use super::scan_costs::RateDistortionModel;
use super::scan_plan::{self, ByteShareLimits, MAX_SHARES, ProgressiveScanPlan, SHARES};
use super::source_analysis::AnalysedSource;
use crate::bisect::bisect;
use crate::format::chunk_store::ChunkStore;
use crate::format::constants::FIRST_BYTES;
use crate::format::error::FormatError;
use crate::format::scan::ProgressiveScan;
use crate::job_executor::Executor;
use crate::transport::{Decibels, FloatTile, SnrAccumulator, TileTransportFunctions};

/// Energy of the dropped components, relative to the quantisation error.
const DROPPED_ENERGY_RATIO: f64 = 0.01;
/// Range of steps of a loss, as powers of two of the coarsest step, and halvings: to 0.5 %.
const LOSS_EXPONENTS: [f64; 2] = [-20.0, 0.0];
const LOSS_HALVINGS: usize = 12;
/// Range of steps of an SNR, and halvings: to 0.3 %.
const SNR_EXPONENTS: [f64; 2] = [-26.0, 0.0];
const SNR_HALVINGS: usize = 13;
/// Range of SNRs of a file size in dB, and halvings.
const SIZE_SNRS: [f64; 2] = [3.0, 75.0];
const SIZE_HALVINGS: usize = 9;
/// Corrections of the step by the error of the plan: their maximum number and factor, and the range of ratios
/// that needs none.
const STEP_CORRECTIONS: usize = 8;
const MAX_STEP_CORRECTION: f32 = 1.25;
const MIN_STEP_RATIO: f32 = 0.99;
const MAX_STEP_RATIO: f32 = 1.05;
/// Factors of the planned shares in new plans for a file that exceeds [`MAX_SHARES`].
const RETRY_SHARE_FACTORS: [f64; 2] = [0.75, 0.5];
/// Bytes of metadata that shares of a file are counted with, so that transport is coded the same at a step whatever is
/// written about it. For 80 photographs the command line writes about 800.
const USUAL_METADATA_BYTES: u64 = 1024;

impl EncodedFile {
    /// Encodes a whole file in memory. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`FormatError::InvalidGeometry`], [`FormatError::TooMany`] basis functions or scans, [`FormatError::Source`] if a
    /// tile cannot be read, [`FormatError::Compress`], [`FormatError::TooLarge`] if even the coarsest file is larger than
    /// the target, and the errors of writing extensions and metadata.
    ///
    /// # Panics
    /// If a tile or a basis function does not have the length that geometry and basis give it.
    pub fn new(
        source: EncoderInput<'_>,
        target: EncodingTarget<'_>,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        Self::new_in(|| Ok(Vec::new()), source, target, executor)
    }

    /// Encodes a file with the quantisation step of another: for the shards of a picture, which are then equally accurate.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), but [`FormatError::TooLarge`].
    ///
    /// # Panics
    /// As [`new`](Self::new).
    pub fn with_step(
        source: EncoderInput<'_>,
        step: f32,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        let mut encoder = FileEncoder::new(&source, || Ok(Vec::new()), executor)?;
        let is_lit = encoder.controller.trial_error(step).signal > 0.0;
        encoder.encode_with_step(is_lit.then_some(step))
    }
}

impl<S: ChunkStore> EncodedFile<S> {
    /// As [`new`](EncodedFile::new), with the chunks in a store of the caller's. `new_store` is called for each attempt to
    /// reach the target, of which up to three are kept at a time.
    ///
    /// # Errors
    /// Those of [`new`](EncodedFile::new), of `new_store` and of the stores.
    ///
    /// # Panics
    /// As [`new`](EncodedFile::new).
    pub fn new_in(
        new_store: impl Fn() -> Result<S, FormatError> + Sync,
        source: EncoderInput<'_>,
        target: EncodingTarget<'_>,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        if let EncodingTarget::Lossless = target {
            let analysed = AnalysedSource::new(&source, executor)?;
            let scans = assembly::lossless_scans(&analysed);
            return assembly::encode(&source, &analysed, scans, new_store()?);
        }
        let mut encoder = FileEncoder::new(&source, new_store, executor)?;
        match target {
            EncodingTarget::Bytes(limit) => encoder.encode_to_size(limit),
            target => {
                let step = encoder.controller.step(target)?;
                encoder.encode_with_step(step)
            }
        }
    }
}

/// Encodes all tiles of a source with a step, or with several until the target is reached.
struct FileEncoder<'a, E, N> {
    source: &'a EncoderInput<'a>,
    controller: RateController<'a, E>,
    new_store: N,
}

impl<'a, E, S, N> FileEncoder<'a, E, N>
where
    E: Executor,
    S: ChunkStore,
    N: Fn() -> Result<S, FormatError> + Sync,
{
    fn new(
        source: &'a EncoderInput<'a>,
        new_store: N,
        executor: &'a E,
    ) -> Result<Self, FormatError> {
        let analysed = AnalysedSource::new(source, executor)?;
        let sample = sample(&analysed, source)?;
        Ok(Self {
            source,
            controller: RateController { analysed, sample },
            new_store,
        })
    }

    fn encode_to_size(&mut self, limit: u64) -> Result<EncodedFile<S>, FormatError> {
        let rotation = self.controller.analysed.rotation.clone();
        let mut try_snr = |snr: f64| {
            let controller = &mut self.controller;
            controller.analysed.rotation.clone_from(&rotation);
            let step = controller.step(EncodingTarget::Snr(Decibels(snr)))?;
            self.encode_with_step(step)
        };
        let mut best = try_snr(SIZE_SNRS[0])?;
        let smallest = best.bytes();
        if smallest > limit {
            return Err(FormatError::TooLarge { limit, smallest });
        }
        bisect(SIZE_SNRS, SIZE_HALVINGS, |snr| {
            let file = try_snr(snr)?;
            let fits = file.bytes() <= limit;
            if fits {
                best = file;
            }
            Ok::<_, FormatError>(fits)
        })?;
        Ok(best)
    }

    /// Encodes all tiles; without a step there is no light. Plans anew with smaller shares if the file exceeds
    /// [`MAX_SHARES`]: predictions from samples may err.
    fn encode_with_step(&mut self, step: Option<f32>) -> Result<EncodedFile<S>, FormatError> {
        let controller = &mut self.controller;
        let Some(step) = step else {
            let store = (self.new_store)()?;
            return assembly::encode(self.source, &controller.analysed, Vec::new(), store);
        };
        let expected = controller.drop_weak_components(step);
        let model = RateDistortionModel::new(&controller.analysed, &controller.sample);
        let encode = |factor: f64| {
            let ProgressiveScanPlan { scans, first_scans } =
                controller.plan(&model, step, expected.error, factor)?;
            let store = (self.new_store)()?;
            let file = assembly::encode(self.source, &controller.analysed, scans, store)?;
            let is_within = is_within_shares(&file, first_scans);
            Ok::<_, FormatError>((file, is_within))
        };
        let (mut file, mut is_within) = encode(1.0)?;
        for factor in RETRY_SHARE_FACTORS {
            // A reader fetches small files at once, unless long metadata make them large.
            if is_within || usual_bytes(&file, file.bytes()) <= FIRST_BYTES {
                break;
            }
            (file, is_within) = encode(factor)?;
        }
        Ok(file)
    }
}

/// The search for a file's step, rank and scans.
pub struct RateController<'a, E> {
    pub analysed: AnalysedSource<'a, E>,
    pub sample: Vec<SampledTilePart>,
}

impl<E: Executor> RateController<'_, E> {
    /// The step for an SNR or a loss; `None` if there is no light.
    ///
    /// # Errors
    /// Those of the metric.
    pub fn step(&mut self, target: EncodingTarget<'_>) -> Result<Option<f32>, FormatError> {
        match target {
            EncodingTarget::Loss(max_loss, metric) => self.step_for_loss(max_loss, metric),
            EncodingTarget::Snr(snr) => Ok(step_for(snr, |step| self.trial_error(step))),
            EncodingTarget::Bytes(_) | EncodingTarget::Lossless => Ok(None),
        }
    }

    fn step_for_loss(
        &mut self,
        max_loss: Decibels,
        metric: &dyn DistortionMetric,
    ) -> Result<Option<f32>, FormatError> {
        let analysed = &mut self.analysed;
        let pixels = analysed.geometry.camera.area() as f64;
        // The step at which nothing is left.
        let coarsest = 16.0 * (analysed.energy / pixels).sqrt();
        if !(coarsest as f32).is_normal() {
            return Ok(None);
        }
        let tiles = codable(analysed, metric.tiles());
        // The metric may have direct functions where the file has none.
        let has_functions = analysed.has_functions;
        analysed.has_functions |= tiles.iter().any(|tile| !tile.functions.is_empty());
        let tiles: Vec<_> = tiles.into_iter().map(|t| analysed.rotated(t)).collect();
        let [exponent, _] = bisect(LOSS_EXPONENTS, LOSS_HALVINGS, |exponent| {
            let scans = scan_plan::trial(analysed, (coarsest * exp2(exponent)) as f32);
            let decoded = |i: usize| decoded(analysed, &tiles[i], &scans);
            let loss = metric.loss(&analysed.executor.map(tiles.len(), decoded));
            Ok::<_, FormatError>(loss.0 <= max_loss.0)
        })?;
        analysed.has_functions = has_functions;
        Ok(Some((coarsest * exp2(exponent)) as f32))
    }

    /// Drops the last components, as far as their energy is small against the error of `step`. Returns this error.
    pub fn drop_weak_components(&mut self, step: f32) -> SnrAccumulator {
        let expected = self.trial_error(step);
        drop_weak_components(&mut self.analysed, expected);
        expected
    }

    /// The plan for `factor` of the planned shares, with a step near `step` at which its error is `expected_error`: the
    /// plan's layers change the error a little.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn plan(
        &self,
        model: &RateDistortionModel,
        mut step: f32,
        expected_error: f64,
        factor: f64,
    ) -> Result<ProgressiveScanPlan, FormatError> {
        let shares = ByteShareLimits {
            first: SHARES.first * factor,
            scan: SHARES.scan * factor,
        };
        let mut plan = scan_plan::plan(&self.analysed, model, step, shares)?;
        for correction in 0..STEP_CORRECTIONS {
            let error = self.error_of(&plan.scans).error;
            let ratio = (expected_error / error.max(f64::MIN_POSITIVE)).sqrt() as f32;
            // Only the first correction makes the step coarser, so that the others converge.
            if ratio >= MIN_STEP_RATIO && (ratio <= MAX_STEP_RATIO || correction > 0) {
                break;
            }
            step *= 0.99 * ratio.clamp(MAX_STEP_CORRECTION.recip(), MAX_STEP_CORRECTION);
            plan = scan_plan::plan(&self.analysed, model, step, shares)?;
        }
        Ok(plan)
    }

    fn trial_error(&self, step: f32) -> SnrAccumulator {
        self.error_of(&scan_plan::trial(&self.analysed, step))
    }

    /// The quantisation error of some scans, predicted from the sample.
    pub fn error_of(&self, scans: &[ProgressiveScan]) -> SnrAccumulator {
        let errors = self.analysed.executor.map(self.sample.len(), |i| {
            let SampledTilePart { tile, weight } = &self.sample[i];
            let (rank, order) = (self.analysed.rank(), &self.analysed.order);
            let error = QuantisedTile::new(tile, rank, order, scans, false).error(scans.len());
            SnrAccumulator {
                signal: error.signal * weight,
                error: error.error * weight,
            }
        });
        // In order, so that the sum does not depend on threads.
        errors.into_iter().sum()
    }
}

/// Whether the index with the first `first_scans` scans, and every later scan, keep [`MAX_SHARES`] of the file.
fn is_within_shares(file: &EncodedFile<impl ChunkStore>, first_scans: usize) -> bool {
    let index = file.index();
    let file_bytes = usual_bytes(file, file.bytes()) as f64;
    let share = |bytes: u64| bytes as f64 / file_bytes;
    let scan_range = |scan: usize| index.scan_range(scan);
    let first_bytes = usual_bytes(file, scan_range(first_scans - 1).end);
    share(first_bytes) <= MAX_SHARES.first
        && (first_scans..index.scans.len())
            .map(scan_range)
            .all(|range| share(range.end - range.start) <= MAX_SHARES.scan)
}

/// The first `bytes` of a file, if it had metadata of [`USUAL_METADATA_BYTES`].
fn usual_bytes(file: &EncodedFile<impl ChunkStore>, bytes: u64) -> u64 {
    bytes - u64::from(file.index().header.metadata.bytes) + USUAL_METADATA_BYTES
}

/// The metric's tiles in the file's coding: as direct functions where the file has no components.
fn codable(
    analysed: &AnalysedSource<'_, impl Executor>,
    mut tiles: Vec<FloatTile>,
) -> Vec<FloatTile> {
    if analysed.rotation.is_none()
        && let Some(basis) = analysed.basis
    {
        for tile in &mut tiles {
            *tile = tile.functions(analysed.geometry, Some(basis)).into();
        }
    }
    tiles
}

/// The functions of a tile over the file's basis, as a reader decodes them.
fn decoded(
    analysed: &AnalysedSource<'_, impl Executor>,
    tile: &FloatTile,
    scans: &[ProgressiveScan],
) -> TileTransportFunctions {
    let quantised = QuantisedTile::new(tile, analysed.rank(), &analysed.order, scans, true);
    let decoded = quantised.decoded(tile, &analysed.order);
    let basis = analysed.rotation.as_ref().map(|rotation| &rotation.basis);
    decoded.functions(analysed.geometry, basis)
}

/// Drops the last components, as far as their energy is small against the quantisation error.
fn drop_weak_components(analysed: &mut AnalysedSource<'_, impl Executor>, error: SnrAccumulator) {
    let SnrAccumulator { signal, error } = error;
    let allowed = DROPPED_ENERGY_RATIO * analysed.energy * error / signal.max(f64::MIN_POSITIVE);
    if let Some(rotation) = &mut analysed.rotation {
        let mut dropped = 0.0;
        let weak = rotation.energies.iter().rev().take_while(|energy| {
            dropped += **energy;
            dropped <= allowed
        });
        let rank = rotation.rank() - weak.count();
        rotation.truncate(rank.max(1));
    }
}

/// The coarsest step with the given SNR, where `error` gives the error of a step. `None` if all values are zero.
fn step_for(snr: Decibels, error: impl Fn(f32) -> SnrAccumulator) -> Option<f32> {
    let norm = error(1.0).signal.sqrt() as f32;
    if !norm.is_normal() {
        return None;
    }
    // Even a value as large as the norm is zero at twice that step.
    let step = |exponent: f64| 2.0 * norm * exp2(exponent) as f32;
    let Ok([exponent, _]) = bisect(SNR_EXPONENTS, SNR_HALVINGS, |exponent| {
        Ok::<_, Infallible>(error(step(exponent)).finite_snr().0 >= snr.0)
    });
    Some(step(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_coarsest_with_the_snr() {
        // The error of values that are large against the step.
        let error = |step: f32| SnrAccumulator {
            signal: 1e4,
            error: f64::from(step).powi(2),
        };
        for target in [10.0, 34.0, 60.0] {
            let step = step_for(Decibels(target), error).unwrap();
            let snr = 10.0 * libm::log10(1e4 / f64::from(step).powi(2));
            assert!((0.0..0.1).contains(&(snr - target)), "{snr} dB");
        }
        assert!(step_for(Decibels(30.0), |_| SnrAccumulator::default()).is_none());
    }
}
