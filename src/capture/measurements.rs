//! Linear measurements: what recovery works on.

use std::ops::Range;

use super::{Noise, Rows};
use crate::transport::{CHANNELS, CameraPx, Correspondence, Extent, TileRect};

/// The light each element emitted during one shot, 1 at full brightness, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// The same for all channels.
    Grey(Vec<f32>),
    /// Red, green, blue. A camera channel is taken to see its own primary alone.
    Rgb([Vec<f32>; CHANNELS]),
}

impl Pattern {
    /// The emission that drives camera channel `c`.
    pub fn plane(&self, c: usize) -> &[f32] {
        match self {
            Self::Grey(plane) => plane,
            Self::Rgb(planes) => &planes[c],
        }
    }
}

/// What a photograph saw, `[rows, width]` for the camera rows at hand, in units of the measurement;
/// NaN where saturated.
pub type Picture = Vec<[f32; CHANNELS]>;

/// `Y = PT` as photographed: patterns in, pictures out, all in linear units.
///
/// Photographs of many megapixels need not be in memory whole: `rows` says which camera rows are at
/// hand. Whoever prepares a recovery may get strips spread over the picture, and must then look at
/// the tiles that are [covered](Self::covers) alone; whoever recovers a tile gets the tile's rows
/// and as many around it as was asked for.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// Camera grid, `N` pixels.
    pub camera: Extent,
    /// Light grid, `M` elements.
    pub light: Extent,
    /// Camera pixels to light elements.
    pub correspondence: Correspondence,
    /// `L` patterns of `M` elements.
    pub patterns: Vec<Pattern>,
    /// For each pattern, the measurement at which a sample saturates: 1 over the exposure.
    pub full_scale: Vec<f32>,
    /// The camera rows that `pictures` hold.
    pub rows: Rows,
    /// `L` pictures of the rows at hand. NaN where a sample was saturated and says nothing.
    pub pictures: Vec<Picture>,
    /// How noisy the samples are.
    pub noise: Noise,
}

impl Measurements {
    /// Whether every pattern is grey, so that channels share their equations.
    pub fn grey(&self) -> bool {
        self.patterns.iter().all(|p| matches!(p, Pattern::Grey(_)))
    }

    /// The planes of the patterns, each with the camera channels that it drives: one for all where
    /// every pattern is grey.
    pub fn planes(&self) -> impl Iterator<Item = (usize, Range<usize>)> + use<> {
        let grey = self.grey();
        (0..if grey { 1 } else { CHANNELS }).map(move |plane| match grey {
            true => (plane, 0..CHANNELS),
            false => (plane, plane..plane + 1),
        })
    }

    /// What channel `c` of a pixel saw under pattern `l`; NaN where saturated, and where the pixel's
    /// row is not at hand.
    pub fn sample(&self, l: usize, pixel: CameraPx, c: usize) -> f64 {
        let pixel = self.index(pixel).map(|n| self.pictures[l][n]);
        pixel.map_or(f64::NAN, |sample| f64::from(sample[c]))
    }

    /// Where `pictures` have a pixel, if its row is at hand.
    pub fn index(&self, pixel: CameraPx) -> Option<usize> {
        let row = self.rows.place(pixel.y)?;
        Some(row * self.camera.width as usize + pixel.x as usize)
    }

    /// Gives back the memory of all rows.
    pub fn forget_rows(&mut self) {
        self.rows = Rows::from_strips([]);
        for picture in &mut self.pictures {
            *picture = Picture::new();
        }
    }

    /// Whether all pixels of a tile are at hand.
    pub fn covers(&self, rect: TileRect) -> bool {
        self.rows.contains_all(rect.y..rect.y + rect.extent.height)
    }

    /// Variance of a sample of channel `c` under pattern `l` that came out as `y`.
    pub fn variance(&self, l: usize, c: usize, y: f64) -> f64 {
        let exposure = f64::from(self.full_scale[l]).recip();
        self.noise.variance(c, y, exposure)
    }

    /// What each pattern's equations count for, mean square 1: photon noise, the most of it, lets a
    /// sample's variance fall as the exposure grows.
    pub fn weights(&self) -> Vec<f64> {
        let exposures = || self.full_scale.iter().map(|&full| f64::from(full).recip());
        let mean = exposures().sum::<f64>() / self.full_scale.len() as f64;
        exposures()
            .map(|exposure| (exposure / mean).sqrt())
            .collect()
    }

    /// Pixels of the tile of which some channel is saturated in so nearly all photographs that fewer
    /// than `fewest` samples are left of it.
    pub fn overexposed_pixels(&self, rect: TileRect, fewest: usize) -> usize {
        let hopeless = |pixel: &CameraPx| {
            (0..CHANNELS).any(|c| {
                let samples = (0..self.pictures.len()).map(|l| self.sample(l, *pixel, c));
                samples.filter(|y| !y.is_nan()).count() < fewest
            })
        };
        rect.pixels().filter(hopeless).count()
    }
}
