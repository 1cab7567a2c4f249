//! Posterior means of a region under the pixel prior, and how neighbouring pixels find each other's.

use super::equations::{BrightnessThresholds, RegionEquations};
use super::posterior::PosteriorSolver;
use super::prior::Prior;
use crate::linalg::vectorise;
use crate::transport::{CHANNELS, Extent, TileRect};

/// Largest distance, along each axis, of a neighbour that predicts a pixel.
pub(super) const NEIGHBOURHOOD_RADIUS: i32 = 2;

/// Offset from an observation to one that predicts it.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeighbourOffset {
    dx: i32,
    dy: i32,
    /// Added to the channel, modulo [`CHANNELS`].
    channel: usize,
}

impl NeighbourOffset {
    /// In the same channel, all pixels in the square neighbourhood; in the other channels, those in
    /// the same row or column, and the pixel itself.
    pub fn all() -> Vec<Self> {
        let mut offsets = Vec::new();
        let range = -NEIGHBOURHOOD_RADIUS..=NEIGHBOURHOOD_RADIUS;
        for (dy, dx) in range
            .clone()
            .flat_map(|dy| range.clone().map(move |dx| (dy, dx)))
        {
            for channel in 0..CHANNELS {
                let is_predictor = match channel {
                    0 => (dx, dy) != (0, 0),
                    _ => dx == 0 || dy == 0,
                };
                if is_predictor {
                    offsets.push(Self { dx, dy, channel });
                }
            }
        }
        offsets
    }
}

/// Where an observation lies in its region.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObservationLocation {
    /// Column and row from the region's first pixel.
    x: u32,
    y: u32,
    pub channel: usize,
    /// Index of the observation, `[pixel, channel]`.
    pub index: usize,
}

/// Posterior means of a region's observations under the pixel prior.
#[derive(Debug)]
pub(super) struct PosteriorMeans<'a> {
    pub equations: &'a RegionEquations,
    /// The pixels whose neighbours all lie in the region, unless the picture ends there.
    pub interior: TileRect,
    /// ẑ, `[pixel, channel, r]`.
    pub means: Vec<f64>,
    /// The same, but zero where an observation is not bright: what neighbours see.
    pub bright_means: Vec<f64>,
    /// ln p(y) up to a constant, `[pixel, channel]`.
    pub log_evidence: Vec<f64>,
    /// Whether an observation counts in training, `[pixel, channel]`.
    pub is_bright: Vec<bool>,
}

impl<'a> PosteriorMeans<'a> {
    /// Computes the posterior mean of every observation of `equations`.
    pub fn new(
        equations: &'a RegionEquations,
        interior: TileRect,
        prior: &Prior,
        thresholds: &BrightnessThresholds,
    ) -> Self {
        let (rank, count) = (equations.rank, equations.observations.len());
        let mut all = Self {
            equations,
            interior,
            means: Vec::with_capacity(count * rank),
            bright_means: Vec::with_capacity(count * rank),
            log_evidence: Vec::with_capacity(count),
            is_bright: Vec::with_capacity(count),
        };
        vectorise(
            #[inline(always)]
            || {
                let mut solver = PosteriorSolver::new(rank);
                for index in 0..count {
                    let log_evidence = prior.infer(equations, index, &mut solver);
                    let is_bright = equations.is_bright(index, thresholds);
                    all.means.extend_from_slice(&solver.mean);
                    let factor = if is_bright { 1.0 } else { 0.0 };
                    all.bright_means
                        .extend(solver.mean.iter().map(|z| factor * z));
                    all.log_evidence.push(log_evidence);
                    all.is_bright.push(is_bright);
                }
            },
        );
        all
    }

    /// ẑ of one observation, `[r]`.
    pub fn mean(&self, index: usize) -> &[f64] {
        let rank = self.equations.rank;
        &self.means[index * rank..(index + 1) * rank]
    }

    /// Posterior mean of a neighbour, `[r]`, zero if it is not bright; `None` outside the region.
    #[inline(always)]
    pub fn neighbour(
        &self,
        location: ObservationLocation,
        offset: &NeighbourOffset,
    ) -> Option<&[f64]> {
        let (rank, Extent { width, height }) = (self.equations.rank, self.equations.rect.extent);
        let (x, y) = (location.x as i32 + offset.dx, location.y as i32 + offset.dy);
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        if x >= width || y >= height {
            return None;
        }
        let pixel = (y * width + x) as usize;
        let index = pixel * CHANNELS + (location.channel + offset.channel) % CHANNELS;
        Some(&self.bright_means[index * rank..(index + 1) * rank])
    }

    /// The observations of the interior, `[pixel, channel]`.
    pub fn interior_locations(&self) -> impl Iterator<Item = ObservationLocation> + use<> {
        let rect = self.equations.rect;
        self.interior.pixels().flat_map(move |pixel| {
            let (x, y) = (pixel.x - rect.x, pixel.y - rect.y);
            let first = (y * rect.extent.width + x) as usize * CHANNELS;
            (0..CHANNELS).map(move |channel| ObservationLocation {
                x,
                y,
                channel,
                index: first + channel,
            })
        })
    }
}
