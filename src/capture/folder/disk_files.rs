//! The files of a capture on disk.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::files::CaptureFiles;

/// The files of a folder on disk.
#[derive(Clone, Debug)]
pub struct DiskFiles {
    pub(super) root: PathBuf,
}

impl CaptureFiles for DiskFiles {
    type File = ReopeningFile;

    fn open(&self, name: &str) -> io::Result<ReopeningFile> {
        ReopeningFile::open(&self.path(name))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }
}

/// A file that is open only during a read: some systems allow a process no more than 256 open files.
pub struct ReopeningFile {
    path: PathBuf,
    position: u64,
    length: u64,
}

impl ReopeningFile {
    fn open(path: &Path) -> io::Result<Self> {
        Ok(Self {
            path: path.to_owned(),
            position: 0,
            length: File::open(path)?.metadata()?.len(),
        })
    }
}

impl Read for ReopeningFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.position))?;
        let count = file.read(buffer)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for ReopeningFile {
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
