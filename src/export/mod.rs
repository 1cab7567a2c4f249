//! From a capture to an `.ltm` file: the steps that the command line and the browser share.
//!
//! [`select_shots`] holds some shots out; [`prepare`] chooses the window and prepares the recovery; the tiles are
//! recovered one by one into [records](encode_tile), from which [`encode_file`] makes the file. [`MemoryPlan`] keeps
//! all of it within a limit. Reading, threads and progress are the caller's.

mod capture_remedy;
mod encoding;
#[cfg(not(target_arch = "wasm32"))]
mod memory_plan;
mod metadata;
mod preparation;
mod shot_selection;
mod tile_record;

pub use capture_remedy::capture_remedy;
pub use encoding::{FILE_TILE_SIDE, FileQuality, encode_file, file_geometry, file_tile};
#[cfg(not(target_arch = "wasm32"))]
pub use encoding::{encode_planned, for_encoded_tiles, plan_file};
#[cfg(not(target_arch = "wasm32"))]
pub use memory_plan::{CaptureSize, EncodingMemory, MemoryPlan, TooLittleMemory};
pub use metadata::{Provenance, metadata};
pub use preparation::{
    ExportSettings, MIN_PLAUSIBLE_SNR, PreparedExport, has_implausible_saturation,
    implausibly_saturated, prepare, saturated_percent,
};
pub use shot_selection::{TooFewShots, select_shots};
pub use tile_record::{decode as decode_tile, encode as encode_tile};
