//! From measurements to light transport functions.
//!
//! For each camera pixel and channel, minimise `‖y − P̂τ‖₂` over its window subject to `τ ≥ 0`
//! (paper, section 3, case (a)). What makes it affordable is that all pixels and channels whose
//! correspondence falls in the same light element share one window and so one set of normal
//! equations ([`design`]); what makes it accurate is how the patterns' common mode is weighted
//! ([`CommonMode`]).
//!
//! [`Recovery`] is pure and works tile by tile: whoever has threads runs tiles on them.

mod bpdn;
mod common_mode;
mod design;
mod direct;
mod learned;
mod nnls;
mod passive;
mod recovery;
#[cfg(all(test, not(target_arch = "wasm32")))]
mod test_problems;
mod vector;
mod workers;

pub use bpdn::{Constraint, Homotopy, Solution, SparsityBasis, Splitting};
pub use common_mode::CommonMode;
pub use nnls::Nnls;
pub use recovery::{Method, RecoverError, Recovery, Settings};
pub use workers::{OneThread, Workers};

/// Fewest patterns that recovery makes sense with.
pub(crate) const FEWEST_PATTERNS: usize = 4;
