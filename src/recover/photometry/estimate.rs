//! Estimates the corrections and finds the photographs that do not belong, in turn.
//!
//! Steps of generalised least squares alternate with tests of the residuals, until neither changes anything. A clean
//! capture takes one step, which finds nothing significant.

use super::equations::{self, CorrectionStep, MAX_PHOTOGRAPHS};
use super::resampling::MAX_SHIFT;
use super::{PhotographCorrection, PhotographFault, Photometry, ResampledPhotographs, faults};
use crate::job_executor::{Cancelled, Executor};
use crate::linalg::{self, median};
use crate::recover::mean_function;
use crate::recover::preparation_input::RecoveryPreparationInput;
use crate::recover::sampling::MIN_PATTERNS;

/// Steps in a row without a test of the residuals.
const MAX_STEPS: usize = 4;
/// Mean square of corrections, by their squared standard errors, above which they are significant as a whole.
const SIGNIFICANT_VARIANCE: f64 = 4.0;
/// Standard errors above which a single correction is significant where they are not as a whole.
const SIGNIFICANT_ERRORS: f64 = 8.0;
/// Mean squared deviation of a photograph, relative to the median of all, above which it does not belong.
const OUTLIER_RATIO: f64 = 3.0;
/// Of photographs whose deviation is above [`OUTLIER_RATIO`] those are left out at once that are above this share of the
/// largest: one bad photograph spoils the predictions of the others.
const WORST_SHARE: f64 = 0.3;
/// Largest share of the photographs that may be left out.
const MAX_OUTLIER_SHARE: f64 = 0.2;
/// Steps of the shifts.
const MAX_SHIFT_STEPS: usize = 4;
/// Root mean square of shifts in camera pixels that does harm.
const MIN_RMS_SHIFT: f64 = 0.004;
/// Shift of a single photograph in camera pixels that does harm, and the standard errors by which it must be larger. Where
/// standard errors are large, functions differ too much from the model to tell.
const MIN_SHIFT: f64 = 0.1;
const SHIFT_ERRORS: f64 = 3.0;
const MAX_SHIFT_ERROR: f64 = 0.05;

/// Distance in camera pixels above which photographs are left out if all others were taken from one place: they would add
/// less than resampling takes away.
const MIN_MOVE: f64 = 0.35;
/// Distance between the values of the softness of interpolation that are compared, from 0 to 1; 0 is used before.
const SOFTNESS_STEP: f64 = 0.5;
const SOFTNESSES: usize = 3;
/// Steps of the shifts after the softness is known.
const STEPS_AFTER_SOFTNESS: usize = 2;
/// Steps of the shifts of photographs that are tried once more.
const MAX_READMISSION_STEPS: usize = 2;
/// Median shift of the other photographs, in camera pixels, up to which the camera was steady.
const MAX_STEADY_SHIFT: f64 = 0.06;
/// Largest share of the photographs that may be left out because the camera moved.
const MAX_MOVED_SHARE: f64 = 0.6;
/// Share of the differences between photographs that may be unexplained. Otherwise these are not photographs of their
/// patterns, which is told later.
const MAX_UNEXPLAINED_SHARE: f64 = 0.5;
/// Fewest squares that give standard errors.
const MIN_SQUARES: usize = 32;
/// Fewest photographs that predict one another.
const MIN_PHOTOGRAPHS: usize = 3 * MIN_PATTERNS;
/// Fewest photographs that must remain.
const MIN_USED: usize = 2 * MIN_PATTERNS;
/// Range of a correction's scale. A photograph of something else has none.
const SCALES: [f64; 2] = [0.05, 20.0];

