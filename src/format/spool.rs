//! A temporary file of records.

use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::error::FormatError;

/// Bytes that are copied at a time.
const COPY_BYTES: u64 = 1 << 20;

/// A temporary file, to which records are appended and from which any is read.
#[derive(Debug)]
pub struct Spool<F>(Mutex<SpoolFile<F>>);

#[derive(Debug)]
struct SpoolFile<F> {
    file: F,
    end: u64,
}

impl<F: Read + Write + Seek> Spool<F> {
    /// A spool in `file`, whose content is overwritten.
    pub fn new(file: F) -> Self {
        Self(Mutex::new(SpoolFile { file, end: 0 }))
    }

    /// Appends what `write` writes; returns its place.
    ///
    /// # Errors
    /// [`FormatError::Spool`].
    pub(crate) fn append(
        &self,
        write: impl FnOnce(&mut F) -> io::Result<()>,
    ) -> Result<Range<u64>, FormatError> {
        let mut spool = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let start = spool.end;
        let append = || -> io::Result<u64> {
            spool.file.seek(SeekFrom::Start(start))?;
            write(&mut spool.file)?;
            spool.file.stream_position()
        };
        spool.end = append().map_err(FormatError::Spool)?;
        Ok(start..spool.end)
    }

    /// The bytes at `range`.
    pub(crate) fn read(&self, range: Range<u64>) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; (range.end - range.start) as usize];
        let mut spool = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        spool.file.seek(SeekFrom::Start(range.start))?;
        spool.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// Copies the bytes at `range` to `out`.
    ///
    /// # Errors
    /// [`FormatError::Spool`] and [`FormatError::Write`].
    pub(crate) fn copy(&self, range: Range<u64>, out: &mut impl Write) -> Result<(), FormatError> {
        let (mut at, end) = (range.start, range.end);
        while at < end {
            let next = end.min(at + COPY_BYTES);
            let bytes = self.read(at..next).map_err(FormatError::Spool)?;
            out.write_all(&bytes).map_err(FormatError::Write)?;
            at = next;
        }
        Ok(())
    }

    /// Forgets all records.
    pub(crate) fn clear(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).end = 0;
    }
}
