//! Posterior means of a region under the pixel prior, and how neighbouring pixels find each other's.

use super::equations::{MinReliableBrightness, ObservationEquations};
use super::posterior::PosteriorSolver;
use super::prior::Prior;
use crate::linalg::vectorise;
use crate::transport::{CHANNELS, Extent, TileRect};

/// Largest distance, along each axis, of a neighbour that predicts a pixel.
pub(in crate::recover) const NEIGHBOURHOOD_RADIUS: u32 = 2;
const NEIGHBOURHOOD_SIDE: usize = 2 * NEIGHBOURHOOD_RADIUS as usize + 1;
/// Predictors of an observation: a constant; in the same channel, all pixels in the square neighbourhood but the pixel
/// itself; in the other channels, those in the same row or column, and the pixel itself.
pub(super) const PREDICTORS: usize =
    NEIGHBOURHOOD_SIDE * NEIGHBOURHOOD_SIDE + (CHANNELS - 1) * (2 * NEIGHBOURHOOD_SIDE - 1);

/// Offset from an observation to a neighbour that predicts it.
#[derive(Clone, Copy, Debug)]
struct NeighbourOffset {
    dx: i32,
    dy: i32,
    /// Added to the channel, modulo [`CHANNELS`].
    channel: usize,
}

impl NeighbourOffset {
    fn all() -> impl Iterator<Item = Self> {
        let radius = NEIGHBOURHOOD_RADIUS as i32;
        let row = move |dy| (-radius..=radius).map(move |dx| (dx, dy));
        let places = (-radius..=radius).flat_map(row);
        let offsets =
            places.flat_map(|(dx, dy)| (0..CHANNELS).map(move |channel| Self { dx, dy, channel }));
        offsets.filter(|offset| match offset.channel {
            0 => (offset.dx, offset.dy) != (0, 0),
            _ => offset.dx == 0 || offset.dy == 0,
        })
    }
}

/// Where an observation lies in its region.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelObservationPosition {
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
    pub equations: &'a ObservationEquations,
    /// The pixels whose neighbours all lie in the region, unless the picture ends there.
    interior: TileRect,
    /// ẑ, `[pixel, channel, r]`.
    means: Vec<f64>,
    /// ln p(y) up to a constant, `[pixel, channel]`.
    pub log_evidence: Vec<f64>,
    /// Whether an observation counts in training, `[pixel, channel]`.
    pub is_reliable: Vec<bool>,
    offsets: Vec<NeighbourOffset>,
    /// The constant predictor, `[r]`.
    ones: Vec<f64>,
}

impl<'a> PosteriorMeans<'a> {
    pub fn new(
        equations: &'a ObservationEquations,
        interior: TileRect,
        prior: &Prior,
        min_brightness: &MinReliableBrightness,
    ) -> Self {
        let (rank, count) = (equations.rank, equations.observations.len());
        let is_reliable = (0..count).map(|i| equations.is_reliable(i, min_brightness));
        let mut all = Self {
            equations,
            interior,
            means: Vec::with_capacity(count * rank),
            log_evidence: Vec::with_capacity(count),
            is_reliable: is_reliable.collect(),
            offsets: NeighbourOffset::all().collect(),
            ones: vec![1.0; rank],
        };
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || {
                let mut solver = PosteriorSolver::new(rank);
                for index in 0..count {
                    let log_evidence = prior.infer(equations, index, &mut solver);
                    all.means.extend_from_slice(&solver.mean);
                    all.log_evidence.push(log_evidence);
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

    /// The predictors of an observation, each with its number below [`PREDICTORS`]: a constant 1, and the posterior means
    /// of its bright neighbours, `[r]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn predictors(
        &self,
        location: PixelObservationPosition,
    ) -> impl Iterator<Item = (usize, &[f64])> {
        let neighbours = self.offsets.iter().zip(1..);
        let neighbours =
            neighbours.filter_map(move |(offset, j)| Some((j, self.neighbour(location, offset)?)));
        std::iter::once((0, &self.ones[..])).chain(neighbours)
    }

    /// Posterior mean of a neighbour, `[r]`; `None` outside the region and if it is not bright.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn neighbour(
        &self,
        location: PixelObservationPosition,
        offset: &NeighbourOffset,
    ) -> Option<&[f64]> {
        let Extent { width, height } = self.equations.rect.extent;
        let x = location.x.checked_add_signed(offset.dx)?;
        let y = location.y.checked_add_signed(offset.dy)?;
        if x >= width || y >= height {
            return None;
        }
        let channel = (location.channel + offset.channel) % CHANNELS;
        let index = (y * width + x) as usize * CHANNELS + channel;
        self.is_reliable[index].then(|| self.mean(index))
    }

    /// The bright observations of the interior.
    pub fn bright_locations(&self) -> impl Iterator<Item = PixelObservationPosition> {
        let locations = self.interior_locations();
        locations.filter(|location| self.is_reliable[location.index])
    }

    /// The observations of the interior, `[pixel, channel]`.
    pub fn interior_locations(&self) -> impl Iterator<Item = PixelObservationPosition> + use<> {
        let rect = self.equations.rect;
        self.interior.pixels().flat_map(move |pixel| {
            let (x, y) = (pixel.x - rect.x, pixel.y - rect.y);
            let first = (y * rect.extent.width + x) as usize * CHANNELS;
            (0..CHANNELS).map(move |channel| PixelObservationPosition {
                x,
                y,
                channel,
                index: first + channel,
            })
        })
    }
}
