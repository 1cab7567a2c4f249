//! Recovery for JavaScript: the module `recovery`, which pages load only to recover.
//!
//! [`MeasurementInput`] reads a capture folder; [`MeasurementBuilder`] takes patterns and photographs that the page has
//! in memory. A [`Recovery`] prepares, recovers tiles and encodes; other workers recover tiles for it by
//! [`TileRecovery`], or prepare it together with it ([`group_executor`]). [`RecoveredTransport`] is what a page shows of the
//! result. Every call runs to its end: a page cancels by ending the worker.

mod capture_files;
mod error;
mod group_executor;
mod linear_png;
mod measurement_input;
mod recovered;
mod recovery_job;
mod tile_recovery;

pub use linear_png::{LinearPng, emission_of_codes, read_pattern, read_photograph};
pub use measurement_input::{MeasurementBuilder, MeasurementInput};
pub use recovered::RecoveredTransport;
pub use recovery_job::Recovery;
pub use tile_recovery::TileRecovery;
