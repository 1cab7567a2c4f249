//! TIFF photographs: linear RGB of 16-bit integers or floating-point numbers, in strips or tiles. With the record of
//! [`IngestRecord`], tiles are read without the others.

use std::io::{self, BufReader};
use std::ops::Range;

use tiff::TiffError;
use tiff::decoder::{Decoder, Limits};

use super::files::{CaptureFile, CaptureFiles};
use super::ingest_record::IngestRecord;
use super::picture_file::PictureFile;
use super::tiff_layout::{Layout, SampleType};
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::{CaptureError, CaptureErrorKind};
use crate::transport::{CHANNELS, Extent};

/// Bytes that are read from a file at a time.
const READ_BYTES: usize = 1 << 16;
/// Bytes that are read for a tag: uncompressed tiles do not go through the buffer.
pub(super) const TAG_BYTES: usize = 1 << 10;
/// Largest strip, or tiles side by side, of more than [`TILE_ROWS`](super::tiled_tiff::TILE_ROWS) rows: as many are in memory as
/// photographs are read at once.
pub(super) const MAX_ROWS_BYTES: usize = 8 << 20;

/// The first picture of a TIFF, row by row from the top.
pub(super) struct TiffRowReader<'a, F: CaptureFiles> {
    file: PictureFile<'a, F>,
    decoder: Decoder<BufReader<CaptureFile<'a, F>>>,
    extent: Extent,
    /// Columns and rows of a strip or a tile.
    chunk: Extent,
    sample_type: SampleType,
    record: Option<IngestRecord>,
    /// The rows that were read last, until they are released.
    read: Option<ChunkRow>,
    next_row: u32,
}

/// The rows of a strip, or of tiles that lie side by side.
struct ChunkRow {
    /// Number of these rows from the top.
    index: u32,
    /// `[rows, width]`, valid in the chunks that are read.
    codes: Vec<[u16; CHANNELS]>,
    /// Whether each chunk is read, from left to right.
    is_read: Vec<bool>,
}

