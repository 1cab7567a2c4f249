//! One light transport function for all pixels: what tells whether there is anything to recover,
//! and where learning starts.

use super::holdout::HoldoutSplit;
use super::sampling::{
    mean_variance, pixels_by_window, reaches_display, spread_squares, unsaturated,
};
use super::{Nnls, RecoverError, pattern_check};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::linalg::{self, add_scaled, dot, vectorise};
use crate::transport::{CHANNELS, CameraPx, Element, Geometry, TileRect, Window};

/// Rounds of finding brightness and mean function in turn. A brightness that is a few per cent off,
/// as it is while the function is unknown, shows as light from far off.
const POOLED_ROUNDS: usize = 3;
/// Parts that sums are made of. Fixed, so that they do not depend on the number of threads.
const PARTS: usize = 8;
/// How far, as a share of full brightness, a pixel is from what the mean function says of it: what
/// weighs pixels against each other where noise is less.
pub(super) const DEVIATION: f64 = 0.1;
/// Weight of the mean over patterns against a centred equation. Noise alone would make it 1; the
/// dark frame's own noise and light from beyond the window shift a pixel by a constant, which
/// averaging over patterns does not lower.
pub(super) const MEAN_WEIGHT: f64 = 0.3;

/// Squares that are looked at, and their side in pixels.
const SQUARES: (usize, u32) = (128, 4);
/// Most channels of pixels in them.
pub(super) const MAX_SAMPLES: usize = SQUARES.0 * (SQUARES.1 * SQUARES.1) as usize * CHANNELS;
/// About the most memory that [`mean_function`] takes, in bytes.
pub(super) fn bytes(window: Window) -> usize {
    (PARTS + 2) * window.area() * window.area() * size_of::<f64>()
}

/// The squares that are looked at.
pub(super) fn sample_squares(measurements: &Measurements) -> Vec<TileRect> {
    spread_squares(measurements, SQUARES.1, SQUARES.0)
}

/// The mean light transport function, non-negative, of sum 1, `[element]`; an error where what was
/// photographed tells none.
pub(super) fn mean_function(
    measurements: &Measurements,
    geometry: &Geometry,
    split: &HoldoutSplit,
    executor: &impl Executor,
) -> Result<Vec<f64>, RecoverError> {
    let squares = sample_squares(measurements);
    if !reaches_display(geometry) {
        return Err(RecoverError::CorrespondenceOffLightPlane);
    }
    let mean = pooled_mean(measurements, geometry, &split.training, &squares, executor)?
        .ok_or_else(|| dark_or_overexposed(measurements, &squares))?;
    executor.check_cancelled()?;
    pattern_check::check_patterns(measurements, geometry, split, &mean, &squares, executor)?;
    Ok(mean)
}

/// The light transport function that explains all of `squares` at once, each pixel scaled by its
/// brightness; non-negative, of sum 1, `[element]`. `None` without light.
fn pooled_mean(
    measurements: &Measurements,
    geometry: &Geometry,
    rows: &[usize],
    squares: &[TileRect],
    executor: &impl Executor,
) -> Result<Option<Vec<f64>>, RecoverError> {
    let area = geometry.window.area();
    let mut mean = vec![1.0 / area as f64; area];
    for _ in 0..POOLED_ROUNDS {
        executor.check_cancelled()?;
        let right = pooled_round(measurements, geometry, rows, squares, &mean, executor);
        let sum: f64 = right.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return Ok(None);
        }
        mean = right.iter().map(|m| m / sum).collect();
    }
    Ok(Some(mean))
}

/// One round: brightness as seen with `mean`, then the function that explains all pixels.
fn pooled_round(
    measurements: &Measurements,
    geometry: &Geometry,
    rows: &[usize],
    squares: &[TileRect],
    mean: &[f64],
    executor: &impl Executor,
) -> Vec<f64> {
    let area = geometry.window.area();
    let whole = |square: &&TileRect| {
        let mut pixels = square.pixels();
        pixels.all(|pixel| on_display(geometry, geometry.window_origin(pixel)))
    };
    let only_whole = 4 * squares.iter().filter(whole).count() >= squares.len();
    let parts = executor.map(PARTS, |part| {
        let mut sums = Pooled {
            gram: vec![0.0; area * area],
            right: vec![0.0; area],
        };
        for square in squares.iter().skip(part).step_by(PARTS) {
            for (origin, pixels) in pixels_by_window(geometry, *square) {
                if only_whole && !on_display(geometry, origin) {
                    continue;
                }
                vectorise(
                    #[inline(always)]
                    || sums.add(measurements, geometry, rows, mean, (origin, &pixels)),
                );
            }
        }
        sums
    });
    let mut total = Pooled {
        gram: vec![0.0; area * area],
        right: vec![0.0; area],
    };
    for part in parts {
        add_scaled(&mut total.gram, 1.0, &part.gram);
        add_scaled(&mut total.right, 1.0, &part.right);
    }
    linalg::mirror_upper(&mut total.gram, area);
    Nnls::new(&total.gram, area).solve(&total.right)
}

