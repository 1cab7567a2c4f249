//! Reading the two kinds of picture a capture has, strictly.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat, ImageReader};

use super::CaptureError;
use crate::transport::Extent;

/// Bytes of a photograph's file read at once.
const FILE_BUFFER: usize = 1 << 16;

/// Opens a PNG of exactly `extent`. `named_by` tells where the manifest names it.
fn open(path: &Path, extent: Extent, named_by: &str) -> Result<DynamicImage, CaptureError> {
    let file = File::open(path).map_err(|e| io_error(path, named_by, e))?;
    // PNG and nothing else: what a lossy format gives back is no measurement.
    let picture = ImageReader::with_format(BufReader::new(file), ImageFormat::Png)
        .decode()
        .map_err(|e| unreadable(path, named_by, &e))?;
    let found = Extent {
        width: picture.width(),
        height: picture.height(),
    };
    check_extent(path, named_by, found, extent)?;
    Ok(picture)
}

fn io_error(path: &Path, named_by: &str, source: io::Error) -> CaptureError {
    match source.kind() {
        io::ErrorKind::NotFound => CaptureError::Missing {
            path: path.to_owned(),
            named_by: field(named_by),
        },
        _ => CaptureError::Io {
            path: path.to_owned(),
            source,
        },
    }
}

/// Where the manifest names a file, in brackets.
fn field(named_by: &str) -> String {
    match named_by {
        "" => String::new(),
        field => format!(" ({field} in {})", super::MANIFEST_NAME),
    }
}

fn unreadable(path: &Path, named_by: &str, why: &dyn std::fmt::Display) -> CaptureError {
    let why = why.to_string();
    CaptureError::Image {
        path: path.to_owned(),
        named_by: field(named_by),
        problem: format!(
            "is not a readable PNG: {}; export or copy it again",
            why.trim_end_matches('.')
        ),
    }
}

fn check_extent(
    path: &Path,
    named_by: &str,
    found: Extent,
    wanted: Extent,
) -> Result<(), CaptureError> {
    if found == wanted {
        return Ok(());
    }
    Err(CaptureError::Image {
        path: path.to_owned(),
        named_by: field(named_by),
        problem: format!("is {found} pixels; capture.json says {wanted}: correct one of them"),
    })
}

/// A 16-bit RGB picture's codes, row by row.
pub(super) fn rgb16(
    path: &Path,
    extent: Extent,
    named_by: &str,
) -> Result<Vec<[u16; 3]>, CaptureError> {
    let mut rows = Rgb16Rows::open(path, extent, named_by)?;
    let mut codes = Vec::with_capacity(extent.area());
    while let Some(row) = rows.next()? {
        codes.extend(row);
    }
    rows.finish()?;
    Ok(codes)
}

/// A 16-bit RGB picture that is read row by row from the top.
pub(super) struct Rgb16Rows {
    path: PathBuf,
    named_by: String,
    reader: png::Reader<BufReader<ReopenedFile>>,
    left: u32,
}

impl Rgb16Rows {
    /// Opens a PNG of exactly `extent`.
    pub fn open(path: &Path, extent: Extent, named_by: &str) -> Result<Self, CaptureError> {
        let bad = |problem| CaptureError::Image {
            path: path.to_owned(),
            named_by: field(named_by),
            problem,
        };
        let file = ReopenedFile::open(path).map_err(|e| io_error(path, named_by, e))?;
        let file = BufReader::with_capacity(FILE_BUFFER, file);
        let reader = png::Decoder::new(file).read_info();
        let reader = reader.map_err(|e| unreadable(path, named_by, &e))?;
        let info = reader.info();
        let found = Extent {
            width: info.width,
            height: info.height,
        };
        check_extent(path, named_by, found, extent)?;
        if (info.bit_depth, info.color_type) != (png::BitDepth::Sixteen, png::ColorType::Rgb) {
            return Err(bad(format!(
                "is {}-bit {}; a photograph must be a 16-bit linear RGB PNG: export it again from \
                 raw",
                info.bit_depth as u8,
                match info.color_type {
                    png::ColorType::Grayscale => "grey",
                    png::ColorType::GrayscaleAlpha => "grey with alpha",
                    png::ColorType::Indexed => "with a palette",
                    png::ColorType::Rgb => "RGB",
                    png::ColorType::Rgba => "RGB with alpha",
                }
            )));
        }
        if info.interlaced {
            return Err(bad(
                "is interlaced, but photographs are read row by row: save it without interlacing"
                    .to_owned(),
            ));
        }
        Ok(Self {
            path: path.to_owned(),
            named_by: named_by.to_owned(),
            left: extent.height,
            reader,
        })
    }

