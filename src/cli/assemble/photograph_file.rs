//! Photographs as cameras and raw converters write them, turned into 16-bit linear RGB.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use super::lens_distortion::{LensDistortion, Tap};
use super::photograph_list::{is_picture, is_raw};
use super::rotation::Rotation;
use crate::capture::{CameraResponse, ManifestCamera};
use crate::photo_file::{PhotoSamples, RawConverter, decode_photo};
use crate::transport::{CHANNELS, Extent, TileRect};

/// Sides of the thumbnail that photographs are paired by.
const THUMBNAIL_SIDE: usize = 16;
/// The code of a saturated sample, and of white where samples become other codes.
const MAX_CODE: u16 = u16::MAX;
/// Photographs of 600 megapixels are decoded; larger ones take too much memory.
const MAX_SAMPLE_BYTES: u64 = 4 << 30;
/// Code of black of floating-point photographs, so that their noise below black is kept: down to 3 % of white.
const FLOAT_BLACK: f64 = 2048.0;
/// Share of the pixels that are equal to the largest in a pile: far more than of a bright part of an object, which has noise.
const MIN_PILE_PIXELS: f64 = 0.005;
/// The least weight of a saturated sample in a pixel that is saturated.
const MIN_SATURATING_WEIGHT: f64 = 1e-3;
/// Where a pile begins, as a share of white: a darker one would be of another cause.
const MIN_PILE_SHARE: f64 = 0.5;
/// Code from which on raw files are saturated, if none is given. The converter rounds down, and averages two greens of
/// which one may be saturated, so that white itself would miss some.
const RAW_WHITE: f64 = 65_000.0;

/// The samples of a photograph's file. Photographs of one capture have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SampleKind {
    /// Integers of 8 bits.
    EightBit,
    /// Integers of 16 or 32 bits.
    Integer,
    /// Floating-point numbers.
    Float,
    /// Those of a raw file, converted to 16 bits from the sensor's black to its white.
    Raw,
}

impl SampleKind {
    /// The sample of white, if none is given.
    fn default_white(self) -> f64 {
        match self {
            Self::EightBit | Self::Integer => f64::from(MAX_CODE),
            Self::Float => 1.0,
            Self::Raw => RAW_WHITE,
        }
    }
}

impl fmt::Display for SampleKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::EightBit => "8 bits a sample",
            Self::Integer => "integers of 16 or 32 bits",
            Self::Float => "floating-point samples",
            Self::Raw => "a camera's raw data",
        })
    }
}

/// How photographs become linear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DevelopSettings {
    /// Tone curve; `None` if it is not declared.
    pub response: Option<CameraResponse>,
    /// Sample without light; `None` if it is not declared.
    pub black: Option<f64>,
    /// Sample at full scale; `None` if it is not declared.
    pub white: Option<f64>,
    /// Side of the squares of pixels that are averaged.
    pub bin: u32,
    /// The lens whose distortion is undone, before a part is kept.
    #[serde(default)]
    pub undistort: Option<LensDistortion>,
    /// The part of the picture that is kept, in pixels before averaging.
    pub crop: Option<TileRect>,
    /// How the part that is kept is turned.
    #[serde(default)]
    pub rotate: Rotation,
}

/// The numbers of black and white.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Levels {
    black: f64,
    white: f64,
}

impl Levels {
    /// A number as a share of white.
    fn share(self, number: f64) -> f64 {
        (number - self.black) * (self.white - self.black).recip()
    }

    fn number(self, share: f64) -> f64 {
        self.black + share * (self.white - self.black)
    }
}

impl DevelopSettings {
    fn response(&self) -> CameraResponse {
        self.response.unwrap_or_default()
    }

    /// Levels of the samples in a photograph's file.
    fn stored(&self, kind: SampleKind) -> Result<Levels> {
        let black = self.black.unwrap_or(0.0);
        let white = self.white.unwrap_or(kind.default_white());
        ensure!(
            black < white,
            "has {kind}, whose white is {white}, but --black is {black}; give a --white above it"
        );
        if kind == SampleKind::Float {
            return Ok(Levels { black, white });
        }
        ensure!(
            black >= 0.0 && white <= f64::from(MAX_CODE),
            "has {kind}, of which --black and --white are codes from 0 to {MAX_CODE}"
        );
        if kind == SampleKind::Raw {
            ensure!(
                black == 0.0,
                "is a raw file, whose black level is subtracted already; leave --black out"
            );
            ensure!(
                self.response() == CameraResponse::Linear,
                "is a raw file, which is linear; leave --response out"
            );
        }
        Ok(Levels { black, white })
    }

