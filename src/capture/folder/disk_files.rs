//! The files of a capture on disk.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::PathBuf;

use super::files::CaptureFiles;

/// The files of a folder on disk.
#[derive(Clone, Debug)]
pub struct DiskFiles {
    pub(super) root: PathBuf,
}

impl CaptureFiles for DiskFiles {
    fn size(&self, name: &str) -> io::Result<u64> {
        Ok(File::open(self.path(name))?.metadata()?.len())
    }

    /// Opens the file for this read only: some systems allow a process no more than 256 open files.
    fn read(&self, name: &str, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let mut file = File::open(self.path(name))?;
        file.seek(SeekFrom::Start(offset))?;
        file.read(buffer)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }
}
