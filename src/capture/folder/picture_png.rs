//! The two types of PNG in a capture: 8-bit patterns and 16-bit linear RGB photographs.
//!
//! Photographs are decoded row by row, so that hundreds can be read in parallel without one of them in memory whole.

use std::io::{BufRead, BufReader, Seek};

use png::{BitDepth, ColorType, DecodingError, Transformations};

use super::files::{CaptureFile, CaptureFiles};
use super::picture_file::PictureFile;
use crate::capture::error::{CaptureError, CaptureErrorKind};
use crate::capture::measurements::Pattern;
use crate::transport::{CHANNELS, Extent};

/// Bytes read from a file at a time.
const READ_BYTES: usize = 1 << 16;

type PngReader<'a, F> = png::Reader<BufReader<CaptureFile<'a, F>>>;

/// Reads an 8-bit pattern and its size; `emission` is that of each code.
pub(super) fn read_pattern<F: CaptureFiles>(
    file: &PictureFile<'_, F>,
    emission: &[f64; 256],
) -> Result<(Extent, Pattern), CaptureError> {
    let (mut reader, channels) = open_pattern(file)?;
    let extent = extent_of(&reader);
    let mut codes = vec![0; channels * extent.area()];
    let decoded = reader.next_frame(&mut codes);
    decoded.map_err(|e| unreadable(file, e))?;
    let emit = |code: &u8| emission[usize::from(*code)] as f32;
    let plane = |c| codes.iter().skip(c).step_by(channels).map(emit).collect();
    let pattern = match channels {
        1 => Pattern::Grey(plane(0)),
        _ => Pattern::Rgb(std::array::from_fn(plane)),
    };
    Ok((extent, pattern))
}

/// Number of planes of an 8-bit pattern.
pub(super) fn pattern_planes<F: CaptureFiles>(
    file: &PictureFile<'_, F>,
) -> Result<usize, CaptureError> {
    Ok(open_pattern(file)?.1)
}

/// Opens a pattern. Returns its number of channels as well.
fn open_pattern<'a, F: CaptureFiles>(
    file: &PictureFile<'a, F>,
) -> Result<(PngReader<'a, F>, usize), CaptureError> {
    // Some programs store black and white in one bit, or in a palette.
    let reader = open(file, Transformations::EXPAND)?;
    match reader.output_color_type() {
        (ColorType::Grayscale, BitDepth::Eight) => Ok((reader, 1)),
        (ColorType::Rgb, BitDepth::Eight) => Ok((reader, CHANNELS)),
        other => Err(file.error(CaptureErrorKind::PatternType(sample_type(other)))),
    }
}

fn open<'a, F: CaptureFiles>(
    file: &PictureFile<'a, F>,
    transformations: Transformations,
) -> Result<PngReader<'a, F>, CaptureError> {
    let source = BufReader::with_capacity(READ_BYTES, file.open()?);
    let mut decoder = png::Decoder::new(source);
    decoder.set_transformations(transformations);
    let reader = decoder.read_info().map_err(|e| unreadable(file, e))?;
    file.check_extent(extent_of(&reader))?;
    Ok(reader)
}

fn unreadable<F: CaptureFiles>(file: &PictureFile<'_, F>, error: DecodingError) -> CaptureError {
    match error {
        // The disk or the network is at fault, not the file.
        DecodingError::IoError(e) if e.raw_os_error().is_some() => file.io_error(e),
        error => file.unreadable("PNG", error),
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
pub(super) struct PngRowReader<'a, F: CaptureFiles> {
    file: PictureFile<'a, F>,
    reader: PngReader<'a, F>,
    row: Vec<[u16; CHANNELS]>,
}

impl<'a, F: CaptureFiles> PngRowReader<'a, F> {
    pub fn open(file: PictureFile<'a, F>) -> Result<Self, CaptureError> {
        let reader = open(&file, Transformations::IDENTITY)?;
        let info = reader.info();
        let found = (info.color_type, info.bit_depth);
        if found != (ColorType::Rgb, BitDepth::Sixteen) {
            return Err(file.error(CaptureErrorKind::PhotoType(sample_type(found))));
        }
        if info.interlaced {
            return Err(file.error(CaptureErrorKind::Interlaced));
        }
        Ok(Self {
            reader,
            row: Vec::new(),
            file,
        })
    }

    pub fn extent(&self) -> Extent {
        extent_of(&self.reader)
    }

    /// The codes of the next row; `None` after the last.
    pub fn next(&mut self) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        let row = self.reader.next_row();
        let row = row.map_err(|e| unreadable(&self.file, e))?;
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
        finished.map_err(|e| unreadable(&self.file, e))
    }
}