/// Estimates the photometry of all photographs, which `preparation` holds uncorrected; `mean_function` is `[slot]`. Their
/// shifts are only estimated if they `is_registered`.
/// Nothing is changed where there are too few photographs or too little picture to tell, or if too many photographs
/// seem not to belong.
///
/// # Errors
/// [`Cancelled`].
pub(in crate::recover) async fn estimate(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
    is_registered: bool,
) -> Result<Photometry, Cancelled> {
    let measurements = preparation.measurements;
    let count = measurements.patterns.len();
    let squares = mean_function::sample_squares(measurements.camera);
    if squares.len() < MIN_SQUARES || !(MIN_PHOTOGRAPHS..=MAX_PHOTOGRAPHS).contains(&count) {
        return Ok(Photometry::default());
    }
    let side = preparation.geometry.window.side() as usize;
    let mut photometry = Photometry {
        mean_function: mean_function::smooth(mean_function, side),
        corrections: vec![PhotographCorrection::IDENTITY; count],
        softness: 0.0,
        faults: Vec::new(),
    };
    let mut used: Vec<usize> = (0..count).collect();
    let mut outliers: Vec<usize> = Vec::new();
    let mut moved: Vec<(usize, PhotographFault)> = Vec::new();
    let mut readmitted: Vec<usize> = Vec::new();
    let mut readmission_steps = 0;
    let max_outliers = (MAX_OUTLIER_SHARE * count as f64) as usize;
    // Pages always register photographs, and their module is smaller if that is known at compile time.
    let is_registered = is_registered || cfg!(target_arch = "wasm32");
    let max_shift_steps = if is_registered { MAX_SHIFT_STEPS } else { 0 };
    let (mut steps, mut shift_steps) = (0, 0);
    // Softnesses that were tried, each after its unexplained share.
    let mut tried: Vec<(f64, f64)> = Vec::new();
    // Whether the shifts were estimated with the softness that is tried.
    let mut shifts_fit_softness = false;
    let last = loop {
        preparation.executor.check_cancelled()?;
        let input = photometry.resampling_input(measurements, &preparation.geometry, &used);
        let step = equations::fit(preparation, input, &squares).await?;
        let Some(step) = step else {
            return Ok(Photometry::default());
        };
        if (1..=SOFTNESSES).contains(&tried.len()) {
            shifts_fit_softness = !shifts_fit_softness;
            if shifts_fit_softness {
                step.apply_shifts(&used, &mut photometry.corrections, &used);
                continue;
            }
            tried.push((step.unexplained_share, photometry.softness));
            photometry.softness = next_softness(&tried);
            (steps, shift_steps) = (0, MAX_SHIFT_STEPS - STEPS_AFTER_SOFTNESS);
            continue;
        }
        if steps < MAX_STEPS && step.is_significant() {
            steps += 1;
            step.apply(&used, &mut photometry.corrections);
            continue;
        }
        if readmission_steps > 0 {
            readmission_steps -= 1;
            step.apply_shifts(&used, &mut photometry.corrections, &readmitted);
            continue;
        }
        let found = step.outliers();
        if found.is_empty() && shift_steps < max_shift_steps && step.has_shifts() {
            step.apply_shifts(&used, &mut photometry.corrections, &used);
            (steps, shift_steps) = (0, shift_steps + 1);
        } else if found.is_empty() && shift_steps > 0 && tried.is_empty() {
            tried.push((step.unexplained_share, photometry.softness));
            photometry.softness = next_softness(&tried);
        } else if !found.is_empty() {
            if outliers.len() + found.len() > max_outliers {
                return Ok(Photometry::default());
            }
            outliers.extend(found.iter().map(|&i| used[i]));
            used.retain(|l| !outliers.contains(l));
            steps = 0;
        } else if shift_steps > 0 && readmitted.is_empty() && !outliers.is_empty() {
            // A photograph from another place may have seemed to be of another object.
            readmitted = std::mem::take(&mut outliers);
            used = (0..count)
                .filter(|l| used.contains(l) || readmitted.contains(l))
                .collect();
            readmission_steps = MAX_READMISSION_STEPS;
        } else {
            let left_out = moved_photographs(&used, &photometry.corrections);
            let all_moved = moved.len() + left_out.len();
            if left_out.is_empty() || all_moved as f64 > MAX_MOVED_SHARE * count as f64 {
                break step;
            }
            used.retain(|l| !left_out.contains(l));
            let fault = |l: usize| PhotographFault::Moved {
                shift: photometry.corrections[l].shift,
            };
            moved.extend(left_out.into_iter().map(|l| (l, fault(l))));
            (steps, shift_steps) = (0, 0);
        }
        if used.len() < MIN_USED {
            return Ok(Photometry::default());
        }
    };
    // NaN where photographs do not differ at all.
    if last.unexplained_share.is_nan() || last.unexplained_share > MAX_UNEXPLAINED_SHARE {
        return Ok(Photometry::default());
    }
    if shift_steps > 0 {
        last.apply_shifts(&used, &mut photometry.corrections, &used);
    }
    for l in 0..count {
        if !used.contains(&l) {
            photometry.corrections[l] = PhotographCorrection::IDENTITY;
        }
    }
    last.keep_significant(&used, &mut photometry.corrections);
    if photometry
        .corrections
        .iter()
        .all(|c| *c == PhotographCorrection::IDENTITY)
    {
        photometry.corrections.clear();
    }
    let input = photometry.resampling_input(measurements, &preparation.geometry, &used);
    let resampled = ResampledPhotographs::of_picture(input);
    let calibrated = input.calibrated(resampled.as_ref());
    let preparation = preparation.with(&calibrated);
    let faults = faults::classify(
        &preparation,
        input.mean_function,
        &squares,
        &used,
        &outliers,
    );
    let mut faults = faults.await?;
    faults.extend(moved);
    let order = linalg::ascending_order(faults.iter().map(|fault| fault.0 as f64));
    photometry.faults = order.into_iter().map(|i| faults[i]).collect();
    Ok(photometry)
}

