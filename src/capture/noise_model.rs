//! Noise model of the measurements, and its floor, estimated from the dark frame.

use serde::{Deserialize, Serialize};

use crate::linalg;
use crate::transport::CHANNELS;

/// Standard deviation of a Gaussian over its median absolute deviation.
const SIGMA_PER_MAD: f64 = 1.4826;
/// Differences of neighbours above this many standard deviations are edges or hot pixels.
const MAX_NOISE_SIGMAS: f64 = 4.0;

/// Variance of samples per channel, in squared units of the measurement.
///
/// A sample `y` at relative exposure `e` has variance `gain·y/e + floor/e²`. The subtracted dark frame has noise of
/// variance `floor` as well, which is not included: it adds the same constant to a pixel in all shots. Subtraction
/// cancels the fixed pattern of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseModel {
    /// Variance per unit of measurement at exposure 1: 1 / electrons at measurement 1.
    pub gain: [f64; CHANNELS],
    /// Variance without light at exposure 1: read noise and rounding to codes.
    pub floor: [f64; CHANNELS],
}

impl NoiseModel {
    /// Estimates the floor from a dark frame with rows of `width` pixels, see [`from_dark_rows`](Self::from_dark_rows).
    pub fn from_dark(dark: &[[f32; CHANNELS]], width: u32, quantum: f64) -> Self {
        Self::from_dark_rows(dark.chunks_exact(width as usize), quantum)
    }

    /// Estimates the floor from rows of a dark frame, or parts of them; the gain is zero.
    ///
    /// The floor is half the mean squared difference of horizontal neighbours, and at least the variance of rounding to
    /// codes `quantum` apart.
    pub fn from_dark_rows<'a>(
        rows: impl Iterator<Item = &'a [[f32; CHANNELS]]> + Clone,
        quantum: f64,
    ) -> Self {
        let rounding = quantum * quantum / 12.0;
        let floor = std::array::from_fn(|c| {
            let differences = rows.clone().flat_map(|row| {
                let pairs = row.chunks_exact(2);
                pairs.map(|pair| f64::from(pair[1][c]) - f64::from(pair[0][c]))
            });
            let mut magnitudes: Vec<f64> = differences.map(f64::abs).collect();
            let Some(median) = quantile(&mut magnitudes, 1, 2) else {
                return rounding;
            };
            // Codes are coarse compared with the noise of a good camera, and so is the median: it only serves to
            // reject outliers, and `quantum` keeps it above zero.
            let limit = MAX_NOISE_SIGMAS * (SIGMA_PER_MAD * median).max(quantum);
            let inliers = magnitudes.iter().take_while(|d| **d <= limit);
            let (count, sum) = inliers.fold((0.0, 0.0), |(n, sum), d| (n + 1.0, sum + d * d));
            (sum / (2.0 * f64::max(count, 1.0))).max(rounding)
        });
        Self {
            gain: [0.0; CHANNELS],
            floor,
        }
    }

    /// The same for codes that are `quantum` apart: with at least the variance of their rounding.
    pub fn with_quantum(mut self, quantum: f64) -> Self {
        self.floor = self.floor.map(|floor| floor.max(quantum * quantum / 12.0));
        self
    }

    /// Variance of a sample `y` of channel `c` at relative exposure `exposure`.
    pub fn variance(&self, c: usize, y: f64, exposure: f64) -> f64 {
        (self.gain[c] * y.max(0.0) + self.floor[c] / exposure) / exposure
    }
}

/// Sorts `values` and returns their quantile `numerator / denominator`; `None` if there are none.
pub(super) fn quantile(values: &mut [f64], numerator: usize, denominator: usize) -> Option<f64> {
    linalg::sort(values);
    values.get(values.len() * numerator / denominator).copied()
}
