//! TIFF photographs: linear RGB of 16-bit integers or floating-point numbers, in strips. With the record of [`IngestRecord`], rows are read without the others.

use std::io::BufReader;

use tiff::TiffError;
use tiff::decoder::{Decoder, Limits};

use super::files::{CaptureFile, CaptureFiles};
use super::ingest_record::IngestRecord;
use super::picture_file::PictureFile;
use super::tiff_layout::{Layout, SampleType};
use crate::capture::code_statistics::CodeStatistics;
use crate::capture::error::CaptureError;
use crate::transport::{CHANNELS, Extent};

/// Bytes that are read from a file at a time.
const READ_BYTES: usize = 1 << 16;
/// Bytes that are read for a tag: uncompressed strips do not go through the buffer.
pub(super) const TAG_BYTES: usize = 1 << 10;
/// Largest strip that is read: as many are in memory as photographs are read at once.
pub(super) const MAX_STRIP_BYTES: usize = 8 << 20;

/// The first picture of a TIFF, row by row from the top.
pub(super) struct TiffRowReader<'a, F: CaptureFiles> {
    file: PictureFile<'a, F>,
    decoder: Decoder<BufReader<CaptureFile<'a, F>>>,
    extent: Extent,
    strip_rows: u32,
    sample_type: SampleType,
    record: Option<IngestRecord>,
    /// The strip that was read last, until it is released.
    strip: Option<(u32, Vec<[u16; CHANNELS]>)>,
    next_row: u32,
}

impl<'a, F: CaptureFiles> TiffRowReader<'a, F> {
    /// Opens a TIFF whose strips take `max_bytes` at most.
    pub fn open_within(file: PictureFile<'a, F>, max_bytes: usize) -> Result<Self, CaptureError> {
        let source = BufReader::with_capacity(TAG_BYTES, file.open()?);
        let mut decoder = Decoder::new(source).map_err(|e| unreadable(&file, e))?;
        let layout = Layout::read(&mut decoder).map_err(|e| unreadable(&file, e))?;
        file.check_extent(layout.extent)?;
        if layout.extent.area() == 0 {
            return Err(file.unreadable("TIFF", "it has no pixels"));
        }
        let sample_type = layout.sample_type(max_bytes).map_err(|e| file.error(e))?;
        let record = IngestRecord::read(&mut decoder).map_err(|e| unreadable(&file, e))?;
        if record.is_none() {
            // The decompressor reads through the buffer.
            let source = BufReader::with_capacity(READ_BYTES, file.open()?);
            decoder = Decoder::new(source).map_err(|e| unreadable(&file, e))?;
        }
        // Refuses strips whose compressed size is more than twice the largest decoded one.
        let mut limits = Limits::default();
        limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(2 * max_bytes);
        decoder = decoder.with_limits(limits);
        Ok(Self {
            extent: layout.extent,
            strip_rows: layout.strip_rows,
            sample_type,
            record,
            strip: None,
            next_row: 0,
            decoder,
            file,
        })
    }

    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// The codes of the next row; `None` after the last.
    pub fn next(&mut self) -> Result<Option<&[[u16; CHANNELS]]>, CaptureError> {
        if self.next_row >= self.extent.height {
            return Ok(None);
        }
        let (i, row) = (
            self.next_row / self.strip_rows,
            self.next_row % self.strip_rows,
        );
        if self.strip.as_ref().is_none_or(|(read, _)| *read != i) {
            self.read_strip(i)?;
        }
        self.next_row += 1;
        let width = self.extent.width as usize;
        let strip = self
            .strip
            .iter()
            .flat_map(|(_, strip)| strip.chunks_exact(width));
        Ok({ strip }.nth(row as usize))
    }

