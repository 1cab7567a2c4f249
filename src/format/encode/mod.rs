//! The encoder: light transport to an `.ltm` file.
//!
//! ```text
//! encoder        one pass over all tiles: moments, peaks  -> rotated basis
//! sampling       parts of some tiles
//! rate_control   sample, target                           -> step, rank
//! scan_plan      sample, step, shares of the file         -> scans
//! assembly       all tiles, scans                         -> chunks, file
//! ```

mod assembly;
mod basis_rotation;
mod encoder;
mod quantisation_error;
mod rate_control;
mod sampling;
mod scan_costs;
mod scan_plan;
mod source;

pub use assembly::EncodedFile;
pub use source::{DistortionMetric, RateTarget, Source};

use super::error::FormatError;
use crate::executor::Executor;
use encoder::Encoder;

impl EncodedFile {
    /// Encodes a whole file. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`FormatError::Source`] if a tile cannot be read, [`FormatError::TooLarge`] if even the coarsest file is
    /// larger than the target, and the errors of writing extensions and metadata.
    ///
    /// # Panics
    /// If a tile or a basis function does not have the length that geometry and basis give it.
    pub fn new(
        source: Source<'_>,
        target: RateTarget<'_>,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        rate_control::encode(Encoder::new(source, executor)?, target, executor)
    }
}
