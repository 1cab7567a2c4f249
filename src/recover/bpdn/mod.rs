//! Basis pursuit denoising: `min ‖φᵀτ‖₁` subject to `‖y − P̂τ‖₂ ≤ ε` and `τ ≥ 0` (paper, section 3,
//! case (b)), for the constraint as written.
//!
//! With φ the identity the path of solutions over ε is followed from dark to where it meets ε
//! ([`homotopy`]); with any other orthonormal φ Newton's method goes to the solution through the
//! inside of all constraints ([`interior`]). Where ε is less than non-negative least squares can reach, no τ satisfies
//! the constraint, and both return that least-squares solution.

mod homotopy;
mod interior;
mod solution;
mod tolerance;
mod transform;
mod window;

pub use homotopy::Homotopy;
pub use interior::InteriorPoint;
pub use solution::{Constraint, Solution};
pub(super) use tolerance::Tolerance;
pub use transform::SparsityBasis;