/// Whether all of the window lies on the display.
fn on_display(geometry: &Geometry, origin: Element) -> bool {
    let side = i64::from(geometry.window.side());
    let inside = |at: i32, length: u32| at >= 0 && i64::from(at) + side <= i64::from(length);
    inside(origin.u, geometry.light.width) && inside(origin.v, geometry.light.height)
}

struct Pooled {
    /// Upper triangle.
    gram: Vec<f64>,
    right: Vec<f64>,
}

impl Pooled {
    #[inline(always)]
    fn add(
        &mut self,
        measurements: &Measurements,
        geometry: &Geometry,
        rows: &[usize],
        mean: &[f64],
        (origin, pixels): (Element, &[(usize, CameraPx)]),
    ) {
        let area = geometry.window.area();
        let elements: Vec<(usize, usize)> = (0..area)
            .filter_map(|slot| {
                let element = geometry.window.element(origin, slot);
                Some((slot, element.index_in(geometry.light)?))
            })
            .collect();
        for (plane, channels) in measurements.planes() {
            let rows = unsaturated(measurements, rows, pixels, channels.clone());
            let count = rows.len();
            let mut columns = vec![0.0; elements.len() * count];
            for (i, &l) in rows.iter().enumerate() {
                let pattern = measurements.patterns[l].plane(plane);
                for (j, &(_, m)) in elements.iter().enumerate() {
                    columns[j * count + i] = f64::from(pattern[m]);
                }
            }
            let means: Vec<f64> = columns
                .chunks_exact_mut(count)
                .map(|column| {
                    let mean = column.iter().sum::<f64>() / count as f64;
                    column.iter_mut().for_each(|p| *p -= mean);
                    mean
                })
                .collect();
            let level: f64 = elements
                .iter()
                .zip(&means)
                .map(|((s, _), p)| mean[*s] * p)
                .sum();
            if level <= 0.0 {
                continue;
            }
            let weight = count as f64 * MEAN_WEIGHT * MEAN_WEIGHT;
            let (mut energy, mut seen) = (0.0, vec![0.0; count]);
            let mut seen_mean = 0.0;
            for &(_, pixel) in pixels {
                for c in channels.clone() {
                    let y: Vec<f64> = rows
                        .iter()
                        .map(|&l| measurements.sample(l, pixel, c))
                        .collect();
                    let mean = y.iter().sum::<f64>() / count as f64;
                    // Also false where some sample is saturated.
                    if mean > 0.0 {
                        let variance = mean_variance(measurements, &rows, c, mean);
                        let brightness = mean / level;
                        let weight =
                            1.0 / (DEVIATION * DEVIATION + variance / (brightness * brightness));
                        energy += weight;
                        add_scaled(&mut seen, weight / brightness, &y);
                        seen_mean += weight / brightness * mean;
                    }
                }
            }
            for (i, &(slot, _)) in elements.iter().enumerate() {
                let a = &columns[i * count..(i + 1) * count];
                self.right[slot] += dot(a, &seen) + weight * means[i] * seen_mean;
                for (j, &(other, _)) in elements.iter().enumerate().skip(i) {
                    let b = &columns[j * count..(j + 1) * count];
                    self.gram[slot * area + other] +=
                        energy * (dot(a, b) + weight * means[i] * means[j]);
                }
            }
        }
    }
}

/// Why nothing can be learned from `squares`.
pub(super) fn dark_or_overexposed(
    measurements: &Measurements,
    squares: &[TileRect],
) -> RecoverError {
    let saturated = |pixel| {
        let mut samples = (0..measurements.patterns.len())
            .flat_map(|l| (0..CHANNELS).map(move |c| measurements.sample(l, pixel, c)));
        samples.any(f64::is_nan)
    };
    let pixels = squares.iter().flat_map(|square| square.pixels());
    let [all, saturated] = pixels.fold([0, 0], |[all, some], pixel| {
        [all + 1, some + usize::from(saturated(pixel))]
    });
    match 2 * saturated > all {
        true => RecoverError::Overexposed,
        false => RecoverError::NoSignal,
    }
}
