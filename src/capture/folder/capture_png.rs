//! The two types of PNG in a capture: 8-bit patterns and 16-bit linear RGB photographs.
//!
//! Other formats are refused: a lossy one would change the measurements. Photographs are decoded row by row, so that
//! hundreds can be read in parallel without one of them in memory whole.

use std::io::{BufRead, BufReader, ErrorKind, Seek};

use png::{BitDepth, ColorType, DecodingError, Transformations};

use super::files::{CaptureFile, CaptureFiles};
use crate::capture::error::{CaptureError, CaptureErrorKind};
use crate::capture::measurements::Pattern;
use crate::transport::{CHANNELS, Extent};

/// Bytes read from a file at a time.
const READ_BYTES: usize = 1 << 16;

type PngReader<'a, F> = png::Reader<BufReader<CaptureFile<'a, F>>>;

/// A PNG and what the manifest says of it.
pub(super) struct CapturePng<'a, F> {
    files: &'a F,
    /// Its name in the manifest.
    name: &'a str,
    /// The size it must have, if a manifest says so.
    extent: Option<Extent>,
    /// The field of the manifest that names it, for messages.
    field: Option<String>,
}

impl<'a, F: CaptureFiles> CapturePng<'a, F> {
    pub fn new(files: &'a F, name: &'a str, extent: Extent, field: Option<String>) -> Self {
        Self {
            files,
            name,
            extent: Some(extent),
            field,
        }
    }

    /// A PNG that no manifest lists.
    pub fn unlisted(files: &'a F, name: &'a str) -> Self {
        Self {
            files,
            name,
            extent: None,
            field: None,
        }
    }

    /// Reads an 8-bit pattern and its size; `emission` is that of each code.
    pub fn read_pattern(&self, emission: &[f64; 256]) -> Result<(Extent, Pattern), CaptureError> {
        // Some programs store black and white in one bit, or in a palette.
        let mut reader = self.open(Transformations::EXPAND)?;
        let channels = match reader.output_color_type() {
            (ColorType::Grayscale, BitDepth::Eight) => 1,
            (ColorType::Rgb, BitDepth::Eight) => CHANNELS,
            other => return Err(self.error(CaptureErrorKind::PatternType(sample_type(other)))),
        };
        let extent = extent_of(&reader);
        let mut codes = vec![0; channels * extent.area()];
        let decoded = reader.next_frame(&mut codes);
        decoded.map_err(|e| self.unreadable(e))?;
        let emit = |code: &u8| emission[usize::from(*code)] as f32;
        let plane = |c| codes.iter().skip(c).step_by(channels).map(emit).collect();
        let pattern = match channels {
            1 => Pattern::Grey(plane(0)),
            _ => Pattern::Rgb(std::array::from_fn(plane)),
        };
        Ok((extent, pattern))
    }

    /// The size and the codes of a 16-bit photograph, row by row.
    pub fn read_rgb16(self) -> Result<(Extent, Vec<[u16; CHANNELS]>), CaptureError> {
        let mut rows = self.open_rgb16()?;
        let extent = extent_of(&rows.reader);
        let mut codes = Vec::with_capacity(extent.area());
        while let Some(row) = rows.next()? {
            codes.extend_from_slice(row);
        }
        rows.finish()?;
        Ok((extent, codes))
    }

    /// Opens a 16-bit photograph to be read row by row.
    pub fn open_rgb16(self) -> Result<Rgb16RowReader<'a, F>, CaptureError> {
        let reader = self.open(Transformations::IDENTITY)?;
        let info = reader.info();
        let found = (info.color_type, info.bit_depth);
        if found != (ColorType::Rgb, BitDepth::Sixteen) {
            return Err(self.error(CaptureErrorKind::PhotoType(sample_type(found))));
        }
        if info.interlaced {
            return Err(self.error(CaptureErrorKind::Interlaced));
        }
        Ok(Rgb16RowReader {
            reader,
            row: Vec::new(),
            file: self,
        })
    }

    fn open(&self, transformations: Transformations) -> Result<PngReader<'a, F>, CaptureError> {
        let file = CaptureFile::open(self.files, self.name).map_err(|e| match e.kind() {
            ErrorKind::NotFound => self.error(CaptureErrorKind::Missing),
            _ => self.error(CaptureErrorKind::Io(e)),
        })?;
        let mut decoder = png::Decoder::new(BufReader::with_capacity(READ_BYTES, file));
        decoder.set_transformations(transformations);
        let reader = decoder.read_info().map_err(|e| self.unreadable(e))?;
        let found = extent_of(&reader);
        match self.extent {
            Some(expected) if found != expected => {
                Err(self.error(CaptureErrorKind::WrongExtent { found, expected }))
            }
            _ => Ok(reader),
        }
    }

    fn unreadable(&self, error: DecodingError) -> CaptureError {
        self.error(match error {
            // The disk or the network is at fault, not the file.
            DecodingError::IoError(e) if e.raw_os_error().is_some() => CaptureErrorKind::Io(e),
            error => {
                let reason = error.to_string().trim_end_matches('.').to_owned();
                CaptureErrorKind::Unreadable(reason)
            }
        })
    }

    fn error(&self, problem: CaptureErrorKind) -> CaptureError {
        CaptureError {
            path: self.files.path(self.name),
            field: self.field.clone(),
            problem,
        }
    }
}

fn extent_of<R: BufRead + Seek>(reader: &png::Reader<R>) -> Extent {
    Extent::new(reader.info().width, reader.info().height)
}

/// For instance "8-bit grey with alpha".
fn sample_type((color, depth): (ColorType, BitDepth)) -> String {
    let color = match color {
        ColorType::Grayscale => "grey",
        ColorType::GrayscaleAlpha => "grey with alpha",
        ColorType::Indexed => "with a palette",
        ColorType::Rgb => "RGB",
        ColorType::Rgba => "RGB with alpha",
    };
    format!("{}-bit {color}", depth as u8)
}

/// A 16-bit RGB photograph that is read row by row from the top.
pub(super) struct Rgb16RowReader<'a, F: CaptureFiles> {
    file: CapturePng<'a, F>,
    reader: PngReader<'a, F>,
    row: Vec<[u16; CHANNELS]>,
}

impl<F: CaptureFiles> Rgb16RowReader<'_, F> {
    /// The codes of the next row; `None` after the last.
    pub fn next(&mut self) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        let row = self.reader.next_row();
        let row = row.map_err(|e| self.file.unreadable(e))?;
        Ok(row.map(|row| {
            let (codes, _) = row.data().as_chunks();
            self.row.resize(codes.len() / CHANNELS, [0; CHANNELS]);
            let samples = self.row.as_flattened_mut().iter_mut();
            samples
                .zip(codes)
                .for_each(|(sample, code)| *sample = u16::from_be_bytes(*code));
            self.row.as_slice()
        }))
    }

    /// Checks the rest of the file, once all rows are read.
    pub fn finish(mut self) -> Result<(), CaptureError> {
        let finished = self.reader.finish();
        finished.map_err(|e| self.file.unreadable(e))
    }
}
