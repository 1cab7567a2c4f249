//! Recovery: from linear measurements to light transport functions.
//!
//! For each camera pixel and channel, y `[L]` measures `P̂τ`: `P̂` `[L, S]` are the L patterns on the S light elements
//! of the pixel's window, and τ `[S]` is its light transport function. L is smaller than S, so something has to be
//! known of τ beforehand. [`Method::Learned`], the default, learns a Gaussian prior from the measurements of all
//! pixels. The paper's methods treat each pixel by itself (section 3): non-negative least squares ([`Nnls`], case (a)),
//! and basis pursuit denoising (case (b)).
//!
//! Pixels and channels with one window share their normal equations, and windows share the patterns' correlations: that
//! makes recovery fast. The weight of the patterns' common mode ([`CommonModeWeight`]) makes it accurate. Parameters
//! are chosen on held-out patterns, which also estimate the SNR ([`HoldoutValidation`]).
//!
//! [`PreparedRecovery`] has no threads and no files: an [`Executor`](crate::job_executor::Executor) runs its jobs. What
//! is `async` waits only for other processes of the executor's group.

mod bpdn;
mod common_mode_weight;
mod diagnosis;
mod error;
mod gram_cache;
mod holdout_split;
mod holdout_validation;
mod hyperparameter_selection;
mod learned;
mod mean_function;
mod method;
mod nnls;
mod normal_equations;
mod partition;
mod passive_set;
mod pattern_check;
mod photometry;
mod pixelwise;
mod prediction;
mod preparation_input;
#[cfg(not(target_arch = "wasm32"))]
mod preparation_pixels;
mod prepared_recovery;
mod sampling;
#[cfg(all(test, not(target_arch = "wasm32")))]
pub(crate) mod test_problems;
mod window_size;

pub use bpdn::{Homotopy, SparsityBasis};
pub use common_mode_weight::CommonModeWeight;
pub use diagnosis::{CaptureFault, LightPlaneSymmetry, diagnose};
pub use error::RecoverError;
pub use holdout_validation::HoldoutValidation;
pub use method::Method;
pub use nnls::Nnls;
pub use photometry::{
    Flicker, FloodShortfall, MOVED_CODE, PhotographCorrection, PhotographFault, ResponseHypothesis,
};
#[cfg(not(target_arch = "wasm32"))]
pub use preparation_pixels::preparation_pixels;
pub use prepared_recovery::{PreparedRecovery, RecoverySettings, find_response};
pub use sampling::MIN_PATTERNS;
pub use window_size::{TailEstimate, WindowSizeEstimate};
