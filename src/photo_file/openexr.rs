//! OpenEXR: the first layer with the channels R, G and B, else with Y; linear by definition.

use std::io::{BufRead, Seek};

use exr::block;
use exr::error::Error;
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::read::read;
use exr::image::read::specific_channels::ReadSpecificChannel;
use exr::math::Vec2;
use exr::meta::attribute::Text;
use exr::meta::header::Header;

use super::decode::PhotoFormat;
use super::error::PhotoFileError;
use super::samples::{PhotoSamples, SampleValues, check_size};
use crate::transport::Extent;

/// Bytes of a sample in memory.
const SAMPLE_BYTES: u64 = 4;

pub(super) fn decode(
    source: impl BufRead + Seek,
    max_bytes: u64,
) -> Result<PhotoSamples, PhotoFileError> {
    let chunks = block::read(source, false).map_err(decoding_error)?;
    for header in chunks.headers() {
        check_header(header, max_bytes)?;
    }
    let layer = |names: &[&str]| {
        let has = |header: &Header, name: &str| {
            let index = header.channels.find_index_of_channel(&Text::from(name));
            index.is_some()
        };
        let mut headers = chunks.headers().iter();
        headers.find(|header| !header.deep && names.iter().all(|name| has(header, name)))
    };
    let (header, channels) = match (layer(&["R", "G", "B"]), layer(&["Y"])) {
        (Some(header), _) => (header, 3),
        (None, Some(header)) => (header, 1),
        (None, None) => {
            let found = "no layer with the channels R, G and B, or Y";
            return Err(PhotoFileError::ColorType(found.to_owned()));
        }
    };
    let display = header.shared_attributes.display_window;
    if display.position != header.own_attributes.layer_position || display.size != header.layer_size
    {
        return Err(PhotoFileError::DataWindow);
    }
    let reader = read().no_deep_data().largest_resolution_level();
    let pixels = match channels {
        1 => {
            let set = |pixels: &mut Pixels, at, (grey,): (f32,)| pixels.set(at, [grey]);
            let create = |size: Vec2<usize>, _: &_| Pixels::new(size, 1);
            let reader = reader.specific_channels().required("Y");
            let reader = reader.collect_pixels(create, set).first_valid_layer();
            let image = reader.all_attributes().from_chunks(chunks);
            image.map(|image| image.layer_data.channel_data.pixels)
        }
        _ => {
            let set =
                |pixels: &mut Pixels, at, (r, g, b): (f32, f32, f32)| pixels.set(at, [r, g, b]);
            let create = |size: Vec2<usize>, _: &_| Pixels::new(size, 3);
            let reader = reader.rgb_channels(create, set).first_valid_layer();
            let image = reader.all_attributes().from_chunks(chunks);
            image.map(|image| image.layer_data.channel_data.pixels)
        }
    };
    pixels.map_err(decoding_error)?.finish(channels)
}

/// The pixels that have been decoded.
struct Pixels {
    size: Vec2<usize>,
    values: Vec<f32>,
    decoded: usize,
}

impl Pixels {
    fn new(size: Vec2<usize>, channels: usize) -> Self {
        Self {
            size,
            values: vec![0.0; size.area() * channels],
            decoded: 0,
        }
    }

    fn set<const K: usize>(&mut self, at: Vec2<usize>, sample: [f32; K]) {
        let first = (at.y() * self.size.width() + at.x()) * K;
        if let Some(target) = self.values.get_mut(first..first + K) {
            target.copy_from_slice(&sample);
            self.decoded += 1;
        }
    }

    /// Refuses a file that ends before its last block.
    fn finish(self, channels: usize) -> Result<PhotoSamples, PhotoFileError> {
        if self.decoded != self.size.area() {
            return Err(PhotoFileError::incomplete(PhotoFormat::OpenExr));
        }
        let side = |side| u32::try_from(side).unwrap_or(u32::MAX);
        let extent = Extent::new(side(self.size.width()), side(self.size.height()));
        PhotoSamples::new(extent, SampleValues::F32(self.values), channels, false)
            .ok_or_else(|| undecodable("it has no pixels".to_owned()))
    }
}

/// Refuses a layer that is too large, or has blocks that are, whether or not it is read.
fn check_header(header: &Header, max_bytes: u64) -> Result<(), PhotoFileError> {
    let block = header.max_block_pixel_size();
    let bytes = (header.channels.bytes_per_pixel as u64).max(3 * SAMPLE_BYTES);
    for size in [header.layer_size, block] {
        check_size(
            [size.width() as u64, size.height() as u64],
            bytes,
            max_bytes,
        )?;
    }
    Ok(())
}

fn decoding_error(error: Error) -> PhotoFileError {
    match error {
        Error::Io(error) => PhotoFileError::of_reading(PhotoFormat::OpenExr, error),
        // What the decoder makes of an unexpected end.
        Error::Invalid(reason) if reason == "reference to missing bytes" => {
            PhotoFileError::incomplete(PhotoFormat::OpenExr)
        }
        error => undecodable(error.to_string()),
    }
}

fn undecodable(reason: String) -> PhotoFileError {
    let format = PhotoFormat::OpenExr;
    PhotoFileError::Undecodable { format, reason }
}
