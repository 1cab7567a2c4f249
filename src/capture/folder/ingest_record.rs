//! The record in a TIFF of `ltm-export stage ingest`: tags of its own, see docs/capture.md.
//!
//! The record has a checksum of each tile, so that a tile can be read and checked without the others, and a histogram of all
//! codes, from which their statistics follow for any saturation.

use std::io::{self, Read, Seek, Write};

use serde::{Deserialize, Serialize};
use tiff::decoder::{ChunkType, Decoder};
use tiff::encoder::{DirectoryEncoder, TiffKind};
use tiff::tags::{Tag, Type, ValueBuffer};
use tiff::{TiffError, TiffResult};

use crate::capture::code_statistics::CodeStatistics;
use crate::transport::CHANNELS;

/// Number of different codes.
const CODES: usize = 1 << 16;
/// JSON text that names the source; the histogram; CRC-32C of each tile and at last of the histogram; CRC-32C of the text and of
/// these checksums. Numbers from 65000 on are for private use.
const SOURCE: Tag = Tag::Unknown(65100);
const HISTOGRAM: Tag = Tag::Unknown(65101);
const CHECKSUMS: Tag = Tag::Unknown(65102);
const CHECKSUM: Tag = Tag::Unknown(65103);
/// Level of zstd for histograms: most are a few hundred kilobytes of small numbers.
const ZSTD_LEVEL: i32 = 9;

/// The file that a photograph was ingested from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IngestSource {
    /// Its name in the manifest.
    pub name: String,
    /// Its length in bytes.
    pub bytes: u64,
    /// Its SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// The record without the histogram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct IngestRecord {
    pub source: IngestSource,
    /// CRC-32C of the samples of each tile as little-endian bytes, without padding, and at last of the histogram.
    pub checksums: Vec<u32>,
    /// CRC-32C of the record, and so of the photograph.
    pub checksum: u32,
}

impl IngestRecord {
    /// Reads the record of the first picture of a TIFF; `None` if it has none. Other programs that change a photograph do not
    /// keep tags that they do not know.
    pub fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> TiffResult<Option<Self>> {
        let Some(checksum) = decoder.find_tag_unsigned(CHECKSUM)? else {
            return Ok(None);
        };
        let source = decoder.get_tag_ascii_string(SOURCE)?;
        let checksums = decoder.get_tag_u32_vec(CHECKSUMS)?;
        let is_tiled = decoder.get_chunk_type() == ChunkType::Tile;
        let is_whole = is_tiled && checksums.len() == decoder.tile_count()? as usize + 1;
        if !is_whole || checksum != record_checksum(&source, &checksums) {
            return Err(damaged());
        }
        Ok(Some(Self {
            source: serde_json::from_str(&source).map_err(|_| damaged())?,
            checksums,
            checksum,
        }))
    }

    /// The statistics of the codes of the photograph with this record, if those from `saturated_from` on are saturated.
    pub fn statistics<R: Read + Seek>(
        &self,
        decoder: &mut Decoder<R>,
        saturated_from: [u32; CHANNELS],
    ) -> TiffResult<CodeStatistics> {
        let (width, height) = decoder.dimensions()?;
        let histogram = self.compressed_histogram(decoder)?;
        let histogram = CodeHistogram::decompress(histogram.as_bytes()).ok_or_else(damaged)?;
        match histogram.is_of(u64::from(width) * u64::from(height)) {
            true => Ok(histogram.statistics(saturated_from)),
            false => Err(damaged()),
        }
    }

    /// Fails if the histogram of the photograph with this record is damaged.
    pub fn check_histogram<R: Read + Seek>(&self, decoder: &mut Decoder<R>) -> TiffResult<()> {
        self.compressed_histogram(decoder).map(drop)
    }

    fn compressed_histogram<R: Read + Seek>(
        &self,
        decoder: &mut Decoder<R>,
    ) -> TiffResult<ValueBuffer> {
        // Other functions make each byte a value of 32 bytes.
        let mut histogram = ValueBuffer::empty(Type::BYTE);
        decoder
            .image_ifd()
            .find_tag_buf(HISTOGRAM, &mut histogram)?;
        match self.checksums.last() == Some(&crc32c::crc32c(histogram.as_bytes())) {
            true => Ok(histogram),
            false => Err(damaged()),
        }
    }

