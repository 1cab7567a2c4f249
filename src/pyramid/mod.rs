//! Files of several levels: pictures that are larger than a screen, of which a reader fetches the part and the level that
//! are seen.
//!
//! Level 0 is the picture. Each further level has half the camera pixels and half the light elements along each axis, so
//! that all levels together take about a third more than level 0. See `docs/format.md`, section 12.
//!
//! ```text
//! geometry        geometry of a level         -> of the next level, of a shard
//! coarsening      fine tiles                  -> coarse tile
//! level_encoder   tiles of the finer level    -> shards of a level
//! level_shares    table, number of processes  -> shards of each process
//! writer          file of one level           -> file of several; a process's shards
//! reader          file, shard                 -> transport
//! ```

mod coarsening;
mod geometry;
mod level_encoder;
mod level_shares;
mod reader;
mod writer;

pub use level_encoder::{FetchChunk, PyramidSource};
pub use level_shares::LevelShares;
pub use reader::{PyramidReader, Shard};
pub use writer::{
    FetchShard, PyramidLayout, SHARD_SIDE, least_level_count, level_count, make_coarser_shards,
    no_shard, write_pyramid,
};
