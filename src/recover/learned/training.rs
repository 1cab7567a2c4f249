//! Training: from all measurements to the learned model.
//!
//! 1. [`RecoveryPreparationInput::fit_basis`] starts from smooth variations of the mean function
//!    ([`initial_prior`](super::initial_prior)), learns the pixel prior over them by expectation–maximisation (EM) on
//!    small squares spread over the picture, and truncates the basis to the largest candidate rank whose error on
//!    held-out patterns is near the least.
//! 2. [`RecoveryPreparationInput::fit_neighbour_prior`] repeats EM on larger training regions, where neighbours of most pixels
//!    are known, and learns the neighbour prior there.
//! 3. [`RecoveryPreparationInput::select_neighbour_prior`] compares the errors on held-out patterns with and without it.

use super::basis::LearnedBasis;
use super::equations::ObservationEquations;
use super::inference::LearnedModel;
use super::initial_prior::{MAX_INITIAL_RANK, initial_prior, principal_axes, truncate_basis};
use super::neighbour_prior::NeighbourPrior;
use super::nnls_blending::centre;
use super::nonnegativity::NonNegativityPenalty;
use super::posterior_means::{NEIGHBOURHOOD_RADIUS, PosteriorMeans};
use super::training_equations::TrainingEquations;
use crate::job_executor::{Cancelled, Executor};
use crate::recover::error::RecoverError;
use crate::recover::mean_function;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::recover::sampling::{spread_squares, with_margin};
use crate::transport::{Extent, TileRect, Window};

/// Ranks to choose from; each fills vector registers together with the mean function.
const CANDIDATE_RANKS: [usize; 3] = [23, 31, 47];
/// Relative increase of the held-out error up to which a larger rank is preferred. Most of that error is noise, which
/// tells little of the components that 80 patterns hardly determine. What a smaller basis cannot represent is lost, but
/// the prior keeps an undetermined component from doing harm.
const MAX_ERROR_INCREASE: f64 = 0.02;
/// Steps of EM over the initial basis. They do what 21 iterations did, to 0.1 dB of SNR, in half the time.
pub(super) const INITIAL_EM_STEPS: [usize; 9] = [1, 1, 2, 1, 3, 1, 2, 3, 7];
/// One in so many squares compares the candidate ranks.
const RANK_COMPARISON_SAMPLING: usize = 2;
/// EM iterations over the truncated basis, on the training regions: from the training patterns, and then from all.
pub(super) const FINAL_EM_ITERATIONS: [usize; 2] = [2, 1];
/// Training regions of the neighbour prior, and their side.
pub(in crate::recover) const MAX_REGIONS: usize = 64;
pub(in crate::recover) const REGION_SIDE_PX: u32 = 16;
/// Side of the middle of a region that decides whether the neighbour prior helps.
const SELECTION_SIDE_PX: u32 = 8;
/// Memory for the regions' Gram matrices. Where many windows differ, or saturated samples leave pixels Gram matrices of
/// their own, there are fewer regions, but at least `MIN_REGIONS`.
const MAX_GRAM_BYTES: usize = 144 << 20;
const MIN_REGIONS: usize = 8;

/// The largest rank that training may choose.
pub(in crate::recover) fn max_rank(window: Window) -> usize {
    let rank = CANDIDATE_RANKS.into_iter().fold(0, usize::max);
    rank.min(window.area())
}

/// Upper estimate of the memory that training takes beside the measurements, in bytes: the equations of the squares,
/// each pixel and channel with a Gram matrix of its own, or later the regions' Gram matrices and as much again for the
/// sums of their regressions.
pub(in crate::recover) fn preparation_bytes(window: Window) -> usize {
    let rank = MAX_INITIAL_RANK.min(window.area());
    let squares = mean_function::MAX_SAMPLES * rank * rank * size_of::<f64>();
    squares.max(2 * MAX_GRAM_BYTES)
}

/// As many training regions as there may be, without the border that holds their outer neighbours. Where there are fewer,
/// each is one of these.
pub(in crate::recover) fn sample_regions(camera: Extent) -> Vec<TileRect> {
    spread_squares(camera, REGION_SIDE_PX, MAX_REGIONS)
}

