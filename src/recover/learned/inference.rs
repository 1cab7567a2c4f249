//! Inference: from a tile's measurements to its coefficients under the learned model.
//!
//! In: the measurements of the tile and of a [halo](LearnedModel::halo) around it, and the patterns to use. Out:
//! coefficients f ẑ, `[pixel, component]` with a value for each channel. ẑ is the posterior mean under the pixel prior
//! or, if the model has a neighbour prior, under the mixture of both, moved by the non-negativity penalty.

use serde::{Deserialize, Serialize};

use super::basis::LearnedBasis;
use super::equations::{MinReliableBrightness, ObservationEquations};
use super::neighbour_prior::NeighbourPrior;
use super::nonnegativity::NonNegativityPenalty;
use super::posterior::PosteriorSolver;
use super::posterior_means::{NEIGHBOURHOOD_RADIUS, PixelObservationPosition, PosteriorMeans};
use super::prior::Prior;
use crate::linalg::vectorise;
use crate::recover::holdout_split::HoldoutSplit;
use crate::recover::photometry::CalibratedMeasurements;
use crate::recover::prediction;
use crate::recover::sampling::with_margin;
use crate::transport::{CHANNELS, FloatTile, Geometry, TileRect, TileTransportFunctions};

/// Everything that training learns.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct LearnedModel {
    pub geometry: Geometry,
    pub basis: LearnedBasis,
    pub penalty: NonNegativityPenalty,
    pub prior: Prior,
    /// `None` where it does not help.
    pub neighbour_prior: Option<NeighbourPrior>,
    pub min_brightness: MinReliableBrightness,
}

impl LearnedModel {
    /// Width, in camera pixels, of the border around a tile whose measurements affect the tile.
    pub fn halo(&self) -> u32 {
        let prior = self.neighbour_prior.as_ref();
        prior.map_or(0, |_| NEIGHBOURHOOD_RADIUS)
    }

    /// Recovers one tile from the patterns `pattern_indices`.
    pub fn tile(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> FloatTile {
        let equations = self.equations(measurements, pattern_indices, rect);
        let means = PosteriorMeans::new(&equations, rect, &self.prior, &self.min_brightness);
        self.coefficients(&means, rect, self.neighbour_prior.as_ref())
    }

    /// The equations of a tile and its halo.
    fn equations(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> ObservationEquations {
        let region = with_margin(measurements.camera, rect, self.halo());
        let (geometry, basis) = (&self.geometry, &self.basis);
        ObservationEquations::new(measurements, geometry, basis, pattern_indices, region)
    }

    /// The coefficients of a tile, with the neighbour prior if one is given.
    fn coefficients(
        &self,
        means: &PosteriorMeans<'_>,
        rect: TileRect,
        neighbour_prior: Option<&NeighbourPrior>,
    ) -> FloatTile {
        let rank = self.basis.rank();
        let mut coefficients = vec![[0.0f32; CHANNELS]; rect.extent.area() * rank];
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || {
                let mut solver = PosteriorSolver::new(rank);
                for (i, location) in means.interior_locations().enumerate() {
                    let brightness = means.equations.observations[location.index].brightness;
                    let pixel = &mut coefficients[i / CHANNELS * rank..][..rank];
                    let z = self.estimate(means, location, neighbour_prior, &mut solver);
                    for (coefficient, z) in pixel.iter_mut().zip(z) {
                        coefficient[location.channel] = (brightness * z) as f32;
                    }
                }
            },
        );
        FloatTile {
            coefficients,
            ..FloatTile::dark(rect)
        }
    }

    /// ẑ of one observation, `[r]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn estimate(
        &self,
        means: &PosteriorMeans<'_>,
        location: PixelObservationPosition,
        neighbour_prior: Option<&NeighbourPrior>,
        solver: &mut PosteriorSolver,
    ) -> Vec<f64> {
        let index = location.index;
        let mut estimate = means.mean(index).to_vec();
        if !means.is_reliable[index] {
            return estimate;
        }
        if let Some(prior) = neighbour_prior {
            let (q, _) = prior.infer(means, self.prior.noise_factor, location, solver);
            for (estimate, z) in estimate.iter_mut().zip(&solver.mean) {
                *estimate = q * z + (1.0 - q) * *estimate;
            }
        } else {
            self.prior.infer(means.equations, index, solver);
        }
        self.penalty.apply(&solver.factor, &mut estimate);
        estimate
    }

    pub fn expand(&self, tile: &FloatTile) -> TileTransportFunctions {
        tile.functions(&self.geometry, Some(&self.basis.functions))
    }

    /// Squared residual, over `rect`, of the held-out patterns as predicted from the others: by the pixel prior, and by
    /// the neighbour prior. Saturated samples do not count.
    pub fn held_out_errors(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        rect: TileRect,
    ) -> [f64; 2] {
        let equations = self.equations(measurements, &split.training, rect);
        let means = PosteriorMeans::new(&equations, rect, &self.prior, &self.min_brightness);
        let error = |neighbour_prior| {
            let functions = self.expand(&self.coefficients(&means, rect, neighbour_prior));
            let residuals =
                prediction::residuals(&self.geometry, measurements, &split.held_out, &functions);
            let finite = residuals.iter().filter(|residual| residual.is_finite());
            finite.map(|residual| residual * residual).sum()
        };
        let without = error(None);
        let with = self.neighbour_prior.as_ref();
        [without, with.map_or(without, |prior| error(Some(prior)))]
    }
}
