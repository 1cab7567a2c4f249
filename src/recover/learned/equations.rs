//! The measurements of a region as normal equations over the basis.
//!
//! An *observation* is one camera pixel in one channel: `y = f B z + noise`, `[L]`, with the pixel's brightness f, the
//! responses B = P̂V of the basis on the pixel's window, `[L, r]`, and coefficients z, `[r]`. Inference needs only BᵀB,
//! `[r, r]`, Bᵀy, `[r]`, ‖y‖² and the noise variance. Observations with the same window and the same unsaturated patterns
//! share BᵀB.
//!
//! B and y are weighted by the patterns' exposures, and the patterns' common mode by [`CommonModeWeight::POOLED`].

use std::ops::Range;

use super::basis::{LearnedBasis, PatternResponses};
use crate::linalg::{dot, sort, vectorise};
use crate::recover::common_mode_weight::CommonModeWeight;
use crate::recover::normal_equations::{EquationWeights, WeightedColumns};
use crate::recover::photometry::CalibratedMeasurements;
use crate::recover::sampling::{PixelsSharingWindow, pixels_by_window, usable_samples};
use crate::transport::{CHANNELS, CameraPixel, Geometry, TileRect};

/// Sub-element positions along one axis. With two camera pixels for each light element, neighbours lie in different
/// halves of it and see different parts of their window.
const PHASES_PER_AXIS: usize = 2;
pub(super) const PHASES: usize = PHASES_PER_AXIS * PHASES_PER_AXIS;

/// Rounding variance of a 16-bit photograph, the least that a measurement has.
const MIN_VARIANCE: f64 = 1.0 / (12.0 * 65536.0 * 65536.0);
/// Share of the brightness at [`BRIGHT_PERCENTILE`] below which an observation is not reliable.
const MIN_RELATIVE_BRIGHTNESS: f64 = 0.1;
const BRIGHT_PERCENTILE: usize = 95;
/// Ratio of brightness to noise below which an observation is not reliable.
const MIN_CONTRAST: f64 = 4.0;

/// Brightness below which an observation is not reliable, by channel: it is left out of training, and in inference it
/// gets neither the neighbour prior nor the non-negativity penalty.
pub(super) type MinReliableBrightness = [f64; CHANNELS];

/// The sub-element position of a pixel's correspondence, 0 to [`PHASES`] - 1.
fn phase(geometry: &Geometry, pixel: CameraPixel) -> usize {
    let at = geometry.correspondence.at(pixel);
    let half = |x: f64| {
        let position = ((x - x.floor()) * PHASES_PER_AXIS as f64) as usize;
        position.min(PHASES_PER_AXIS - 1)
    };
    half(at.v) * PHASES_PER_AXIS + half(at.u)
}

/// One channel of one pixel, but for BᵀB and Bᵀy.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelObservation {
    /// Index of BᵀB among the region's Gram matrices.
    pub gram: usize,
    /// Brightness f, in units of the measurement: the response of the mean function under full light.
    pub brightness: f64,
    /// Noise variance of one measurement.
    pub variance: f64,
    /// ‖y‖².
    pub energy: f64,
    /// Number of measurements; 0 if none is usable.
    pub count: usize,
    pub phase: usize,
    /// Whether all of its window is inside the light plane.
    pub has_full_window: bool,
}

/// The normal equations of all observations of a region.
#[derive(Debug)]
pub(super) struct ObservationEquations {
    pub rect: TileRect,
    pub rank: usize,
    /// `[pixel, channel]`.
    pub observations: Vec<PixelObservation>,
    /// BᵀB, `[r, r]` each, for each window and set of usable patterns.
    pub gram_matrices: Vec<Vec<f64>>,
    /// Bᵀy, `[pixel, channel, r]`.
    pub right_hand_sides: Vec<f64>,
}