    /// Levels of the codes in the capture: those of the file, if its samples can be kept.
    fn written(&self, kind: SampleKind, stored: Levels) -> Levels {
        let white = f64::from(MAX_CODE);
        match (self.response(), kind) {
            (CameraResponse::Linear, SampleKind::Float) => Levels {
                black: FLOAT_BLACK,
                white,
            },
            (CameraResponse::Linear, _) => stored,
            _ => Levels { black: 0.0, white },
        }
    }
}

/// A photograph in 16 bits, linear.
pub struct DevelopedPhotograph {
    /// Size and levels.
    pub camera: ManifestCamera,
    /// `[N]`.
    pub codes: Vec<[u16; CHANNELS]>,
    /// Mean measurement of each part of the picture.
    pub thumbnail: Vec<f64>,
    /// Share of the samples that are saturated.
    pub saturated_share: f64,
    /// Share of the samples that are too far below black for a code.
    pub clipped_share: f64,
    /// The sample at which many pile up below white, as if they were saturated.
    pub pile: Option<f64>,
    /// The samples of the file.
    pub kind: SampleKind,
}

/// Reads and develops the photograph at `path`. Temporary files go to the folder `scratch`.
pub fn develop(
    path: &Path,
    settings: &DevelopSettings,
    scratch: &Path,
) -> Result<DevelopedPhotograph> {
    let develop = || {
        let (samples, kind) = read(path, scratch)?;
        develop_samples(&samples, kind, settings)
    };
    develop().with_context(|| path.display().to_string())
}

fn read(path: &Path, scratch: &Path) -> Result<(PhotoSamples, SampleKind)> {
    if is_raw(path) {
        let samples = RawConverter::default().convert(path, scratch, MAX_SAMPLE_BYTES)?;
        return Ok((samples, SampleKind::Raw));
    }
    ensure!(
        is_picture(path),
        "is neither PNG, TIFF, OpenEXR nor a raw file by its name; convert it to 16-bit linear TIFF first (docs/capture.md says how)"
    );
    let file = File::open(path).context("cannot be read")?;
    let samples = decode_photo(BufReader::new(file), MAX_SAMPLE_BYTES)?;
    let kind = match (samples.is_float(), samples.is_eight_bit()) {
        (true, _) => SampleKind::Float,
        (_, true) => SampleKind::EightBit,
        _ => SampleKind::Integer,
    };
    Ok((samples, kind))
}

fn develop_samples(
    samples: &PhotoSamples,
    kind: SampleKind,
    settings: &DevelopSettings,
) -> Result<DevelopedPhotograph> {
    ensure!(
        kind != SampleKind::EightBit || settings.response.is_some(),
        "has 8 bits a sample, mostly with a tone curve. Give --response srgb, or --response linear if it has none; 16-bit \
         linear photographs or raw files are far better"
    );
    let development = Development::new(settings, kind)?;
    let rect = kept_part(samples.extent(), settings)?;
    let place = |x: u32, y: u32| {
        let (x, y) = settings.rotate.source(rect.extent, x, y);
        (rect.x + x, rect.y + y)
    };
    let extent = settings.rotate.extent(rect.extent);
    let sample = |x: u32, y: u32| samples.pixel(x, y);
    let averaged = match &settings.undistort {
        None => {
            let taps = |x: u32, y: u32| {
                let (x, y) = place(x, y);
                [Tap::whole(x, y)]
            };
            development.average(extent, taps, sample)
        }
        Some(lens) => {
            lens.check(samples.extent(), rect)?;
            let taps = |x: u32, y: u32| {
                let (x, y) = place(x, y);
                lens.taps(samples.extent(), x, y)
            };
            development.average(extent, taps, sample)
        }
    };
    let averaged = match averaged {
        Ok(averaged) => averaged,
        Err(NotANumber { x, y }) => bail!(
            "has a sample at ({x}, {y}) that is not a number, or minus infinity; export it again, or write 0 for pixels that the \
             converter cannot compute"
        ),
    };
    let count = (averaged.codes.len() * CHANNELS) as f64;
    let pile = averaged.pile(development.stored);
    Ok(DevelopedPhotograph {
        camera: ManifestCamera {
            width: averaged.extent.width,
            height: averaged.extent.height,
            black: development.written.black,
            white: development.written.white,
            ..ManifestCamera::default()
        },
        thumbnail: averaged.thumbnail,
        saturated_share: averaged.saturated as f64 / count,
        clipped_share: averaged.clipped as f64 / count,
        // With 8 bits, many samples have the same code anyway.
        pile: pile.filter(|_| kind != SampleKind::EightBit),
        codes: averaged.codes,
        kind,
    })
}

