//! Inference: from a tile's measurements to its coefficients under the learned model.
//!
//! In: the measurements of the tile and of a [halo](LearnedModel::halo) around it, and the patterns to use. Out:
//! coefficients f ẑ, `[pixel, component]` with a value for each channel. ẑ is the posterior mean under the pixel prior
//! or, if the model has a neighbour prior, under the mixture of both, moved by the non-negativity penalty.

use super::basis::LearnedBasis;
use super::equations::{BrightnessThresholds, RegionEquations, with_margin};
use super::neighbour_prior::NeighbourPrior;
use super::nonnegativity::NonNegativityPenalty;
use super::posterior::PosteriorSolver;
use super::posterior_means::{NEIGHBOURHOOD_RADIUS, PosteriorMeans};
use super::prior::Prior;
use crate::capture::Measurements;
use crate::linalg::vectorise;
use crate::recover::holdout::HoldoutSplit;
use crate::recover::sampling::pixels_by_window;
use crate::transport::{CHANNELS, FactoredTile, Geometry, TileRect, TransportFunctions};

/// Everything that training learns.
#[derive(Debug)]
pub(super) struct LearnedModel {
    pub geometry: Geometry,
    pub basis: LearnedBasis,
    pub penalty: NonNegativityPenalty,
    pub prior: Prior,
    /// `None` where it does not help.
    pub neighbour_prior: Option<NeighbourPrior>,
    pub thresholds: BrightnessThresholds,
}

impl LearnedModel {
    /// Number of basis functions, r.
    pub fn rank(&self) -> usize {
        self.basis.rank()
    }

    /// Width, in camera pixels, of the border around a tile whose measurements affect the tile.
    pub fn halo(&self) -> u32 {
        match self.neighbour_prior {
            Some(_) => NEIGHBOURHOOD_RADIUS as u32,
            None => 0,
        }
    }

    /// Recovers one tile from the patterns `pattern_indices`.
    pub fn tile(
        &self,
        measurements: &Measurements,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> FactoredTile {
        let region = with_margin(measurements, rect, self.halo());
        let (geometry, basis) = (&self.geometry, &self.basis);
        let equations =
            RegionEquations::new(measurements, geometry, basis, pattern_indices, region);
        let means = PosteriorMeans::new(&equations, rect, &self.prior, &self.thresholds);
        let z = self.estimate(&means);
        let rank = self.rank();
        let mut coefficients = vec![[0.0f32; CHANNELS]; rect.extent.area() * rank];
        let z = z.chunks_exact(rank);
        for (i, (location, z)) in means.interior_locations().zip(z).enumerate() {
            let scale = means.equations.observations[location.index].scale;
            let pixel = &mut coefficients[i / CHANNELS * rank..(i / CHANNELS + 1) * rank];
            for (coefficient, z) in pixel.iter_mut().zip(z) {
                coefficient[location.channel] = (scale * z) as f32;
            }
        }
        FactoredTile { rect, coefficients }
    }

    /// ẑ of every pixel in the interior of `means`, `[pixel, channel, r]`.
    fn estimate(&self, means: &PosteriorMeans<'_>) -> Vec<f64> {
        let (rank, noise) = (self.rank(), self.prior.noise_factor);
        let mut all = Vec::with_capacity(means.interior.extent.area() * CHANNELS * rank);
        vectorise(
            #[inline(always)]
            || {
                let mut solver = PosteriorSolver::new(rank);
                let (mut mean, mut estimate) = (vec![0.0; rank], vec![0.0; rank]);
                for location in means.interior_locations() {
                    let index = location.index;
                    let pixel_mean = means.mean(index);
                    estimate.copy_from_slice(pixel_mean);
                    if means.is_bright[index] {
                        if let Some(prior) = &self.neighbour_prior {
                            let q = prior.infer(means, noise, location, &mut mean, &mut solver);
                            let both = solver.mean.iter().zip(pixel_mean);
                            for (estimate, (z, a)) in estimate.iter_mut().zip(both) {
                                *estimate = q * z + (1.0 - q) * a;
                            }
                        } else {
                            self.prior.infer(means.equations, index, &mut solver);
                        }
                        solver.apply_penalty(&self.penalty, &mut estimate);
                    }
                    all.extend_from_slice(&estimate);
                }
            },
        );
        all
    }

    /// The light transport functions of a tile.
    pub fn expand(&self, tile: &FactoredTile) -> TransportFunctions {
        tile.expand(&self.geometry, self.basis.functions())
    }

    /// Squared residual, over `rect`, of the held-out patterns as predicted from the others. Saturated
    /// samples do not count.
    pub fn held_out_error(
        &self,
        measurements: &Measurements,
        split: &HoldoutSplit,
        rect: TileRect,
    ) -> f64 {
        let (rank, tile) = (self.rank(), self.tile(measurements, &split.training, rect));
        let mut error = 0.0;
        for (origin, pixels) in pixels_by_window(&self.geometry, rect) {
            for (plane, channels) in measurements.planes() {
                let responses = self
                    .basis
                    .respond(measurements, &self.geometry, origin, plane);
                for &(p, pixel) in &pixels {
                    let coefficients = &tile.coefficients[p * rank..(p + 1) * rank];
                    for &l in &split.held_out {
                        for c in channels.clone() {
                            let terms = responses.row(l).iter().zip(coefficients);
                            let predicted: f64 = terms.map(|(b, z)| f64::from(b * z[c])).sum();
                            let residual = measurements.sample(l, pixel, c) - predicted;
                            if residual.is_finite() {
                                error += residual * residual;
                            }
                        }
                    }
                }
            }
        }
        error
    }
}
