//! The files of a capture: on disk, or wherever else a program has them.

use std::io::{self, Read, Seek};
use std::path::PathBuf;

/// The files of a capture, by their names in the manifest: paths relative to its folder.
pub trait CaptureFiles {
    /// An opened file.
    type File: Read + Seek;

    /// Opens the file `name`.
    ///
    /// # Errors
    /// [`NotFound`](io::ErrorKind::NotFound) if there is no such file, others if it cannot be read.
    fn open(&self, name: &str) -> io::Result<Self::File>;

    /// Path of the file `name` for messages.
    fn path(&self, name: &str) -> PathBuf;
}
