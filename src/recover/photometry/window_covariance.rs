//! The covariance of a pixel's measurements, `[L, L]`, under the Gaussian model.
//!
//! Divided by the pixel's brightness, measurements are taken to have the mean `m = P̂h`, with the mean function h, and the
//! covariance `K = P̂ diag(v) P̂ᵀ + mmᵀ + ε²I`: every element of the function varies by itself with the variance
//! `v = 1.2 h²`, and the brightness is unknown. Noise is not part of K, as its estimate takes faults for noise; but no
//! photograph is blamed for its own noise.

use std::ops::Range;

use super::CalibratedMeasurements;
use crate::linalg::{self, dot};
use crate::recover::sampling::PixelsSharingWindow;
use crate::transport::{CameraPixel, Extent, Geometry, LightElement};

/// Variance of a function's elements as a share of h²: four times that of the learned prior's start, whose neighbouring
/// elements vary together.
const RELATIVE_VARIANCE: f64 = 1.2;
/// ε²: what no function explains, relative to brightness.
pub(super) const UNEXPLAINED_VARIANCE: f64 = 1e-5;
/// Variance of a pixel's measurements around those that the mean function predicts, relative to brightness; pixels with
/// more noise than that say less.
pub(super) const MODEL_VARIANCE: f64 = 0.01;

/// Steps of one camera pixel to the right and down.
pub(super) const AXES: [(u32, u32); 2] = [(1, 0), (0, 1)];

/// What the model says of the photographs of a list at one window.
pub(super) struct WindowModel {
    /// `m`, `[L]`.
    pub means: Vec<f64>,
    /// Factor of K without its diagonal: `FFᵀ = K − ε²I`, `[L, S + 1]`.
    factor: Vec<f64>,
}

/// The model with the inverse of its covariance.
pub(super) struct WindowCovariance {
    pub model: WindowModel,
    /// `K⁻¹`, `[L, L]`.
    pub inverse: Vec<f64>,
}

/// A pixel's channel: measurements divided by its brightness, times its weight.
#[derive(Clone)]
pub(super) struct ScaledPixel {
    pub pixel: CameraPixel,
    pub channel: usize,
    /// `[L]`.
    pub y: Vec<f64>,
    /// What a measurement of 1 becomes.
    pub unit: f64,
    /// 1 without noise.
    pub weight: f64,
    /// Differences of `y` per camera pixel to the right and down, `[2][L]`; zero where a neighbour is not measured.
    pub gradients: [Vec<f64>; 2],
    /// Variance of the noise of `y`, `[L]`.
    pub noise: Vec<f64>,
}

impl ScaledPixel {
    /// Measurements less their mean, `[L]`.
    pub fn residual(&self, means: &[f64]) -> Vec<f64> {
        let pairs = self.y.iter().zip(means);
        pairs.map(|(y, m)| y - self.weight * m).collect()
    }
}