/// The part of a picture that is kept: whole squares of pixels.
fn kept_part(picture: Extent, settings: &DevelopSettings) -> Result<TileRect> {
    let Extent { width, height } = picture;
    let whole = TileRect {
        x: 0,
        y: 0,
        extent: picture,
    };
    let mut rect = settings.crop.unwrap_or(whole);
    let Extent {
        width: crop_width,
        height: crop_height,
    } = rect.extent;
    ensure!(
        u64::from(rect.x) + u64::from(crop_width) <= u64::from(width)
            && u64::from(rect.y) + u64::from(crop_height) <= u64::from(height),
        "has {width}x{height} pixels, but --crop keeps {crop_width}x{crop_height} from ({}, {}) on",
        rect.x,
        rect.y
    );
    let bin = settings.bin;
    ensure!(
        crop_width >= bin && crop_height >= bin,
        "has fewer pixels than --bin {bin} averages"
    );
    rect.extent = Extent::new(crop_width / bin * bin, crop_height / bin * bin);
    Ok(rect)
}

/// The part of a thumbnail that pixel (x, y) of a photograph belongs to.
pub fn thumbnail_part(photograph: Extent, x: u32, y: u32) -> usize {
    let parts = |side: u32| THUMBNAIL_SIDE.min(side as usize);
    let place = |at: u32, side: u32| at as usize * parts(side) / side as usize;
    let Extent { width, height } = photograph;
    place(y, height) * parts(width) + place(x, width)
}

/// The largest sample of a channel, and how many samples are equal to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LargestSample {
    sample: f64,
    count: usize,
}

impl LargestSample {
    fn add(&mut self, sample: f64) {
        if sample > self.sample {
            *self = Self { sample, count: 0 };
        }
        self.count += usize::from(sample == self.sample);
    }
}

/// How samples become codes.
struct Development {
    stored: Levels,
    written: Levels,
    response: CameraResponse,
    bin: u32,
    /// `[code]`: the measurements of integers that have a tone curve, which takes long to compute; else empty.
    measurements: Vec<f64>,
}

/// A weighted sum that stays within its terms: weights of cubic convolution may be negative.
struct InterpolatedPixel {
    sum: [f64; CHANNELS],
    range: [[f64; 2]; CHANNELS],
}

impl Default for InterpolatedPixel {
    fn default() -> Self {
        Self {
            sum: [0.0; CHANNELS],
            range: [[f64::INFINITY, f64::NEG_INFINITY]; CHANNELS],
        }
    }
}

impl InterpolatedPixel {
    fn add(&mut self, c: usize, weight: f64, measurement: f64) {
        self.sum[c] += weight * measurement;
        let [least, largest] = self.range[c];
        self.range[c] = [least.min(measurement), largest.max(measurement)];
    }

    /// 0 without terms.
    fn value(&self, c: usize) -> f64 {
        match self.range[c] {
            [least, largest] if least <= largest => self.sum[c].clamp(least, largest),
            _ => 0.0,
        }
    }
}

/// A pixel has a sample that is not a number, or minus infinity.
#[derive(Debug, PartialEq)]
struct NotANumber {
    x: u32,
    y: u32,
}

/// Linear codes, averaged.
#[derive(Debug, PartialEq)]
struct AveragedPhotograph {
    extent: Extent,
    codes: Vec<[u16; CHANNELS]>,
    thumbnail: Vec<f64>,
    saturated: usize,
    clipped: usize,
    /// Number of pixels that were read, some more than once.
    pixels: usize,
    largest: [LargestSample; CHANNELS],
}