    /// Writes the tags of a photograph from `source`, with these `checksums` of its tiles.
    pub fn write<W: Write + Seek, K: TiffKind>(
        encoder: &mut DirectoryEncoder<'_, W, K>,
        source: &IngestSource,
        mut checksums: Vec<u32>,
        histogram: &CodeHistogram,
    ) -> TiffResult<()> {
        let source = serde_json::to_string(source).map_err(io::Error::from)?;
        let histogram = histogram.compress()?;
        checksums.push(crc32c::crc32c(&histogram));
        let checksum = record_checksum(&source, &checksums);
        encoder.write_tag(SOURCE, source.as_str())?;
        encoder.write_tag(HISTOGRAM, histogram.as_slice())?;
        encoder.write_tag(CHECKSUMS, checksums.as_slice())?;
        encoder.write_tag(CHECKSUM, checksum)
    }
}

fn damaged() -> TiffError {
    io::Error::other("its record of ltm-export is damaged").into()
}

fn record_checksum(source: &str, checksums: &[u32]) -> u32 {
    let bytes = checksums.iter().map(|checksum| checksum.to_le_bytes());
    let source = crc32c::crc32c(source.as_bytes());
    bytes.fold(source, |checksum, bytes| {
        crc32c::crc32c_append(checksum, &bytes)
    })
}

/// How many samples of each channel have each code.
pub(super) struct CodeHistogram {
    /// `[3, 65536]`.
    counts: Vec<u64>,
}

impl CodeHistogram {
    /// Of no samples yet.
    pub fn empty() -> Self {
        Self {
            counts: vec![0; CHANNELS * CODES],
        }
    }

    pub fn add(&mut self, pixels: &[[u16; CHANNELS]]) {
        for codes in pixels {
            for (c, code) in codes.iter().enumerate() {
                self.counts[c * CODES + usize::from(*code)] += 1;
            }
        }
    }

    /// Whether each channel has `pixels` samples.
    fn is_of(&self, pixels: u64) -> bool {
        let mut channels = self.counts.chunks_exact(CODES);
        channels.all(|counts| {
            let sum = counts.iter().try_fold(0, |sum: u64, n| sum.checked_add(*n));
            sum == Some(pixels)
        })
    }

    fn statistics(&self, saturated_from: [u32; CHANNELS]) -> CodeStatistics {
        let channels = self.counts.chunks_exact(CODES);
        let mut statistics = CodeStatistics::of_photograph();
        for (c, counts) in channels.enumerate() {
            let codes = (0..=u16::MAX).zip(counts);
            for (code, samples) in codes.filter(|(_, samples)| **samples > 0) {
                let is_saturated = u32::from(code) >= saturated_from[c];
                statistics.add_code(c, code, *samples as usize, is_saturated);
            }
        }
        statistics
    }

    fn compress(&self) -> io::Result<Vec<u8>> {
        let bytes: Vec<u8> = self.counts.iter().flat_map(|n| n.to_le_bytes()).collect();
        zstd::bulk::compress(&bytes, ZSTD_LEVEL)
    }

    fn decompress(bytes: &[u8]) -> Option<Self> {
        let length = CHANNELS * CODES * size_of::<u64>();
        let bytes = zstd::bulk::decompress(bytes, length).ok()?;
        let counts = bytes.as_chunks().0.iter().map(|n| u64::from_le_bytes(*n));
        let counts: Vec<u64> = counts.collect();
        (counts.len() == CHANNELS * CODES).then_some(Self { counts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_a_histogram_are_those_of_the_rows() {
        let pixel = |i: u32, factor: u32| {
            let code = |c: u32| (i.wrapping_mul(2_654_435_761 + 2 * c) % 250 * factor) as u16;
            std::array::from_fn(|c| code(c as u32).min(60_000 - 100 * c as u16))
        };
        for (count, factor) in [(0, 1), (1, 1), (5000, 1), (5000, 257), (5000, 256)] {
            let pixels: Vec<[u16; CHANNELS]> = (0..count).map(|i| pixel(i, factor)).collect();
            for saturated_from in [[u32::MAX; CHANNELS], [60_000, 50_000, 59_800], [1, 2, 3]] {
                let mut histogram = CodeHistogram::empty();
                let mut expected = CodeStatistics::of_photograph();
                for row in pixels.chunks(700) {
                    histogram.add(row);
                    expected.add_row(row, saturated_from);
                }
                let stored = CodeHistogram::decompress(&histogram.compress().unwrap()).unwrap();
                assert!(stored.is_of(count.into()) && !stored.is_of(u64::from(count) + 1));
                assert_eq!(stored.statistics(saturated_from), expected);
            }
        }
        assert!(CodeHistogram::decompress(b"no histogram").is_none());
    }
}
