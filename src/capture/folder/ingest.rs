//! Photographs as TIFFs whose rows are read without the others.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

use thiserror::Error;
use tiff::TiffError;
use tiff::decoder::Decoder;

use super::CaptureFolder;
use super::files::CaptureFiles;
use super::ingest_record::{IngestRecord, IngestSource};
use super::picture_tiff::{self, TAG_BYTES, is_tiff};
use crate::capture::error::CaptureError;
use crate::capture::manifest::ListedPhotograph;

/// Why a photograph is not ingested.
#[derive(Debug, Error)]
pub enum IngestError {
    /// It cannot be read.
    #[error(transparent)]
    Input(#[from] CaptureError),
    /// The TIFF cannot be written.
    #[error("cannot be written")]
    Output(#[source] io::Error),
}

impl From<TiffError> for IngestError {
    fn from(error: TiffError) -> Self {
        Self::Output(match error {
            TiffError::IoError(error) => error,
            other => io::Error::other(other),
        })
    }
}

impl<F: CaptureFiles> CaptureFolder<F> {
    /// Writes a photograph that the manifest names as an uncompressed TIFF in strips of 16 rows, with a record: its `source`, a
    /// checksum of each strip, and a histogram of all codes. The codes are unchanged.
    ///
    /// # Errors
    /// If the photograph cannot be read, or the TIFF not written.
    pub fn ingest(
        &self,
        photograph: ListedPhotograph<'_>,
        source: &IngestSource,
        out: impl Write + Seek,
    ) -> Result<(), IngestError> {
        picture_tiff::write(self.listed(photograph), source, out)
    }
}

/// A TIFF of [`CaptureFolder::ingest`], by its record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IngestedPhotograph {
    /// The file that it was made from.
    pub source: IngestSource,
    /// CRC-32C of the record, which has the checksums of all strips.
    pub checksum: u32,
}

impl IngestedPhotograph {
    /// Reads the record of the file at `path`; `None` if it has none that is intact.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(path: &Path) -> io::Result<Option<Self>> {
        let mut file = File::open(path)?;
        let mut start = Vec::new();
        Read::by_ref(&mut file).take(4).read_to_end(&mut start)?;
        if !is_tiff(&start) {
            return Ok(None);
        }
        file.rewind()?;
        let record = Decoder::new(BufReader::with_capacity(TAG_BYTES, file))
            .and_then(|mut decoder| IngestRecord::read(&mut decoder));
        match record {
            Ok(record) => Ok(record.map(|record| Self {
                source: record.source,
                checksum: record.checksum,
            })),
            Err(TiffError::IoError(error)) if error.raw_os_error().is_some() => Err(error),
            Err(_) => Ok(None),
        }
    }
}
