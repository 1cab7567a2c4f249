//! Photometric calibration: what each photograph has of its own, and which photographs do not belong to the capture.
//!
//! Shutters and lamps make every photograph's exposure differ a little from what is declared, and room light comes and
//! goes. Photograph l of a pixel is taken to be `y_l = g_l · p_l T + b_l`, with a gain g and a stray light b that all
//! pixels and channels share. Under the Gaussian model of light transport functions around the mean function, a pixel's
//! measurements have a known covariance K, so gains and stray light follow by generalised least squares
//! ([`equations`]): the functions themselves are integrated out. Standard errors come from the scatter between squares of
//! the picture (clusters, as in Liang and Zeger 1986), and only what exceeds them is corrected ([`estimate`]).
//!
//! The same model predicts every photograph from all the others (leave-one-out prediction, Rasmussen and Williams 2006,
//! section 5.4.2). A photograph that is predicted far worse than the others is left out, with the [fault](faults) that it
//! most looks like.

use serde::{Deserialize, Serialize};

use crate::capture::Measurements;
use crate::transport::Geometry;

mod calibrated_measurements;
mod equations;
mod estimate;
mod faults;
mod flicker;
mod flood_shortfall;
mod resampling;
mod response;
#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests;
mod window_covariance;

pub(super) use calibrated_measurements::CalibratedMeasurements;
pub use calibrated_measurements::PhotographCorrection;
#[cfg(not(target_arch = "wasm32"))]
pub(super) use equations::GRADIENT_MARGIN;
pub(super) use equations::max_bytes;
pub(super) use estimate::estimate;
pub use faults::{MOVED_CODE, PhotographFault};
pub use flicker::Flicker;
pub(super) use flicker::find as find_flicker;
pub use flood_shortfall::FloodShortfall;
pub(super) use flood_shortfall::find as find_flood_shortfall;
#[cfg(not(target_arch = "wasm32"))]
pub(super) use resampling::SMALL_BLOCK_SIDE as BLOCK_SIDE;
pub(super) use resampling::{
    HALO, ResampledPhotographs, ResamplingInput, max_prepared_bytes, max_tile_bytes,
};
pub use response::ResponseHypothesis;
pub(super) use response::find as find_response;

/// Corrections of the photographs, and those that are left out.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Photometry {
    /// One for each photograph; none at all if no photograph needs one.
    pub corrections: Vec<PhotographCorrection>,
    /// The photographs that are left out, by their indices in the measurements, with the fault that each looks like. Not
    /// needed to recover tiles elsewhere.
    #[serde(skip)]
    pub faults: Vec<(usize, PhotographFault)>,
    /// How softly shifted pictures interpolate: 0 as cubic splines, ½ as by cubic convolution, 1 as straight lines.
    pub softness: f64,
    /// The mean function that shifted photographs are [resampled](resampling) with, `[slot]`.
    pub mean_function: Vec<f64>,
}

impl Photometry {
    /// Whether photographs are corrected or left out.
    pub fn has_changes(&self) -> bool {
        !self.corrections.is_empty() || !self.faults.is_empty()
    }

    /// What the photographs `used` are resampled from.
    pub(super) fn resampling_input<'a>(
        &'a self,
        measurements: &'a Measurements,
        geometry: &'a Geometry,
        used: &'a [usize],
    ) -> ResamplingInput<'a> {
        ResamplingInput {
            measurements,
            corrections: &self.corrections,
            geometry,
            mean_function: &self.mean_function,
            softness: self.softness,
            used,
            is_exact: true,
        }
    }
}
