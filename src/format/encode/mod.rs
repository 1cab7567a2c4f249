//! The encoder: light transport to an `.ltm` file.
//!
//! ```text
//! source_analysis      one pass over all tiles: moments, peaks  -> rotated basis
//! rate_control_sample  parts of some tiles
//! rate_control         sample, target                           -> step, rank
//! scan_plan            sample, step, shares of the file         -> scans
//! assembly             all tiles, scans                         -> chunks, file
//! coding_plan          a sample, target                         -> step, rank, scans; one tile -> its chunks
//! shard                some tiles of a file                     -> file
//! ```

mod assembly;
mod basis_rotation;
#[cfg(not(target_arch = "wasm32"))]
mod coding_plan;
mod encoder_input;
mod rate_control;
mod rate_control_sample;
mod scan_costs;
mod scan_plan;
#[cfg(not(target_arch = "wasm32"))]
mod shard;
mod source_analysis;

pub use assembly::EncodedFile;
#[cfg(not(target_arch = "wasm32"))]
pub use coding_plan::{CodingPlan, EncodedTile, EncodedTileHead, TileEncoder, TileSample};
pub use encoder_input::{DistortionMetric, EncoderInput, EncodingTarget};

/// `2^x`, by the exponential function, which recovery needs anyway: `libm::exp2` has a table of 4 kB.
fn exp2(x: f64) -> f64 {
    libm::exp(x * std::f64::consts::LN_2)
}
