//! Photographs as TIFFs whose rows are read without the others.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

use thiserror::Error;
use tiff::TiffError;
use tiff::decoder::Decoder;
use tiff::encoder::colortype::RGB16;
use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};

use super::CaptureFolder;
use super::files::CaptureFiles;
use super::ingest_record::{CodeHistogram, IngestRecord, IngestSource};
use super::photograph_codes::PhotographCodes;
use super::picture_tiff::{MAX_STRIP_BYTES, TAG_BYTES};
use crate::capture::error::CaptureError;
use crate::capture::manifest::ListedPhotograph;
use crate::tiff_signature::is_tiff;
use crate::transport::{CHANNELS, Extent};

/// Rows of a strip, if they are not too large to be read.
const STRIP_ROWS: u32 = 16;
/// Largest strip that is read to write smaller ones.
const MAX_INGESTED_STRIP_BYTES: usize = 1 << 30;
/// Bytes of samples from which on offsets do not fit in 32 bits, with space for the rest of the file.
const BIG_TIFF_BYTES: u64 = 0xF000_0000;

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
    /// Writes a photograph that the manifest names as an uncompressed TIFF in strips of 16 rows at most, with a record: its `source`, a
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
        let file = self.listed(photograph);
        let codes = PhotographCodes::open_within(file, MAX_INGESTED_STRIP_BYTES)?;
        let bytes = size_of::<[u16; CHANNELS]>() as u64 * codes.extent().area() as u64;
        match bytes < BIG_TIFF_BYTES {
            true => write::<_, _, TiffKindStandard>(codes, source, out),
            false => write::<_, _, TiffKindBig>(codes, source, out),
        }
    }
}

/// Writes a photograph, whose file is `source`, as an uncompressed TIFF of strips with their record.
pub(super) fn write<F: CaptureFiles, W: Write + Seek, K: TiffKind>(
    mut photograph: PhotographCodes<'_, F>,
    source: &IngestSource,
    out: W,
) -> Result<(), IngestError> {
    let Extent { width, height } = photograph.extent();
    let mut encoder = TiffEncoder::<W, K>::new_generic(out)?;
    let mut image = encoder.new_image::<RGB16>(width, height)?;
    let rows_of_strip = strip_rows(width).min(height);
    image.rows_per_strip(rows_of_strip)?;
    let (mut checksums, mut histogram) = (Vec::new(), CodeHistogram::empty());
    let mut strip: Vec<[u16; CHANNELS]> = Vec::new();
    for y in 0..height {
        if let Some(row) = photograph.next()? {
            strip.extend_from_slice(row);
        }
        if (y + 1) % rows_of_strip == 0 || y + 1 == height {
            let samples = strip.as_flattened();
            image.write_strip(samples)?;
            checksums.push(crc32c::crc32c(bytemuck::cast_slice(samples)));
            histogram.add(&strip);
            strip.clear();
        }
    }
    photograph.finish([u32::MAX; CHANNELS])?;
    IngestRecord::write(image.encoder(), source, checksums, &histogram)?;
    Ok(image.finish()?)
}

/// Rows of a strip of pictures of this width.
fn strip_rows(width: u32) -> u32 {
    let row_bytes = size_of::<[u16; CHANNELS]>() * width as usize;
    ((MAX_STRIP_BYTES / row_bytes.max(1)) as u32).clamp(1, STRIP_ROWS)
}

/// A TIFF of [`CaptureFolder::ingest`], by its record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IngestedPhotograph {
    /// The file that it was made from.
    pub source: IngestSource,
    /// Its length in bytes.
    pub bytes: u64,
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
        let bytes = file.metadata()?.len();
        let record = Decoder::new(BufReader::with_capacity(TAG_BYTES, file))
            .and_then(|mut decoder| IngestRecord::read(&mut decoder));
        match record {
            Ok(record) => Ok(record.map(|record| Self {
                source: record.source,
                bytes,
                checksum: record.checksum,
            })),
            Err(TiffError::IoError(error)) if error.raw_os_error().is_some() => Err(error),
            Err(_) => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::MAX_SIDE;

    #[test]
    fn strips_of_every_width_can_be_read() {
        assert_eq!(strip_rows(1000), STRIP_ROWS);
        for width in [1, 87_381, 87_382, 500_000, MAX_SIDE] {
            let bytes = strip_rows(width) as usize * width as usize * 6;
            assert!(bytes <= MAX_STRIP_BYTES, "{width}");
        }
    }
}
