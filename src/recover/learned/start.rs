//! Where learning starts: the mean light transport function, and smooth variations of it.

use super::equations::{MEAN_WEIGHT, windows};
use super::prior::Prior;
use crate::capture::Measurements;
use crate::recover::dense;
use crate::recover::vector::{add_scaled, dot, vectorised};
use crate::recover::{FEWEST_PATTERNS, Nnls, RecoverError, Workers};
use crate::transport::{CHANNELS, CameraPx, Element, Extent, Geometry, TileRect};

/// Kernels that learning starts with. Together with the mean a whole number of vector registers.
const KERNELS: usize = 95;
/// Rounds of subspace iteration: the kernels need span the large directions, not be exact.
const ROUNDS: usize = 12;
/// Distance, in elements, over which variations of a function are taken to be correlated at first.
/// Twice as much is too smooth for textured glass, and what the start lacks is not learned later.
const CORRELATION: f64 = 1.0;
/// Variance of these variations, as a share of the mean's square.
const VARIANCE: f64 = 0.3;
/// Standard deviation, in elements, of the blur that takes the noise from the pooled mean.
const BLUR: f64 = 1.0;
/// Rounds of finding brightness and mean function in turn. A brightness that is a few per cent off,
/// as it is while the function is unknown, shows as light from far off.
const POOLED_ROUNDS: usize = 3;
/// Parts that sums are made of. Fixed, so that they do not depend on the number of threads.
pub(super) const PARTS: usize = 8;
/// How far, as a share of full brightness, a pixel is from what the mean function says of it: what
/// weighs pixels against each other where noise is less.
pub(in crate::recover) const DEVIATION: f64 = 0.1;

/// Squares of `side` pixels spread evenly over the picture, none over another, at most `most`: all
/// there are room for where the picture is small. Only such whose measurements are at hand.
pub(in crate::recover) fn spread(
    measurements: &Measurements,
    side: u32,
    most: usize,
) -> Vec<TileRect> {
    let camera = measurements.camera;
    squares(camera, side, most, |square| measurements.covers(square))
}

fn squares(
    camera: Extent,
    side: u32,
    most: usize,
    at_hand: impl Fn(TileRect) -> bool,
) -> Vec<TileRect> {
    let extent = Extent {
        width: side.min(camera.width),
        height: side.min(camera.height),
    };
    let cells = Extent {
        width: camera.width / extent.width,
        height: camera.height / extent.height,
    };
    let square = |x: u32, y: u32| TileRect {
        x: x * extent.width,
        y: y * extent.height,
        extent,
    };
    if cells.area() <= most {
        return (0..cells.height)
            .flat_map(|y| (0..cells.width).map(move |x| square(x, y)))
            .filter(|&square| at_hand(square))
            .collect();
    }
    let mut squares: Vec<TileRect> = Vec::with_capacity(most);
    // Roberts's R2 sequence: even, and in step with no pattern of the picture.
    for i in 1..=64 * most {
        let at =
            |step: f64, cells: u32| ((0.5 + step * i as f64).fract() * f64::from(cells)) as u32;
        let (x, y) = (
            at(0.754_877_666_246_69, cells.width),
            at(0.569_840_290_998_05, cells.height),
        );
        if !squares.contains(&square(x, y)) && at_hand(square(x, y)) {
            squares.push(square(x, y));
            if squares.len() == most {
                break;
            }
        }
    }
    squares
}

