//! How well recovery does where the transport is known: the figures of the paper (Thanikachalam et
//! al. 2014), its comparison with other ways to acquire a transport, and a table of scenes.
//!
//! Each part takes what is known and photographed and yields a [`Section`]: text, tables and
//! pictures in memory. Whoever has files writes them.

mod accuracy;
mod blocks;
mod brute_force;
mod chart;
mod comparison;
mod dense;
mod known;
mod methods;
mod nystrom;
mod photograph;
mod relit;
mod report;
mod scenes;
mod sheet;
mod snr_curves;
mod sparsity;
mod unwindowed;

pub use comparison::comparison;
pub use known::{CaptureTruth, Known, SceneTruth};
pub use nystrom::{Nystrom, Samples};
pub use photograph::{Photographer, first_shots};
pub use relit::{RelitLight, built_in_lights, relit_pictures};
pub use report::{Section, Table};
pub use scenes::scenes_table;
pub use snr_curves::{SNR_PATTERNS, snr_curves};
pub use sparsity::{SparsityProfile, sparsity};

use thiserror::Error;

use crate::recover::RecoverError;
use crate::transport::{CHANNELS, GeometryError};

/// Linear RGB of every camera pixel, row by row, in units of the measurement.
type Picture = Vec<[f32; CHANNELS]>;

/// What the study tells while it is at work.
pub type Progress<'a> = &'a (dyn Fn(&str) + Sync);

/// Why a part of the study cannot be done.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A method refused the measurements.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// A scene does not fit.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A distribution has impossible parameters.
    #[error("the camera's noise cannot be drawn")]
    Noise(#[from] rand_distr::NormalError),
    /// A chart cannot be drawn.
    #[error("a chart cannot be drawn: {0}")]
    Chart(String),
    /// A picture cannot be encoded.
    #[error("a picture cannot be encoded")]
    Picture(#[from] image::ImageError),
    /// A table cannot be written.
    #[error("a table cannot be written as CSV")]
    Table(#[from] csv::Error),
}
