//! How coarse the numbers of a file may be.

use crate::transport::Decibels;

/// Squared numbers, and squared errors of their rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// Squared numbers.
    pub energy: f64,
    /// Squared errors.
    pub error: f64,
}

impl Rounding {
    /// Of this and the other together.
    pub fn and(self, other: Self) -> Self {
        Self {
            energy: self.energy + other.energy,
            error: self.error + other.error,
        }
    }

    /// Of so many like it.
    pub fn times(self, count: f64) -> Self {
        Self {
            energy: self.energy * count,
            error: self.error * count,
        }
    }

    /// How far numbers lie above their errors.
    pub fn snr(self) -> Decibels {
        Decibels(10.0 * (self.energy / self.error.max(f64::MIN_POSITIVE)).log10())
    }
}

/// Steps are looked for from `2^FINEST` times the root mean square up, this often halving the range.
const FINEST: f32 = -26.0;
const HALVINGS: usize = 13;

/// The coarsest step, to within a hundredth, that keeps an SNR of `quality`: `error` is what comes of
/// a step. `None` where there are no numbers but zero.
pub fn step_for(quality: Decibels, error: impl Fn(f32) -> Rounding) -> Option<f32> {
    let energy = error(1.0).energy;
    let root = energy.sqrt() as f32;
    if !root.is_normal() {
        return None;
    }
    // A number as large as all together is zero at twice that step, and nothing is left.
    let coarsest = 2.0 * root;
    let (mut fine, mut coarse) = (FINEST, 0.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (fine + coarse);
        match error(coarsest * f32::exp2(middle)).snr().0 >= quality.0 {
            true => fine = middle,
            false => coarse = middle,
        }
    }
    Some(coarsest * f32::exp2(fine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_coarsest_that_keeps_the_quality() {
        // Rounding as it is where numbers are large against the step.
        let error = |step: f32| Rounding {
            energy: 1e4,
            error: f64::from(step).powi(2),
        };
        for quality in [10.0, 34.0, 60.0] {
            let step = step_for(Decibels(quality), error).unwrap();
            let snr = 10.0 * (1e4 / f64::from(step).powi(2)).log10();
            assert!((0.0..0.1).contains(&(snr - quality)), "{snr} dB");
        }
        assert!(step_for(Decibels(30.0), |_| Rounding::default()).is_none());
    }
}
