//! Rounding of direct functions that keeps the brightness of pictures under wide lights.
//!
//! A light that covers a whole window sees the sum of a light transport function. Most values of a function are
//! below a quantisation step and become 0; each error is small, but most have the same sign, so that pictures under
//! such lights become darker. The errors e of a function's slots in one layer therefore count as
//!
//! ```text
//! Σ e² + w (Σ e)² + bits
//! ```
//!
//! The first term is the squared error under a light of independent elements, the second that under a uniform light. The
//! sum is minimised greedily: some numbers change by one step, all in the direction that Σ e has at first, the cheapest first;
//! those that are more than half a step off do so even if Σ e changes its sign.

use std::array::from_fn;

use super::colour::ColourVector;
use super::tokens::MAX_MAGNITUDE;
use crate::linalg::ascending_order;
use crate::transport::CHANNELS;

/// Added to a magnitude in steps before it is truncated. Less than a half: small values are mostly noise,
/// whose bits reduce the error less than those of large ones.
const ROUNDING_OFFSET: f32 = 0.2;
/// The weight w of sums in the last layer. Larger weights make files larger, as finer steps have to make up for the
/// errors of single values.
const SUM_WEIGHT: f32 = 0.05;
/// The largest weight in earlier layers, which make pictures before the last has come.
const MAX_SUM_WEIGHT: f32 = 1.0;
/// Cost of the bits of a number that was zero, in squared steps: a bit is worth 2 ln 2 / 12. Other changes, by a bit at
/// most, are not counted, nor is what a number that becomes zero saves.
const ZERO_COST: f32 = 0.7;
/// Largest magnitude of a number before a change by one step. Co and Cg are up to twice as large.
pub const MAX_ROUNDED: i32 = MAX_MAGNITUDE / 2 - 1;

/// A slot of a function: its numbers in red, green and blue, and what rounding leaves of the values, in steps.
#[derive(Clone, Copy, Debug)]
pub struct RoundedSlot {
    pub numbers: [i32; CHANNELS],
    pub residual: ColourVector,
}

impl RoundedSlot {
    /// Rounds values to multiples of a step.
    pub fn new(tau: ColourVector, step: f32) -> Self {
        let numbers = tau.map(|t| {
            let steps = (t.abs() / step + ROUNDING_OFFSET) as i32; // `as` saturates
            steps.min(MAX_ROUNDED) * if t < 0.0 { -1 } else { 1 }
        });
        Self {
            numbers,
            residual: from_fn(|c| tau[c] / step - numbers[c] as f32),
        }
    }
}

/// The weight of sums in a layer whose step is `step_ratio` times the last layer's: the more later layers correct single
/// values, the more the sums count.
pub fn sum_weight(step_ratio: f32) -> f32 {
    (SUM_WEIGHT * step_ratio * step_ratio).min(MAX_SUM_WEIGHT)
}

