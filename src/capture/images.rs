//! Reading the two kinds of picture a capture has, strictly.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::{DynamicImage, ImageFormat, ImageReader};

use super::CaptureError;
use crate::transport::Extent;

/// Opens a PNG of exactly `extent`. `named_by` tells where the manifest names it.
fn open(path: &Path, extent: Extent, named_by: &str) -> Result<DynamicImage, CaptureError> {
    let io = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => CaptureError::Missing {
            path: path.to_owned(),
            named_by: match named_by {
                "" => String::new(),
                field => format!(" ({field} in {})", super::MANIFEST_NAME),
            },
        },
        _ => CaptureError::Io {
            path: path.to_owned(),
            source,
        },
    };
    let bad = |problem: String| CaptureError::Image {
        path: path.to_owned(),
        problem,
    };
    let file = BufReader::new(File::open(path).map_err(io)?);
    // PNG and nothing else: what a lossy format gives back is no measurement.
    let picture = ImageReader::with_format(file, ImageFormat::Png)
        .decode()
        .map_err(|e| bad(format!("is not a readable PNG: {e}")))?;
    let found = Extent {
        width: picture.width(),
        height: picture.height(),
    };
    if found == extent {
        Ok(picture)
    } else {
        Err(bad(format!(
            "is {found} pixels; capture.json says {extent}: correct one of them"
        )))
    }
}

/// A 16-bit RGB picture's codes, row by row.
pub(super) fn rgb16(
    path: &Path,
    extent: Extent,
    named_by: &str,
) -> Result<Vec<[u16; 3]>, CaptureError> {
    match open(path, extent, named_by)? {
        DynamicImage::ImageRgb16(picture) => Ok(picture.pixels().map(|p| p.0).collect()),
        other => Err(CaptureError::Image {
            path: path.to_owned(),
            problem: format!(
                "is {}; a photograph must be a 16-bit linear RGB PNG: export it again from raw",
                kind(&other)
            ),
        }),
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
