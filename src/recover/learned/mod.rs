//! Recovery with a Gaussian prior that is learned from the measurements themselves.
//!
//! With L = 80 patterns and S = 225 light elements in a window, one pixel's measurements leave most of its light
//! transport function undetermined (paper, section 3, L < S). The functions of one object resemble each other, and every
//! pixel measures a different random projection of its own: together they determine the distribution of the functions.
//! The model, for each camera pixel and channel:
//!
//! ```text
//! y = P̂τ + noise,   τ = f V z,   z ~ N(m, C)
//! ```
//!
//! with the pixel's brightness f, an orthonormal basis V, `[S, r]`, that all pixels share ([`basis`]), and coefficients
//! z, `[r]`. Expectation–maximisation learns m and C ([`prior`]), then the distribution of z given the neighbouring
//! pixels ([`neighbour_prior`]). The posterior mean ẑ has a closed form ([`posterior`]); f ẑ are the coefficients of a
//! factored tile.
//!
//! - [`training`] chooses the rank and decides, by hold-out validation, whether the neighbour prior is used;
//! - [`inference`] computes the coefficients of a tile;
//! - [`nnls_blending`] mixes in non-negative least squares where that predicts held-out patterns better.

mod basis;
mod equations;
mod inference;
mod initial_prior;
mod neighbour_prior;
mod neighbour_regression;
mod nnls_blending;
mod nonnegativity;
mod posterior;
mod posterior_means;
mod prior;
#[cfg(test)]
mod tests;
mod training;
mod training_equations;

use serde::{Deserialize, Serialize};

use super::common_mode_weight::CommonModeWeight;
use super::error::RecoverError;
use super::holdout_split::HoldoutSplit;
use super::photometry::CalibratedMeasurements;
use super::pixelwise::PixelwiseRecovery;
use super::preparation_input::RecoveryPreparationInput;
use crate::job_executor::Executor;
use crate::transport::{
    Basis, CHANNELS, FloatTile, Geometry, TileRect, TileTransportFunctions, Window,
};
use inference::LearnedModel;
use nnls_blending::{BlendingGram, MIN_TILE_GAIN, TILE_CENTRE_SIDE_PX, fit_nnls_alternative};
pub(super) use posterior_means::NEIGHBOURHOOD_RADIUS as MAX_HALO;
use training::FINAL_EM_ITERATIONS;
#[cfg(not(target_arch = "wasm32"))]
pub(super) use training::{MAX_REGIONS, REGION_SIDE_PX, sample_regions};
pub(super) use training::{max_rank, preparation_bytes};

/// The learned model and, where blending pays, non-negative least squares.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct LearnedRecovery {
    model: LearnedModel,
    /// `None` where blending with least squares does not pay over the whole picture.
    nnls: Option<PixelwiseRecovery>,
}

/// Upper estimate of the memory that one tile takes beside its functions, in bytes: a Gram matrix for each pixel and
/// channel, as saturated samples may differ between them.
pub(super) fn tile_bytes(window: Window) -> usize {
    let side = (Geometry::DEFAULT_TILE_SIDE + 2 * MAX_HALO) as usize;
    side.pow(2) * CHANNELS * max_rank(window).pow(2) * size_of::<f64>()
}

impl LearnedRecovery {
    /// Trains on all measurements, starting from their [mean function](super::mean_function::mean_function), `[S]`.
    ///
    /// # Errors
    /// [`RecoverError::NoSignal`] where no prior can be learned, [`RecoverError::Cancelled`] after cancellation, and the
    /// errors of [`PixelwiseRecovery::least_squares`].
    pub async fn new(
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        mean_function: &[f64],
    ) -> Result<Self, RecoverError> {
        let (split, executor) = (preparation.split, preparation.executor);
        let mut model = preparation.fit_basis(mean_function).await?;
        executor.check_cancelled()?;
        let regions = preparation.training_regions(model.basis.rank()).await?;
        let [first, second] = FINAL_EM_ITERATIONS;
        let training = preparation.fit_priors(&mut model, &split.training, &regions, first, true);
        training.await?;
        let mut nnls = None;
        if !split.held_out.is_empty() {
            let selection = preparation.select_neighbour_prior(&mut model, &regions);
            selection.await?;
            executor.check_cancelled()?;
            nnls = fit_nnls_alternative(&model, preparation, &regions).await?;
            // All choices are made: train on the held-out patterns, too.
            executor.check_cancelled()?;
            let helps = model.neighbour_prior.is_some();
            let training = preparation.fit_priors(&mut model, &split.all, &regions, second, helps);
            training.await?;
        }
        Ok(Self { model, nnls })
    }

    /// The orthonormal basis of the factored tiles.
    pub fn basis(&self) -> &Basis {
        &self.model.basis.functions
    }

    /// Weight of the patterns' common mode in the least squares that tiles are blended with.
    pub fn common_mode(&self) -> Option<CommonModeWeight> {
        self.nnls.as_ref().map(|nnls| nnls.common_mode)
    }

    /// Width, in camera pixels, of the border around a tile whose measurements affect the tile.
    pub fn halo(&self) -> u32 {
        self.model.halo()
    }

    /// Recovers one tile from all patterns.
    pub fn tile(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        rect: TileRect,
    ) -> FloatTile {
        let tile = self.model.tile(measurements, &split.all, rect);
        let Some(nnls) = &self.nnls else {
            return tile;
        };
        // The prior was trained on the held-out patterns, too, but has few parameters to fit to them; the pixels' own
        // measurements in this comparison are those under the other patterns only.
        let centre = nnls_blending::centre(rect, TILE_CENTRE_SIDE_PX);
        let products = BlendingGram::recover(&self.model, nnls, measurements, split, centre);
        self.blended_tile(tile, products, || nnls.tile(measurements, &split.all, rect))
    }

    /// Recovers one tile without the held-out patterns, for hold-out validation. All of its pixels determine the weight
    /// of the blend.
    pub fn training_tile(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        rect: TileRect,
    ) -> FloatTile {
        let tile = self.model.tile(measurements, &split.training, rect);
        let Some(nnls) = &self.nnls else {
            return tile;
        };
        let learned = self.model.expand(&tile);
        let alternative = nnls.tile(measurements, &split.training, rect);
        let recovered = [&learned, &alternative];
        let products = BlendingGram::new(&self.model, measurements, split, recovered);
        self.blended_tile(tile, products, || alternative)
    }

    /// `tile`, moved towards the `alternative` by the best weight for the products of their residuals.
    fn blended_tile(
        &self,
        tile: FloatTile,
        products: BlendingGram,
        alternative: impl FnOnce() -> TileTransportFunctions,
    ) -> FloatTile {
        let weight = products.best_weight(MIN_TILE_GAIN);
        if weight == 0.0 {
            return tile;
        }
        let mut functions = self.model.expand(&tile);
        let nnls = alternative();
        for (tau, nnls) in functions.tau.iter_mut().zip(&nnls.tau) {
            for c in 0..CHANNELS {
                tau[c] += weight * (nnls[c] - tau[c]);
            }
        }
        FloatTile::from(functions)
    }
}
