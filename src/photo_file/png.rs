//! PNG: integers of 8 and 16 bits.

use std::io::{BufRead, Seek};

use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Limits};

use super::decode::PhotoFormat;
use super::error::PhotoFileError;
use super::samples::{PhotoSamples, SampleValues};
use crate::transport::Extent;

pub(super) fn decode(
    source: impl BufRead + Seek,
    max_bytes: u64,
) -> Result<PhotoSamples, PhotoFileError> {
    let mut reader = ImageReader::with_format(source, ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_alloc = Some(max_bytes);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| match error {
        ImageError::IoError(error) => PhotoFileError::of_reading(PhotoFormat::Png, error),
        ImageError::Limits(_) => PhotoFileError::TooLarge { max_bytes },
        error => undecodable(error.to_string()),
    })?;
    let extent = Extent::new(image.width(), image.height());
    let (values, channels) = match image {
        DynamicImage::ImageLuma8(image) => (SampleValues::U8(image.into_raw()), 1),
        DynamicImage::ImageLumaA8(image) => (SampleValues::U8(image.into_raw()), 2),
        DynamicImage::ImageRgb8(image) => (SampleValues::U8(image.into_raw()), 3),
        DynamicImage::ImageRgba8(image) => (SampleValues::U8(image.into_raw()), 4),
        DynamicImage::ImageLuma16(image) => (SampleValues::U16(image.into_raw()), 1),
        DynamicImage::ImageLumaA16(image) => (SampleValues::U16(image.into_raw()), 2),
        DynamicImage::ImageRgb16(image) => (SampleValues::U16(image.into_raw()), 3),
        DynamicImage::ImageRgba16(image) => (SampleValues::U16(image.into_raw()), 4),
        other => {
            let found = format!("colours of the type {:?}", other.color());
            return Err(PhotoFileError::ColorType(found));
        }
    };
    PhotoSamples::new(extent, values, channels, false)
        .ok_or_else(|| undecodable("it has no pixels".to_owned()))
}

fn undecodable(reason: String) -> PhotoFileError {
    let format = PhotoFormat::Png;
    PhotoFileError::Undecodable { format, reason }
}
