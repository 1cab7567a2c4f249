//! How the samples of a TIFF photograph are stored, and their codes.

use std::io::{Read, Seek};

use half::f16;
use tiff::decoder::Decoder;
use tiff::tags::{PlanarConfiguration, SampleFormat, Tag};
use tiff::{ColorType, TiffResult};

use super::tiled_tiff::TILE_ROWS;
use crate::capture::error::CaptureErrorKind;
use crate::transport::{CHANNELS, Extent};

/// The type of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleType {
    /// Integers of 16 bits, which are codes.
    U16,
    /// Floating-point numbers of 16 bits; 1 is the highest code.
    F16,
    /// Floating-point numbers of 32 bits; 1 is the highest code.
    F32,
}

impl SampleType {
    pub fn bytes(self) -> usize {
        match self {
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    /// The codes of samples as the decoder gives them. `None` if one is not a number.
    pub fn codes(self, bytes: &[u8], codes: &mut [u16]) -> Option<()> {
        fn convert<const BYTES: usize>(
            bytes: &[u8],
            codes: &mut [u16],
            code: impl Fn([u8; BYTES]) -> Option<u16>,
        ) -> Option<()> {
            let (samples, _) = bytes.as_chunks();
            debug_assert_eq!(codes.len(), samples.len());
            for (converted, sample) in codes.iter_mut().zip(samples) {
                *converted = code(*sample)?;
            }
            Some(())
        }
        match self {
            Self::U16 => convert(bytes, codes, |sample| Some(u16::from_ne_bytes(sample))),
            Self::F16 => convert(bytes, codes, |sample| {
                float_code(f16::from_ne_bytes(sample).to_f32())
            }),
            Self::F32 => convert(bytes, codes, |sample| {
                float_code(f32::from_ne_bytes(sample))
            }),
        }
    }
}

/// Light below 0 and above 1 gets the lowest and the highest code.
fn float_code(sample: f32) -> Option<u16> {
    (!sample.is_nan()).then(|| (sample * f32::from(u16::MAX)).round() as u16)
}

/// How the samples of a TIFF are arranged.
pub(super) struct Layout {
    pub extent: Extent,
    /// Columns, with padding, and rows of a strip or a tile.
    pub chunk: Extent,
    color: ColorType,
    /// Samples of a pixel, with those that are no colour.
    samples_per_pixel: u16,
    /// The number of [`Tag::SampleFormat`], if all samples have one.
    format: Option<u16>,
    is_planar: bool,
}

impl Layout {
    pub fn read(decoder: &mut Decoder<impl Read + Seek>) -> TiffResult<Self> {
        let (width, height) = decoder.dimensions()?;
        let (chunk_width, chunk_height) = decoder.chunk_dimensions();
        let formats: Option<Vec<u16>> = decoder.find_tag_unsigned_vec(Tag::SampleFormat)?;
        let planes: Option<u16> = decoder.find_tag_unsigned(Tag::PlanarConfiguration)?;
        let formats = formats.unwrap_or_default();
        let first = *formats.first().unwrap_or(&SampleFormat::Uint.to_u16());
        Ok(Self {
            extent: Extent::new(width, height),
            chunk: Extent::new(chunk_width.max(1), chunk_height.min(height).max(1)),
            color: decoder.colortype()?,
            samples_per_pixel: decoder
                .find_tag_unsigned(Tag::SamplesPerPixel)?
                .unwrap_or(1),
            format: formats
                .iter()
                .all(|format| *format == first)
                .then_some(first),
            is_planar: planes == Some(PlanarConfiguration::Planar.to_u16()),
        })
    }

    /// The type of the samples, if photographs may be stored so, in strips or rows of tiles of at most `max_bytes`, or tiles of
    /// at most [`TILE_ROWS`] rows.
    pub fn sample_type(&self, max_bytes: usize) -> Result<SampleType, CaptureErrorKind> {
        const INTEGER: u16 = SampleFormat::Uint.to_u16();
        const FLOAT: u16 = SampleFormat::IEEEFP.to_u16();
        let sample_type = match (self.color, self.format) {
            (ColorType::RGB(16), Some(INTEGER)) => SampleType::U16,
            (ColorType::RGB(16), Some(FLOAT)) => SampleType::F16,
            (ColorType::RGB(32), Some(FLOAT)) => SampleType::F32,
            _ => return Err(CaptureErrorKind::PhotoType(self.name())),
        };
        // The decoder would leave the others out, after it has undone a predictor with a wrong number of samples.
        if usize::from(self.samples_per_pixel) != CHANNELS {
            let (name, count) = (self.name(), self.samples_per_pixel);
            let found = format!("{name} with {count} samples a pixel");
            return Err(CaptureErrorKind::PhotoType(found));
        }
        if self.is_planar {
            return Err(CaptureErrorKind::Planar);
        }
        let pixel_bytes = (CHANNELS * sample_type.bytes()) as u64;
        let chunk_bytes = pixel_bytes.saturating_mul(self.chunk.area() as u64);
        let chunks = u64::from(self.extent.width.div_ceil(self.chunk.width));
        // On a few threads, they take less than the rows that the memory plan counts for all photographs.
        let are_few = self.chunk.height <= TILE_ROWS && chunk_bytes <= max_bytes as u64;
        match are_few || chunk_bytes.saturating_mul(chunks) <= max_bytes as u64 {
            true => Ok(sample_type),
            false => Err(CaptureErrorKind::LargeStrips(self.chunk.height)),
        }
    }

    /// The type of samples and pixels, for messages.
    fn name(&self) -> String {
        let numbers = match self.format.map(SampleFormat::from_u16_exhaustive) {
            Some(SampleFormat::Uint) => "",
            Some(SampleFormat::IEEEFP) => " floating-point",
            _ => " signed or mixed",
        };
        let bits = self.color.bit_depth();
        let color = match self.color {
            ColorType::Gray(_) => "grey",
            ColorType::GrayA(_) => "grey with alpha",
            ColorType::RGB(_) => "RGB",
            ColorType::RGBA(_) => "RGB with alpha",
            ColorType::Palette(_) => "with a palette",
            _ => "of another colour type",
        };
        format!("{bits}-bit{numbers} {color}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_are_bounded() {
        let mut large = Layout {
            extent: Extent::new(60_000, 60_000),
            chunk: Extent::new(60_000, 60_000),
            color: ColorType::RGB(16),
            samples_per_pixel: 3,
            format: Some(SampleFormat::Uint.to_u16()),
            is_planar: false,
        };
        let error = large.sample_type(8 << 20).unwrap_err();
        assert!(matches!(error, CaptureErrorKind::LargeStrips(60_000)));
        large.chunk.height = 20;
        assert_eq!(large.sample_type(8 << 20).unwrap(), SampleType::U16);
        // Tiles of a row count together, unless they are flat.
        for (tile, is_read) in [
            (Extent::new(64, 20), true),
            (Extent::new(64, 32), false),
            (Extent::new(1 << 20, 20), false),
            (Extent::new(1 << 20, 16), false),
            (Extent::new(1 << 14, 16), true),
        ] {
            large.chunk = tile;
            assert_eq!(large.sample_type(8 << 20).is_ok(), is_read, "{tile:?}");
        }
        large.chunk = Extent::new(60_000, 20);
        // Twice as large, by its samples.
        (large.color, large.format) = (ColorType::RGB(32), Some(SampleFormat::IEEEFP.to_u16()));
        assert_eq!(large.sample_type(16 << 20).unwrap(), SampleType::F32);
        assert!(large.sample_type(8 << 20).is_err());
    }

    #[test]
    fn floating_point_samples_have_codes() {
        for (sample, code) in [
            (0.0, Some(0)),
            (1.0, Some(65_535)),
            (0.5, Some(32_768)),
            (-0.1, Some(0)),
            (7.0, Some(65_535)),
            (f32::INFINITY, Some(65_535)),
            (f32::NAN, None),
        ] {
            assert_eq!(float_code(sample), code, "{sample}");
        }
        let every: Vec<u16> = (0..=u16::MAX).collect();
        let bytes: Vec<u8> = { every.iter() }
            .flat_map(|code| (f32::from(*code) / 65_535.0).to_ne_bytes())
            .collect();
        let mut codes = vec![0; every.len()];
        SampleType::F32.codes(&bytes, &mut codes).unwrap();
        assert!(codes == every);
    }
}
