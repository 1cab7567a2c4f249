//! One light transport function for all pixels: what tells whether there is anything to recover,
//! and where learning starts.

use super::holdout::Split;
use super::sample::{mean_variance, reaches_display, spread, unsaturated, windows};
use super::vector::{add_scaled, dot, vectorised};
use super::{Nnls, RecoverError, Workers, dense};
use crate::capture::Measurements;
use crate::transport::{CHANNELS, CameraPx, Element, Geometry, TileRect};

/// Rounds of finding brightness and mean function in turn. A brightness that is a few per cent off,
/// as it is while the function is unknown, shows as light from far off.
const POOLED_ROUNDS: usize = 3;
/// Parts that sums are made of. Fixed, so that they do not depend on the number of threads.
pub(super) const PARTS: usize = 8;
/// How far, as a share of full brightness, a pixel is from what the mean function says of it: what
/// weighs pixels against each other where noise is less.
pub(super) const DEVIATION: f64 = 0.1;
/// Weight of the mean over patterns against a centred equation. Noise alone would make it 1; the
/// dark frame's own noise and light from beyond the window shift a pixel by a constant, which
/// averaging over patterns does not lower.
pub(super) const MEAN_WEIGHT: f64 = 0.3;

/// Squares that are looked at, and their side in pixels.
const SQUARES: (usize, u32) = (128, 4);
/// Least correlation of patterns held out, as the mean function shows them, with what was
/// photographed. Where the two have nothing to do with each other it is zero but for chance; of
/// captures that are worth recovering it is above a half.
const RELATED: f64 = 0.1;

/// Share of the correlation usual in a capture below which a pattern's photograph is of another.
const ASTRAY: f64 = 0.3;
/// Fewest windows that tell one photograph from another.
const FEWEST_WINDOWS: usize = 64;

/// The squares that are looked at.
pub(super) fn squares(measurements: &Measurements) -> Vec<TileRect> {
    spread(measurements, SQUARES.1, SQUARES.0)
}

/// The mean light transport function, non-negative, of sum 1, `[element]`; an error where what was
/// photographed tells none.
pub(super) fn mean_function(
    measurements: &Measurements,
    geometry: &Geometry,
    split: &Split,
    workers: &impl Workers,
) -> Result<Vec<f64>, RecoverError> {
    let squares = squares(measurements);
    if !reaches_display(geometry) {
        return Err(RecoverError::NoLight);
    }
    let mean = pooled_mean(measurements, geometry, &split.learn, &squares, workers)
        .ok_or_else(|| dark_or_overexposed(measurements, &squares))?;
    let parts = workers.map(squares.len(), |i| {
        let mut agreement = vec![Agreement::default(); split.all.len()];
        let windows = windows(geometry, squares[i]);
        let count = windows.len();
        for (origin, pixels) in windows {
            agree(
                &mut agreement,
                measurements,
                geometry,
                split,
                &mean,
                (origin, &pixels),
            );
        }
        (agreement, count)
    });
    let mut by_pattern = vec![Agreement::default(); split.all.len()];
    for (part, _) in &parts {
        for (sum, part) in by_pattern.iter_mut().zip(part) {
            sum.add(*part);
        }
    }
    let mut held = Agreement::default();
    split.held.iter().for_each(|&l| held.add(by_pattern[l]));
    if held
        .correlation()
        .is_some_and(|correlation| correlation < RELATED)
    {
        return Err(RecoverError::Unrelated);
    }
    let looked_at: usize = parts.iter().map(|(_, windows)| windows).sum();
    match astray(&by_pattern) {
        patterns if !patterns.is_empty() && looked_at >= FEWEST_WINDOWS => {
            Err(RecoverError::Astray(patterns))
        }
        _ => Ok(mean),
    }
}

/// Patterns that show what was photographed far worse than others do.
fn astray(by_pattern: &[Agreement]) -> Vec<usize> {
    let correlations: Vec<Option<f64>> = by_pattern.iter().map(|a| a.correlation()).collect();
    let mut known: Vec<f64> = correlations.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    // Of those that are right, if no more than nine in ten are wrong.
    let Some(usual) = known.get(known.len() * 9 / 10) else {
        return Vec::new();
    };
    let worse = |c: &Option<f64>| c.is_some_and(|c| c < ASTRAY * usual);
    (0..by_pattern.len())
        .filter(|&l| worse(&correlations[l]))
        .collect()
}

