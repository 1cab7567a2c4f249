//! Recovery with a Gaussian prior that is learned from the measurements themselves.
//!
//! With L = 80 patterns and S = 225 light elements in a window, one pixel's measurements leave most of
//! its light transport function undetermined (paper, section 3, L < S). The functions of one object
//! resemble each other, and every pixel measures a different random projection of its own: together
//! they determine the distribution of the functions. The model, for each camera pixel and channel:
//!
//! ```text
//! y = P̂τ + noise,   τ = f V z,   z ~ N(m, C)
//! ```
//!
//! with the pixel's brightness f, an orthonormal basis V, `[S, r]`, that all pixels share ([`basis`]),
//! and coefficients z, `[r]`. Expectation–maximisation learns m and C ([`prior`]), then the distribution
//! of z given the neighbouring pixels ([`neighbour_prior`]). The posterior mean ẑ has a closed form
//! ([`posterior`]); f ẑ are the coefficients of a factored tile.
//!
//! - [`training`] chooses the rank and decides, by hold-out validation, whether the neighbour prior is used;
//! - [`inference`] computes the coefficients of a tile;
//! - [`blending`] mixes in non-negative least squares where that predicts held-out patterns better.

mod basis;
mod blending;
mod equations;
mod inference;
mod initial_prior;
mod neighbour_prior;
mod nonnegativity;
mod posterior;
mod posterior_means;
mod prior;
mod regression;
#[cfg(test)]
mod tests;
mod training;

use super::common_mode::CommonMode;
use super::error::RecoverError;
use super::holdout::HoldoutSplit;
use super::pixelwise::PixelwiseRecovery;
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::transport::{Basis, CHANNELS, Geometry, RecoveredTile, TileRect, Window};
use blending::{ResidualProducts, blend, fit_nnls_alternative};
use inference::LearnedModel;
use posterior_means::NEIGHBOURHOOD_RADIUS;
use training::Training;

/// The learned model and, where blending pays, non-negative least squares.
#[derive(Debug)]
pub(super) struct LearnedRecovery {
    model: LearnedModel,
    split: HoldoutSplit,
    /// `None` where blending with least squares does not pay over the whole picture.
    nnls: Option<PixelwiseRecovery>,
}

impl LearnedRecovery {
    /// Upper estimate of the memory that training takes beside the measurements, in bytes.
    pub fn preparation_bytes(window: Window) -> usize {
        training::max_bytes(window)
    }

    /// Upper estimate of the memory that one tile takes beside its functions, in bytes: a Gram matrix for
    /// each pixel and channel, as saturated samples may differ between them.
    pub fn tile_bytes(window: Window) -> usize {
        let side = (Geometry::DEFAULT_TILE_SIDE + 2 * Self::MAX_HALO) as usize;
        side.pow(2) * CHANNELS * Self::max_rank(window).pow(2) * size_of::<f64>()
    }

    /// The largest rank that training may choose.
    pub fn max_rank(window: Window) -> usize {
        training::max_rank(window)
    }

    /// Trains on all of `measurements`, starting from their [mean function](super::pooled::mean_function), `[S]`.
    ///
    /// # Errors
    /// [`RecoverError::NoSignal`] where no prior can be learned, [`RecoverError::Cancelled`] after
    /// cancellation, and the errors of [`PixelwiseRecovery::least_squares`].
    pub fn new(
        measurements: &Measurements,
        geometry: Geometry,
        split: HoldoutSplit,
        mean_function: &[f64],
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let training = Training {
            measurements,
            geometry,
            split: &split,
            executor,
        };
        let mut model = training.fit_basis(mean_function)?;
        executor.check_cancelled()?;
        let regions = training.regions(model.rank());
        training.fit_neighbour_prior(&mut model, &split.training, &regions);
        let mut nnls = None;
        if !split.held_out.is_empty() {
            let helps = training.neighbour_prior_helps(&mut model, &regions);
            if !helps {
                model.neighbour_prior = None;
            }
            executor.check_cancelled()?;
            nnls = fit_nnls_alternative(&model, measurements, &split, &regions, executor)?;
            // All choices are made: train on the held-out patterns, too.
            executor.check_cancelled()?;
            training.fit_neighbour_prior(&mut model, &split.all, &regions);
            if !helps {
                model.neighbour_prior = None;
            }
        }
        Ok(Self { model, split, nnls })
    }

    /// The orthonormal basis of the factored tiles.
    pub fn basis(&self) -> &Basis {
        self.model.basis.functions()
    }

    /// Weight of the patterns' common mode in the least squares that tiles are blended with.
    pub fn common_mode(&self) -> Option<CommonMode> {
        self.nnls.as_ref().map(|nnls| nnls.common_mode)
    }

    /// The largest [`halo`](Self::halo), in camera pixels.
    pub const MAX_HALO: u32 = NEIGHBOURHOOD_RADIUS as u32;

    /// Width, in camera pixels, of the border around a tile whose measurements affect the tile.
    pub fn halo(&self) -> u32 {
        self.model.halo()
    }

    /// Recovers one tile from all patterns.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> RecoveredTile {
        let tile = self.model.tile(measurements, &self.split.all, rect);
        let Some(nnls) = &self.nnls else {
            return RecoveredTile::Factored(tile);
        };
        // The prior was trained on the held-out patterns, too, but has few parameters to fit to them; the
        // pixels' own measurements in this comparison are those under the other patterns only.
        let weight = ResidualProducts::on_tile(&self.model, nnls, measurements, &self.split, rect)
            .tile_weight();
        if weight == 0.0 {
            return RecoveredTile::Factored(tile);
        }
        let mut functions = self.model.expand(&tile);
        blend(&mut functions, &nnls.tile(measurements, rect), weight);
        RecoveredTile::Direct(functions)
    }

    /// Recovers one tile without the held-out patterns, for hold-out validation. All of its pixels
    /// determine the weight of the blend.
    pub fn training_tile(&self, measurements: &Measurements, rect: TileRect) -> RecoveredTile {
        let tile = self.model.tile(measurements, &self.split.training, rect);
        let Some(nnls) = &self.nnls else {
            return RecoveredTile::Factored(tile);
        };
        let mut functions = self.model.expand(&tile);
        let alternative = nnls.tile_from(measurements, &self.split.training, rect);
        let recovered = [&functions, &alternative];
        let weight =
            ResidualProducts::new(&self.model, measurements, &self.split, recovered).tile_weight();
        if weight == 0.0 {
            return RecoveredTile::Factored(tile);
        }
        blend(&mut functions, &alternative, weight);
        RecoveredTile::Direct(functions)
    }
}