impl ObservationEquations {
    /// The equations of the pixels `rect` from the patterns `pattern_indices`.
    pub fn new(
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        basis: &LearnedBasis,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> Self {
        let count = rect.extent.area() * CHANNELS;
        let mut equations = Self {
            rect,
            rank: basis.rank(),
            observations: vec![PixelObservation::default(); count],
            gram_matrices: Vec::new(),
            right_hand_sides: vec![0.0; count * basis.rank()],
        };
        for (origin, pixels) in pixels_by_window(geometry, rect) {
            for (plane, channels) in measurements.planes() {
                let responses = basis.respond(measurements, geometry, origin, plane);
                let window = (&responses, &pixels[..], channels);
                vectorise(
                    #[cfg_attr(target_arch = "x86_64", inline(always))]
                    || equations.add_window(measurements, geometry, pattern_indices, window),
                );
            }
        }
        equations
    }

    pub fn count_gram_matrices(
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        pattern_indices: &[usize],
        rect: TileRect,
    ) -> usize {
        let mut count = 0;
        for (_, pixels) in pixels_by_window(geometry, rect) {
            for (_, channels) in measurements.planes() {
                let mut sets: Vec<Vec<usize>> = Vec::new();
                for (pixel, c) in pixels
                    .iter()
                    .flat_map(|p| channels.clone().map(move |c| (p.1, c)))
                {
                    let (patterns, _) = usable_samples(measurements, pattern_indices, pixel, c);
                    if !sets.contains(&patterns) {
                        sets.push(patterns);
                    }
                }
                count += sets.len();
            }
        }
        count
    }

    /// BᵀB of an observation, `[r, r]`, both triangles.
    pub fn gram(&self, index: usize) -> &[f64] {
        &self.gram_matrices[self.observations[index].gram]
    }

    /// Bᵀy of an observation, `[r]`.
    pub fn right_hand_side(&self, index: usize) -> &[f64] {
        &self.right_hand_sides[index * self.rank..(index + 1) * self.rank]
    }

    /// Whether an observation is bright enough for training.
    pub fn is_reliable(&self, index: usize, min_brightness: &MinReliableBrightness) -> bool {
        let observation = &self.observations[index];
        observation.count > 0
            && observation.brightness > min_brightness[index % CHANNELS]
            && observation.brightness / observation.variance.sqrt() > MIN_CONTRAST
    }

    /// Adds the observations of a window's pixels in the channels that one plane of the patterns drives.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_window(
        &mut self,
        measurements: &CalibratedMeasurements<'_>,
        geometry: &Geometry,
        pattern_indices: &[usize],
        (responses, pixels, channels): (&PatternResponses, &PixelsSharingWindow, Range<usize>),
    ) {
        let first_gram = self.gram_matrices.len();
        let mut shared: Vec<WeightedBasisResponses> = Vec::new();
        for &(p, pixel) in pixels {
            for c in channels.clone() {
                let (usable, y) = usable_samples(measurements, pattern_indices, pixel, c);
                let known = shared.iter().position(|s| s.pattern_indices == usable);
                let known = known.unwrap_or_else(|| {
                    let weighted = WeightedBasisResponses::new(measurements, responses, usable);
                    self.gram_matrices.push(weighted.columns.gram());
                    shared.push(weighted);
                    shared.len() - 1
                });
                let index = p * CHANNELS + c;
                let right_hand_side = &mut self.right_hand_sides[index * self.rank..][..self.rank];
                self.observations[index] = PixelObservation {
                    gram: first_gram + known,
                    phase: phase(geometry, pixel),
                    has_full_window: responses.has_full_window,
                    ..shared[known].observe(measurements, c, y, right_hand_side)
                };
            }
        }
    }
}

/// The brightness below which observations with these `brightnesses`, `[pixel, channel]`, are not reliable: by channel, a
/// share of what the brightest 5 % exceed.
pub(super) fn min_reliable_brightness(brightnesses: &[f64]) -> MinReliableBrightness {
    std::array::from_fn(|c| {
        let mut of_channel: Vec<f64> = brightnesses
            .iter()
            .skip(c)
            .step_by(CHANNELS)
            .copied()
            .collect();
        sort(&mut of_channel);
        let bright = of_channel.get(of_channel.len() * BRIGHT_PERCENTILE / 100);
        MIN_RELATIVE_BRIGHTNESS * bright.copied().unwrap_or(0.0)
    })
}

/// The responses of the basis on one window, weighted, to one set of L patterns.
struct WeightedBasisResponses {
    pattern_indices: Vec<usize>,
    /// B.
    columns: WeightedColumns,
    /// Mean response of the mean function.
    mean_response: f64,
}

impl WeightedBasisResponses {
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn new(
        measurements: &CalibratedMeasurements<'_>,
        responses: &PatternResponses,
        pattern_indices: Vec<usize>,
    ) -> Self {
        let count = pattern_indices.len();
        let mut columns = vec![0.0; responses.rank * count];
        for (i, &l) in pattern_indices.iter().enumerate() {
            for (k, &b) in responses.row(l).iter().enumerate() {
                columns[k * count + i] = f64::from(b);
            }
        }
        let weights = measurements.pattern_weights();
        let weights = pattern_indices.iter().map(|&l| weights[l]).collect();
        let weights = EquationWeights::new(weights, CommonModeWeight::POOLED);
        let products = pattern_indices.iter().zip(&weights.patterns);
        let products = products.map(|(&l, w)| w * w * responses.mean(l));
        Self {
            mean_response: products.sum::<f64>() / weights.energy,
            columns: WeightedColumns::new(columns, weights),
            pattern_indices,
        }
    }

    /// Brightness, variance, energy and count of channel `c` with measurements y; writes Bᵀy to `right_hand_side`, `[r]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn observe(
        &self,
        measurements: &CalibratedMeasurements<'_>,
        c: usize,
        mut y: Vec<f64>,
        right_hand_side: &mut [f64],
    ) -> PixelObservation {
        let weights = &self.columns.weights;
        let samples = self.pattern_indices.iter().zip(&weights.patterns).zip(&y);
        let variances = samples.map(|((&l, w), &y)| w * w * measurements.variance(l, c, y));
        let variance = variances.sum::<f64>() / y.len() as f64;
        let mean = weights.apply(&mut y);
        let products = self.columns.right_hand_side(&y);
        let pairs = right_hand_side.iter_mut().zip(products);
        pairs.for_each(|(right, product)| *right = product);
        let brightness = match self.mean_response > 0.0 {
            true => mean / self.mean_response,
            false => 0.0,
        };
        PixelObservation {
            brightness: brightness.max(0.0),
            variance: variance.max(MIN_VARIANCE),
            energy: dot(&y, &y),
            count: y.len(),
            ..PixelObservation::default()
        }
    }
}