/// The light transport function that explains all of `squares` at once, each pixel scaled by its
/// brightness; non-negative, of sum 1, `[element]`. `None` without light.
pub(super) fn pooled_mean(
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

/// Those of the patterns `rows` under which no channel of no pixel is saturated; all of them where
/// those are too few, for pixels that are not.
pub(in crate::recover) fn unsaturated(
    measurements: &Measurements,
    rows: &[usize],
    pixels: &[(usize, CameraPx)],
    channels: std::ops::Range<usize>,
) -> Vec<usize> {
    let seen = |&l: &usize| {
        let mut pixels = pixels.iter();
        pixels.all(|&(_, pixel)| {
            let mut channels = channels.clone();
            channels.all(|c| measurements.sample(l, pixel, c).is_finite())
        })
    };
    let usable: Vec<usize> = rows.iter().copied().filter(seen).collect();
    match usable.len() >= FEWEST_PATTERNS {
        true => usable,
        false => rows.to_vec(),
    }
}

/// Mean variance of measurements that are `y` on average, over the patterns `rows`, whose exposures
/// may differ.
pub(in crate::recover) fn mean_variance(
    measurements: &Measurements,
    rows: &[usize],
    c: usize,
    y: f64,
) -> f64 {
    let variances = rows.iter().map(|&l| measurements.variance(l, c, y));
    variances.sum::<f64>() / rows.len().max(1) as f64
}

/// Why nothing can be learned from `squares`.
pub(in crate::recover) fn dark_or_overexposed(
    measurements: &Measurements,
    squares: &[TileRect],
) -> RecoverError {
    let saturated = |pixel| {
        let mut samples = (0..measurements.patterns.len())
            .flat_map(|l| (0..CHANNELS).map(move |c| measurements.sample(l, pixel, c)));
        samples.any(f64::is_nan)
    };
    match squares
        .iter()
        .flat_map(|square| square.pixels())
        .any(saturated)
    {
        true => RecoverError::Overexposed,
        false => RecoverError::Dark,
    }
}

/// Blurs a function on the window, keeping its sum near 1.
pub(super) fn blur(mean: &[f64], side: usize) -> Vec<f64> {
    let reach = (3.0 * BLUR).ceil() as i64;
    let tap = |d: i64| (-0.5 * (d as f64 / BLUR).powi(2)).exp();
    let norm: f64 = (-reach..=reach).map(tap).sum();
    let line = |values: &[f64], stride: usize, lines: usize| {
        let mut out = vec![0.0; values.len()];
        for i in 0..side {
            for line in 0..side {
                out[i * stride + line * lines] = (-reach..=reach)
                    .filter_map(|d| {
                        let j = usize::try_from(i as i64 + d).ok().filter(|&j| j < side)?;
                        Some(tap(d) / norm * values[j * stride + line * lines])
                    })
                    .sum();
            }
        }
        out
    };
    let blurred = line(&line(mean, 1, side), side, 1);
    let sum: f64 = blurred.iter().sum();
    blurred.iter().map(|m| m / sum).collect()
}

/// Kernels that span the likely variations of `mean`, `[r, element]`, orthonormal, and the prior on
/// them: covariance `0.3 h(s) h(t) exp(-|s - t|)`.
pub(super) fn first_prior(mean: &[f64], side: usize, workers: &impl Workers) -> (Vec<f64>, Prior) {
    let area = side * side;
    let rank = KERNELS.min(area);
    let rows = workers.map(area, |s| {
        let (v, u) = ((s / side) as f64, (s % side) as f64);
        (0..area)
            .map(|t| {
                let distance = (v - (t / side) as f64).hypot(u - (t % side) as f64);
                VARIANCE * mean[s] * mean[t] * (-distance / CORRELATION).exp()
            })
            .collect::<Vec<f64>>()
    });
    let apply = |kernels: &[f64]| -> Vec<f64> {
        workers
            .map(rank, |k| {
                let kernel = &kernels[k * area..(k + 1) * area];
                rows.iter()
                    .map(|row| dot(row, kernel))
                    .collect::<Vec<f64>>()
            })
            .concat()
    };
    // Start from functions of rising frequency, which the covariance's own are like.
    let mut kernels: Vec<f64> = (0..rank)
        .flat_map(|k| {
            let (fv, fu) = diagonal(k);
            let wave = move |f: usize, x: usize| {
                (std::f64::consts::PI * f as f64 * (x as f64 + 0.5) / side as f64).cos()
            };
            (0..area).map(move |s| wave(fv, s / side) * wave(fu, s % side) * mean[s].max(1e-9))
        })
        .collect();
    for _ in 0..ROUNDS {
        kernels = apply(&kernels);
        orthonormalise(&mut kernels, area);
    }
    let covariance = dense::product(
        &apply(&kernels),
        &dense::transpose(&kernels, area),
        area,
        rank,
    );
    let coefficients: Vec<f64> = kernels.chunks_exact(area).map(|v| dot(v, mean)).collect();
    (kernels, Prior::new(&coefficients, covariance))
}

/// The `k`-th pair of frequencies, by rising sum.
fn diagonal(k: usize) -> (usize, usize) {
    let mut sum = 0;
    let mut left = k;
    while left > sum {
        left -= sum + 1;
        sum += 1;
    }
    (left, sum - left)
}

/// Gram–Schmidt, twice over for the sake of rounding. Rows that depend on earlier ones are replaced
/// by single elements.
fn orthonormalise(rows: &mut [f64], length: usize) {
    let count = rows.len() / length;
    for k in 0..count {
        let (before, rest) = rows.split_at_mut(k * length);
        let row = &mut rest[..length];
        let mut spare = 0;
        loop {
            let first = dot(row, row).sqrt();
            if first > 0.0 {
                row.iter_mut().for_each(|x| *x /= first);
            }
            for _ in 0..2 {
                for other in before.chunks_exact(length) {
                    let share = dot(other, row);
                    add_scaled(row, -share, other);
                }
            }
            let norm = dot(row, row).sqrt();
            if norm > 1e-8 {
                row.iter_mut().for_each(|x| *x /= norm);
                break;
            }
            if spare == length {
                break;
            }
            row.fill(0.0);
            row[spare] = 1.0;
            spare += 1;
        }
    }
}

/// Keeps the `rank` directions, at most the prior's own number, in which functions vary most, mean and
/// all: kernels `[rank, element]` and the prior on them.
pub(super) fn cut(kernels: &[f64], prior: &Prior, rank: usize, area: usize) -> (Vec<f64>, Prior) {
    let full = prior.rank;
    let mut moment = prior.covariance.clone();
    for mean in &prior.mean {
        for i in 0..full {
            let share = mean[i] / prior.mean.len() as f64;
            add_scaled(&mut moment[i * full..(i + 1) * full], share, mean);
        }
    }
    let (_, vectors) = crate::eigen::symmetric_eigen(moment, full);
    let kept = &vectors[..rank * full];
    let rotated = dense::product(kept, &prior.covariance, full, full);
    let covariance = dense::product(&rotated, &dense::transpose(kept, full), full, rank);
    let mut cut = Prior::new(&vec![0.0; rank], covariance);
    cut.noise = prior.noise;
    for (mean, old) in cut.mean.iter_mut().zip(&prior.mean) {
        *mean = kept.chunks_exact(full).map(|v| dot(v, old)).collect();
    }
    (dense::product(kept, kernels, full, area), cut)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recover::OneThread;

    #[test]
    fn squares_are_spread_and_apart() {
        let camera = Extent {
            width: 128,
            height: 96,
        };
        let chosen = squares(camera, 16, 24, |_| true);
        assert_eq!(chosen.len(), 24);
        for (i, a) in chosen.iter().enumerate() {
            assert!(a.x + 16 <= 128 && a.y + 16 <= 96);
            for b in &chosen[..i] {
                assert!(a.x.abs_diff(b.x) >= 16 || a.y.abs_diff(b.y) >= 16);
            }
        }
        assert_eq!(
            squares(
                Extent {
                    width: 3,
                    height: 5
                },
                16,
                24,
                |_| true
            )
            .len(),
            1
        );
    }

    #[test]
    fn first_kernels_are_orthonormal() {
        let side = 11;
        let mut mean = vec![0.0; side * side];
        mean[60] = 0.7;
        mean[61] = 0.3;
        let (kernels, prior) = first_prior(&blur(&mean, side), side, &OneThread);
        for i in 0..prior.rank {
            for j in 0..=i {
                let row = |k: usize| &kernels[k * 121..(k + 1) * 121];
                let expected = f64::from(u8::from(i == j));
                assert!((dot(row(i), row(j)) - expected).abs() < 1e-9);
            }
        }
    }
}
