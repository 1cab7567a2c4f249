//! Squared quantisation error against squared values.

use crate::transport::Decibels;

/// Sums of squared values and of squared quantisation errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuantisationError {
    pub energy: f64,
    pub error: f64,
}

impl QuantisationError {
    /// The sum of two.
    pub fn plus(self, other: Self) -> Self {
        Self {
            energy: self.energy + other.energy,
            error: self.error + other.error,
        }
    }

    /// The sum of `factor` like it.
    pub fn times(self, factor: f64) -> Self {
        Self {
            energy: self.energy * factor,
            error: self.error * factor,
        }
    }

    /// The ratio in decibels.
    pub fn snr(self) -> Decibels {
        Decibels(10.0 * (self.energy / self.error.max(f64::MIN_POSITIVE)).log10())
    }
}
