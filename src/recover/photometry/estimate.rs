//! Estimates the corrections and finds the photographs that do not belong, in turn.
//!
//! Steps of generalised least squares alternate with tests of the residuals, until neither changes anything. A clean
//! capture takes one step, which finds nothing significant.

use super::equations::{self, CorrectionStep, MAX_PHOTOGRAPHS};
use super::{CalibratedMeasurements, LinearCorrection, PhotographFault, Photometry, faults};
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
/// Shift in camera pixels that does harm, and the standard errors by which it must be larger. Where standard errors are
/// large, functions differ too much from the model to tell.
const MIN_SHIFT: f64 = 0.1;
const SHIFT_ERRORS: f64 = 3.0;
const MAX_SHIFT_ERROR: f64 = 0.05;
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

/// Estimates the photometry of all photographs, which `preparation` holds uncorrected; `mean_function` is `[slot]`.
/// Nothing is changed where there are too few photographs or too little picture to tell, or if too many photographs
/// seem not to belong.
///
/// # Errors
/// [`Cancelled`].
pub(in crate::recover) async fn estimate(
    preparation: &RecoveryPreparationInput<'_, impl Executor>,
    mean_function: &[f64],
) -> Result<Photometry, Cancelled> {
    let measurements = preparation.measurements;
    let count = measurements.patterns.len();
    let squares = mean_function::sample_squares(measurements);
    if squares.len() < MIN_SQUARES || !(MIN_PHOTOGRAPHS..=MAX_PHOTOGRAPHS).contains(&count) {
        return Ok(Photometry::default());
    }
    let mean_function =
        mean_function::smooth(mean_function, preparation.geometry.window.side() as usize);
    let mut corrections = vec![LinearCorrection::IDENTITY; count];
    let mut used: Vec<usize> = (0..count).collect();
    let mut outliers: Vec<usize> = Vec::new();
    let mut moved: Vec<(usize, PhotographFault)> = Vec::new();
    let max_outliers = (MAX_OUTLIER_SHARE * count as f64) as usize;
    let mut steps = 0;
    let last = loop {
        preparation.executor.check_cancelled()?;
        let calibrated = CalibratedMeasurements::new(measurements, &corrections);
        let preparation = preparation.with(&calibrated);
        let step = equations::fit(&preparation, &mean_function, &squares, &used).await?;
        let Some(step) = step else {
            return Ok(Photometry::default());
        };
        if steps < MAX_STEPS && step.is_significant() {
            steps += 1;
            step.apply(&used, &mut corrections);
            continue;
        }
        let (mut found, shifted) = (step.outliers(), step.shifted());
        // After a move, an outlier from the other place is no other object.
        let may_be_moved = found.is_empty() || !moved.is_empty();
        let all_moved = moved.len() + shifted.len();
        if may_be_moved && all_moved as f64 <= MAX_MOVED_SHARE * count as f64 {
            found.retain(|i| shifted.iter().all(|(other, _)| other != i));
            let faults = shifted.iter();
            moved.extend(faults.map(|&(i, shift)| (used[i], PhotographFault::Moved { shift })));
        }
        let is_left_out = |l: &usize| moved.iter().any(|(other, _)| other == l);
        if found.is_empty() && !used.iter().any(is_left_out) {
            break step;
        }
        if outliers.len() + found.len() > max_outliers {
            return Ok(Photometry::default());
        }
        outliers.extend(found.iter().map(|&i| used[i]));
        used.retain(|l| !outliers.contains(l) && !is_left_out(l));
        if used.len() < MIN_USED {
            return Ok(Photometry::default());
        }
        steps = 0;
    };
    // NaN where photographs do not differ at all.
    if last.unexplained_share.is_nan() || last.unexplained_share > MAX_UNEXPLAINED_SHARE {
        return Ok(Photometry::default());
    }
    for l in 0..count {
        if !used.contains(&l) {
            corrections[l] = LinearCorrection::IDENTITY;
        }
    }
    last.keep_significant(&used, &mut corrections);
    if corrections.iter().all(|c| *c == LinearCorrection::IDENTITY) {
        corrections.clear();
    }
    let calibrated = CalibratedMeasurements::new(measurements, &corrections);
    let preparation = preparation.with(&calibrated);
    let faults = faults::classify(&preparation, &mean_function, &squares, &used, &outliers);
    let mut faults = faults.await?;
    faults.extend(moved);
    let order = linalg::ascending_order(faults.iter().map(|fault| fault.0 as f64));
    Ok(Photometry {
        faults: order.into_iter().map(|i| faults[i]).collect(),
        corrections,
    })
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
    fn apply(&self, used: &[usize], corrections: &mut [LinearCorrection]) {
        let [scales, offsets] = &self.steps;
        for (i, &l) in used.iter().enumerate() {
            let LinearCorrection { scale, offset } = &mut corrections[l];
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

    /// Photographs whose picture is shifted, by their positions, with the shift. The camera's place is that in the first half
    /// of the capture: the Gray code comes before it. None if the others moved as well.
    fn shifted(&self) -> Vec<(usize, [f64; 2])> {
        let first_half = self.shifts[0].len().div_ceil(2);
        let place = [0, 1].map(|axis| median(&self.shifts[axis][..first_half]));
        let shift = |i: usize| [0, 1].map(|axis| self.shifts[axis][i] - place[axis]);
        let is_shifted = |&(i, shift): &(usize, [f64; 2])| {
            (0..2).any(|axis| {
                let error = self.shift_errors[axis][i];
                error < MAX_SHIFT_ERROR && shift[axis].abs() > MIN_SHIFT + SHIFT_ERRORS * error
            })
        };
        let all = (0..self.shifts[0].len()).map(|i| (i, shift(i)));
        let (shifted, steady): (Vec<_>, Vec<_>) = all.partition(is_shifted);
        if steady.is_empty() {
            return Vec::new();
        }
        let distances = steady.iter().map(|(_, [x, y])| (x * x + y * y).sqrt());
        let deviation = median(&distances.collect::<Vec<f64>>());
        match deviation < MAX_STEADY_SHIFT {
            true => shifted,
            false => Vec::new(),
        }
    }

    /// Shrinks the corrections of the photographs `used` towards none, by the variance that exceeds their standard errors
    /// (empirical Bayes); those that are not significant become none.
    fn keep_significant(&self, used: &[usize], corrections: &mut [LinearCorrection]) {
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
            corrections[l] = LinearCorrection {
                scale: 1.0 + relative[i],
                offset: mean + centred[i],
            };
        }
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
