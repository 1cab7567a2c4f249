//! Reading of captures for JavaScript: the module `capture_reader`, which a page loads beside `recovery` to recover from
//! files.
//!
//! A [`CaptureReader`] reads a capture folder, shot by shot; [`read_photograph`] and [`read_pattern`] read PNGs that no
//! manifest lists. Pages that have their pictures in memory do not load the module.

mod error;
mod folder_reader;
mod linear_png;
mod page_files;

pub use folder_reader::CaptureReader;
pub use linear_png::{LinearPng, read_pattern, read_photograph};
