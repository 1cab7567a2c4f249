//! Why a part of the study fails.

use thiserror::Error;

use crate::recover::RecoverError;
use crate::transport::GeometryError;

/// An error of the drawing library.
pub(super) type ChartError = plotters::drawing::DrawingAreaErrorKind<std::io::Error>;

/// Why a part of the study fails.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A method cannot recover the transport from the measurements.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// The geometry of a scene is invalid.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Drawing a chart failed.
    #[error("a chart cannot be drawn")]
    LineChart(#[from] ChartError),
    /// Encoding a picture failed.
    #[error("a picture cannot be encoded")]
    Picture(#[from] image::ImageError),
    /// Writing a table as CSV failed.
    #[error("a table cannot be written as CSV")]
    Csv(#[from] csv::Error),
}
