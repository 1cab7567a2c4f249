//! Blends the learned recovery with non-negative least squares (NNLS).
//!
//! A Gaussian prior does not know that light is non-negative. Where functions are sparse and unlike each other, NNLS
//! (paper, section 3, case (a)) uses that and errs differently, so that the blend `τ = (1 − w) τ_learned + w τ_nnls`
//! is better than either. With the residuals a and b of the two on held-out patterns, `‖(1 − w) a + w b‖²` is least at
//! `w = (aᵀa − aᵀb) / ‖a − b‖²`, clamped to 0..=1.

use bytemuck::{Pod, Zeroable};

use super::inference::LearnedModel;
use crate::job_executor::Executor;
use crate::recover::error::RecoverError;
use crate::recover::holdout_split::HoldoutSplit;
use crate::recover::photometry::CalibratedMeasurements;
use crate::recover::pixelwise::PixelwiseRecovery;
use crate::recover::prediction;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::transport::{Extent, TileRect, TileTransportFunctions};

/// Smallest share of a tile's squared held-out residual that blending must save: a blended tile is direct and takes ten
/// times the bytes of a factored one.
pub(super) const MIN_TILE_GAIN: f64 = 0.005;
/// The same over all training regions, for blending to be tried at all: that doubles the time.
const MIN_PICTURE_GAIN: f64 = 0.02;
/// Side of the centre of a tile that determines the tile's blend.
pub(super) const TILE_CENTRE_SIDE_PX: u32 = 16;
/// Side of the centre of a training region that counts for [`MIN_PICTURE_GAIN`].
const REGION_CENTRE_SIDE_PX: u32 = 4;

/// Inner products of the two methods' residuals on held-out patterns.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct BlendingGram {
    /// `aᵀa`, of the learned recovery.
    pub learned: f64,
    /// `aᵀb`.
    pub cross: f64,
    /// `bᵀb`, of NNLS.
    pub nnls: f64,
}

impl BlendingGram {
    /// The products for a tile's functions that both methods recovered without the held-out patterns. Saturated samples
    /// do not count.
    pub fn new(
        model: &LearnedModel,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        [learned, nnls]: [&TileTransportFunctions; 2],
    ) -> Self {
        let [learned, nnls] = [learned, nnls].map(|functions| {
            prediction::residuals(&model.geometry, measurements, &split.held_out, functions)
        });
        let mut products = Self::default();
        for (a, b) in learned.into_iter().zip(nnls) {
            if a.is_finite() && b.is_finite() {
                products.learned += a * a;
                products.cross += a * b;
                products.nnls += b * b;
            }
        }
        products
    }

    /// Recovers `rect` by both methods without the held-out patterns.
    pub fn recover(
        model: &LearnedModel,
        nnls: &PixelwiseRecovery,
        measurements: &CalibratedMeasurements<'_>,
        split: &HoldoutSplit,
        rect: TileRect,
    ) -> Self {
        let learned = model.expand(&model.tile(measurements, &split.training, rect));
        let alternative = nnls.tile(measurements, &split.training, rect);
        Self::new(model, measurements, split, [&learned, &alternative])
    }

    /// The weight of NNLS with the least squared residual; 0 if that saves no more than the share `min_gain` of the
    /// learned recovery's.
    pub fn best_weight(self, min_gain: f64) -> f32 {
        let squared_distance = self.learned - 2.0 * self.cross + self.nnls;
        if squared_distance.is_nan() || squared_distance <= 0.0 {
            return 0.0;
        }
        let weight = ((self.learned - self.cross) / squared_distance).clamp(0.0, 1.0);
        let saved = weight * (2.0 * (self.learned - self.cross) - weight * squared_distance);
        match saved > min_gain * self.learned {
            true => weight as f32,
            false => 0.0,
        }
    }
}

/// NNLS, if blending with it pays over all of `regions`. Errors are those of [`PixelwiseRecovery::least_squares`].
pub(super) async fn fit_nnls_alternative(
    model: &LearnedModel,
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    regions: &[TileRect],
) -> Result<Option<PixelwiseRecovery>, RecoverError> {
    let (measurements, split) = (preparation.measurements, preparation.split);
    let nnls = PixelwiseRecovery::least_squares(preparation).await?;
    let region_products = |i: usize| {
        let rect = centre(regions[i], REGION_CENTRE_SIDE_PX);
        vec![BlendingGram::recover(
            model,
            &nnls,
            measurements,
            split,
            rect,
        )]
    };
    let executor = preparation.executor;
    let products = executor.all_gather(regions.len(), region_products).await?;
    let sum = |a: BlendingGram, b: BlendingGram| BlendingGram {
        learned: a.learned + b.learned,
        cross: a.cross + b.cross,
        nnls: a.nnls + b.nnls,
    };
    let total = products
        .into_iter()
        .flatten()
        .fold(BlendingGram::default(), sum);
    Ok((total.best_weight(MIN_PICTURE_GAIN) > 0.0).then_some(nnls))
}

/// The central part of a rectangle, at most `side` by `side` pixels.
pub(super) fn centre(rect: TileRect, side: u32) -> TileRect {
    let extent = Extent::new(rect.extent.width.min(side), rect.extent.height.min(side));
    TileRect {
        x: rect.x + (rect.extent.width - extent.width) / 2,
        y: rect.y + (rect.extent.height - extent.height) / 2,
        extent,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blend_weight_minimises_the_held_out_residual() {
        let weight = |learned, cross, nnls| {
            let products = BlendingGram {
                learned,
                cross,
                nnls,
            };
            products.best_weight(MIN_TILE_GAIN)
        };
        assert_eq!(weight(1.0, 0.0, 1.0), 0.5); // uncorrelated residuals of one size
        assert!((weight(1.0, 0.0, 3.0) - 0.25).abs() < 1e-6);
        assert_eq!(weight(1.0, 1.0, 4.0), 0.0); // NNLS errs as the learned recovery does, and more
        assert_eq!(weight(4.0, 1.0, 1.0), 1.0);
        assert_eq!(weight(1.0, 1.0, 1.0), 0.0); // equal residuals
        assert_eq!(weight(1.0, 0.97, 1.4), 0.0); // saves less than MIN_TILE_GAIN
        assert_eq!(weight(f64::NAN, 0.0, 1.0), 0.0);
    }
}
