//! Recovery for JavaScript: the module `recovery`, which pages load only to recover.
//!
//! [`CaptureBuilder`] takes what the module `capture_reader` reads of a folder, [`MeasurementBuilder`] patterns and
//! photographs that the page has in memory; either gives a [`MeasurementInput`]. A [`Recovery`] prepares, recovers tiles
//! and encodes; other workers recover tiles for it by [`TileRecovery`], or prepare it together with it
//! ([`group_executor`]). [`RecoveredTransport`] is what a page shows of the result. Every call runs to its end: a page
//! cancels by ending the worker.

mod capture_builder;
mod error;
mod group_executor;
mod measurement_builder;
mod measurement_input;
mod recovered;
mod recovery_job;
mod tile_recovery;

pub use capture_builder::CaptureBuilder;
pub use measurement_builder::{MeasurementBuilder, emission_of_codes};
pub use measurement_input::MeasurementInput;
pub use recovered::RecoveredTransport;
pub use recovery_job::Recovery;
pub use tile_recovery::TileRecovery;
