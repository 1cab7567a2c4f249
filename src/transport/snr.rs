//! The distance of two transports as a signal-to-noise ratio.

use std::fmt;
use std::iter::Sum;

use bytemuck::{Pod, Zeroable};

/// A ratio in decibels: 20 log10 of a ratio of amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Decibels(pub f64);

impl fmt::Display for Decibels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} dB", self.0)
    }
}

/// Sums of squares for SNR(T, T̂) = 20 log10(‖T‖_F / ‖T − T̂‖_F) (paper, section 4) over all entries of both matrices,
/// in any order.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct SnrAccumulator {
    /// Of the true values.
    pub signal: f64,
    /// Of the differences.
    pub error: f64,
}

impl SnrAccumulator {
    /// Adds one entry: its true value and its estimate.
    pub fn add(&mut self, truth: f64, estimate: f64) {
        self.signal += truth * truth;
        self.error += (truth - estimate) * (truth - estimate);
    }

    /// From the energies of true values, and of the errors of their estimates.
    pub fn from_energies(signal: f64, error: f64) -> Self {
        Self { signal, error }
    }

    /// Adds the sums of other entries, for instance of another thread.
    pub fn merge(&mut self, other: Self) {
        self.signal += other.signal;
        self.error += other.error;
    }

    /// The SNR; `None` if the error or the signal is zero, as the ratio then has no finite logarithm.
    pub fn snr(&self) -> Option<Decibels> {
        (self.signal > 0.0 && self.error > 0.0).then(|| self.finite_snr())
    }

    /// The SNR, finite if the error is zero.
    pub(crate) fn finite_snr(&self) -> Decibels {
        Decibels(10.0 * libm::log10(self.signal / self.error.max(f64::MIN_POSITIVE)))
    }
}

impl Sum for SnrAccumulator {
    fn sum<I: Iterator<Item = Self>>(errors: I) -> Self {
        let mut sum = Self::default();
        errors.for_each(|error| sum.merge(error));
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_a_tenth_is_twenty_decibels() {
        let mut e = SnrAccumulator::default();
        for t in [1.0, 2.0, -3.0] {
            e.add(t, 0.9 * t);
        }
        assert!((e.snr().unwrap().0 - 20.0).abs() < 1e-9);
        assert_eq!(SnrAccumulator::default().snr(), None);
    }
}