/// The softness to try after those that were tried, which are given after their unexplained shares: those at equal
/// distances, then the minimum of the parabola through their shares. At last the one with the least share.
fn next_softness(tried: &[(f64, f64)]) -> f64 {
    match *tried {
        [(a, _), (b, _), (c, _)] => {
            let curvature = (a - 2.0 * b + c).max(f64::MIN_POSITIVE);
            let minimum = SOFTNESS_STEP - 0.5 * SOFTNESS_STEP * (c - a) / curvature;
            minimum.clamp(0.0, 1.0)
        }
        [_, _, _, ..] => {
            let lesser = |a: (f64, f64), b: &(f64, f64)| if b.0 < a.0 { *b } else { a };
            tried.iter().fold((f64::INFINITY, 0.0), lesser).1
        }
        _ => SOFTNESS_STEP * tried.len() as f64,
    }
}

impl CorrectionStep {
    /// Whether the step may be more than noise.
    fn is_significant(&self) -> bool {
        let is_large = |(step, error): (&f64, &f64)| step.abs() > SIGNIFICANT_ERRORS * error;
        self.steps.iter().zip(&self.errors).any(|(steps, errors)| {
            mean_square_ratio(steps, errors) > SIGNIFICANT_VARIANCE
                || steps.iter().zip(errors).any(is_large)
        })
    }

    /// Composes the step with the corrections of the photographs `used`.
    fn apply(&self, used: &[usize], corrections: &mut [PhotographCorrection]) {
        let [scales, offsets] = &self.steps;
        for (i, &l) in used.iter().enumerate() {
            let PhotographCorrection { scale, offset, .. } = &mut corrections[l];
            let factor = 1.0 + scales[i];
            *scale = (*scale * factor).clamp(SCALES[0], SCALES[1]);
            *offset = *offset * factor + offsets[i];
        }
    }

    /// Photographs that fit far worse than most, by their positions.
    fn outliers(&self) -> Vec<usize> {
        let typical = median(&self.deviations);
        let worst = self.deviations.iter().copied().fold(0.0, f64::max);
        let limit = (OUTLIER_RATIO * typical).max(WORST_SHARE * worst);
        let deviations = self.deviations.iter().enumerate();
        let outliers = deviations.filter(|(_, deviation)| **deviation > limit);
        outliers.map(|(i, _)| i).collect()
    }

    /// Whether shifts may be more than noise.
    fn has_shifts(&self) -> bool {
        let mut axes = self.shifts.iter().zip(&self.shift_errors);
        axes.any(|(shifts, errors)| are_significant(shifts, errors))
    }

    /// Adds the step of the shifts to the corrections of those of the photographs `used` that are `adjusted`, relative to
    /// the camera's place.
    fn apply_shifts(
        &self,
        used: &[usize],
        corrections: &mut [PhotographCorrection],
        adjusted: &[usize],
    ) {
        for axis in 0..2 {
            let step = used.iter().zip(&self.shifts[axis]);
            let shifts = step.map(|(&l, step)| corrections[l].shift[axis] + step);
            let shifts: Vec<f64> = shifts.collect();
            let place = place(&shifts, self.flood_shift.map(|shift| shift[axis]));
            for (&l, shift) in used
                .iter()
                .zip(shifts)
                .filter(|(l, _)| adjusted.contains(l))
            {
                corrections[l].shift[axis] = (shift - place).clamp(-MAX_SHIFT, MAX_SHIFT);
            }
        }
    }

    /// Shrinks the corrections of the photographs `used` towards none, by the variance that exceeds their standard errors
    /// (empirical Bayes); those that are not significant become none.
    fn keep_significant(&self, used: &[usize], corrections: &mut [PhotographCorrection]) {
        let [scale_errors, offset_errors] = &self.errors;
        let scales: Vec<f64> = used.iter().map(|&l| corrections[l].scale).collect();
        let middle = median(&scales);
        let relative: Vec<f64> = scales.iter().map(|scale| scale / middle - 1.0).collect();
        let relative = shrunk(&relative, scale_errors);
        let offsets: Vec<f64> = used
            .iter()
            .map(|&l| corrections[l].offset / middle)
            .collect();
        let mean = offsets.iter().sum::<f64>() / offsets.len() as f64;
        let centred: Vec<f64> = offsets.iter().map(|offset| offset - mean).collect();
        let centred = shrunk(&centred, offset_errors);
        let is_significant = mean.abs() > SIGNIFICANT_ERRORS * self.mean_offset_error;
        let mean = if is_significant { mean } else { 0.0 };
        for (i, &l) in used.iter().enumerate() {
            corrections[l].scale = 1.0 + relative[i];
            corrections[l].offset = mean + centred[i];
        }
        let has_shifts = (0..2).any(|axis| {
            let shifts: Vec<f64> = used.iter().map(|&l| corrections[l].shift[axis]).collect();
            are_significant(&shifts, &self.shift_errors[axis])
        });
        if !has_shifts {
            used.iter().for_each(|&l| corrections[l].shift = [0.0; 2]);
        }
    }
}

