//! The normal equations that the priors are learned from.

use super::equations::{MinReliableBrightness, ObservationEquations, min_reliable_brightness};
use crate::job_executor::{Cancelled, Executor, PARTS};
use crate::recover::partition::Partition;
use crate::recover::preparation_input::RecoveryPreparationInput;

/// If at least one in so many observations has a full window, the others are left out.
const FULL_WINDOW_RATIO: u64 = 4;

/// The equations of regions of the picture.
#[derive(Debug)]
pub(super) struct TrainingEquations {
    pub regions: Partition<ObservationEquations>,
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
        let counts_of_part = |part: usize| {
            let observations = regions.part(part).iter().flat_map(|r| &r.observations);
            let full_windows = observations.clone().filter(|o| o.has_full_window).count();
            vec![[full_windows, observations.count()].map(|count| count as u64)]
        };
        let counts = executor.all_gather(PARTS, counts_of_part).await?.concat();
        let [full_windows, all] =
            [0, 1].map(|i| counts.iter().map(|counts| counts[i]).sum::<u64>());
        Ok(Self {
            regions,
            only_full_windows: FULL_WINDOW_RATIO * full_windows >= all,
        })
    }

    /// The brightness below which the observations are not reliable.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub async fn min_reliable_brightness(
        &self,
        executor: &impl Executor,
    ) -> Result<MinReliableBrightness, Cancelled> {
        let brightnesses_of_part = |part: usize| {
            let regions = self.regions.part(part).iter();
            let observations = regions.flat_map(|r| &r.observations);
            observations.map(|o| o.brightness).collect::<Vec<_>>()
        };
        let brightnesses = executor.all_gather(PARTS, brightnesses_of_part).await?;
        Ok(min_reliable_brightness(&brightnesses.concat()))
    }

    /// The equations of one region, of which every observation counts.
    #[cfg(test)]
    pub fn of_region(equations: ObservationEquations) -> Self {
        Self {
            regions: Partition::single(equations),
            only_full_windows: false,
        }
    }
}