impl<E: Executor> RecoveryPreparationInput<'_, E> {
    /// Learns the basis and the pixel prior over it, starting from the mean function, `[S]`.
    ///
    /// # Errors
    /// [`RecoverError::NoSignal`] where no rank has a finite error, [`RecoverError::Cancelled`] after cancellation.
    pub(super) async fn fit_basis(
        &self,
        mean_function: &[f64],
    ) -> Result<LearnedModel, RecoverError> {
        let side = self.geometry.window.side() as usize;
        let mean = mean_function::smooth(mean_function, side);
        let (functions, mut prior) = initial_prior(&mean, side, self.executor);
        let basis = LearnedBasis::new(&functions, &mean);
        let squares = mean_function::sample_squares(self.measurements.camera);
        let training = TrainingEquations::new(self, squares.len(), |i| {
            self.equations(&basis, &self.split.training, squares[i])
        });
        let training = training.await?;
        let min_brightness = training.min_reliable_brightness(self.executor).await?;
        for step in INITIAL_EM_STEPS {
            self.executor.check_cancelled()?;
            let iteration = prior.em_iteration(&training, &min_brightness, step, self.executor);
            iteration.await?;
        }
        drop(training);

        let axes = principal_axes(&prior);
        let mut chosen: Option<(f64, LearnedModel)> = None;
        // A small window has fewer candidates.
        let mut ranks = CANDIDATE_RANKS.map(|rank| rank.min(prior.rank)).to_vec();
        ranks.dedup();
        for rank in ranks {
            self.executor.check_cancelled()?;
            let (functions, prior) = truncate_basis(&functions, &prior, &axes, rank);
            let model = LearnedModel {
                geometry: self.geometry.clone(),
                basis: LearnedBasis::new(&functions, &mean),
                penalty: NonNegativityPenalty::new(&functions, &mean),
                prior,
                neighbour_prior: None,
                min_brightness,
            };
            let held_out_error = |i: usize| {
                let square = squares[i * RANK_COMPARISON_SAMPLING];
                vec![model.held_out_errors(self.measurements, self.split, square)[0]]
            };
            let count = squares.len().div_ceil(RANK_COMPARISON_SAMPLING);
            let errors = self.executor.all_gather(count, held_out_error).await?;
            let error = errors.iter().flatten().sum();
            let least = chosen.as_ref().map_or(error, |(least, _)| least.min(error));
            if error <= (1.0 + MAX_ERROR_INCREASE) * least {
                chosen = Some((least, model));
            }
        }
        chosen.map(|(_, model)| model).ok_or(RecoverError::NoSignal)
    }

    /// The training regions of the neighbour prior, as many as there is memory for, without the border that holds their
    /// outer neighbours.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) async fn training_regions(&self, rank: usize) -> Result<Vec<TileRect>, Cancelled> {
        let camera = self.measurements.camera;
        let regions = sample_regions(camera);
        let count = |i: usize| {
            let (all, rect) = (&self.split.all, self.with_neighbours(regions[i]));
            let (measurements, geometry) = (self.measurements, &self.geometry);
            let count =
                ObservationEquations::count_gram_matrices(measurements, geometry, all, rect);
            vec![count as u64]
        };
        let counts = self.executor.all_gather(regions.len(), count).await?;
        let bytes = counts.iter().flatten().sum::<u64>() as usize * rank * rank * size_of::<f64>();
        if bytes <= MAX_GRAM_BYTES {
            return Ok(regions);
        }
        let fit = MAX_GRAM_BYTES / (bytes / regions.len()).max(1);
        let count = fit.max(MIN_REGIONS);
        Ok(spread_squares(camera, REGION_SIDE_PX, count))
    }

    /// Continues EM of the pixel prior by `em_iterations` on `regions` from the patterns `pattern_indices`, and learns
    /// the neighbour prior, anew or from the one that the model has, or removes it.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) async fn fit_priors(
        &self,
        model: &mut LearnedModel,
        pattern_indices: &[usize],
        regions: &[TileRect],
        em_iterations: usize,
        learn_neighbour_prior: bool,
    ) -> Result<(), Cancelled> {
        let training = TrainingEquations::new(self, regions.len(), |i| {
            let rect = self.with_neighbours(regions[i]);
            self.equations(&model.basis, pattern_indices, rect)
        });
        let training = training.await?;
        let (prior, min_brightness) = (&mut model.prior, &model.min_brightness);
        for _ in 0..em_iterations {
            let iteration = prior.em_iteration(&training, min_brightness, 1, self.executor);
            iteration.await?;
        }
        let start = model.neighbour_prior.take();
        if learn_neighbour_prior {
            let means = training.regions.map(self.executor, |i, equations| {
                PosteriorMeans::new(equations, regions[i], prior, min_brightness)
            });
            let learned = NeighbourPrior::learn(&means, prior, start, self.executor);
            model.neighbour_prior = learned.await?;
        }
        Ok(())
    }

    /// Removes the neighbour prior unless it lowers the error on held-out patterns over the middles of `regions`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) async fn select_neighbour_prior(
        &self,
        model: &mut LearnedModel,
        regions: &[TileRect],
    ) -> Result<(), Cancelled> {
        let held_out_errors = |i: usize| {
            let rect = centre(regions[i], SELECTION_SIDE_PX);
            vec![model.held_out_errors(self.measurements, self.split, rect)]
        };
        let errors = self
            .executor
            .all_gather(regions.len(), held_out_errors)
            .await?;
        let [without, with] = [0, 1].map(|i| errors.iter().flatten().map(|e| e[i]).sum::<f64>());
        model.neighbour_prior = model.neighbour_prior.take().filter(|_| with < without);
        Ok(())
    }

    fn equations(
        &self,
        basis: &LearnedBasis,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> ObservationEquations {
        let (measurements, geometry) = (self.measurements, &self.geometry);
        ObservationEquations::new(measurements, geometry, basis, pattern_indices, rect)
    }

    fn with_neighbours(&self, rect: TileRect) -> TileRect {
        with_margin(self.measurements.camera, rect, NEIGHBOURHOOD_RADIUS)
    }
}
