//! Why a recovery fails.

use thiserror::Error;

use super::sampling::MIN_PATTERNS;
use crate::job_executor::Cancelled;
use crate::transport::GeometryError;

/// Why a recovery fails.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// There are fewer patterns than recovery makes sense with.
    #[error("{0} patterns are too few; recovery needs at least {MIN_PATTERNS}")]
    TooFewPatterns(usize),
    /// The window, the grids or the correspondence are out of range.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The window of every camera pixel lies off the light plane.
    #[error("the correspondence maps no camera pixel onto the light plane")]
    CorrespondenceOffLightPlane,
    /// No pixel that was sampled is brighter than black.
    #[error("the photographs show no light from the light plane")]
    NoSignal,
    /// The photographs do not depend on their patterns as light transport does.
    #[error("the photographs do not follow from their patterns")]
    UncorrelatedPatterns,
    /// Some photographs do not show the pattern that they are listed with.
    #[error("{} of the photographs do not match their patterns", pattern_indices.len())]
    MismatchedPatterns {
        /// Their patterns, as indices into the measurements' patterns.
        pattern_indices: Vec<usize>,
    },
    /// The photographs are alike.
    #[error("photographs do not differ from pattern to pattern by more than their noise")]
    IndistinctPhotographs,
    /// More than half of the pixels that were sampled are saturated in some photograph.
    #[error("too many pixels are saturated in too many photographs")]
    Overexposed,
    /// The caller cancelled the recovery.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
