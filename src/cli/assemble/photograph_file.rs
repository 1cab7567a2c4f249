//! Photographs as cameras and raw converters write them, turned into 16-bit linear RGB.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use image::{DynamicImage, ImageReader, Limits};

use super::photograph_list::is_photograph;
use crate::capture::{CameraResponse, ManifestCamera};
use crate::transport::{CHANNELS, Extent, TileRect};

/// Sides of the thumbnail that photographs are paired by.
const THUMBNAIL_SIDE: usize = 16;
/// Code of a saturated sample, and of white where a tone curve is undone.
const WHITE: u16 = u16::MAX;

/// How photographs become linear.
#[derive(Clone, Copy, Debug)]
pub struct DevelopSettings {
    /// Tone curve; `None` if it is not declared.
    pub response: Option<CameraResponse>,
    /// Code without light, of 16 bits.
    pub black: f64,
    /// Code at full scale.
    pub white: f64,
    /// Side of the squares of pixels that are averaged.
    pub bin: u32,
    /// The part of the picture that is kept, in pixels before averaging.
    pub crop: Option<TileRect>,
}

impl DevelopSettings {
    fn response(&self) -> CameraResponse {
        self.response.unwrap_or_default()
    }

    fn is_linear(&self) -> bool {
        self.response() == CameraResponse::Linear
    }

    /// The camera of developed photographs of this size.
    pub fn camera(&self, extent: Extent) -> ManifestCamera {
        let (black, white) = match self.is_linear() {
            true => (self.black, self.white),
            false => (0.0, f64::from(WHITE)),
        };
        ManifestCamera {
            width: extent.width,
            height: extent.height,
            black,
            white,
            ..ManifestCamera::default()
        }
    }
}

/// A photograph in 16 bits, linear.
pub struct DevelopedPhotograph {
    pub extent: Extent,
    /// `[N]`.
    pub codes: Vec<[u16; CHANNELS]>,
    /// Mean measurement of each part of the picture.
    pub thumbnail: Vec<f64>,
    /// Share of the samples that are saturated.
    pub saturated_share: f64,
    /// Whether the file has 8 bits a sample.
    pub is_eight_bit: bool,
}

/// Reads and develops the photograph at `path`.
pub fn develop(path: &Path, settings: &DevelopSettings) -> Result<DevelopedPhotograph> {
    read(path, settings).with_context(|| path.display().to_string())
}

/// Photographs of 600 megapixels are decoded; larger ones take too much memory.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(4 << 30);
    limits
}

fn read(path: &Path, settings: &DevelopSettings) -> Result<DevelopedPhotograph> {
    let mut reader = ImageReader::open(path)?.with_guessed_format()?;
    reader.limits(limits());
    ensure!(
        is_photograph(path),
        "is no PNG or TIFF; convert raw files to 16-bit linear TIFF first (docs/capture.md says how)"
    );
    let image = reader.decode().context("cannot be decoded")?;
    ensure!(
        !matches!(
            image,
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
        ),
        "has floating-point samples; export integers of 16 bits"
    );
    let is_eight_bit = matches!(
        image,
        DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_)
    );
    ensure!(
        !is_eight_bit || settings.response.is_some(),
        "has 8 bits a sample, mostly with a tone curve. Give --response srgb, or --response linear if it has none; 16-bit \
         linear photographs from raw files are far better"
    );
    let picture = image.into_rgb16();
    let (width, height) = picture.dimensions();
    let whole = TileRect {
        x: 0,
        y: 0,
        extent: Extent::new(width, height),
    };
    let rect = settings.crop.unwrap_or(whole);
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
    let extent = Extent::new(crop_width / settings.bin, crop_height / settings.bin);
    ensure!(
        extent.width > 0 && extent.height > 0,
        "has fewer pixels than --bin {} averages",
        settings.bin
    );
    let code = |x: u32, y: u32| picture.get_pixel(rect.x + x, rect.y + y).0;
    Ok(DevelopedPhotograph {
        is_eight_bit,
        ..averaged(extent, settings, code)
    })
}

