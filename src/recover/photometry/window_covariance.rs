//! The covariance of a pixel's measurements, `[L, L]`, under the Gaussian model.
//!
//! Divided by the pixel's brightness, measurements are taken to have the mean `m = P̂h`, with the mean function h, and the
//! covariance `K = P̂ diag(v) P̂ᵀ + mmᵀ + ε²I`: every element of the function varies by itself with the variance
//! `v = 1.2 h²`, and the brightness is unknown.

use super::CalibratedMeasurements;
use crate::linalg::{self, dot};
use crate::recover::sampling::PixelsSharingWindow;
use crate::transport::{CameraPixel, Geometry, LightElement};

/// Variance of a function's elements as a share of h²: four times that of the learned prior's start, whose neighbouring
/// elements vary together.
const RELATIVE_VARIANCE: f64 = 1.2;
/// ε²: what no function explains, relative to brightness.
const UNEXPLAINED_VARIANCE: f64 = 1e-5;
/// Variance of a pixel's measurements around those that the mean function predicts, relative to brightness; pixels with
/// more noise than that say less.
const MODEL_VARIANCE: f64 = 0.01;

/// The model of the photographs `pattern_indices` at one window.
pub(super) struct WindowCovariance {
    /// `m`, `[L]`.
    pub means: Vec<f64>,
    /// `K⁻¹`, `[L, L]`.
    pub inverse: Vec<f64>,
    /// Factor of K: `FFᵀ = K − ε²I`, `[L, S + 1]`.
    factor: Vec<f64>,
}

/// A pixel's channel: measurements divided by its brightness, times the square root of its certainty.
pub(super) struct ScaledPixel {
    /// `[L]`.
    pub y: Vec<f64>,
    /// What a measurement of 1 becomes.
    pub unit: f64,
    /// The square root of the certainty, 1 without noise.
    pub certainty: f64,
    /// Differences of `y` per camera pixel to the right and down, `[2][L]`; zero where a neighbour is not measured.
    pub gradients: [Vec<f64>; 2],
}

impl ScaledPixel {
    /// Measurements less their mean, `[L]`.
    pub fn residual(&self, means: &[f64]) -> Vec<f64> {
        let pairs = self.y.iter().zip(means);
        pairs.map(|(y, m)| y - self.certainty * m).collect()
    }
}

impl WindowCovariance {
    /// For the window at `origin` and the patterns' plane `plane`; `mean_function` is `[slot]`. `None` if the window is
    /// off the light plane.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        mean_function: &[f64],
        origin: LightElement,
        plane: usize,
        pattern_indices: &[usize],
    ) -> Option<Self> {
        let elements: Vec<_> = geometry.elements_of_window(origin).collect();
        let (patterns, width) = (pattern_indices.len(), elements.len() + 1);
        let mut factor = vec![0.0; patterns * width];
        let mut means = Vec::with_capacity(patterns);
        for (&l, row) in pattern_indices.iter().zip(factor.chunks_exact_mut(width)) {
            let pattern = measurements.patterns[l].plane(plane);
            let mut mean = 0.0;
            for (&(slot, m), value) in elements.iter().zip(&mut *row) {
                *value = mean_function[slot] * f64::from(pattern[m]);
                mean += *value;
                *value *= RELATIVE_VARIANCE.sqrt();
            }
            row[width - 1] = mean;
            means.push(mean);
        }
        let mut covariance = vec![0.0; patterns * patterns];
        for i in 0..patterns {
            for j in i..patterns {
                covariance[i * patterns + j] = dot(row(&factor, width, i), row(&factor, width, j));
            }
            covariance[i * patterns + i] += UNEXPLAINED_VARIANCE;
        }
        if means.iter().sum::<f64>() <= 0.0 {
            return None;
        }
        linalg::cholesky(&mut covariance, patterns)?;
        let mut scratch = vec![0.0; patterns * patterns];
        let mut inverse = vec![0.0; patterns * patterns];
        linalg::cholesky_inverse(&covariance, patterns, &mut scratch, &mut inverse);
        linalg::mirror_upper(&mut inverse, patterns);
        Some(Self {
            means,
            inverse,
            factor,
        })
    }

    /// `K(others, these)`, the covariance of this window's photographs with another list of photographs of it,
    /// `[other, L]`.
    pub fn cross_covariance(&self, others: &Self) -> Vec<f64> {
        let (patterns, width) = (self.means.len(), self.factor.len() / self.means.len());
        let entry = |i: usize| {
            let (other, this) = (i / patterns, i % patterns);
            dot(
                row(&others.factor, width, other),
                row(&self.factor, width, this),
            )
        };
        (0..others.means.len() * patterns).map(entry).collect()
    }

    /// The channels of `pixels` that no photograph saturates and that are brighter than black.
    pub fn scaled_pixels(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        pixels: &PixelsSharingWindow,
        channels: std::ops::Range<usize>,
        pattern_indices: &[usize],
    ) -> Vec<ScaledPixel> {
        let count = pattern_indices.len() as f64;
        let level = self.means.iter().sum::<f64>() / count;
        let channels = pixels
            .iter()
            .flat_map(|pixel| channels.clone().map(move |c| (pixel.1, c)));
        let scale = |(pixel, c)| {
            let sample = |&l: &usize| measurements.sample(l, pixel, c);
            let mut y: Vec<f64> = pattern_indices.iter().map(sample).collect();
            let mean = y.iter().sum::<f64>() / count;
            let brightness = mean / level;
            // The mean is NaN if a sample is saturated.
            if brightness.is_nan() || brightness <= 0.0 {
                return None;
            }
            let noise = |&l: &usize| measurements.variance(l, c, mean);
            let noise = pattern_indices.iter().map(noise).sum::<f64>() / count;
            let noise = noise / brightness.powi(2);
            let certainty = (MODEL_VARIANCE / (MODEL_VARIANCE + noise)).sqrt();
            let unit = certainty / brightness;
            y.iter_mut().for_each(|y| *y *= unit);
            let gradients = [(1, 0), (0, 1)].map(|step| {
                let gradient = |&l: &usize| unit * gradient(measurements, l, pixel, c, step);
                pattern_indices.iter().map(gradient).collect()
            });
            Some(ScaledPixel {
                y,
                unit,
                certainty,
                gradients,
            })
        };
        channels.filter_map(scale).collect()
    }
}

/// Half the difference of the samples of a photograph beside a pixel, along `(x, y)`; zero if one is not measured.
fn gradient(
    measurements: &CalibratedMeasurements<'_>,
    l: usize,
    CameraPixel { x, y }: CameraPixel,
    c: usize,
    (dx, dy): (u32, u32),
) -> f64 {
    let camera = measurements.camera;
    if x < dx || y < dy || x + dx >= camera.width || y + dy >= camera.height {
        return 0.0;
    }
    let sample = |x: u32, y: u32| measurements.sample(l, CameraPixel { x, y }, c);
    let difference = sample(x + dx, y + dy) - sample(x - dx, y - dy);
    if difference.is_nan() {
        0.0
    } else {
        0.5 * difference
    }
}

fn row(matrix: &[f64], width: usize, i: usize) -> &[f64] {
    &matrix[i * width..(i + 1) * width]
}