/// Whether shifts in camera pixels with standard `errors` are significant, together or one of them.
fn are_significant(shifts: &[f64], errors: &[f64]) -> bool {
    let is_large = |(shift, error): (&f64, &f64)| {
        *error < MAX_SHIFT_ERROR && shift.abs() > MIN_SHIFT + SHIFT_ERRORS * error
    };
    let mean_square = linalg::dot(shifts, shifts) / shifts.len() as f64;
    mean_square > MIN_RMS_SHIFT.powi(2) && mean_square_ratio(shifts, errors) > SIGNIFICANT_VARIANCE
        || shifts.iter().zip(errors).any(is_large)
}

/// The photographs taken from another place than the others of `used`, which were taken from one: the camera moved once.
fn moved_photographs(used: &[usize], corrections: &[PhotographCorrection]) -> Vec<usize> {
    let distance = |l: usize| {
        let [x, y] = corrections[l].shift;
        (x * x + y * y).sqrt()
    };
    let mut moved = Vec::new();
    let mut distances = Vec::new();
    for &l in used {
        match distance(l) {
            far if far > MIN_MOVE => moved.push(l),
            near => distances.push(near),
        }
    }
    if distances.is_empty() || median(&distances) > MAX_STEADY_SHIFT {
        moved.clear();
    }
    moved
}

/// The camera's place along one axis: the mean shift of photographs that are near those of the first half, as the Gray
/// code comes before them; the flood photograph's where this may be the same.
fn place(shifts: &[f64], flood: Option<f64>) -> f64 {
    let first_half = &shifts[..shifts.len().div_ceil(2)];
    let middle = median(first_half);
    let distances = first_half.iter().map(|shift| (shift - middle).abs());
    // Two thirds of the standard deviation, if shifts are normal.
    let distance = median(&distances.collect::<Vec<f64>>());
    let is_near = |shift: f64| (shift - middle).abs() <= MIN_SHIFT + 3.0 * distance;
    let (mut sum, mut count) = (0.0, 0.0);
    for &shift in shifts.iter().filter(|shift| is_near(**shift)) {
        sum += shift;
        count += 1.0;
    }
    let mean = sum / count;
    let tolerance = MIN_RMS_SHIFT + 4.5 * distance / count.sqrt();
    match flood {
        Some(flood) if (flood - mean).abs() <= tolerance => flood,
        _ => mean,
    }
}

/// Values with standard `errors`, shrunk by what their variance exceeds that of the errors; single large ones stay.
fn shrunk(values: &[f64], errors: &[f64]) -> Vec<f64> {
    let is_large = |i: usize| values[i].abs() > SIGNIFICANT_ERRORS * errors[i];
    let typical = (0..values.len()).filter(|&i| !is_large(i));
    let typical: Vec<usize> = match typical.clone().count() * 2 > values.len() {
        true => typical.collect(),
        false => (0..values.len()).collect(),
    };
    let of_typical = |list: &[f64]| -> Vec<f64> { typical.iter().map(|&i| list[i]).collect() };
    let (typical_values, typical_errors) = (of_typical(values), of_typical(errors));
    let mean_square = |list: &[f64]| linalg::dot(list, list) / list.len() as f64;
    let excess = mean_square(&typical_values) - mean_square(&typical_errors);
    let is_significant = mean_square_ratio(&typical_values, &typical_errors) > SIGNIFICANT_VARIANCE;
    let shrink = |i: usize| match (is_large(i), is_significant) {
        (true, _) => values[i],
        (false, true) => values[i] * excess / (excess + errors[i] * errors[i]),
        (false, false) => 0.0,
    };
    (0..values.len()).map(shrink).collect()
}

/// The mean square of values by that of their standard errors.
fn mean_square_ratio(values: &[f64], errors: &[f64]) -> f64 {
    linalg::dot(values, values) / linalg::dot(errors, errors).max(f64::MIN_POSITIVE)
}
