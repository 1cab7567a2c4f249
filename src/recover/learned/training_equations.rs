//! The normal equations that the priors are learned from.

use super::equations::{MinReliableBrightness, ObservationEquations, min_reliable_brightness};
use crate::job_executor::{Cancelled, Executor, PARTS};
use crate::recover::partition::Partition;
use crate::recover::preparation_input::RecoveryPreparationInput;

/// If at least one in so many observations has a full window, the others are left out.
const FULL_WINDOW_RATIO: usize = 4;

/// The equations of regions of the picture, and what depends on all of them.
#[derive(Debug)]
pub(super) struct TrainingEquations {
    pub regions: Partition<ObservationEquations>,
    pub min_reliable_brightness: MinReliableBrightness,
    /// Whether observations whose window is partly outside the light plane are left out: they determine little of their
    /// functions and slow EM down.
    pub only_full_windows: bool,
}

impl TrainingEquations {
    /// The equations `region(0)` to `region(count - 1)`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub async fn new(
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        count: usize,
        region: impl Fn(usize) -> ObservationEquations + Sync + Send,
    ) -> Result<Self, Cancelled> {
        let executor = preparation.executor;
        let regions = Partition::new(executor, count, region);
        let observations_of_part = |part: usize| {
            let observations = regions.part(part).iter().flat_map(|r| &r.observations);
            let described = observations.map(|o| [o.brightness, f64::from(o.has_full_window)]);
            described.collect::<Vec<_>>()
        };
        let observations = executor.all_gather(PARTS, observations_of_part).await?;
        let observations = observations.concat();
        let full_windows = observations.iter().filter(|[_, full]| *full > 0.0).count();
        let brightnesses: Vec<f64> = observations
            .iter()
            .map(|[brightness, _]| *brightness)
            .collect();
        Ok(Self {
            regions,
            min_reliable_brightness: min_reliable_brightness(&brightnesses),
            only_full_windows: FULL_WINDOW_RATIO * full_windows >= brightnesses.len(),
        })
    }

    /// The equations of one region, of which every observation counts.
    #[cfg(test)]
    pub fn of_region(equations: ObservationEquations) -> Self {
        Self {
            regions: Partition::single(equations),
            min_reliable_brightness: MinReliableBrightness::default(),
            only_full_windows: false,
        }
    }
}