impl AveragedPhotograph {
    /// The least sample at which a channel ends with many equal samples, below white, but not far below.
    fn pile(&self, stored: Levels) -> Option<f64> {
        let least = stored.number(MIN_PILE_SHARE);
        let is_pile = |largest: &&LargestSample| {
            (least..stored.white).contains(&largest.sample)
                && largest.count as f64 > MIN_PILE_PIXELS * self.pixels as f64
        };
        let piles = self.largest.iter().filter(is_pile);
        piles.map(|largest| largest.sample).min_by(f64::total_cmp)
    }
}

impl Development {
    fn new(settings: &DevelopSettings, kind: SampleKind) -> Result<Self> {
        let stored = settings.stored(kind)?;
        let mut development = Self {
            stored,
            written: settings.written(kind, stored),
            response: settings.response(),
            bin: settings.bin,
            measurements: Vec::new(),
        };
        let are_integers = matches!(kind, SampleKind::EightBit | SampleKind::Integer);
        if are_integers && development.response != CameraResponse::Linear {
            let measurements = (0..=MAX_CODE).map(|code| development.measurement(code.into()));
            development.measurements = measurements.collect();
        }
        Ok(development)
    }

    /// What a sample measures, as a share of white.
    fn measurement(&self, sample: f64) -> f64 {
        let code = sample as usize; // `as` saturates
        match self.measurements.get(code) {
            Some(measurement) if code as f64 == sample => *measurement,
            _ => {
                let share = self.stored.share(sample.min(self.stored.white));
                self.response.linearise(share)
            }
        }
    }