impl<'a, F: CaptureFiles> TiffRowReader<'a, F> {
    /// Opens a TIFF whose strips or rows of tiles take `max_bytes` at most.
    pub fn open_within(file: PictureFile<'a, F>, max_bytes: usize) -> Result<Self, CaptureError> {
        let source = BufReader::with_capacity(TAG_BYTES, file.open()?);
        let mut decoder = Decoder::new(source).map_err(|e| unreadable(&file, e))?;
        let layout = Layout::read(&mut decoder).map_err(|e| unreadable(&file, e))?;
        file.check_extent(layout.extent)?;
        if layout.extent.area() == 0 {
            return Err(file.unreadable("TIFF", "it has no pixels"));
        }
        let sample_type = layout.sample_type(max_bytes).map_err(|e| file.error(e))?;
        let record = IngestRecord::read(&mut decoder).map_err(|e| damaged_record(&file, e))?;
        if record.is_none() {
            // The decompressor reads through the buffer.
            let source = BufReader::with_capacity(READ_BYTES, file.open()?);
            decoder = Decoder::new(source).map_err(|e| unreadable(&file, e))?;
        }
        // Refuses strips and tiles whose compressed size is much more than the largest decoded one.
        let mut limits = Limits::default();
        limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(2 * max_bytes);
        decoder = decoder.with_limits(limits);
        Ok(Self {
            extent: layout.extent,
            chunk: layout.chunk,
            sample_type,
            record,
            read: None,
            next_row: 0,
            decoder,
            file,
        })
    }

    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// The codes of the next row, of which those outside of `columns` may be wrong; `None` after the last.
    pub fn next(
        &mut self,
        columns: impl Iterator<Item = Range<u32>>,
    ) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        if self.next_row >= self.extent.height {
            return Ok(None);
        }
        let (index, row) = (
            self.next_row / self.chunk.height,
            self.next_row % self.chunk.height,
        );
        let width = self.extent.width as usize;
        let mut read = match self.read.take() {
            Some(read) if read.index == index => read,
            last => self.start_rows(index, last),
        };
        for columns in columns.filter(|columns| !columns.is_empty()) {
            for i in columns.start / self.chunk.width..=(columns.end - 1) / self.chunk.width {
                if !read.is_read[i as usize] {
                    self.read_chunk(i, &mut read)?;
                    read.is_read[i as usize] = true;
                }
            }
        }
        self.next_row += 1;
        let rows = self.read.insert(read).codes.chunks_exact(width);
        Ok({ rows }.nth(row as usize))
    }

    /// The rows of number `index`, of which nothing is read, in the memory of the `last`.
    fn start_rows(&self, index: u32, last: Option<ChunkRow>) -> ChunkRow {
        let (mut codes, mut is_read) =
            last.map_or_else(Default::default, |last| (last.codes, last.is_read));
        let rows = self.row_range(index).len();
        codes.resize(self.extent.width as usize * rows, [0; CHANNELS]);
        is_read.clear();
        is_read.resize(self.chunks_across() as usize, false);
        ChunkRow {
            index,
            codes,
            is_read,
        }
    }

    fn chunks_across(&self) -> u32 {
        self.extent.width.div_ceil(self.chunk.width)
    }

    /// The rows of the photograph that the chunks of number `index` from the top have.
    fn row_range(&self, index: u32) -> Range<u32> {
        let first = index * self.chunk.height;
        first..self.extent.height.min(first + self.chunk.height)
    }

    /// Reads the chunk of number `i` from the left into `read`.
    fn read_chunk(&mut self, i: u32, read: &mut ChunkRow) -> Result<(), CaptureError> {
        let number = read.index * self.chunks_across() + i;
        let rows = self.row_range(read.index);
        let first = i * self.chunk.width;
        let columns = first..self.extent.width.min(first + self.chunk.width);
        let is_whole = columns.len() == self.extent.width as usize;
        let mut own = Vec::new();
        let codes = match is_whole {
            true => read.codes.as_flattened_mut(),
            false => {
                own.resize(columns.len() * rows.len(), [0; CHANNELS]);
                own.as_flattened_mut()
            }
        };
        let place = || {
            let rows = format!("rows {} to {}", rows.start, rows.end - 1);
            match is_whole {
                true => rows,
                false => format!("{rows}, columns {} to {}", columns.start, columns.end - 1),
            }
        };
        if self.sample_type == SampleType::U16 {
            let bytes = bytemuck::cast_slice_mut(codes);
            let done = self.decoder.read_chunk_bytes(number, bytes);
            done.map_err(|e| unreadable(&self.file, e))?;
        } else {
            let mut bytes = vec![0; codes.len() * self.sample_type.bytes()];
            let done = self.decoder.read_chunk_bytes(number, &mut bytes);
            done.map_err(|e| unreadable(&self.file, e))?;
            if self.sample_type.codes(&bytes, codes).is_none() {
                let reason = format!("there is a sample that is not a number in {}", place());
                return Err(self.file.unreadable("TIFF", reason));
            }
        }
        if let Some(record) = &self.record {
            let checksum = crc32c::crc32c(bytemuck::cast_slice(codes));
            if record.checksums.get(number as usize) != Some(&checksum) {
                return Err(self.file.error(CaptureErrorKind::WrongChecksum(place())));
            }
        }
        let width = self.extent.width as usize;
        let parts = { own.chunks_exact(columns.len()) }.zip(read.codes.chunks_exact_mut(width));
        for (part, row) in parts {
            row[columns.start as usize..columns.end as usize].copy_from_slice(part);
        }
        Ok(())
    }

    /// Whether the file has a record.
    pub fn is_recorded(&self) -> bool {
        self.record.is_some()
    }

    /// Makes row `y` the next one.
    pub fn skip_to(&mut self, y: u32) {
        self.next_row = y;
    }

    pub fn release(&mut self) {
        self.read = None;
    }

    /// The statistics by the record, if there is one.
    pub fn statistics(
        mut self,
        saturated_from: [u32; CHANNELS],
    ) -> Result<Option<CodeStatistics>, CaptureError> {
        let Some(record) = &self.record else {
            return Ok(None);
        };
        let statistics = record.statistics(&mut self.decoder, saturated_from);
        { statistics.map(Some) }.map_err(|e| damaged_record(&self.file, e))
    }
}

fn unreadable<F: CaptureFiles>(file: &PictureFile<'_, F>, error: TiffError) -> CaptureError {
    match error {
        // The disk or the network is at fault, not the file.
        TiffError::IoError(e) if e.raw_os_error().is_some() => file.io_error(e),
        TiffError::IoError(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            file.unreadable("TIFF", "it is cut off or damaged")
        }
        error => file.unreadable("TIFF", error),
    }
}

