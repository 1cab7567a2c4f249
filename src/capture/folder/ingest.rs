//! Photographs as TIFFs whose tiles are read without the others.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

use thiserror::Error;
use tiff::decoder::Decoder;
use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::{TiffError, TiffResult};

use super::CaptureFolder;
use super::files::CaptureFiles;
use super::ingest_record::{CodeHistogram, IngestRecord, IngestSource};
use super::photograph_codes::PhotographCodes;
use super::picture_tiff::TAG_BYTES;
use super::tiled_tiff::{TILE_ROWS, TiledTiffEncoder, tiles_bytes};
use crate::capture::error::CaptureError;
use crate::capture::manifest::ListedPhotograph;
use crate::tiff_signature::is_tiff;
use crate::transport::CHANNELS;

/// Largest strip or row of tiles that is read to write smaller ones.
const MAX_SOURCE_ROWS_BYTES: usize = 1 << 30;
/// Bytes of tiles from which on offsets do not fit in 32 bits, with space for the rest of the file.
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
    /// Writes a photograph that the manifest names as an uncompressed TIFF in tiles of 16 rows and 1,024 columns at most, with a record: its
    /// `source`, a checksum of each tile, and a histogram of all codes. The codes are unchanged.
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
        let codes = PhotographCodes::open_within(file, MAX_SOURCE_ROWS_BYTES)?;
        match tiles_bytes(codes.extent()) < BIG_TIFF_BYTES {
            true => write::<_, _, TiffKindStandard>(codes, source, out),
            false => write::<_, _, TiffKindBig>(codes, source, out),
        }
    }
}

/// Writes a photograph, whose file is `source`, as an uncompressed TIFF of tiles with their record.
pub(super) fn write<F: CaptureFiles, W: Write + Seek, K: TiffKind>(
    mut photograph: PhotographCodes<'_, F>,
    source: &IngestSource,
    out: W,
) -> Result<(), IngestError> {
    let extent = photograph.extent();
    let mut encoder = TiffEncoder::<W, K>::new_generic(out)?;
    let mut tiles = TiledTiffEncoder::new(encoder.image_directory()?, extent)?;
    let (mut checksums, mut histogram) = (Vec::new(), CodeHistogram::empty());
    let mut rows: Vec<[u16; CHANNELS]> = Vec::new();
    for y in 1..=extent.height {
        if let Some(row) = photograph.next()? {
            rows.extend_from_slice(row);
        }
        if y % TILE_ROWS == 0 || y == extent.height {
            tiles.write_tiles(&rows, &mut checksums)?;
            histogram.add(&rows);
            rows.clear();
        }
    }
    photograph.finish([u32::MAX; CHANNELS])?;
    let mut directory = tiles.finish()?;
    IngestRecord::write(&mut directory, source, checksums, &histogram)?;
    Ok(directory.finish()?)
}

/// A TIFF of [`CaptureFolder::ingest`], by its record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IngestedPhotograph {
    /// The file that it was made from.
    pub source: IngestSource,
    /// Its length in bytes.
    pub bytes: u64,
    /// CRC-32C of the record, which has the checksums of all tiles.
    pub checksum: u32,
}

impl IngestedPhotograph {
    /// Reads the record of the file at `path`; `None` if it has none that is intact.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(path: &Path) -> io::Result<Option<Self>> {
        Self::read_if(path, |_, _| Ok(()))
    }

    /// The same, with its histogram: `None` if that is damaged as well.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read_whole(path: &Path) -> io::Result<Option<Self>> {
        Self::read_if(path, IngestRecord::check_histogram)
    }

    fn read_if(
        path: &Path,
        check: impl FnOnce(&IngestRecord, &mut Decoder<BufReader<File>>) -> TiffResult<()>,
    ) -> io::Result<Option<Self>> {
        let mut file = File::open(path)?;
        let mut start = Vec::new();
        Read::by_ref(&mut file).take(4).read_to_end(&mut start)?;
        if !is_tiff(&start) {
            return Ok(None);
        }
        file.rewind()?;
        let bytes = file.metadata()?.len();
        let source = BufReader::with_capacity(TAG_BYTES, file);
        let record = Decoder::new(source).and_then(|mut decoder| {
            let record = IngestRecord::read(&mut decoder)?;
            if let Some(record) = &record {
                check(record, &mut decoder)?;
            }
            Ok(record)
        });
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