/// Linearises codes and averages squares of them; `code` is that of a pixel before averaging.
fn averaged(
    extent: Extent,
    settings: &DevelopSettings,
    code: impl Fn(u32, u32) -> [u16; CHANNELS],
) -> DevelopedPhotograph {
    let (range, bin) = (settings.white - settings.black, settings.bin);
    let share = |code: u16| (f64::from(code) - settings.black) / range;
    let linear = |code: u16| match settings.is_linear() {
        true => f64::from(code),
        false => f64::from(WHITE) * settings.response().linearise(share(code)),
    };
    let measurement = |code: f64| match settings.is_linear() {
        true => (code - settings.black) / range,
        false => code / f64::from(WHITE),
    };
    let mut codes = Vec::with_capacity(extent.area());
    let mut sums = vec![[0.0; 2]; THUMBNAIL_SIDE * THUMBNAIL_SIDE];
    let mut saturated = 0;
    for (x, y) in extent.cells() {
        let mut total = [0.0; CHANNELS];
        let mut is_saturated = [false; CHANNELS];
        for (dx, dy) in Extent::new(bin, bin).cells() {
            let code = code(x * bin + dx, y * bin + dy);
            for c in 0..CHANNELS {
                total[c] += linear(code[c]);
                is_saturated[c] |= f64::from(code[c]) >= settings.white;
            }
        }
        let place = |at: u32, side: u32| at as usize * THUMBNAIL_SIDE / side as usize;
        let part = place(y, extent.height) * THUMBNAIL_SIDE + place(x, extent.width);
        codes.push(std::array::from_fn(|c| {
            let mean = total[c] / f64::from(bin * bin);
            sums[part][0] += measurement(mean);
            sums[part][1] += 1.0;
            match is_saturated[c] {
                true => {
                    saturated += 1;
                    WHITE
                }
                false => mean.round() as u16,
            }
        }));
    }
    let parts = sums.iter().filter(|[_, count]| *count > 0.0);
    DevelopedPhotograph {
        extent,
        thumbnail: parts.map(|[sum, count]| sum / count).collect(),
        saturated_share: f64::from(saturated) / (codes.len() * CHANNELS) as f64,
        is_eight_bit: false,
        codes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: DevelopSettings = DevelopSettings {
        response: None,
        black: 500.0,
        white: 60_000.0,
        bin: 2,
        crop: None,
    };

    #[test]
    fn squares_of_pixels_are_averaged_and_saturation_is_kept() {
        let code = |x: u32, y: u32| match (x, y) {
            (3, 1) => [60_000, 1000, 1000],
            (x, _) => [1000 + 100 * x as u16; CHANNELS],
        };
        let photo = averaged(Extent::new(2, 1), &SETTINGS, code);
        assert_eq!(photo.codes, [[1050; 3], [WHITE, 1175, 1175]]);
        assert!((photo.saturated_share - 1.0 / 6.0).abs() < 1e-12);
        let camera = SETTINGS.camera(photo.extent);
        assert_eq!(
            (camera.width, camera.black, camera.white),
            (2, 500.0, 60_000.0)
        );
        let expected = 550.0 / 59_500.0;
        assert!((photo.thumbnail[0] - expected).abs() < 1e-12);
    }

    #[test]
    fn a_tone_curve_is_undone_before_averaging() {
        let settings = DevelopSettings {
            response: Some(CameraResponse::Gamma(2.0)),
            black: 0.0,
            white: 65_535.0,
            ..SETTINGS
        };
        let code = |x: u32, _: u32| if x == 0 { [0; 3] } else { [32_768; 3] };
        let photo = averaged(Extent::new(1, 1), &settings, code);
        // Half of a quarter of white.
        assert!(photo.codes[0][0].abs_diff(8192) <= 1, "{:?}", photo.codes);
    }
}