    /// Linearises samples and averages squares of pixels of a picture, each of which is the sum of its `taps`; `sample` gives those
    /// of the photograph. Samples at white or above, infinity included, are saturated, and so is every square that has one.
    fn average<T: IntoIterator<Item = Tap>>(
        &self,
        picture: Extent,
        taps: impl Fn(u32, u32) -> T,
        sample: impl Fn(u32, u32) -> [f64; CHANNELS],
    ) -> Result<AveragedPhotograph, NotANumber> {
        let bin = self.bin;
        let white = self.stored.white;
        let extent = Extent::new(picture.width / bin, picture.height / bin);
        let mut codes = Vec::with_capacity(extent.area());
        let mut sums =
            vec![[0.0; 2]; thumbnail_part(extent, extent.width - 1, extent.height - 1) + 1];
        let (mut saturated, mut clipped, mut pixels) = (0, 0, 0);
        let mut largest = [LargestSample::default(); CHANNELS];
        for (x, y) in extent.cells() {
            let mut total = [0.0; CHANNELS];
            let mut is_saturated = [false; CHANNELS];
            for (dx, dy) in Extent::new(bin, bin).cells() {
                let mut pixel = InterpolatedPixel::default();
                for Tap { x, y, weight } in taps(x * bin + dx, y * bin + dy) {
                    pixels += 1;
                    let sample = sample(x, y);
                    for c in 0..CHANNELS {
                        if sample[c].is_nan() || sample[c] == f64::NEG_INFINITY {
                            return Err(NotANumber { x, y });
                        }
                        largest[c].add(sample[c]);
                        is_saturated[c] |=
                            sample[c] >= white && weight.abs() >= MIN_SATURATING_WEIGHT;
                        pixel.add(c, weight, self.measurement(sample[c]));
                    }
                }
                (0..CHANNELS).for_each(|c| total[c] += pixel.value(c));
            }
            let part = thumbnail_part(extent, x, y);
            codes.push(std::array::from_fn(|c| {
                let measurement = total[c] / f64::from(bin * bin);
                sums[part][0] += measurement;
                sums[part][1] += 1.0;
                if is_saturated[c] {
                    saturated += 1;
                    return MAX_CODE;
                }
                let code = self.written.number(measurement).round();
                clipped += usize::from(code < 0.0);
                code as u16
            }));
        }
        Ok(AveragedPhotograph {
            extent,
            thumbnail: sums.iter().map(|[sum, count]| sum / count).collect(),
            codes,
            saturated,
            clipped,
            pixels,
            largest,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo_file::SampleValues;

    const SETTINGS: DevelopSettings = DevelopSettings {
        response: None,
        black: Some(500.0),
        white: Some(60_000.0),
        bin: 2,
        undistort: None,
        crop: None,
        rotate: Rotation::NONE,
    };

    /// With a tone curve, from 0 to the largest code.
    const SQUARE: DevelopSettings = DevelopSettings {
        response: Some(CameraResponse::Gamma(2.0)),
        black: None,
        white: None,
        ..SETTINGS
    };

    fn development(settings: &DevelopSettings, kind: SampleKind) -> Development {
        Development::new(settings, kind).unwrap()
    }

    fn whole(x: u32, y: u32) -> [Tap; 1] {
        [Tap::whole(x, y)]
    }

    #[test]
    fn pixels_are_sums_of_taps_and_saturated_with_one_of_them() {
        let settings = DevelopSettings { bin: 1, ..SETTINGS };
        let development = development(&settings, SampleKind::Integer);
        let taps = |x: u32, y: u32| {
            let taps = [(x, 0.75), (x + 1, 0.25)].map(|(x, weight)| Tap { x, y, weight });
            taps.into_iter().take(if x < 3 { 2 } else { 0 })
        };
        let samples = [1000.0, 2000.0, 4000.0, 60_000.0];
        let sample = |x: u32, _: u32| [samples[x as usize]; CHANNELS];
        let photo = development
            .average(Extent::new(4, 1), taps, sample)
            .unwrap();
        let codes: Vec<u16> = photo.codes.iter().map(|code| code[0]).collect();
        // The last has no taps, and is black.
        assert_eq!(codes, [1250, 2500, MAX_CODE, 500]);
        assert_eq!(photo.pixels, 6);
        // A sum that leaves the range of its samples, and a saturated sample that hardly counts.
        let taps = |x: u32, y: u32| {
            let weights = if x < 2 { [1.1, -0.1] } else { [0.9999, 0.0001] };
            [0, 1].map(|i| Tap {
                x: x + i,
                y,
                weight: weights[i as usize],
            })
        };
        let photo = development
            .average(Extent::new(3, 1), taps, sample)
            .unwrap();
        let codes: Vec<u16> = photo.codes.iter().map(|code| code[0]).collect();
        assert_eq!(codes, [1000, 2000, 4006]);
        assert_eq!(photo.saturated, 0);
    }

    #[test]
    fn the_undistorted_picture_is_cropped_then_turned() {
        let extent = Extent::new(12, 10);
        let value = |x: u32, y: u32| (1000 + 300 * x + 2000 * (y % 3)) as u16;
        let values = extent.cells().flat_map(|(x, y)| [value(x, y); CHANNELS]);
        let photograph =
            PhotoSamples::new(extent, SampleValues::U16(values.collect()), CHANNELS, false)
                .unwrap();
        let developed = |crop: Option<TileRect>, degrees: u32| {
            let settings = DevelopSettings {
                bin: 1,
                undistort: Some("10,10,5.5,4.5,-0.1,0.01".parse().unwrap()),
                crop,
                rotate: Rotation::from_degrees(degrees).unwrap(),
                ..SETTINGS
            };
            develop_samples(&photograph, SampleKind::Integer, &settings).unwrap()
        };
        let whole = developed(None, 0).codes;
        let crop = TileRect {
            x: 3,
            y: 2,
            extent: Extent::new(4, 6),
        };
        let turned = developed(Some(crop), 90);
        assert_eq!((turned.camera.width, turned.camera.height), (6, 4));
        for (i, (x, y)) in Extent::new(6, 4).cells().enumerate() {
            // Clockwise: the bottom left corner becomes the top left one.
            let (from_x, from_y) = (3 + y, 2 + 5 - x);
            assert_eq!(turned.codes[i], whole[(from_y * 12 + from_x) as usize]);
        }
    }

    #[test]
    fn squares_of_pixels_are_averaged_and_saturation_is_kept() {
        let sample = |x: u32, y: u32| match (x, y) {
            (3, 1) => [60_000.0, 1000.0, 1000.0],
            (x, _) => [1000.0 + 100.0 * f64::from(x); CHANNELS],
        };
        let development = development(&SETTINGS, SampleKind::Integer);
        let photo = development
            .average(Extent::new(4, 2), whole, sample)
            .unwrap();
        assert_eq!(photo.codes, [[1050; 3], [MAX_CODE, 1175, 1175]]);
        assert_eq!((photo.saturated, photo.clipped), (1, 0));
        assert_eq!(development.written, development.stored);
        let expected = 550.0 / 59_500.0;
        assert!((photo.thumbnail[0] - expected).abs() < 1e-12);
    }

    #[test]
    fn a_tone_curve_is_undone_before_averaging() {
        let sample = |x: u32, _: u32| if x == 0 { [0.0; 3] } else { [32_768.0; 3] };
        let photo = development(&SQUARE, SampleKind::EightBit);
        let photo = photo.average(Extent::new(2, 2), whole, sample).unwrap();
        // Half of a quarter of white.
        assert!(photo.codes[0][0].abs_diff(8192) <= 1, "{:?}", photo.codes);
    }

    #[test]
    fn integers_with_fractions_have_a_tone_curve_as_well() {
        let development = development(&SQUARE, SampleKind::Integer);
        for sample in [0.0, 0.5, 1000.0, 1000.25, 65_535.0, 70_000.0] {
            let expected = (sample / 65_535.0_f64).min(1.0).powi(2);
            let measurement = development.measurement(sample);
            assert!(
                (measurement - expected).abs() < 1e-12,
                "{sample}: {measurement}"
            );
        }
    }

    #[test]
    fn floating_point_noise_below_black_is_kept() {
        let settings = DevelopSettings {
            black: None,
            white: Some(4.0),
            bin: 1,
            ..SETTINGS
        };
        let development = development(&settings, SampleKind::Float);
        let values = [-0.05, 0.0, 1.0, f64::INFINITY, -1.0];
        let sample = |x: u32, _: u32| [values[x as usize]; CHANNELS];
        let photo = development
            .average(Extent::new(5, 1), whole, sample)
            .unwrap();
        let codes: Vec<u16> = photo.codes.iter().map(|code| code[0]).collect();
        // White is 63487 codes above black.
        assert_eq!(codes, [1254, 2048, 17_920, MAX_CODE, 0]);
        assert_eq!((photo.saturated, photo.clipped), (3, 3));
        assert!(photo.thumbnail.iter().all(|mean| mean.is_finite()));
        for invalid in [f64::NAN, f64::NEG_INFINITY] {
            let sample = |x: u32, _: u32| [0.0, 0.0, if x == 3 { invalid } else { 0.0 }];
            let refused = development.average(Extent::new(5, 1), whole, sample);
            assert_eq!(refused, Err(NotANumber { x: 3, y: 0 }));
        }
    }

    #[test]
    fn samples_that_pile_up_below_white_are_found() {
        let settings = DevelopSettings { bin: 1, ..SETTINGS };
        let development = development(&settings, SampleKind::Integer);
        let extent = Extent::new(100, 1);
        let pile = |largest: f64| {
            let sample = |x: u32, _: u32| [100.0, (1000.0 * f64::from(x)).min(largest), 60_000.0];
            let photo = development.average(extent, whole, sample).unwrap();
            photo.pile(development.stored)
        };
        assert_eq!(pile(50_000.0), Some(50_000.0));
        assert_eq!(pile(20_000.0), None);
        assert_eq!(pile(60_000.0), None);
    }

    #[test]
    fn levels_that_do_not_fit_the_samples_are_refused() {
        let error = |black, white, response, kind| {
            let settings = DevelopSettings {
                black,
                white,
                response,
                ..SETTINGS
            };
            settings.stored(kind).unwrap_err().to_string()
        };
        let curve = Some(CameraResponse::Srgb);
        for (message, part) in [
            (
                error(Some(2.0), None, None, SampleKind::Float),
                "--white above",
            ),
            (
                error(None, Some(7e4), None, SampleKind::Integer),
                "0 to 65535",
            ),
            (
                error(Some(-1.0), None, None, SampleKind::Integer),
                "0 to 65535",
            ),
            (
                error(Some(9.0), None, None, SampleKind::Raw),
                "leave --black out",
            ),
            (
                error(None, None, curve, SampleKind::Raw),
                "leave --response out",
            ),
        ] {
            assert!(message.contains(part), "{message}");
        }
    }
}
