//! Generalised least squares for the corrections of all photographs, and for the shifts of the camera between them.
//!
//! A correction `s_l y_l + o_l` of small effect changes a pixel's scaled residual `r = y − m` by `D_y (s − 1) + o/f`, with
//! `D_y = diag(y)`; a shift d of the picture is undone by `(∂y/∂x) d_x + (∂y/∂y) d_y`, to first order. The corrections
//! minimise `Σ rᵀ K⁻¹ r` over sampled pixels and channels. The objective is quadratic: one step leads to its minimum, but
//! for the brightness f, which depends on the corrections.
//!
//! Unknowns are `[scales, shifts x, shifts y, offsets, leak]`, L of each but the leak. The means of scales and shifts are
//! fixed, as brightness and functions absorb them. The leak is the light from outside the window relative to brightness, nearly constant, the same for all pixels: it must
//! not pass for stray light, which does not depend on brightness.

use super::resampling::{ResampledPhotographs, ResamplingInput};
use super::window_covariance::{AXES, ScaledPixel, WindowCovariance, WindowModel, differences};
use crate::capture::Measurements;
use crate::job_executor::{Cancelled, Executor, PARTS, share_of_jobs};
use crate::linalg::{self, add_scaled, dot, vectorise};
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::recover::sampling::{self, PixelsSharingWindow};
use crate::transport::{Geometry, LightElement, TileRect, Window};

/// Most photographs whose equations fit in memory.
pub(super) const MAX_PHOTOGRAPHS: usize = 256;
/// Weight of the constraints on means, relative to the equations'.
const GAUGE_WEIGHT: f64 = 1e3;
/// Added to the mean squared deviation of a pixel's photographs, whose inverse weights the pixel: how far functions are
/// from the mean function differs between parts of an object.
const MIN_DEVIATION: f64 = 0.1;
/// Distance, in camera pixels, of the samples whose difference is a gradient.
pub(in crate::recover) const GRADIENT_MARGIN: u32 = 1;
/// Ridge relative to the equations' diagonal: a dark photograph has no equations of its own.
const RIDGE: f64 = 1e-8;

/// The corrections that improve the fit most, and how well the photographs fit without them.
pub(super) struct CorrectionStep {
    /// Shift of each photograph's picture, in camera pixels, relative to their mean, `[2][L]`.
    pub shifts: [Vec<f64>; 2],
    /// Standard errors of the same.
    pub shift_errors: [Vec<f64>; 2],
    /// Shift of the flood photograph's picture relative to those of the others as they are corrected, in camera pixels;
    /// `None` without one.
    pub flood_shift: Option<[f64; 2]>,
    /// Change of each photograph's scale and offset, `[2][L]`.
    pub steps: [Vec<f64>; 2],
    /// Standard errors of the same.
    pub errors: [Vec<f64>; 2],
    /// Standard error of the offsets' mean.
    pub mean_offset_error: f64,
    /// Energy of the leave-one-out residuals, relative to that of the measurements' differences between photographs.
    pub unexplained_share: f64,
    /// Mean square of each photograph's leave-one-out residuals, by their expected variances and relative to the mean of
    /// all photographs of a pixel, `[L]`.
    pub deviations: Vec<f64>,
}

