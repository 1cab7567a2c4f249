//! The recovery methods, and upper bounds on what each needs.

use serde::Serialize;

use super::bpdn::SparsityBasis;
use super::learned;
use super::mean_function;
use super::photometry;
use super::pixelwise::PixelwiseRecovery;
use crate::transport::Window;

/// How light transport functions are recovered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Posterior mean under a Gaussian prior that is learned from the measurements; blended with least squares in tiles
    /// where the blend predicts held-out patterns better.
    Learned,
    /// Non-negative least squares, each pixel and channel by itself (paper, section 3, case (a)).
    Nnls,
    /// Basis pursuit denoising: of all functions that explain a pixel's measurements to within the noise, the sparsest
    /// one in this basis (paper, section 3, case (b)).
    Bpdn(#[serde(skip_serializing)] SparsityBasis),
}

impl Method {
    /// All methods.
    pub const ALL: &[Self] = &[
        Self::Learned,
        Self::Nnls,
        Self::Bpdn(SparsityBasis::Identity),
        Self::Bpdn(SparsityBasis::Dct),
        Self::Bpdn(SparsityBasis::Haar),
    ];

    /// `bound` for [`Learned`](Self::Learned), zero for the others.
    fn if_learned<T: Default>(self, bound: T) -> T {
        match self {
            Self::Learned => bound,
            Self::Nnls | Self::Bpdn(_) => T::default(),
        }
    }

    /// Upper bound on the memory that preparing a recovery from so many photographs takes beside the measurements, in
    /// bytes.
    pub fn preparation_bytes(self, window: Window, photographs: usize) -> usize {
        let learned = self.if_learned(learned::preparation_bytes(window));
        let shared =
            mean_function::max_bytes(window).max(photometry::max_bytes(window, photographs));
        learned.max(shared)
    }

    /// Upper bound on the memory that recovering a tile takes beside the measurements and the tile's functions, in
    /// bytes.
    pub fn tile_bytes(self, window: Window, patterns: usize) -> usize {
        // Learned tiles may be blended with least squares.
        let learned = self.if_learned(learned::tile_bytes(window));
        let solver = learned.max(PixelwiseRecovery::max_tile_bytes(window, patterns));
        solver + photometry::max_tile_bytes(patterns, self.max_solver_halo())
    }

    /// Upper bound on the memory that resampled samples of so many photographs take while a recovery is prepared, in bytes.
    pub fn resampled_bytes(photographs: usize) -> usize {
        photometry::max_prepared_bytes(photographs) + photometry::max_tile_bytes(photographs, 0)
    }

    /// Largest rank of the basis that factored tiles share.
    pub fn max_rank(self, window: Window) -> usize {
        self.if_learned(learned::max_rank(window))
    }

    /// Largest distance from a tile, in camera pixels, of measurements that the tile depends on.
    pub fn max_halo(self) -> u32 {
        self.max_solver_halo() + photometry::HALO
    }

    /// The same of photographs that are not shifted.
    pub(super) fn max_solver_halo(self) -> u32 {
        self.if_learned(learned::MAX_HALO)
    }

    /// The basis of [`Bpdn`](Self::Bpdn).
    pub fn basis(self) -> Option<SparsityBasis> {
        match self {
            Self::Bpdn(basis) => Some(basis),
            Self::Learned | Self::Nnls => None,
        }
    }

    /// The method's name in options, reports and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Learned => "learned",
            Self::Nnls => "nnls",
            Self::Bpdn(_) => "bpdn",
        }
    }
}
