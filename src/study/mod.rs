//! Evaluation of recovery on known light transport: the figures of the paper (Thanikachalam et al. 2014), its
//! comparison with other acquisition methods, a table of scenes, and one of faults.
//!
//! Each part takes a [`KnownTransport`](crate::transport::KnownTransport) and measurements of it and returns a
//! [`ReportSection`]: text, tables and pictures in memory. The caller writes them to files. Faults are measured by the
//! caller, which has the folders that they are in.

mod accuracy;
mod brute_force_scan;
mod chart;
mod comparison;
mod error;
mod fault_table;
mod known_transport;
mod method_sample_sizes;
mod nystrom;
mod picture_sheet;
mod pixel_sampling;
mod relit_pictures;
mod section;
mod snr_curves;
mod transport_structure;
mod unseen_scenes;
mod unwindowed;

pub use comparison::comparison;
pub use error::StudyError;
pub use fault_table::{FaultOutcome, FaultedCapture, fault_table};
pub use known_transport::CaptureTruth;
pub use relit_pictures::{EvaluationLight, built_in_lights, psnr, relit_pictures};
pub use section::{ProgressLog, ReportSection};
pub use snr_curves::{SNR_PATTERNS, snr_curves};
pub use transport_structure::sparsity;
pub use unseen_scenes::scenes_table;
