//! How good an answer is, and how much of it is lost on the way to a file, as far as patterns held out
//! can tell.

use super::RecoverError;
use super::holdout::HoldoutSplit;
use super::pixelwise::predictions;
use super::sampling::spread_squares;
use crate::capture::{Measurements, Pattern};
use crate::executor::Executor;
use crate::transport::{
    Basis, CHANNELS, Decibels, Geometry, RecoveredTile, TileRect, TransportFunctions,
};

/// Squares looked at, and their side: that of a file's blocks.
const SQUARES: (usize, u32) = (96, 8);
/// Share of the noise below which what is missed cannot be told from it, as noise is known to a few
/// hundredths.
const RESOLUTION: f64 = 0.1;

/// Some of the picture, recovered without the patterns held out, and what was seen under these.
///
/// Elements of patterns vary independently, so that measurements vary between patterns by
/// `var(p) ‖τ‖²` and predictions are missed by `var(p) ‖τ − τ̂‖²`, plus noise of known variance.
#[derive(Clone, Debug)]
pub struct HoldoutValidation {
    geometry: Geometry,
    held: Vec<Pattern>,
    squares: Vec<Square>,
    /// Sums of variances between patterns, over pixels and channels: of measurements, less their
    /// noise; and of the noise of those held out.
    signal: f64,
    noise: f64,
    /// Of what the recovered functions miss.
    missed: f64,
}

#[derive(Clone, Debug)]
struct Square {
    tile: RecoveredTile,
    /// What was seen under the patterns held out, `[pixel, held, channel]`.
    seen: Vec<f64>,
}

impl HoldoutValidation {
    /// Recovers squares by `training_tile`, which takes only the patterns to learn from. None where there
    /// are too few patterns to hold any out.
    pub(super) fn new(
        measurements: &Measurements,
        (geometry, basis): (&Geometry, Option<&Basis>),
        split: &HoldoutSplit,
        executor: &impl Executor,
        training_tile: impl Fn(TileRect) -> RecoveredTile + Sync + Send,
    ) -> Result<Option<Self>, RecoverError> {
        executor.check_cancelled()?;
        if split.held_out.len() < 2 {
            return Ok(None);
        }
        let rects = spread_squares(measurements, SQUARES.1, SQUARES.0);
        let parts = executor.map(rects.len(), |i| {
            let mut seen = Vec::new();
            for pixel in rects[i].pixels() {
                for &l in &split.held_out {
                    seen.extend((0..CHANNELS).map(|c| measurements.sample(l, pixel, c)));
                }
            }
            let tile = training_tile(rects[i]);
            (
                Square { tile, seen },
                variances(measurements, split, rects[i]),
            )
        });
        let mut rehearsal = Self {
            geometry: *geometry,
            held: split
                .held_out
                .iter()
                .map(|&l| measurements.patterns[l].clone())
                .collect(),
            squares: Vec::with_capacity(parts.len()),
            signal: 0.0,
            noise: 0.0,
            missed: 0.0,
        };
        for (square, (signal, noise)) in parts {
            rehearsal.squares.push(square);
            rehearsal.signal += signal;
            rehearsal.noise += noise;
        }
        let functions = executor.map(rehearsal.squares.len(), |i| {
            rehearsal.squares[i].tile.clone().functions(geometry, basis)
        });
        rehearsal.missed = rehearsal.missed(&functions);
        Ok(Some(rehearsal))
    }

    /// Whether measurements differ from pattern to pattern by more than their noise.
    pub fn has_signal(&self) -> bool {
        self.signal > 0.0
    }

    /// About the SNR of the recovery.
    pub fn snr(&self) -> Option<Decibels> {
        let error = self.error(self.missed);
        (error > 0.0 && self.signal > 0.0).then(|| Decibels(10.0 * (self.signal / error).log10()))
    }

    /// The squares as they were recovered.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &RecoveredTile> {
        self.squares.iter().map(|square| &square.tile)
    }

    /// About how much SNR is lost where `functions` stand for the [squares](Self::tiles): less than
    /// nothing where what was changed was noise.
    pub fn loss(&self, functions: &[TransportFunctions]) -> Decibels {
        let before = self.error(self.missed);
        // What is added to both by noise that is not well known cancels.
        let after = before + self.missed(functions) - self.missed;
        Decibels(10.0 * (after.max(f64::MIN_POSITIVE) / before.max(f64::MIN_POSITIVE)).log10())
    }

    fn error(&self, missed: f64) -> f64 {
        (missed - self.noise).max(RESOLUTION * self.noise)
    }

    /// Sum of the variances of what functions miss.
    fn missed(&self, functions: &[TransportFunctions]) -> f64 {
        let squares = self.squares.iter().zip(functions);
        squares
            .map(|(square, functions)| {
                let predicted = predictions(&self.geometry, &self.held, functions);
                let misses = square.seen.iter().zip(&predicted).map(|(y, p)| y - p);
                let misses: Vec<f64> = misses.collect();
                let of_pixels = misses.chunks_exact(self.held.len() * CHANNELS);
                let of_channels = of_pixels.flat_map(|misses| {
                    (0..CHANNELS)
                        .map(|c| variance(misses.iter().skip(c).step_by(CHANNELS).copied()))
                });
                of_channels.filter(|missed| missed.is_finite()).sum::<f64>()
            })
            .sum()
    }
}

/// Variances between patterns, summed over pixels and channels that are nowhere saturated: of
/// measurements less their noise, and of the noise of those held out.
fn variances(measurements: &Measurements, split: &HoldoutSplit, rect: TileRect) -> (f64, f64) {
    let (mut signal, mut noise) = (0.0, 0.0);
    for pixel in rect.pixels() {
        for c in 0..CHANNELS {
            let sample = |l: &usize| measurements.sample(*l, pixel, c);
            let noise_of = |l: &usize| measurements.variance(*l, c, sample(l));
            let seen = variance(split.all.iter().map(sample));
            if seen.is_finite() {
                signal += seen - mean(split.all.iter().map(noise_of));
            }
            if split.held_out.iter().all(|l| sample(l).is_finite()) {
                noise += mean(split.held_out.iter().map(noise_of));
            }
        }
    }
    (signal, noise)
}

/// The mean; NaN if any value is.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The unbiased variance; NaN if any value is.
fn variance(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let (count, mean) = (values.len() as f64, mean(values.clone()));
    values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)
}