    /// The next row's codes; `None` after the last.
    pub fn next(&mut self) -> Result<Option<impl Iterator<Item = [u16; 3]>>, CaptureError> {
        if self.left == 0 {
            return Ok(None);
        }
        let row = self.reader.next_row();
        let row = row.map_err(|e| unreadable(&self.path, &self.named_by, &e))?;
        let Some(row) = row else {
            return Err(unreadable(&self.path, &self.named_by, &"it ends too soon"));
        };
        self.left -= 1;
        let code = |bytes: &[u8]| u16::from_be_bytes([bytes[0], bytes[1]]);
        let pixels = row.data().chunks_exact(6);
        Ok(Some(pixels.map(move |p| {
            [code(&p[..2]), code(&p[2..4]), code(&p[4..])]
        })))
    }

    /// Checks that the file is whole to its end, once all rows have been read.
    pub fn finish(mut self) -> Result<(), CaptureError> {
        let finished = self.reader.finish();
        finished.map_err(|e| unreadable(&self.path, &self.named_by, &e))
    }
}

/// A file that is open only while it is read from, so that hundreds can be read side by side where
/// a system allows a process no more than 256 open files.
struct ReopenedFile {
    path: PathBuf,
    position: u64,
    length: u64,
}

impl ReopenedFile {
    fn open(path: &Path) -> io::Result<Self> {
        Ok(Self {
            path: path.to_owned(),
            position: 0,
            length: File::open(path)?.metadata()?.len(),
        })
    }
}

impl Read for ReopenedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.position))?;
        let count = file.read(buffer)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for ReopenedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

/// The codes of an 8-bit picture: one plane for a grey one, three for RGB.
pub(super) fn codes8(
    path: &Path,
    extent: Extent,
    named_by: &str,
) -> Result<Vec<Vec<u8>>, CaptureError> {
    match open(path, extent, named_by)? {
        DynamicImage::ImageLuma8(picture) => Ok(vec![picture.into_raw()]),
        DynamicImage::ImageRgb8(picture) => Ok((0..3)
            .map(|c| picture.pixels().map(|p| p.0[c]).collect())
            .collect()),
        other => Err(CaptureError::Image {
            path: path.to_owned(),
            named_by: field(named_by),
            problem: format!(
                "is {}; a pattern must be an 8-bit grey or RGB PNG",
                kind(&other)
            ),
        }),
    }
}

fn kind(picture: &DynamicImage) -> &'static str {
    match picture {
        DynamicImage::ImageLuma8(_) => "8-bit grey",
        DynamicImage::ImageLumaA8(_) => "8-bit grey with alpha",
        DynamicImage::ImageRgb8(_) => "8-bit RGB",
        DynamicImage::ImageRgba8(_) => "8-bit RGB with alpha",
        DynamicImage::ImageLuma16(_) => "16-bit grey",
        DynamicImage::ImageLumaA16(_) => "16-bit grey with alpha",
        DynamicImage::ImageRgb16(_) => "16-bit RGB",
        DynamicImage::ImageRgba16(_) => "16-bit RGB with alpha",
        _ => "of an unknown kind",
    }
}