impl WindowModel {
    /// For the window at `origin` and the patterns' plane `plane`; `mean_function` is `[slot]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        mean_function: &[f64],
        origin: LightElement,
        plane: usize,
        pattern_indices: &[usize],
    ) -> Self {
        let planes: Vec<&[f32]> = pattern_indices
            .iter()
            .map(|&l| measurements.patterns[l].plane(plane))
            .collect();
        let emission = |i: usize, m: usize| planes[i][m];
        Self::of_emissions(geometry, mean_function, origin, planes.len(), emission)
    }

    /// For one photograph with all elements lit.
    pub fn of_flood(geometry: &Geometry, mean_function: &[f64], origin: LightElement) -> Self {
        Self::of_emissions(geometry, mean_function, origin, 1, |_, _| 1.0)
    }

    /// For photographs with these emissions of element `m`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn of_emissions(
        geometry: &Geometry,
        mean_function: &[f64],
        origin: LightElement,
        patterns: usize,
        emission: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let elements: Vec<_> = geometry.elements_of_window(origin).collect();
        let width = elements.len() + 1;
        let mut factor = vec![0.0; patterns * width];
        let mut means = Vec::with_capacity(patterns);
        for (i, row) in factor.chunks_exact_mut(width).enumerate() {
            let mut mean = 0.0;
            for (&(slot, m), value) in elements.iter().zip(&mut *row) {
                *value = mean_function[slot] * f64::from(emission(i, m));
                mean += *value;
                *value *= RELATIVE_VARIANCE.sqrt();
            }
            row[width - 1] = mean;
            means.push(mean);
        }
        Self { means, factor }
    }

    /// The covariance of the photographs of `others` with those of this list, `[other, L]`.
    pub fn cross_covariance(&self, others: &Self) -> Vec<f64> {
        let rows = others.rows();
        let products = rows.flat_map(|other| self.rows().map(move |this| dot(other, this)));
        products.collect()
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.factor
            .chunks_exact(self.factor.len() / self.means.len())
    }

    /// The channels of `pixels` that no photograph of the list saturates and that are brighter than black.
    fn scaled_pixels(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        pixels: &PixelsSharingWindow,
        channels: Range<usize>,
    ) -> Vec<ScaledPixel> {
        let count = pattern_indices.len() as f64;
        let level = self.means.iter().sum::<f64>() / count;
        let channels = pixels
            .iter()
            .flat_map(|pixel| channels.clone().map(move |c| (pixel.1, c)));
        let scale = |(pixel, c)| {
            let mut y = measurements.samples(pattern_indices, pixel, c);
            let mean = y.iter().sum::<f64>() / count;
            let brightness = mean / level;
            // The mean is NaN if a sample is saturated, and the level is zero off the light plane.
            if !(brightness > 0.0 && brightness.is_finite()) {
                return None;
            }
            let noise = |&l: &usize| measurements.variance(l, c, mean) / brightness.powi(2);
            let mut noise: Vec<f64> = pattern_indices.iter().map(noise).collect();
            let mean_noise = noise.iter().sum::<f64>() / count;
            let weight = (MODEL_VARIANCE / (MODEL_VARIANCE + mean_noise)).sqrt();
            let unit = weight / brightness;
            y.iter_mut().for_each(|y| *y *= unit);
            noise.iter_mut().for_each(|noise| *noise *= weight * weight);
            let gradients = AXES.map(|step| {
                let gradient = |&l: &usize| {
                    let sample = |pixel| measurements.sample(l, pixel, c);
                    unit * differences(measurements.camera, sample, pixel, step)[0]
                };
                pattern_indices.iter().map(gradient).collect()
            });
            Some(ScaledPixel {
                pixel,
                channel: c,
                y,
                unit,
                weight,
                gradients,
                noise,
            })
        };
        channels.filter_map(scale).collect()
    }

    /// The inverse of `FFᵀ` with `variance` added to each photograph's, `[L, L]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn inverse_covariance(&self, variance: impl Fn(usize) -> f64) -> Option<Vec<f64>> {
        let patterns = self.means.len();
        let mut covariance = vec![0.0; patterns * patterns];
        for (i, row) in self.rows().enumerate() {
            for (j, other) in self.rows().enumerate().skip(i) {
                covariance[i * patterns + j] = dot(row, other);
            }
            covariance[i * patterns + i] += variance(i);
        }
        linalg::cholesky(&mut covariance, patterns)?;
        let mut scratch = vec![0.0; patterns * patterns];
        let mut inverse = vec![0.0; patterns * patterns];
        linalg::cholesky_inverse(&covariance, patterns, &mut scratch, &mut inverse);
        linalg::mirror_upper(&mut inverse, patterns);
        Some(inverse)
    }

    /// Scales the channels of `pixels`, and inverts the covariance. `None` if no channel can be used.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn with_pixels(
        self,
        measurements: &CalibratedMeasurements<'_>,
        pattern_indices: &[usize],
        pixels: &PixelsSharingWindow,
        channels: Range<usize>,
    ) -> Option<(WindowCovariance, Vec<ScaledPixel>)> {
        let pixels = self.scaled_pixels(measurements, pattern_indices, pixels, channels);
        if pixels.is_empty() {
            return None;
        }
        let inverse = self.inverse_covariance(|_| UNEXPLAINED_VARIANCE)?;
        let model = self;
        Some((WindowCovariance { model, inverse }, pixels))
    }
}

/// First and second difference of samples at a pixel along `step`, per camera pixel; zero where a neighbour is not measured.
pub(super) fn differences(
    camera: Extent,
    sample: impl Fn(CameraPixel) -> f64,
    CameraPixel { x, y }: CameraPixel,
    (dx, dy): (u32, u32),
) -> [f64; 2] {
    if x < dx || y < dy || x + dx >= camera.width || y + dy >= camera.height {
        return [0.0; 2];
    }
    let sample = |x: u32, y: u32| sample(CameraPixel { x, y });
    let (before, after) = (sample(x - dx, y - dy), sample(x + dx, y + dy));
    let differences = [0.5 * (after - before), before + after - 2.0 * sample(x, y)];
    match differences[0].is_nan() {
        true => [0.0; 2],
        false => differences,
    }
}
