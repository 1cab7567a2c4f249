//! Modules that the fuzz targets share. `pkg-scripts/fuzz` runs the targets.
//!
//! | target | input | property |
//! |---|---|---|
//! | `open` | a file | its file index is read or refused, and no length exceeds the limits |
//! | `levels` | a file | its table of levels and its shards are read or refused, within the limits |
//! | `decode` | a file | it is read or refused within the memory budget, previews included, and `check` has the same result |
//! | `chunked` | a file and choices | pieces in any order give the same as the whole file |
//! | `crafted` | choices | the properties of `decode` and `chunked`, for assembled files with arbitrary frame contents |
//! | `round_trip` | choices | the reader reads what the encoder writes, with the error that the file declares |
//! | `manifest` | `capture.json` | it is refused, or its values are within their ranges |
//! | `sequence` | `sequence.json` | it is refused, or makes a valid manifest, and photographs are compared with it |
//! | `photo_file` | a PNG, TIFF or OpenEXR picture | it is refused, or has all its samples, within the memory budget |
//! | `gray_code` | choices | photographs of Gray code give a map of finite numbers, or an error |
//!
//! cargo fuzz sets `cfg(fuzzing)`, with which the reader ignores checksums.

pub mod choices;
pub mod craft;
pub mod heap;
pub mod pieces;
pub mod reading;
pub mod seal;
pub mod source;

#[global_allocator]
static HEAP: heap::CountingAllocator = heap::CountingAllocator;