    fn read_strip(&mut self, i: u32) -> Result<(), CaptureError> {
        // Strips have equal sizes, so the memory of the last is enough.
        let mut strip = self.strip.take().map_or(Vec::new(), |(_, strip)| strip);
        let first = i * self.strip_rows;
        let rows = self.strip_rows.min(self.extent.height - first);
        strip.resize(Extent::new(self.extent.width, rows).area(), [0; CHANNELS]);
        let codes = strip.as_flattened_mut();
        if self.sample_type == SampleType::U16 {
            let read = self
                .decoder
                .read_chunk_bytes(i, bytemuck::cast_slice_mut(codes));
            read.map_err(|e| unreadable(&self.file, e))?;
        } else {
            let mut bytes = vec![0; codes.len() * self.sample_type.bytes()];
            let read = self.decoder.read_chunk_bytes(i, &mut bytes);
            read.map_err(|e| unreadable(&self.file, e))?;
            if self.sample_type.codes(&bytes, codes).is_none() {
                let last = first + rows - 1;
                let reason = format!("rows {first} to {last} have a sample that is not a number");
                return Err(self.file.unreadable("TIFF", reason));
            }
        }
        if let Some(record) = &self.record {
            let checksum = crc32c::crc32c(bytemuck::cast_slice(codes));
            if record.checksums.get(i as usize) != Some(&checksum) {
                let last = first + rows - 1;
                let reason = format!("the checksum of rows {first} to {last} is wrong");
                return Err(self.file.unreadable("TIFF", reason));
            }
        }
        self.strip = Some((i, strip));
        Ok(())
    }

    /// See [`PhotographCodes::skip_to`](super::photograph_codes::PhotographCodes::skip_to).
    pub fn skip_to(&mut self, y: u32) -> bool {
        if self.record.is_some() {
            self.next_row = y;
        }
        self.record.is_some()
    }

    pub fn release(&mut self) {
        self.strip = None;
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
        statistics.map(Some).map_err(|e| unreadable(&self.file, e))
    }
}

fn unreadable<F: CaptureFiles>(file: &PictureFile<'_, F>, error: TiffError) -> CaptureError {
    match error {
        // The disk or the network is at fault, not the file.
        TiffError::IoError(e) if e.raw_os_error().is_some() => file.io_error(e),
        error => file.unreadable("TIFF", error),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::io::{self, Cursor};
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
    use crate::capture::error::CaptureErrorKind;
    use crate::capture::{CaptureFolder, Manifest};

    const WIDTH: u32 = 20;
    const HEIGHT: u32 = 300;
    /// Where strips begin: after the header and the resolution.
    const STRIPS_START: usize = 24;

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
        let code = |i: u32| (i.wrapping_mul(2_654_435_761) >> 17) as u16;
        (0..WIDTH * HEIGHT * 3).map(code).collect()
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
        let mut manifest = Manifest {
            version: 1,
            dark: Some(name.to_owned()),
            shots: vec![Default::default()],
            ..Manifest::default()
        };
        (manifest.camera.width, manifest.camera.height) = (WIDTH, HEIGHT);
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
        let dark = capture.read_dark(&CameraPixelSet::row_range(0..HEIGHT, WIDTH));
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
            said.contains("rows 16 to 31 have a sample that is not a number"),
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
        // Strips of 16 rows: 0 to 31, 96 to 143 with 112 to 127 twice, 288 to 299; and the record.
        let record = ingested.files.files["a.tif"].len() - codes().len() * 2;
        let strips = (32 + 64 + 12) * width * 6;
        assert!(
            (strips..strips + record + (8 << 10)).contains(&bytes),
            "{bytes}"
        );
        let (photo, found, bytes) = read(&whole);
        assert_eq!((bits(&photo), found), (own, statistics));
        assert!(bytes > codes().len() * 2);
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
        let row_bytes = WIDTH as usize * 6;
        assert_eq!(damaged(STRIPS_START + 15 * row_bytes), Ok(()));
        let said = damaged(STRIPS_START + 16 * row_bytes).unwrap_err();
        assert!(
            said.contains("the checksum of rows 16 to 31 is wrong"),
            "{said}"
        );
        let said = fault(whole[..whole.len() / 2].to_vec()).unwrap_err();
        assert!(said.contains("is not a readable TIFF"), "{said}");
        // The text that names the source.
        let at = whole
            .windows(5)
            .position(|bytes| bytes == b"a.png")
            .unwrap();
        let said = damaged(at).unwrap_err();
        assert!(
            said.contains("its record of ltm-export is damaged"),
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
