//! The files of a capture: on disk, or wherever else a program has them.

use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// The files of a capture, by their names in the manifest: paths relative to its folder.
pub trait CaptureFiles {
    /// Bytes of the file `name`.
    ///
    /// # Errors
    /// [`NotFound`](io::ErrorKind::NotFound) if there is no such file, others if it cannot be read.
    fn size(&self, name: &str) -> io::Result<u64>;

    /// Reads bytes of the file `name` from `offset` on into `buffer`, and returns their number; 0 at the end of the file.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn read(&self, name: &str, offset: u64, buffer: &mut [u8]) -> io::Result<usize>;

    /// Path of the file `name` for messages.
    fn path(&self, name: &str) -> PathBuf;
}

/// A position in one of the files. Nothing stays open between reads.
pub(super) struct CaptureFile<'a, F> {
    files: &'a F,
    name: &'a str,
    position: u64,
    length: u64,
}

impl<'a, F: CaptureFiles> CaptureFile<'a, F> {
    /// The start of the file `name`.
    pub fn open(files: &'a F, name: &'a str) -> io::Result<Self> {
        Ok(Self {
            files,
            name,
            position: 0,
            length: files.size(name)?,
        })
    }
}

impl<F: CaptureFiles> Read for CaptureFile<'_, F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.files.read(self.name, self.position, buffer)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl<F: CaptureFiles> Seek for CaptureFile<'_, F> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
        };
        self.position = position.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}
