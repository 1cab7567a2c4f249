//! Linear algebra on small dense matrices of `f64`, row-major, as slices.
//!
//! The matrices here have 3 to about 1000 rows, and one factorisation is over in microseconds: what a general library
//! does before and after costs as much as the work itself. The inner loops are in `kernels`. The compiler makes vector
//! instructions of them, and [`vectorise`] compiles a caller together with all that it inlines for the widest ones; for
//! WebAssembly they are written out. No function fuses a multiplication with an addition or sums in an order that depends
//! on the width of a register, so every machine returns the same bits.

#[cfg(not(target_arch = "wasm32"))]
mod banded;
mod cholesky;
mod cosine;
#[cfg(any(test, feature = "simulate"))]
mod cubic_convolution;
mod eigen;
mod kernels;
mod matrix;
mod order;
mod vector;
mod vectorise;

#[cfg(not(target_arch = "wasm32"))]
pub(crate) use banded::BandedMatrix;
pub(crate) use cholesky::{cholesky, cholesky_inverse, cholesky_solve, cholesky_with_ridge};
pub(crate) use cosine::cos_pi;
#[cfg(all(test, not(target_arch = "wasm32")))]
pub(crate) use cubic_convolution::cubic_convolution;
#[cfg(feature = "simulate")]
pub(crate) use cubic_convolution::cubic_convolution_weights;
pub(crate) use eigen::{symmetric_eigen, symmetric_eigenvalues};
pub(crate) use kernels::{
    BLOCK_SLOTS, LANES, add_outer_block, add_products, add_scaled, combine_blocks, combine_slots,
    dot, multiply_rows, set_scaled_sum,
};
pub(crate) use matrix::{mirror_upper, multiply, multiply_vector, transpose};
pub(crate) use order::{ascending_order, median, sort};
pub(crate) use vector::{add_scaled_rows, padded_len};
pub(crate) use vectorise::vectorise;
