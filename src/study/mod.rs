//! Evaluation of recovery on known light transport: the figures of the paper (Thanikachalam et al. 2014), its
//! comparison with other acquisition methods, and a table of scenes.
//!
//! Each part takes a [`KnownTransport`] and measurements of it and returns a [`Section`]: text, tables and
//! pictures in memory. The caller writes them to files.

mod accuracy;
mod chart;
mod comparison;
mod dense_transport;
mod known_transport;
mod methods;
mod nystrom;
mod picture_sheet;
mod pixel_sampling;
mod relit_pictures;
mod scanning;
mod scene_camera;
mod scenes;
mod section;
mod snr_curves;
mod sparsity;
mod unwindowed;

pub use comparison::comparison;
pub use known_transport::{CaptureTruth, KnownTransport, SceneTruth};
pub use nystrom::{Nystrom, NystromSamples};
pub use relit_pictures::{RelitLight, built_in_lights, relit_pictures};
pub use scene_camera::{SceneCamera, first_shots};
pub use scenes::scenes_table;
pub use section::{Section, Table};
pub use snr_curves::{SNR_PATTERNS, snr_curves};
pub use sparsity::{SparsityProfile, sparsity};

use thiserror::Error;

use crate::recover::RecoverError;
use crate::transport::GeometryError;

/// Receives a line of text when a part of the study advances.
pub type ProgressCallback<'a> = &'a (dyn Fn(&str) + Sync);

/// Why a part of the study fails.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A method cannot recover the transport from the measurements.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// The geometry of a scene is invalid.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A random distribution has invalid parameters.
    #[error("the simulated camera has invalid noise parameters")]
    Noise(#[from] rand_distr::NormalError),
    /// Drawing a chart failed.
    #[error("a chart cannot be drawn: {0}")]
    Chart(String),
    /// Encoding a picture failed.
    #[error("a picture cannot be encoded")]
    Picture(#[from] image::ImageError),
    /// Writing a table as CSV failed.
    #[error("a table cannot be written as CSV")]
    Table(#[from] csv::Error),
}