/// Inner products, over pixels, of what the mean function says that differs from a pixel's mean, and
/// what was photographed.
#[derive(Clone, Copy, Debug, Default)]
struct Agreement {
    shown: f64,
    both: f64,
    seen: f64,
}

impl Agreement {
    fn add(&mut self, other: Self) {
        self.shown += other.shown;
        self.both += other.both;
        self.seen += other.seen;
    }

    /// `None` where nothing is seen, or shown, that differs.
    fn correlation(self) -> Option<f64> {
        let correlation = self.both / (self.shown * self.seen).sqrt();
        correlation.is_finite().then_some(correlation)
    }
}

/// Adds one window's pixels to `agreement`, `[pattern]`.
fn agree(
    agreement: &mut [Agreement],
    measurements: &Measurements,
    geometry: &Geometry,
    split: &Split,
    mean: &[f64],
    (origin, pixels): (Element, &[(usize, CameraPx)]),
) {
    for (plane, channels) in measurements.planes() {
        let shown = |&l: &usize| {
            let pattern = measurements.patterns[l].plane(plane);
            let slots = mean.iter().enumerate().filter_map(|(slot, m)| {
                let element = geometry.window.element(origin, slot);
                Some(m * f64::from(pattern[element.index_in(geometry.light)?]))
            });
            slots.sum::<f64>()
        };
        let shown: Vec<f64> = split.all.iter().map(shown).collect();
        let pixels = pixels.iter().map(|&(_, pixel)| pixel);
        for (pixel, c) in pixels.flat_map(|pixel| channels.clone().map(move |c| (pixel, c))) {
            let sample = |l: usize| measurements.sample(l, pixel, c);
            let known = split.learn.iter().filter(|&&l| sample(l).is_finite());
            let sums = known.fold([0.0; 3], |[shown_sum, seen, count], &l| {
                [shown_sum + shown[l], seen + sample(l), count + 1.0]
            });
            let [level, light, count] = sums;
            if !(level > 0.0 && light > 0.0) {
                continue;
            }
            for (l, agreement) in agreement.iter_mut().enumerate() {
                let seen = sample(l) - light / count;
                if seen.is_finite() {
                    let shown = light / level * (shown[l] - level / count);
                    agreement.add(Agreement {
                        shown: shown * shown,
                        both: shown * seen,
                        seen: seen * seen,
                    });
                }
            }
        }
    }
}

/// The light transport function that explains all of `squares` at once, each pixel scaled by its
/// brightness; non-negative, of sum 1, `[element]`. `None` without light.
fn pooled_mean(
    measurements: &Measurements,
    geometry: &Geometry,
    rows: &[usize],
    squares: &[TileRect],
    workers: &impl Workers,
) -> Option<Vec<f64>> {
    let area = geometry.window.area();
    let mut mean = vec![1.0 / area as f64; area];
    for _ in 0..POOLED_ROUNDS {
        let right = pooled_round(measurements, geometry, rows, squares, &mean, workers);
        let sum: f64 = right.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return None;
        }
        mean = right.iter().map(|m| m / sum).collect();
    }
    Some(mean)
}

/// One round: brightness as seen with `mean`, then the function that explains all pixels.
fn pooled_round(
    measurements: &Measurements,
    geometry: &Geometry,
    rows: &[usize],
    squares: &[TileRect],
    mean: &[f64],
    workers: &impl Workers,
) -> Vec<f64> {
    let area = geometry.window.area();
    let whole = |square: &&TileRect| {
        let mut pixels = square.pixels();
        pixels.all(|pixel| on_display(geometry, geometry.window_origin(pixel)))
    };
    let only_whole = 4 * squares.iter().filter(whole).count() >= squares.len();
    let parts = workers.map(PARTS, |part| {
        let mut sums = Pooled {
            gram: vec![0.0; area * area],
            right: vec![0.0; area],
        };
        for square in squares.iter().skip(part).step_by(PARTS) {
            for (origin, pixels) in windows(geometry, *square) {
                if only_whole && !on_display(geometry, origin) {
                    continue;
                }
                vectorised(
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
    dense::mirror(&mut total.gram, area);
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
        false => RecoverError::Dark,
    }
}
