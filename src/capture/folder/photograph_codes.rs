//! The codes of a photograph, row by row, whatever the format of its file.

#[cfg(not(target_arch = "wasm32"))]
use std::io::Read;
use std::ops::Range;

use super::files::CaptureFiles;
use super::picture_file::PictureFile;
use super::picture_png::PngRowReader;
#[cfg(not(target_arch = "wasm32"))]
use super::picture_tiff::{self, TiffRowReader};
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::CaptureError;
#[cfg(not(target_arch = "wasm32"))]
use crate::tiff_signature::is_tiff;
use crate::transport::{CHANNELS, Extent};

/// The first bytes of a PNG.
#[cfg(not(target_arch = "wasm32"))]
const PNG_SIGNATURE: &[u8] = b"\x89PNG";

/// A 16-bit RGB photograph that is read row by row from the top. Pages read PNG only.
pub(super) enum PhotographCodes<'a, F: CaptureFiles> {
    Png(Box<PngRowReader<'a, F>>),
    #[cfg(not(target_arch = "wasm32"))]
    Tiff(Box<TiffRowReader<'a, F>>),
}

impl<'a, F: CaptureFiles> PhotographCodes<'a, F> {
    /// Opens a photograph by the format that its first bytes say.
    pub fn open(file: PictureFile<'a, F>) -> Result<Self, CaptureError> {
        #[cfg(not(target_arch = "wasm32"))]
        return Self::open_within(file, picture_tiff::MAX_ROWS_BYTES);
        #[cfg(target_arch = "wasm32")]
        Ok(Self::Png(Box::new(PngRowReader::open(file)?)))
    }

    /// The same, with strips or rows of tiles of a TIFF that take `max_bytes` at most.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn open_within(file: PictureFile<'a, F>, max_bytes: usize) -> Result<Self, CaptureError> {
        let mut start = Vec::new();
        let read = file.open()?.take(4).read_to_end(&mut start);
        read.map_err(|e| file.io_error(e))?;
        if is_tiff(&start) {
            let reader = TiffRowReader::open_within(file, max_bytes)?;
            return Ok(Self::Tiff(Box::new(reader)));
        }
        if !start.starts_with(PNG_SIGNATURE) {
            let reason = match start.is_empty() {
                true => "it is empty",
                false => "it begins like neither",
            };
            return Err(file.unreadable("PNG or TIFF", reason));
        }
        Ok(Self::Png(Box::new(PngRowReader::open(file)?)))
    }

    pub fn extent(&self) -> Extent {
        match self {
            Self::Png(reader) => reader.extent(),
            #[cfg(not(target_arch = "wasm32"))]
            Self::Tiff(reader) => reader.extent(),
        }
    }

    /// The codes of the next row; `None` after the last.
    pub fn next(&mut self) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        let width = self.extent().width;
        self.next_columns(std::iter::once(0..width))
    }

    /// The same, of which those outside of `columns` may be wrong in a TIFF.
    #[cfg_attr(
        target_arch = "wasm32",
        expect(unused_variables, reason = "of TIFF only")
    )]
    pub fn next_columns(
        &mut self,
        columns: impl Iterator<Item = Range<u32>>,
    ) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        match self {
            Self::Png(reader) => reader.next(),
            #[cfg(not(target_arch = "wasm32"))]
            Self::Tiff(reader) => reader.next(columns),
        }
    }

    /// Whether the file has a record with the statistics of all codes. Rows of other files must all be read.
    pub fn is_recorded(&self) -> bool {
        match self {
            Self::Png(_) => false,
            #[cfg(not(target_arch = "wasm32"))]
            Self::Tiff(reader) => reader.is_recorded(),
        }
    }

    /// Makes row `y` of a file with a record, which must not lie above, the next one without reading those between.
    #[cfg_attr(
        target_arch = "wasm32",
        expect(unused_variables, reason = "of TIFF only")
    )]
    pub fn skip_to(&mut self, y: u32) {
        match self {
            Self::Png(_) => {}
            #[cfg(not(target_arch = "wasm32"))]
            Self::Tiff(reader) => reader.skip_to(y),
        }
    }

    /// Frees the memory of rows that were decoded.
    pub fn release(&mut self) {
        #[cfg(not(target_arch = "wasm32"))]
        if let Self::Tiff(reader) = self {
            reader.release();
        }
    }

    /// The statistics of all codes by the record of an ingested photograph, if codes from `saturated_from` on are saturated.
    /// `None` of other files, of which it checks what follows the last row.
    #[cfg_attr(
        target_arch = "wasm32",
        expect(unused_variables, reason = "of TIFF only")
    )]
    pub fn finish(
        self,
        saturated_from: [u32; CHANNELS],
    ) -> Result<Option<CodeStatistics>, CaptureError> {
        match self {
            Self::Png(reader) => reader.finish().map(|()| None),
            #[cfg(not(target_arch = "wasm32"))]
            Self::Tiff(reader) => reader.statistics(saturated_from),
        }
    }
}
