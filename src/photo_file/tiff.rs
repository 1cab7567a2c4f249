//! TIFF: integers of 8, 16 and 32 bits, floating-point numbers of 16, 32 and 64. The first picture of the file counts.

use std::io::{BufRead, Seek};

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::{ColorType, TiffError};

use super::decode::PhotoFormat;
use super::error::PhotoFileError;
use super::samples::{PhotoSamples, SampleValues, check_size};
use crate::transport::Extent;

pub(super) fn decode(
    source: impl BufRead + Seek,
    max_bytes: u64,
) -> Result<PhotoSamples, PhotoFileError> {
    let error = |error| decoding_error(error, max_bytes);
    // It reads the tags within limits of its own: a list of values, such as places of strips, takes 256 MiB at most.
    let mut decoder = Decoder::new(source).map_err(error)?;
    let bytes = usize::try_from(max_bytes).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.intermediate_buffer_size = bytes;
    decoder = decoder.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(error)?;
    let color = decoder.colortype().map_err(error)?;
    let channels = channels(color)?;
    let bits = color.bit_depth();
    if ![8, 16, 32, 64].contains(&bits) {
        return Err(PhotoFileError::SampleType(format!("{bits} bits")));
    }
    let bytes_per_pixel = u64::from(channels) * u64::from(bits / 8);
    check_size([width.into(), height.into()], bytes_per_pixel, max_bytes)?;
    let mut buffer = DecodingResult::U8(Vec::new());
    let layout = decoder.read_image_to_buffer(&mut buffer).map_err(error)?;
    if buffer.as_buffer(0).byte_len() < layout.complete_len {
        return Err(PhotoFileError::TooLarge { max_bytes });
    }
    let values = values(buffer)?;
    let extent = Extent::new(width, height);
    // Channels beyond alpha are part of the pixel.
    let pixels = (u64::from(width) * u64::from(height)).max(1);
    let stored = values.len() as u64 / pixels;
    (stored >= u64::from(channels))
        .then(|| PhotoSamples::new(extent, values, stored as usize, layout.planes > 1))
        .flatten()
        .ok_or_else(|| undecodable("it has fewer samples than its size says".to_owned()))
}

/// Channels of a pixel, by the TIFF's colours.
fn channels(color: ColorType) -> Result<u16, PhotoFileError> {
    match color {
        ColorType::Gray(_) => Ok(1),
        ColorType::GrayA(_) => Ok(2),
        ColorType::RGB(_) => Ok(3),
        ColorType::RGBA(_) => Ok(4),
        // Grey with an alpha channel.
        ColorType::Multiband { num_samples: 2, .. } => Ok(2),
        other => Err(PhotoFileError::ColorType(format!(
            "colours of the type {other:?}"
        ))),
    }
}

fn values(buffer: DecodingResult) -> Result<SampleValues, PhotoFileError> {
    let other = match buffer {
        DecodingResult::U8(values) => return Ok(SampleValues::U8(values)),
        DecodingResult::U16(values) => return Ok(SampleValues::U16(values)),
        DecodingResult::U32(values) => return Ok(SampleValues::U32(values)),
        DecodingResult::F16(values) => return Ok(SampleValues::F16(values)),
        DecodingResult::F32(values) => return Ok(SampleValues::F32(values)),
        DecodingResult::F64(values) => return Ok(SampleValues::F64(values)),
        DecodingResult::U64(_) => "64-bit integers",
        DecodingResult::I8(_)
        | DecodingResult::I16(_)
        | DecodingResult::I32(_)
        | DecodingResult::I64(_) => "integers with sign",
    };
    Err(PhotoFileError::SampleType(other.to_owned()))
}

fn decoding_error(error: TiffError, max_bytes: u64) -> PhotoFileError {
    match error {
        TiffError::IoError(error) => PhotoFileError::of_reading(PhotoFormat::Tiff, error),
        TiffError::LimitsExceeded => PhotoFileError::TooLarge { max_bytes },
        error => undecodable(error.to_string()),
    }
}

fn undecodable(reason: String) -> PhotoFileError {
    let format = PhotoFormat::Tiff;
    PhotoFileError::Undecodable { format, reason }
}