/// Fits the changes of the corrections of the photographs used, on one window of each square. `None` if too little is
/// measured.
///
/// # Errors
/// [`Cancelled`].
pub(super) async fn fit(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    input: ResamplingInput<'_>,
    squares: &[TileRect],
) -> Result<Option<CorrectionStep>, Cancelled> {
    let (executor, patterns) = (preparation.executor, input.used.len());
    let input = ResamplingInput {
        is_exact: false,
        ..input
    };
    let picture = ResampledPhotographs::of_small_picture(input, squares.len());
    let sum_part = |part: usize| {
        let mut sums = CalibrationSums::zeros(patterns);
        for square in &squares[share_of_jobs(squares.len(), part, PARTS)] {
            sums.scores
                .resize(sums.scores.len() + unknowns(patterns), 0.0);
            let region = sampling::with_margin(input.measurements.camera, *square, GRADIENT_MARGIN);
            let resampled = match &picture {
                Some(_) => None,
                None => ResampledPhotographs::of_region(input, region),
            };
            let measurements = input.calibrated(picture.as_ref().or(resampled.as_ref()));
            let preparation = &preparation.with(&measurements);
            for_largest_window(&preparation.geometry, *square, |origin, pixels| {
                vectorise(
                    #[cfg_attr(target_arch = "x86_64", inline(always))]
                    || {
                        let (mean_function, used) = (input.mean_function, input.used);
                        sums.add_window(preparation, mean_function, used, origin, pixels);
                    },
                );
            });
        }
        sums.into_values()
    };
    let parts = executor.all_gather(PARTS, sum_part).await?;
    let mut total = CalibrationSums::zeros(patterns);
    parts.iter().for_each(|part| total.add_values(part));
    Ok(total.solve())
}

/// Gives the window that most pixels of a square share, and these pixels.
pub(super) fn for_largest_window(
    geometry: &Geometry,
    square: TileRect,
    mut visit: impl FnMut(LightElement, &PixelsSharingWindow),
) {
    let windows = sampling::pixels_by_window(geometry, square);
    // The first of equals.
    let largest = windows.iter().rev().max_by_key(|(_, pixels)| pixels.len());
    if let Some((origin, pixels)) = largest {
        visit(*origin, pixels);
    }
}

/// Gives the largest window of a square with its scaled pixels, from corrected photographs; once for each plane. `picture`
/// holds the resampled photographs, unless the square has to be resampled alone.
pub(super) fn for_scaled_pixels(
    input: ResamplingInput<'_>,
    picture: Option<&ResampledPhotographs<'_>>,
    square: TileRect,
    mut visit: impl FnMut(LightElement, &WindowCovariance, &[ScaledPixel]),
) {
    let region = match picture {
        Some(_) => None,
        None => ResampledPhotographs::of_region(input, square),
    };
    let measurements = input.calibrated(picture.or(region.as_ref()));
    for_largest_window(input.geometry, square, |origin, pixels| {
        for (plane, channels) in measurements.planes() {
            let model = WindowModel::new(
                &measurements,
                input.geometry,
                input.mean_function,
                origin,
                plane,
                input.used,
            );
            let window = model.with_pixels(&measurements, input.used, pixels, channels);
            if let Some((window, pixels)) = window {
                visit(origin, &window, &pixels);
            }
        }
    });
}

/// Upper bound on the memory that [`fit`] takes for so many photographs, in bytes: the sums of each part, those of all,
/// and for each part the model of a window.
pub(in crate::recover) fn max_bytes(window: Window, photographs: usize) -> usize {
    let photographs = photographs.min(MAX_PHOTOGRAPHS);
    let sums = (2 * PARTS + 2) * unknowns(photographs).pow(2);
    let window = PARTS * photographs * (14 * photographs + 2 * window.area());
    (sums + window) * size_of::<f64>()
}

struct CalibrationSums {
    patterns: usize,
    /// `[4L + 1, 4L + 1]`; of the blocks, upper and diagonal ones.
    hessian: Vec<f64>,
    /// Sums of [`CorrectionStep::deviations`], `[L]`.
    deviations: Vec<f64>,
    /// Number of pixels and channels.
    count: f64,
    /// Energies of leave-one-out residuals and of differences between photographs.
    energies: [f64; 2],
    /// Regression of the flood photograph: sums of products of its [columns](FLOOD_COLUMNS).
    flood: Vec<f64>,
    /// Negative gradient of each square, `[square, 4L + 1]`.
    scores: Vec<f64>,
}

/// Columns of the regression of the flood photograph: its prediction, gradients to the right and down, second differences
/// along both axes, a constant, and the photograph. Predictions from resampled photographs are less sharp than the flood
/// photograph; without second differences, part of this would pass for a shift.
const FLOOD_COLUMNS: usize = 7;

