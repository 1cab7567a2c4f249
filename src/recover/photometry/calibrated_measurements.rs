//! Measurements with every photograph corrected for its exposure, its stray light and its place.

use std::ops::Deref;

use serde::{Deserialize, Serialize};

use super::resampling::ResampledPhotographs;
use crate::capture::Measurements;
use crate::transport::CameraPixel;

/// Makes a photograph's samples those of a photograph without stray light, at the exposure and from the place of the
/// others: `scale · y + offset`, [resampled](super::resampling) where the picture is shifted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhotographCorrection {
    /// Inverse of the photograph's gain relative to the others.
    pub scale: f64,
    /// Added after scaling, in units of the measurement.
    pub offset: f64,
    /// Shift of the picture in camera pixels, to the right and down.
    pub shift: [f64; 2],
}

impl PhotographCorrection {
    /// Changes nothing.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        offset: 0.0,
        shift: [0.0; 2],
    };

    /// That of photograph `l` in a list of corrections, which is empty if no photograph needs one.
    pub(super) fn of(corrections: &[Self], l: usize) -> Self {
        corrections.get(l).copied().unwrap_or(Self::IDENTITY)
    }

    /// Whether the picture is shifted.
    pub fn is_shifted(self) -> bool {
        self.shift != [0.0; 2]
    }

    /// The sample, corrected for exposure and stray light.
    pub fn apply(self, y: f64) -> f64 {
        self.scale * y + self.offset
    }

    /// The sample before correction.
    pub(super) fn invert(self, corrected: f64) -> f64 {
        (corrected - self.offset) / self.scale
    }

    /// The photograph's exposure relative to the declared one.
    pub fn gain(self) -> f64 {
        self.scale.recip()
    }

    /// The light in the photograph that does not come from the light plane, in units of the measurement.
    pub fn stray_light(self) -> f64 {
        (0.0 - self.offset) / self.scale
    }
}

/// Measurements with a correction for each photograph.
#[derive(Clone, Copy, Debug)]
pub(in crate::recover) struct CalibratedMeasurements<'a> {
    measurements: &'a Measurements,
    /// One for each pattern, or none at all.
    corrections: &'a [PhotographCorrection],
    /// The samples of photographs that are shifted, and of the others.
    resampled: Option<&'a ResampledPhotographs<'a>>,
}

impl<'a> CalibratedMeasurements<'a> {
    /// Measurements corrected for exposures and stray light.
    pub fn new(measurements: &'a Measurements, corrections: &'a [PhotographCorrection]) -> Self {
        Self {
            measurements,
            corrections,
            resampled: None,
        }
    }

    /// The same measurements, corrected for shifts as well; only those of the resampled region can be used.
    pub fn with_resampled(self, resampled: Option<&'a ResampledPhotographs<'a>>) -> Self {
        Self { resampled, ..self }
    }

    /// Measurements as they are.
    pub fn uncorrected(measurements: &'a Measurements) -> Self {
        Self::new(measurements, &[])
    }

    fn correction(&self, l: usize) -> PhotographCorrection {
        PhotographCorrection::of(self.corrections, l)
    }

    /// Channel `c` of a pixel under pattern `l`; NaN if saturated or not loaded.
    pub fn sample(&self, l: usize, pixel: CameraPixel, c: usize) -> f64 {
        if let Some(resampled) = self.resampled {
            return resampled.sample(l, pixel, c);
        }
        let y = self.measurements.sample(l, pixel, c);
        self.correction(l).apply(y)
    }

    /// The same under each of the patterns. Not inlined, as a WebAssembly module would have it many times.
    #[inline(never)]
    pub fn samples(&self, pattern_indices: &[usize], pixel: CameraPixel, c: usize) -> Vec<f64> {
        let sample = |&l: &usize| self.sample(l, pixel, c);
        pattern_indices.iter().map(sample).collect()
    }

    /// The least that a saturated sample can be.
    pub fn white(&self, l: usize) -> f64 {
        let white = f64::from(self.measurements.full_scale[l]);
        self.correction(l).apply(white)
    }

    /// The same; white, the least that it can be, if saturated.
    pub fn sample_or_white(&self, l: usize, pixel: CameraPixel, c: usize) -> f64 {
        match self.sample(l, pixel, c) {
            y if y.is_finite() => y,
            _ => self.white(l),
        }
    }

    /// Variance of a sample `y` of channel `c` under pattern `l`.
    pub fn variance(&self, l: usize, c: usize, y: f64) -> f64 {
        let correction = self.correction(l);
        let variance = self.measurements.variance(l, c, correction.invert(y));
        correction.scale.powi(2) * variance
    }

    /// Weight of each pattern's equations, mean square 1: the square root of its exposure, as the variance of photon
    /// noise, the largest part, is inversely proportional to exposure.
    pub fn pattern_weights(&self) -> Vec<f64> {
        let exposure = |(l, &full): (usize, &f32)| {
            let scale = f64::from(full) * self.correction(l).scale;
            scale.recip()
        };
        let exposures = self.full_scale.iter().enumerate().map(exposure);
        let mean = exposures.clone().sum::<f64>() / self.full_scale.len() as f64;
        exposures.map(|exposure| (exposure / mean).sqrt()).collect()
    }
}

impl Deref for CalibratedMeasurements<'_> {
    type Target = Measurements;

    fn deref(&self) -> &Measurements {
        self.measurements
    }
}
