//! Files of several levels: pictures that are larger than a screen, of which a reader fetches the part and the level that
//! are seen.
//!
//! Level 0 is the picture. Each further level has half the camera pixels and half the light elements along each axis, so
//! that all levels together take about a third more than level 0. See `docs/format.md`, section 12.
//!
//! ```text
//! geometry     geometry of a level        -> of the next level, of a shard
//! coarsening   fine tiles                 -> coarse tile
//! writer       geometry, shards of level 0 -> levels, file
//! reader       file, shard                 -> transport
//! ```

mod coarsening;
mod geometry;
mod reader;
mod writer;

pub use reader::{PyramidReader, Shard};
pub use writer::{PyramidLayout, SHARD_SIDE, least_level_count, level_count, write_pyramid};
