//! What the fuzz targets share. `pkg-scripts/fuzz` runs them.
//!
//! | target | its input | what must hold |
//! |---|---|---|
//! | `open` | a file | its index is read or refused, and no length exceeds the limits |
//! | `decode` | a file | it is read or refused within the memory budget, previews included, and `check` agrees |
//! | `chunked` | a file, and choices | pieces in any order give what the whole gives |
//! | `crafted` | choices | the same of files that are put together part by part, past zstd |
//! | `round_trip` | choices | what the encoder writes the reader reads, as well as the file says |
//!
//! cargo fuzz sets `cfg(fuzzing)`, by which the reader passes over checksums.

pub mod choices;
pub mod craft;
pub mod heap;
pub mod pieces;
pub mod reading;
pub mod seal;
pub mod source;

#[global_allocator]
static HEAP: heap::CountingAllocator = heap::CountingAllocator;
