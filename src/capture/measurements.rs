//! The linear system that recovery solves: `Y = PT` for each channel, with `L` patterns `P` `[L, M]` and their
//! photographs `Y` `[L, N]`.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::camera_pixel_set::CameraPixelSet;
use super::noise_model::NoiseModel;
use crate::transport::{CHANNELS, CameraPixel, Correspondence, Extent, TileRect};

/// The emission of each light element during one shot, `[M]`, row by row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Pattern {
    /// One plane for all channels.
    Grey(Vec<f32>),
    /// Red, green, blue. Each camera channel is assumed to respond to its own primary only.
    Rgb([Vec<f32>; CHANNELS]),
}

impl Pattern {
    /// The emission that camera channel `c` responds to.
    pub fn plane(&self, c: usize) -> &[f32] {
        match self {
            Self::Grey(plane) => plane,
            Self::Rgb(planes) => &planes[c],
        }
    }

    /// Whether elements lie between the darkest and the brightest of a plane, so that their emission depends on the
    /// display's exponent.
    pub fn has_grey_levels(&self) -> bool {
        (0..CHANNELS).any(|c| {
            let plane = self.plane(c);
            let darkest = plane.iter().copied().fold(f32::INFINITY, f32::min);
            let brightest = plane.iter().copied().fold(0.0, f32::max);
            plane.iter().any(|e| *e > darkest && *e < brightest)
        })
    }

    /// The emission that each camera channel responds to, `[M, 3]`.
    pub fn rgb(&self) -> Vec<f32> {
        let element = |m| [0, 1, 2].map(|c| self.plane(c)[m]);
        (0..self.plane(0).len()).flat_map(element).collect()
    }
}

/// Camera pixels of a photograph as measurements, row by row; NaN where saturated.
pub type LinearPhoto = Vec<[f32; CHANNELS]>;

/// Patterns and the loaded pixels of their photographs, in linear units.
///
/// Large photographs need not be in memory whole: `loaded` lists the loaded camera pixels. While a recovery is prepared
/// they include the [pixels that the preparation reads](crate::recover::preparation_pixels), while a tile is recovered the
/// tile and the rows around it that its recovery asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurements {
    /// The camera grid, `N` pixels.
    pub camera: Extent,
    /// The light plane, `M` elements.
    pub light: Extent,
    /// Maps camera pixels to light elements.
    pub correspondence: Correspondence,
    /// `L` patterns of `M` elements.
    pub patterns: Vec<Pattern>,
    /// For each pattern the measurement at which a sample saturates: 1 / exposure.
    pub full_scale: Vec<f32>,
    /// The loaded camera pixels.
    pub loaded: CameraPixelSet,
    /// These pixels of the `L` photographs.
    pub photos: Vec<LinearPhoto>,
    /// These pixels of the photograph with all light elements lit, if there is one. Nothing is recovered from it.
    pub flood: Option<LinearPhoto>,
    /// Variance of the samples.
    pub noise: NoiseModel,
}

impl Measurements {
    /// Whether every pattern is grey, so that all channels have the same equations.
    pub fn is_grey(&self) -> bool {
        self.patterns.iter().all(|p| matches!(p, Pattern::Grey(_)))
    }

    /// The planes of the patterns with the camera channels that respond to each: one plane for all channels if every
    /// pattern is grey.
    pub fn planes(&self) -> impl Iterator<Item = (usize, Range<usize>)> + use<> {
        let grey = self.is_grey();
        let channels = move |plane| if grey { 0..CHANNELS } else { plane..plane + 1 };
        (0..if grey { 1 } else { CHANNELS }).map(move |plane| (plane, channels(plane)))
    }

    /// Channel `c` of a pixel under pattern `l`; NaN if saturated or not loaded.
    pub fn sample(&self, l: usize, pixel: CameraPixel, c: usize) -> f64 {
        let pixel = self.pixel_index(pixel).map(|n| self.photos[l][n]);
        pixel.map_or(f64::NAN, |sample| f64::from(sample[c]))
    }

    /// Channel `c` of a pixel of the flood photograph; NaN if saturated, not loaded or without such a photograph.
    pub fn flood_sample(&self, pixel: CameraPixel, c: usize) -> f64 {
        let sample = self.pixel_index(pixel).zip(self.flood.as_ref());
        sample.map_or(f64::NAN, |(n, flood)| f64::from(flood[n][c]))
    }

    /// Index of a pixel in `photos`, if it is loaded.
    #[inline]
    pub fn pixel_index(&self, pixel: CameraPixel) -> Option<usize> {
        self.loaded.index_of(pixel)
    }

    /// Unloads all pixels and frees their memory.
    pub fn unload(&mut self) {
        self.loaded = CameraPixelSet::row_range(0..0, self.camera.width);
        self.photos.fill(LinearPhoto::new());
        self.flood = None;
    }

    /// Whether all pixels of a tile are loaded.
    pub fn has_tile(&self, rect: TileRect) -> bool {
        self.loaded.contains_all(rect)
    }

    /// Variance of a sample `y` of channel `c` under pattern `l`.
    pub fn variance(&self, l: usize, c: usize, y: f64) -> f64 {
        let exposure = f64::from(self.full_scale[l]).recip();
        self.noise.variance(c, y, exposure)
    }

    /// Number of pixels of a tile with fewer than `min_samples` unsaturated samples in some channel.
    pub fn count_overexposed_pixels(&self, rect: TileRect, min_samples: usize) -> usize {
        let is_overexposed = |pixel: &CameraPixel| {
            (0..CHANNELS).any(|c| {
                let samples = (0..self.photos.len()).map(|l| self.sample(l, *pixel, c));
                samples.filter(|y| !y.is_nan()).count() < min_samples
            })
        };
        rect.pixels().filter(is_overexposed).count()
    }
}
