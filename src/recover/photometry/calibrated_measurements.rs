//! Measurements with every photograph corrected for its exposure and its stray light.

use std::ops::Deref;

use serde::{Deserialize, Serialize};

use crate::capture::Measurements;
use crate::transport::CameraPixel;

/// Makes a photograph's samples those of a photograph without stray light, at the exposure of the others:
/// `scale · y + offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinearCorrection {
    /// Inverse of the photograph's gain relative to the others.
    pub scale: f64,
    /// Added after scaling, in units of the measurement.
    pub offset: f64,
}

impl LinearCorrection {
    /// Changes nothing.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        offset: 0.0,
    };

    /// The corrected sample.
    pub fn apply(self, y: f64) -> f64 {
        self.scale * y + self.offset
    }

    /// The sample before correction.
    fn invert(self, corrected: f64) -> f64 {
        (corrected - self.offset) / self.scale
    }

    /// The photograph's exposure relative to what is declared.
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
    corrections: &'a [LinearCorrection],
}

impl<'a> CalibratedMeasurements<'a> {
    pub fn new(measurements: &'a Measurements, corrections: &'a [LinearCorrection]) -> Self {
        Self {
            measurements,
            corrections,
        }
    }

    /// Measurements as they are.
    pub fn uncorrected(measurements: &'a Measurements) -> Self {
        Self::new(measurements, &[])
    }

    fn correction(&self, l: usize) -> LinearCorrection {
        let correction = self.corrections.get(l).copied();
        correction.unwrap_or(LinearCorrection::IDENTITY)
    }

    /// Channel `c` of a pixel under pattern `l`; NaN if saturated or not loaded.
    pub fn sample(&self, l: usize, pixel: CameraPixel, c: usize) -> f64 {
        let y = self.measurements.sample(l, pixel, c);
        self.correction(l).apply(y)
    }

    /// The least that a saturated sample can be.
    pub fn white(&self, l: usize) -> f64 {
        let white = f64::from(self.measurements.full_scale[l]);
        self.correction(l).apply(white)
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
