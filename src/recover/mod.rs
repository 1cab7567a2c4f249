//! From measurements to light transport functions.
//!
//! By default a prior learned from all pixels' measurements says what each function is likely to be
//! ([`learned`]). The paper's own methods treat every pixel by itself: for each camera pixel and channel, over its window and subject to `τ ≥ 0`: minimise `‖y − P̂τ‖₂`
//! (paper, section 3, case (a); [`Nnls`]), or `‖φᵀτ‖₁` subject to `‖y − P̂τ‖₂ ≤ ε` (case (b);
//! [`Homotopy`] and [`InteriorPoint`]). What makes it affordable is that all pixels and channels
//! whose correspondence falls in the same light element share one window and so one set of normal
//! equations, and that windows share the patterns' correlations ([`design`]); what makes it accurate
//! is how the patterns' common mode is weighted ([`CommonMode`]).
//!
//! [`Recovery`] is pure and works tile by tile: whoever has threads runs tiles on them.

mod bandwidth;
mod bpdn;
mod common_mode;
mod error;
mod gram_cache;
mod holdout;
mod holdout_validation;
mod learned;
mod method;
mod model_selection;
mod nnls;
mod normal_equations;
mod passive_set;
mod pattern_check;
mod pixelwise;
mod pooled;
mod prediction;
mod recovery;
mod sampling;
#[cfg(all(test, not(target_arch = "wasm32")))]
mod test_problems;

pub use bandwidth::{BandwidthEstimate, WindowEstimate};
pub use bpdn::{Constraint, Homotopy, InteriorPoint, Solution, SparsityBasis};
pub use common_mode::CommonMode;
pub use error::RecoverError;
pub use holdout_validation::HoldoutValidation;
pub use method::Method;
pub use nnls::Nnls;
pub use recovery::{Recovery, Settings};
pub use sampling::MIN_PATTERNS;