/// Kinds of unknowns whose columns differ from photograph to photograph: scales and shifts.
const VARYING: usize = 3;

fn unknowns(patterns: usize) -> usize {
    (VARYING + 1) * patterns + 1
}

impl CalibrationSums {
    fn zeros(patterns: usize) -> Self {
        Self {
            patterns,
            hessian: vec![0.0; unknowns(patterns).pow(2)],
            deviations: vec![0.0; patterns],
            count: 0.0,
            energies: [0.0; 2],
            flood: vec![0.0; FLOOD_COLUMNS * FLOOD_COLUMNS],
            scores: Vec::new(),
        }
    }

    /// Everything in one list.
    fn into_values(self) -> Vec<f64> {
        let energies = vec![self.count, self.energies[0], self.energies[1]];
        [
            self.hessian,
            self.deviations,
            energies,
            self.flood,
            self.scores,
        ]
        .concat()
    }

    /// Adds the list of another part, whose squares follow.
    fn add_values(&mut self, values: &[f64]) {
        let (hessian, rest) = values.split_at(self.hessian.len());
        let (deviations, rest) = rest.split_at(self.patterns);
        add_scaled(&mut self.hessian, 1.0, hessian);
        add_scaled(&mut self.deviations, 1.0, deviations);
        self.count += rest[0];
        add_scaled(&mut self.energies, 1.0, &rest[1..3]);
        let (flood, scores) = rest[3..].split_at(self.flood.len());
        add_scaled(&mut self.flood, 1.0, flood);
        self.scores.extend_from_slice(scores);
    }

