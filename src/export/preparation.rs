//! Chooses the window, prepares the recovery, and checks that the photographs show light transport at all.

use crate::capture::Measurements;
use crate::job_executor::Executor;
use crate::linalg::median;
use crate::recover::{
    HoldoutValidation, Method, PreparedRecovery, RecoverError, RecoverySettings, TailEstimate,
    WindowSizeEstimate,
};
use crate::transport::{CHANNELS, Decibels, Window};

/// SNR on held-out patterns below which the photographs are probably at fault.
pub const MIN_PLAUSIBLE_SNR: Decibels = Decibels(13.0);

/// Percentage of saturated samples above which an error in the calibration is likelier than highlights.
const MAX_SATURATED_PERCENT: f64 = 2.0;

/// The same percentage of one photograph, relative to the median of all, above which it was exposed differently.
const MIN_SATURATION_RATIO: f64 = 4.0;

/// A recovery that is ready to run.
#[derive(Debug)]
pub struct PreparedExport {
    /// The recovery.
    pub recovery: PreparedRecovery,
    /// How wide the band is, if the window was estimated.
    pub band: Option<TailEstimate>,
}

impl PreparedExport {
    /// The SNR of the recovered transport, estimated on held-out patterns.
    pub fn expected_snr(&self) -> Option<Decibels> {
        let validation = self.recovery.holdout_validation();
        validation.and_then(HoldoutValidation::snr)
    }
}

/// Percentage of the samples that are saturated.
pub fn saturated_percent(saturated: usize, measurements: &Measurements) -> f64 {
    let samples = measurements.photos.len() * measurements.camera.area() * CHANNELS;
    100.0 * saturated as f64 / samples as f64
}

/// Whether so many samples are saturated that the white level or the exposure is probably wrong.
pub fn has_implausible_saturation(saturated: usize, measurements: &Measurements) -> bool {
    has_one_exposure(measurements)
        && saturated_percent(saturated, measurements) > MAX_SATURATED_PERCENT
}

/// The photographs that saturate too many samples; `saturated` are the numbers of these samples, `[L]`. If that is so of all
/// together, those above the limit, otherwise those that are also far above most others.
pub fn implausibly_saturated(saturated: &[usize], measurements: &Measurements) -> Vec<usize> {
    if saturated.is_empty() || !has_one_exposure(measurements) {
        return Vec::new();
    }
    let samples = (measurements.camera.area() * CHANNELS) as f64;
    let percents = saturated.iter().map(|own| 100.0 * *own as f64 / samples);
    let percents: Vec<f64> = percents.collect();
    let limit = match has_implausible_saturation(saturated.iter().sum(), measurements) {
        true => MAX_SATURATED_PERCENT,
        false => MAX_SATURATED_PERCENT.max(MIN_SATURATION_RATIO * median(&percents)),
    };
    let is_above = |l: &usize| percents[*l] > limit;
    (0..percents.len()).filter(is_above).collect()
}

/// Of several exposures the longest are meant to saturate.
fn has_one_exposure(measurements: &Measurements) -> bool {
    let full_scale = &measurements.full_scale;
    full_scale.iter().all(|value| *value == full_scale[0])
}

/// How a recovery is prepared.
#[derive(Clone, Copy, Debug)]
pub struct ExportSettings {
    /// How light transport functions are recovered.
    pub method: Method,
    /// The window; `None` to estimate it.
    pub window: Option<Window>,
    /// Whether shifts between photographs are estimated and corrected.
    pub is_registered: bool,
}

/// Prepares a recovery.
///
/// # Errors
/// Those of [`PreparedRecovery::prepare`], and [`RecoverError::IndistinctPhotographs`].
pub async fn prepare(
    measurements: &Measurements,
    settings: ExportSettings,
    executor: &impl Executor,
) -> Result<PreparedExport, RecoverError> {
    let (window, band) = match settings.window {
        Some(window) => (window, None),
        None => {
            let estimate = WindowSizeEstimate::from_measurements(measurements, executor).await?;
            (estimate.window, Some(estimate.band))
        }
    };
    let settings = RecoverySettings {
        method: settings.method,
        window,
        is_registered: settings.is_registered,
    };
    let recovery = PreparedRecovery::prepare(measurements, settings, executor).await?;
    match recovery.holdout_validation() {
        Some(validation) if !validation.has_signal() => Err(RecoverError::IndistinctPhotographs),
        _ => Ok(PreparedExport { recovery, band }),
    }
}