/// Changes some numbers of a function's slots by one step each, as far as a change reduces the sum of error and cost in
/// bits, and as all numbers together still reduce the squared error of the values by more than the changes cost.
pub fn restore_sums(slots: &mut [RoundedSlot], weight: f32) {
    for c in 0..CHANNELS {
        let (mut sum, mut reduction) = (0.0, 0.0);
        for slot in slots.iter() {
            let (number, residual) = (slot.numbers[c] as f32, slot.residual[c]);
            sum += residual;
            // By how much the number reduces the squared error, from (n + r)² to r².
            reduction += number * (number + 2.0 * residual);
        }
        // Values beyond all numbers. The sign of a sum that is not a number would differ by machine.
        if !sum.is_finite() {
            continue;
        }
        let sign = 1f32.copysign(sum);
        let gain = |sum: f32| weight * (2.0 * sign * sum - 1.0);
        let cost = |slot: &RoundedSlot| {
            let bits = if slot.numbers[c] == 0 { ZERO_COST } else { 0.0 };
            // The squared error increases from r² to (r - sign)².
            1.0 - 2.0 * sign * slot.residual[c] + bits
        };
        // The gain falls with each change, so that no other slot will be worth its cost.
        let mut candidates: Vec<usize> = (0..slots.len()).collect();
        candidates.retain(|&i| cost(&slots[i]) < gain(sum));
        for k in ascending_order(candidates.iter().map(|&i| cost(&slots[i]).into())) {
            let i = candidates[k];
            let cost = cost(&slots[i]);
            reduction -= cost;
            if cost >= gain(sum) || reduction < 0.0 {
                break;
            }
            slots[i].numbers[c] += sign as i32;
            sum -= sign;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_weigh_more_in_layers_that_others_correct_but_no_more_than_all_values() {
        assert_eq!(sum_weight(1.0), SUM_WEIGHT);
        assert_eq!(sum_weight(2.0), 4.0 * SUM_WEIGHT);
        assert_eq!(sum_weight(100.0), MAX_SUM_WEIGHT);
    }

    fn rounded(values: &[f32]) -> Vec<RoundedSlot> {
        let slot = |&value: &f32| RoundedSlot {
            numbers: [value as i32; CHANNELS],
            residual: [value.fract(); CHANNELS],
        };
        values.iter().map(slot).collect()
    }

    /// What the numbers of green leave of the values.
    fn left<'a>(slots: &'a [RoundedSlot], values: &'a [f32]) -> impl Iterator<Item = f32> + 'a {
        let pairs = slots.iter().zip(values);
        pairs.map(|(slot, value)| value - slot.numbers[1] as f32)
    }

    #[test]
    fn numbers_take_what_zeros_have_lost() {
        for sign in [1.0, -1.0] {
            let mut values = [0.2 * sign; 40];
            values[..4].copy_from_slice(&[9.4, 5.1, 3.3, 2.2].map(|value| value * sign));
            let slots = rounded(&values);
            let sum = |slots: &[RoundedSlot]| left(slots, &values).sum::<f32>().abs();
            let restored = |weight| {
                let mut slots = slots.clone();
                restore_sums(&mut slots, weight);
                slots
            };
            let [little, much] = [1.0, 16.0].map(|ratio| restored(sum_weight(ratio)));
            // By the numbers that there are.
            assert!(little[4..].iter().all(|slot| slot.numbers == [0; CHANNELS]));
            assert!(sum(&little) < sum(&slots) - 0.9, "{}", sum(&little));
            assert!(sum(&much) < 0.5 * sum(&slots), "{}", sum(&much));
        }
    }

    #[test]
    fn numbers_change_as_long_as_the_error_stays_below_that_of_zeros() {
        let mut values = [0.3; 60];
        values[..2].copy_from_slice(&[1.3, 1.3]);
        let mut slots = rounded(&values);
        restore_sums(&mut slots, 100.0);
        let before = rounded(&values);
        let change = |(a, b): (&RoundedSlot, &RoundedSlot)| (a.numbers[0] - b.numbers[0]).abs();
        let changes = slots.iter().zip(&before).map(change);
        // All are worth it, but more than four would leave a larger error than zeros do.
        assert_eq!(changes.sum::<i32>(), 4);
        let error: f32 = left(&slots, &values).map(|error| error * error).sum();
        let zeros: f32 = values.iter().map(|value| value * value).sum();
        assert!(error <= zeros, "{error} {zeros}");
    }

    #[test]
    fn small_errors_that_sum_to_zero_are_left() {
        let balanced = [7.0, -3.0, 0.3, -0.3, 0.0];
        let mut slots = rounded(&balanced);
        restore_sums(&mut slots, 1.0);
        for (slot, value) in slots.iter().zip(balanced) {
            assert_eq!(slot.numbers, [value as i32; CHANNELS]);
        }
    }

    #[test]
    fn values_beyond_all_numbers_get_the_largest() {
        let values = [1.0, -1.0, f32::MAX];
        let mut slots = vec![RoundedSlot::new(values, 1e-9); 3];
        restore_sums(&mut slots, 1.0);
        for slot in slots {
            // A third value is infinite in steps.
            let changes = [1, 1, 0];
            let expected = from_fn(|c| [1, -1, 1][c] * (MAX_ROUNDED + changes[c]));
            assert_eq!(slot.numbers, expected);
        }
    }
}