    /// Adds a window to the sums and to the last square's score.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_window(
        &mut self,
        preparation: &RecoveryPreparationInput<'_, impl Executor>,
        mean_function: &[f64],
        pattern_indices: &[usize],
        origin: LightElement,
        pixels: &PixelsSharingWindow,
    ) {
        let measurements = preparation.measurements;
        for (plane, channels) in measurements.planes() {
            let model = WindowModel::new(
                measurements,
                &preparation.geometry,
                mean_function,
                origin,
                plane,
                pattern_indices,
            );
            let window = model.with_pixels(measurements, pattern_indices, pixels, channels);
            if let Some((window, pixels)) = window {
                self.add_pixels(&window, &pixels);
                let flood = WindowModel::of_flood(&preparation.geometry, mean_function, origin);
                self.add_flood(measurements, &window, &flood, &pixels);
            }
        }
    }

    /// Adds the flood photograph's pixels to its regression.
    fn add_flood(
        &mut self,
        measurements: &Measurements,
        window: &WindowCovariance,
        flood: &WindowModel,
        pixels: &[ScaledPixel],
    ) {
        for scaled in pixels {
            let sample = |pixel| measurements.flood_sample(pixel, scaled.channel);
            let measured = sample(scaled.pixel);
            if measured.is_nan() {
                continue;
            }
            let [[right, second_x], [down, second_y]] =
                AXES.map(|step| differences(measurements.camera, sample, scaled.pixel, step));
            let mut columns = [
                predict(window, flood, scaled)[0] / scaled.unit,
                right,
                down,
                second_x,
                second_y,
                1.0,
                measured,
            ];
            columns.iter_mut().for_each(|value| *value *= scaled.unit);
            for (row, factor) in self.flood.chunks_exact_mut(FLOOD_COLUMNS).zip(columns) {
                add_scaled(row, factor, &columns);
            }
        }
    }

    /// A shift d changes the flood photograph by `−∇·d`, to first order.
    fn flood_shift(&self) -> Option<[f64; 2]> {
        const UNKNOWNS: usize = FLOOD_COLUMNS - 1;
        let rows = self.flood.chunks_exact(FLOOD_COLUMNS).take(UNKNOWNS);
        let matrix: Vec<f64> = rows.flat_map(|row| &row[..UNKNOWNS]).copied().collect();
        let trace: f64 = (0..UNKNOWNS).map(|i| matrix[i * UNKNOWNS + i]).sum();
        let ridge = RIDGE * trace;
        let (factor, _) = linalg::cholesky_with_ridge(&matrix, UNKNOWNS, ridge)?;
        let mut solution = self.flood[UNKNOWNS * FLOOD_COLUMNS..][..UNKNOWNS].to_vec();
        linalg::cholesky_solve(&factor, &mut solution);
        (trace > 0.0).then(|| [-solution[1], -solution[2]])
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_pixels(&mut self, window: &WindowCovariance, pixels: &[ScaledPixel]) {
        let l = self.patterns;
        let n = unknowns(l);
        let start = self.scores.len() - n;
        let score = &mut self.scores[start..];
        // `K⁻¹1`: what the leak's column becomes.
        let leak: Vec<f64> = window
            .inverse
            .chunks_exact(l)
            .map(|row| row.iter().sum())
            .collect();
        // Sums over pixels of products: between varying columns; of these with 1/f and with the leak; and of the latter two.
        let mut products = vec![0.0; VARYING * VARYING * l * l];
        let (mut offset_sums, mut leak_sums) = (vec![0.0; VARYING * l], vec![0.0; VARYING * l]);
        let [mut offsets, mut leaks, mut offset_leaks] = [0.0; 3];
        let mut solved = vec![0.0; l];
        for pixel in pixels {
            linalg::multiply_vector(
                &window.inverse,
                &pixel.residual(&window.model.means),
                &mut solved,
            );
            // Relative to the variance of the model, and to that of model and noise.
            let deviation = |i: usize| solved[i] * solved[i] / window.inverse[i * l + i];
            let noisy_deviation =
                |i: usize| deviation(i) / (1.0 + window.inverse[i * l + i] * pixel.noise[i]);
            let mean =
                |deviation: &dyn Fn(usize) -> f64| (0..l).map(deviation).sum::<f64>() / l as f64;
            let weight = 1.0 / (mean(&deviation) + MIN_DEVIATION);
            let typical = mean(&noisy_deviation).max(f64::MIN_POSITIVE);
            let mean = pixel.y.iter().sum::<f64>() / l as f64;
            let [right, down] = &pixel.gradients;
            let columns = [&pixel.y, right, down];
            for i in 0..l {
                self.deviations[i] += noisy_deviation(i) / typical;
                let left_out = solved[i] / window.inverse[i * l + i];
                self.energies[0] += weight * left_out * left_out;
                self.energies[1] += weight * (pixel.y[i] - mean).powi(2);
                score[VARYING * l + i] -= weight * pixel.unit * solved[i];
            }
            for (a, column) in columns.iter().enumerate() {
                for i in 0..l {
                    score[a * l + i] -= weight * column[i] * solved[i];
                }
                for b in a..VARYING {
                    let block = &mut products[(a * VARYING + b) * l * l..][..l * l];
                    for (row, value) in block.chunks_exact_mut(l).zip(*column) {
                        add_scaled(row, weight * value, columns[b]);
                    }
                }
                let range = a * l..(a + 1) * l;
                add_scaled(&mut offset_sums[range.clone()], weight * pixel.unit, column);
                add_scaled(&mut leak_sums[range], weight * pixel.weight, column);
            }
            score[n - 1] -= weight * pixel.weight * solved.iter().sum::<f64>();
            offsets += weight * pixel.unit * pixel.unit;
            offset_leaks += weight * pixel.unit * pixel.weight;
            leaks += weight * pixel.weight * pixel.weight;
        }
        self.count += pixels.len() as f64;
        let (rows, leak_row) = self.hessian.split_at_mut(n * (n - 1));
        for (k, row) in rows.chunks_exact_mut(n).enumerate() {
            let (a, i) = (k / l, k % l);
            let inverse = &window.inverse[i * l..(i + 1) * l];
            if a == VARYING {
                add_scaled(&mut row[a * l..(a + 1) * l], offsets, inverse);
                row[n - 1] += offset_leaks * leak[i];
                continue;
            }
            for b in a..VARYING {
                let products = &products[((a * VARYING + b) * l + i) * l..][..l];
                linalg::add_products(&mut row[b * l..(b + 1) * l], inverse, products);
            }
            add_scaled(
                &mut row[VARYING * l..(VARYING + 1) * l],
                offset_sums[k],
                inverse,
            );
            row[n - 1] += leak_sums[k] * leak[i];
        }
        leak_row[n - 1] += leaks * leak.iter().sum::<f64>();
    }

    fn solve(&self) -> Option<CorrectionStep> {
        let l = self.patterns;
        let n = unknowns(l);
        // Scaled to a diagonal of 1.
        let diagonal = |i: usize| {
            self.hessian[i * n + i]
                .max(f64::MIN_POSITIVE)
                .sqrt()
                .recip()
        };
        let scale: Vec<f64> = (0..n).map(diagonal).collect();
        let mut matrix = vec![0.0; n * n];
        for i in 0..n {
            for j in i..n {
                matrix[i * n + j] = scale[i] * scale[j] * self.hessian[i * n + j];
            }
            matrix[i * n + i] += RIDGE;
        }
        for a in 0..VARYING {
            let range = a * l..(a + 1) * l;
            let norm: f64 = scale[range.clone()].iter().map(|s| s * s).sum();
            for i in range.clone() {
                let factor = GAUGE_WEIGHT * scale[i] / norm;
                let row = &mut matrix[i * n + i..i * n + range.end];
                add_scaled(row, factor, &scale[i..range.end]);
            }
        }
        linalg::cholesky(&mut matrix, n)?;
        let solve = |score: &[f64]| -> Vec<f64> {
            let mut x: Vec<f64> = score.iter().zip(&scale).map(|(b, s)| b * s).collect();
            linalg::cholesky_solve(&matrix, &mut x);
            x.iter().zip(&scale).map(|(x, s)| x * s).collect()
        };
        let mut step = vec![0.0; n];
        let mut variances = vec![0.0; n];
        let mut mean_offset_variance = 0.0;
        let shares: Vec<Vec<f64>> = self.scores.chunks_exact(n).map(solve).collect();
        shares
            .iter()
            .for_each(|share| add_scaled(&mut step, 1.0, share));
        for share in &shares {
            let mut deviation = share.clone();
            add_scaled(&mut deviation, -1.0 / shares.len() as f64, &step);
            linalg::add_products(&mut variances, &deviation, &deviation);
            let offsets = &deviation[VARYING * l..(VARYING + 1) * l];
            let mean = offsets.iter().sum::<f64>() / l as f64;
            mean_offset_variance += mean * mean;
        }
        let errors: Vec<f64> = variances.iter().map(|variance| variance.sqrt()).collect();
        let deviations = self.deviations.iter().map(|d| d / self.count);
        let parts =
            |values: &[f64], kinds: [usize; 2]| kinds.map(|a| values[a * l..(a + 1) * l].to_vec());
        (self.count > 0.0).then(|| CorrectionStep {
            steps: parts(&step, [0, VARYING]),
            errors: parts(&errors, [0, VARYING]),
            shifts: parts(&step, [1, 2]),
            flood_shift: self.flood_shift(),
            shift_errors: parts(&errors, [1, 2]),
            mean_offset_error: mean_offset_variance.sqrt(),
            unexplained_share: self.energies[0] / self.energies[1],
            deviations: deviations.collect(),
        })
    }
}

/// The prediction of photographs that are not in the window's list, `[other]`, for one of its pixels.
pub(super) fn predict(
    window: &WindowCovariance,
    others: &WindowModel,
    pixel: &ScaledPixel,
) -> Vec<f64> {
    let l = window.model.means.len();
    let mut solved = vec![0.0; l];
    let residual = pixel.residual(&window.model.means);
    linalg::multiply_vector(&window.inverse, &residual, &mut solved);
    let cross = window.model.cross_covariance(others);
    let rows = cross.chunks_exact(l).zip(&others.means);
    rows.map(|(row, mean)| pixel.weight * mean + dot(row, &solved))
        .collect()
}
