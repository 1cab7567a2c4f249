//! The samples of a photograph, in the type of its file.

use half::f16;

use super::error::PhotoFileError;
use crate::transport::{CHANNELS, Extent};

/// Factors that map the largest value of 8 and of 32 bits to that of 16.
const CODE_OF_8_BITS: f64 = 257.0;
const CODE_OF_32_BITS: f64 = 1.0 / 65_537.0;

/// Numbers as the file has them.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleValues {
    /// Integers of 8 bits.
    U8(Vec<u8>),
    /// Integers of 16 bits.
    U16(Vec<u16>),
    /// Integers of 32 bits.
    U32(Vec<u32>),
    /// Floating-point numbers of 16 bits.
    F16(Vec<f16>),
    /// Floating-point numbers of 32 bits.
    F32(Vec<f32>),
    /// Floating-point numbers of 64 bits.
    F64(Vec<f64>),
}

impl SampleValues {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::U32(values) => values.len(),
            Self::F16(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::F64(values) => values.len(),
        }
    }

    /// Value `i`: integers as codes of 16 bits, with fractions if they have 32; floating-point numbers as they are.
    fn value(&self, i: usize) -> f64 {
        match self {
            Self::U8(values) => f64::from(values[i]) * CODE_OF_8_BITS,
            Self::U16(values) => f64::from(values[i]),
            Self::U32(values) => f64::from(values[i]) * CODE_OF_32_BITS,
            Self::F16(values) => f64::from(values[i]),
            Self::F32(values) => f64::from(values[i]),
            Self::F64(values) => values[i],
        }
    }
}

/// A decoded photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoSamples {
    extent: Extent,
    values: SampleValues,
    /// Values of a pixel.
    channels: usize,
    /// Values from a pixel to the next.
    pixel_stride: usize,
    /// Values from the beginning of a pixel to red, green and blue; all the same in a grey photograph.
    channel_offsets: [usize; CHANNELS],
}

impl PhotoSamples {
    /// A photograph of `channels` values a pixel: grey, grey and alpha, RGB, or RGB and more. They lie pixel by pixel, or plane
    /// by plane if `is_planar`. `None` if there are not as many values as the extent says, or none at all.
    pub(crate) fn new(
        extent: Extent,
        values: SampleValues,
        channels: usize,
        is_planar: bool,
    ) -> Option<Self> {
        let pixels = (extent.width as usize).checked_mul(extent.height as usize)?;
        if pixels == 0 || channels == 0 || pixels.checked_mul(channels)? != values.len() {
            return None;
        }
        let (pixel_stride, channel_stride) = match is_planar {
            true => (1, pixels),
            false => (channels, 1),
        };
        let is_grey = channels < CHANNELS;
        let offset = |c: usize| if is_grey { 0 } else { c * channel_stride };
        Some(Self {
            extent,
            values,
            channels,
            pixel_stride,
            channel_offsets: std::array::from_fn(offset),
        })
    }

    /// Size in pixels.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Values of a pixel in the file, alpha included.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The numbers of the file.
    pub fn values(&self) -> &SampleValues {
        &self.values
    }

    /// Whether the samples are floating-point numbers.
    pub fn is_float(&self) -> bool {
        matches!(
            self.values,
            SampleValues::F16(_) | SampleValues::F32(_) | SampleValues::F64(_)
        )
    }

    /// Whether the samples have 8 bits.
    pub fn is_eight_bit(&self) -> bool {
        matches!(self.values, SampleValues::U8(_))
    }

    /// The samples of a pixel inside the extent: integers as codes of 16 bits, floating-point numbers as they are.
    pub fn pixel(&self, x: u32, y: u32) -> [f64; CHANNELS] {
        let pixel = y as usize * self.extent.width as usize + x as usize;
        let first = pixel * self.pixel_stride;
        self.channel_offsets
            .map(|offset| self.values.value(first + offset))
    }
}

/// Refuses a picture of more than `max_bytes`, before anything is allocated.
pub(super) fn check_size(
    extent: [u64; 2],
    bytes_per_pixel: u64,
    max_bytes: u64,
) -> Result<(), PhotoFileError> {
    let [width, height] = extent;
    let bytes = width
        .checked_mul(height)
        .and_then(|pixels| pixels.checked_mul(bytes_per_pixel));
    match bytes {
        Some(bytes) if bytes <= max_bytes => Ok(()),
        _ => Err(PhotoFileError::TooLarge { max_bytes }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_found_in_every_layout() {
        let extent = Extent::new(2, 1);
        let of = |values: &[u16], channels, is_planar| {
            PhotoSamples::new(
                extent,
                SampleValues::U16(values.to_vec()),
                channels,
                is_planar,
            )
        };
        let chunky = of(&[1, 2, 3, 9, 4, 5, 6, 9], 4, false).unwrap();
        let planar = of(&[1, 4, 2, 5, 3, 6], 3, true).unwrap();
        let grey = of(&[7, 0, 8, 0], 2, false).unwrap();
        assert_eq!(chunky.pixel(1, 0), [4.0, 5.0, 6.0]);
        assert_eq!(planar.pixel(1, 0), [4.0, 5.0, 6.0]);
        assert_eq!(grey.pixel(1, 0), [8.0; 3]);
        assert_eq!(of(&[1, 2, 3], 3, false), None);
    }

    #[test]
    fn integers_of_all_widths_have_the_same_full_scale() {
        let of = |values| PhotoSamples::new(Extent::new(1, 1), values, 1, false).unwrap();
        for values in [
            SampleValues::U8(vec![u8::MAX]),
            SampleValues::U16(vec![u16::MAX]),
            SampleValues::U32(vec![u32::MAX]),
        ] {
            assert!((of(values).pixel(0, 0)[0] - 65_535.0).abs() < 1e-6);
        }
        let half = of(SampleValues::F16(vec![f16::from_f32(-0.25)]));
        assert!(half.is_float());
        assert_eq!(half.pixel(0, 0)[1], -0.25);
    }
}
