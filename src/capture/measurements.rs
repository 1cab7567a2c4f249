//! Linear measurements: what recovery works on.

use super::Noise;
use crate::transport::{CHANNELS, CameraPx, Correspondence, Extent};

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

/// What a photograph saw, `[N]`, in units of the measurement; NaN where saturated.
pub type Picture = Vec<[f32; CHANNELS]>;

/// `Y = PT` as photographed: patterns in, pictures out, all in linear units.
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
    /// `L` pictures of `N` pixels, row by row. NaN where a sample was saturated and says nothing.
    pub pictures: Vec<Picture>,
    /// What every element at full brightness shows together, less the dark, where it was
    /// photographed; taken at exposure 1.
    pub flood: Option<Picture>,
    /// How noisy the samples are.
    pub noise: Noise,
}

impl Measurements {
    /// Whether every pattern is grey, so that channels share their equations.
    pub fn grey(&self) -> bool {
        self.patterns.iter().all(|p| matches!(p, Pattern::Grey(_)))
    }

    /// What channel `c` of a pixel saw under pattern `l`; NaN where saturated.
    pub fn sample(&self, l: usize, pixel: CameraPx, c: usize) -> f64 {
        f64::from(self.pictures[l][self.camera.index(pixel)][c])
    }

    /// Variance of a sample of channel `c` under pattern `l` that came out as `y`.
    pub fn variance(&self, l: usize, c: usize, y: f64) -> f64 {
        let exposure = f64::from(self.full_scale[l]).recip();
        self.noise.variance(c, y, exposure)
    }

    /// Pixels of which some channel is saturated in so nearly all photographs that fewer than
    /// `fewest` samples are left of it.
    pub fn overexposed_pixels(&self, fewest: usize) -> usize {
        let hopeless = |n: &usize| {
            (0..CHANNELS).any(|c| {
                let samples = self.pictures.iter();
                samples.filter(|picture| !picture[*n][c].is_nan()).count() < fewest
            })
        };
        (0..self.camera.area()).filter(hopeless).count()
    }

    /// Saturated samples, of `L · N · 3`.
    pub fn saturated(&self) -> usize {
        let samples = self.pictures.iter().flatten().flatten();
        samples.filter(|y| y.is_nan()).count()
    }
}