fn damaged_record<F: CaptureFiles>(file: &PictureFile<'_, F>, error: TiffError) -> CaptureError {
    let error = unreadable(file, error);
    match error.problem {
        CaptureErrorKind::Unreadable(..) => {
            file.error(CaptureErrorKind::WrongChecksum("its record".to_owned()))
        }
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::io::Cursor;
    use std::path::PathBuf;

    use tiff::encoder::colortype::{
        ColorType, Gray16, Gray32Float, RGB8, RGB16, RGB32Float, RGB64Float, RGBA16,
    };
    use tiff::encoder::{Compression, TiffEncoder, TiffKindBig, TiffValue};
    use tiff::tags::{ExtraSamples, PhotometricInterpretation, SampleFormat};

    use super::super::ingest;
    use super::*;
    use crate::capture::IngestSource;
    use crate::capture::camera_pixel_set::CameraPixelSet;
    use crate::capture::camera_row_set::CameraRowSet;
    use crate::capture::{CaptureFolder, Manifest};
    use crate::transport::TileRect;

    const WIDTH: u32 = 20;
    const HEIGHT: u32 = 300;
    /// Where tiles begin: after the header and the values of tags that are known before.
    const TILES_START: usize = 36;

    /// Files in memory that count the bytes that are read.
    #[derive(Clone, Default)]
    struct CountedFiles {
        files: BTreeMap<String, Vec<u8>>,
        bytes: Cell<usize>,
    }

    impl CaptureFiles for CountedFiles {
        fn size(&self, name: &str) -> io::Result<u64> {
            let file = self.files.get(name).ok_or(io::ErrorKind::NotFound)?;
            Ok(file.len() as u64)
        }

        fn read(&self, name: &str, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
            let file = self.files.get(name).ok_or(io::ErrorKind::NotFound)?;
            let rest = file.get(offset as usize..).unwrap_or_default();
            let count = rest.len().min(buffer.len());
            buffer[..count].copy_from_slice(&rest[..count]);
            self.bytes.set(self.bytes.get() + count);
            Ok(count)
        }

        fn path(&self, name: &str) -> PathBuf {
            name.into()
        }
    }

    fn codes() -> Vec<u16> {
        codes_of(Extent::new(WIDTH, HEIGHT))
    }

    fn codes_of(extent: Extent) -> Vec<u16> {
        let code = |i: u32| (i.wrapping_mul(2_654_435_761) >> 17) as u16;
        (0..extent.area() as u32 * 3).map(code).collect()
    }

    fn tiff<C: ColorType>(
        samples: &[C::Inner],
        strip_rows: u32,
        compression: Compression,
    ) -> Vec<u8>
    where
        [C::Inner]: TiffValue,
    {
        let mut file = Cursor::new(Vec::new());
        let encoder = TiffEncoder::new(&mut file).unwrap();
        let mut encoder = encoder.with_compression(compression);
        let mut image = encoder.new_image::<C>(WIDTH, HEIGHT).unwrap();
        image.rows_per_strip(strip_rows).unwrap();
        image.write_data(samples).unwrap();
        file.into_inner()
    }

    /// Half-precision numbers, by their bits: the encoder has no such type.
    struct Rgb16Float;

    impl ColorType for Rgb16Float {
        type Inner = u16;
        const TIFF_VALUE: PhotometricInterpretation = PhotometricInterpretation::RGB;
        const BITS_PER_SAMPLE: &'static [u16] = &[16; 3];
        const SAMPLE_FORMAT: &'static [SampleFormat] = &[SampleFormat::IEEEFP; 3];

        fn horizontal_predict(_: &[u16], _: &mut Vec<u16>) {
            unreachable!("no predictor is set")
        }
    }

    /// A capture whose dark frame is the photograph `name` with these bytes.
    fn capture(name: &str, bytes: Vec<u8>) -> CaptureFolder<CountedFiles> {
        capture_of(Extent::new(WIDTH, HEIGHT), name, bytes)
    }

    fn capture_of(extent: Extent, name: &str, bytes: Vec<u8>) -> CaptureFolder<CountedFiles> {
        let mut manifest = Manifest {
            version: 1,
            dark: Some(name.to_owned()),
            shots: vec![Default::default()],
            ..Manifest::default()
        };
        (manifest.camera.width, manifest.camera.height) = (extent.width, extent.height);
        (manifest.light.width, manifest.light.height) = (1, 1);
        (manifest.light.gamma, manifest.camera.white) = (Some(1.0), 30_000.0);
        manifest.shots[0].photo = name.to_owned();
        let json = serde_json::to_vec(&manifest).unwrap();
        let files = BTreeMap::from([("capture.json".to_owned(), json), (name.to_owned(), bytes)]);
        CaptureFolder::from_files(CountedFiles {
            files,
            ..CountedFiles::default()
        })
        .unwrap()
    }

    fn source() -> IngestSource {
        IngestSource {
            name: "a.png".to_owned(),
            bytes: 9,
            sha256: "00".to_owned(),
        }
    }

    fn ingested(capture: &CaptureFolder<CountedFiles>) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let listed = capture.manifest().photographs()[0];
        capture.ingest(listed, &source(), &mut out).unwrap();
        out.into_inner()
    }

    /// As bits: saturated samples are NaN.
    fn bits(photo: &[[f32; CHANNELS]]) -> Vec<[u32; CHANNELS]> {
        photo.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
    }

    fn read_all(capture: &CaptureFolder<CountedFiles>) -> (Vec<[u32; CHANNELS]>, CodeStatistics) {
        let dark = capture.read_dark(&CameraPixelSet::all(capture.manifest().camera.extent()));
        let shot = capture.open_shot(0).unwrap();
        let (photo, statistics) = shot.read_all(&dark.unwrap()).unwrap();
        (bits(&photo), statistics)
    }

    #[test]
    fn tiffs_of_all_strips_and_compressions_have_the_same_codes() {
        let codes = codes();
        let expected = read_all(&capture(
            "a.tif",
            tiff::<RGB16>(&codes, 1, Compression::Uncompressed),
        ));
        assert!(expected.1.saturated > 0);
        for compression in [
            Compression::Uncompressed,
            Compression::Lzw,
            Compression::Deflate(Default::default()),
            Compression::Packbits,
        ] {
            for strip_rows in [7, 16, HEIGHT] {
                let capture = capture("a.tif", tiff::<RGB16>(&codes, strip_rows, compression));
                assert!(read_all(&capture) == expected, "{strip_rows} rows");
                let again = self::capture("a.tif", ingested(&capture));
                assert!(read_all(&again) == expected);
                let mut big = Cursor::new(Vec::new());
                let listed = capture.listed(capture.manifest().photographs()[0]);
                ingest::write::<_, _, TiffKindBig>(
                    listed.open_codes().unwrap(),
                    &source(),
                    &mut big,
                )
                .unwrap();
                let big = big.into_inner();
                assert_eq!(&big[..4], b"II+\0");
                assert!(read_all(&self::capture("a.tif", big)) == expected);
            }
        }
    }

    #[test]
    fn floating_point_numbers_are_read_as_codes() {
        let codes = codes();
        let none = Compression::Uncompressed;
        let expected = read_all(&capture("a.tif", tiff::<RGB16>(&codes, 16, none)));
        let mut samples: Vec<f32> = { codes.iter() }
            .map(|code| f32::from(*code) / 65_535.0)
            .collect();
        let deflate = Compression::Deflate(Default::default());
        for compression in [none, Compression::Lzw, deflate] {
            let float = capture("a.tif", tiff::<RGB32Float>(&samples, 7, compression));
            assert!(read_all(&float) == expected);
            assert!(read_all(&capture("a.tif", ingested(&float))) == expected);
        }
        let halves: Vec<u16> = { samples.iter() }
            .map(|sample| half::f16::from_f32(*sample).to_bits())
            .collect();
        let half = capture("a.tif", tiff::<Rgb16Float>(&halves, 7, none));
        let rounded: Vec<f32> = { halves.iter() }
            .map(|bits| half::f16::from_bits(*bits).to_f32())
            .collect();
        let single = capture("a.tif", tiff::<RGB32Float>(&rounded, 7, none));
        assert!(read_all(&half) == read_all(&single));
        samples[3 * WIDTH as usize * 30] = f32::NAN;
        let bytes = tiff::<RGB32Float>(&samples, 16, none);
        let float = capture("a.tif", bytes);
        let rows = CameraPixelSet::row_range(16..32, WIDTH);
        let said = float.read_dark(&rows).map(drop).unwrap_err().to_string();
        assert!(
            said.contains("there is a sample that is not a number in rows 16 to 31"),
            "{said}"
        );
    }

    #[test]
    fn rows_of_an_ingested_photograph_are_read_without_the_others() {
        let whole = capture(
            "a.tif",
            tiff::<RGB16>(&codes(), 50, Compression::Uncompressed),
        );
        let (expected, statistics) = read_all(&whole);
        let ingested = capture("a.tif", ingested(&whole));
        let strips = [3..20, 100..130, 290..300];
        let rows = CameraRowSet::from_strips(strips);
        let pixels = CameraPixelSet::of_rows(rows.clone(), WIDTH);
        let read = |capture: &CaptureFolder<CountedFiles>| {
            let dark = capture.read_dark(&pixels).unwrap();
            let before = capture.files.bytes.get();
            let (mut reader, mut photo) = (capture.open_shot(0).unwrap(), Vec::new());
            for end in [25, 115, HEIGHT] {
                let above = rows.iter().filter(|y| *y < end).map(|y| y..y + 1);
                let part = CameraPixelSet::of_rows(CameraRowSet::from_strips(above), WIDTH);
                reader.read(&part, &dark, &mut photo).unwrap();
            }
            let statistics = reader.finish().unwrap();
            (photo, statistics, capture.files.bytes.get() - before)
        };
        let (photo, found, bytes) = read(&ingested);
        let width = WIDTH as usize;
        let own = rows
            .iter()
            .flat_map(|y| &expected[y as usize * width..][..width]);
        let own: Vec<_> = own.copied().collect();
        assert_eq!(bits(&photo), own);
        assert_eq!(found, statistics);
        // Tiles of 16 rows and 32 columns: 0 to 31, 96 to 143, 288 to 299; and the record.
        let record = ingested.files.files["a.tif"].len() - codes().len() * 2;
        let tiles = (32 + 48 + 12) * 32 * 6;
        assert!(
            (tiles..tiles + record + (8 << 10)).contains(&bytes),
            "{bytes}"
        );
        let (photo, found, bytes) = read(&whole);
        assert_eq!((bits(&photo), found), (own, statistics));
        assert!(bytes > codes().len() * 2);
    }

    #[test]
    fn tiles_of_an_ingested_photograph_are_read_without_the_others() {
        // Three tiles of 704 columns with padding, three of 16 rows.
        let extent = Extent::new(2100, 48);
        let tile_bytes = 704 * 16 * 6;
        let codes = codes_of(extent);
        let whole = capture_of(extent, "a.tif", {
            let mut file = Cursor::new(Vec::new());
            let mut encoder = TiffEncoder::new(&mut file).unwrap();
            let image = encoder.new_image::<RGB16>(extent.width, extent.height);
            let mut image = image.unwrap();
            image.rows_per_strip(9).unwrap();
            image.write_data(&codes).unwrap();
            file.into_inner()
        });
        let bytes = ingested(&whole);
        let tiled = capture_of(extent, "a.tif", bytes.clone());
        let expected = read_all(&whole);
        assert!(read_all(&tiled) == expected);
        // Without the record: any tiled TIFF.
        let record = { bytes.windows(2) }.rposition(|tag| tag == 65103u16.to_le_bytes());
        let mut common = bytes.clone();
        common[record.unwrap()] ^= 4; // no tag of ours
        let common = capture_of(extent, "a.tif", common);
        assert!(read_all(&common) == expected);
        let rect = |x, y, width, height| TileRect {
            x,
            y,
            extent: Extent::new(width, height),
        };
        for (rects, tiles) in [
            (vec![rect(5, 3, 20, 9)], 1),
            (vec![rect(700, 14, 8, 4)], 4),
            (vec![rect(2090, 35, 10, 5)], 1),
            (vec![rect(5, 0, 8, 20), rect(2090, 2, 10, 5)], 3),
            (vec![rect(0, 17, 2100, 2)], 3),
            (Vec::new(), 0),
        ] {
            let pixels = CameraPixelSet::union(extent, &rects);
            let own = { pixels.rects() }.flat_map(TileRect::pixels);
            let own: Vec<_> = own.map(|pixel| expected.0[extent.index(pixel)]).collect();
            for (capture, is_recorded) in [(&tiled, true), (&common, false)] {
                let dark = capture.read_dark(&pixels).unwrap();
                let before = capture.files.bytes.get();
                let mut photo = Vec::new();
                let mut reader = capture.open_shot(0).unwrap();
                reader.read(&pixels, &dark, &mut photo).unwrap();
                assert_eq!(bits(&photo), own);
                assert_eq!(reader.finish().unwrap(), expected.1);
                let read = (capture.files.bytes.get() - before) / tile_bytes;
                // Through a buffer without a record.
                let is_right = if is_recorded {
                    read == tiles
                } else {
                    read >= 9
                };
                assert!(is_right, "{read} {rects:?}");
            }
        }
        // Row 16, column 704: the second tile of the second row.
        let mut damaged = bytes;
        damaged[TILES_START + 4 * tile_bytes] ^= 1;
        let damaged = capture_of(extent, "a.tif", damaged);
        let pixels = |x| CameraPixelSet::union(extent, &[rect(x, 20, 4, 4)]);
        assert!(damaged.read_dark(&pixels(700)).is_ok());
        let said = damaged.read_dark(&pixels(701)).map(drop).unwrap_err();
        let said = said.to_string();
        assert!(
            said.contains("has a wrong checksum in rows 16 to 31, columns 704 to 1407"),
            "{said}"
        );
    }

    #[test]
    fn damage_is_told_by_its_rows() {
        let whole = ingested(&capture(
            "a.tif",
            tiff::<RGB16>(&codes(), 50, Compression::Uncompressed),
        ));
        let fault = |bytes: Vec<u8>| {
            let capture = capture("a.tif", bytes);
            let dark = capture.read_dark(&CameraPixelSet::row_range(16..32, WIDTH));
            dark.map(drop).map_err(|e| e.to_string())
        };
        let damaged = |at: usize| {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            fault(bytes)
        };
        let row_bytes = 32 * 6;
        assert_eq!(damaged(TILES_START + 15 * row_bytes), Ok(()));
        let said = damaged(TILES_START + 16 * row_bytes).unwrap_err();
        assert!(
            said.contains("has a wrong checksum in rows 16 to 31"),
            "{said}"
        );
        let said = fault(whole[..whole.len() / 2].to_vec()).unwrap_err();
        assert!(
            said.contains("is not a readable TIFF: it is cut off"),
            "{said}"
        );
        // The text that names the source.
        let at = whole
            .windows(5)
            .position(|bytes| bytes == b"a.png")
            .unwrap();
        let said = damaged(at).unwrap_err();
        assert!(
            said.contains("has a wrong checksum in its record"),
            "{said}"
        );
    }

    #[test]
    fn other_types_of_samples_are_named() {
        let (area, none) = ((WIDTH * HEIGHT) as usize, Compression::Uncompressed);
        for (bytes, expected) in [
            (tiff::<RGB8>(&vec![0; 3 * area], 16, none), "8-bit RGB"),
            (tiff::<Gray16>(&vec![0; area], 16, none), "16-bit grey"),
            (
                tiff::<RGBA16>(&vec![0; 4 * area], 16, none),
                "16-bit RGB with alpha",
            ),
            (
                tiff::<Gray32Float>(&vec![0.0; area], 16, none),
                "32-bit floating-point grey",
            ),
            (
                tiff::<RGB64Float>(&vec![0.0; 3 * area], 16, none),
                "64-bit floating-point RGB",
            ),
        ] {
            let error = capture("a.tif", bytes).open_shot(0).map(drop).unwrap_err();
            assert!(
                matches!(&error.problem, CaptureErrorKind::PhotoType(found) if found == expected)
            );
        }
        // A fourth sample that is no alpha channel.
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut image = encoder.new_image::<RGB16>(WIDTH, HEIGHT).unwrap();
        image.extra_samples(&[ExtraSamples::Unspecified]).unwrap();
        image.rows_per_strip(16).unwrap();
        image.write_data(&vec![0; 4 * area]).unwrap();
        let four = capture("a.tif", file.into_inner());
        let error = four.open_shot(0).map(drop).unwrap_err();
        let expected = "16-bit RGB with 4 samples a pixel";
        assert!(matches!(&error.problem, CaptureErrorKind::PhotoType(found) if found == expected));
    }
}
