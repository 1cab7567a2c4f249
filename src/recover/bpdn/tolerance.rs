//! ε, the largest residual that basis pursuit denoising allows.
//!
//! The noise variance of a measurement is `σ² = gain · ȳ + floor`: photon noise, and noise independent of light. The
//! true function has the squared residual L σ²; a fitted one has about (L − d) σ², where d degrees of freedom fit noise,
//! so that ε² = L σ² smooths too much. d depends on patterns, scene and basis. Therefore `ε² = share · L σ²` with a
//! share that is chosen on held-out patterns.

use serde::{Deserialize, Serialize};

use crate::recover::sampling::mean;

/// Iterations of the reweighted least-squares fit.
const REWEIGHTINGS: usize = 4;
/// Smallest expected variance, as a share of the mean variance: limits the weight of one pair.
const MIN_EXPECTED_VARIANCE_SHARE: f64 = 0.1;

/// The noise model and the share that determine ε.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualTolerance {
    /// Noise variance for each unit of the measurement.
    pub gain: f64,
    /// Noise variance without light.
    pub floor: f64,
    /// `ε² / (L σ²)`.
    pub share: f64,
}

impl ResidualTolerance {
    /// Shares to choose from. With 0 the constraint is infeasible and the solution is least squares, so that
    /// sparsity that only harms is not used.
    pub const CANDIDATE_SHARES: [f64; 7] = [1.0, 0.6, 0.35, 0.2, 0.1, 0.04, 0.0];

    /// ε for the measurements y.
    pub fn epsilon(self, y: &[f64]) -> f64 {
        let variance = (self.gain * mean(y).max(0.0) + self.floor).max(0.0);
        (self.share * y.len() as f64 * variance).sqrt()
    }

    /// Fits gain and floor, both at least zero, to pairs of mean and variance by least squares relative to
    /// the expected variance: the uncertainty of a variance is proportional to it.
    pub fn fit(pairs: &[[f64; 2]]) -> Self {
        let (levels, variances): (Vec<f64>, Vec<f64>) = pairs.iter().map(|&[x, y]| (x, y)).unzip();
        let (level, variance) = (mean(&levels), mean(&variances));
        let mut fit = Self {
            gain: 0.0,
            floor: variance,
            share: 1.0,
        };
        // The weights depend on the fit.
        for _ in 0..REWEIGHTINGS {
            let [mut w, mut wx, mut wxx, mut wy, mut wxy] = [0.0; 5];
            for &[x, y] in pairs {
                let expected =
                    (fit.gain * x + fit.floor).max(MIN_EXPECTED_VARIANCE_SHARE * variance);
                let weight = 1.0 / (expected * expected).max(f64::MIN_POSITIVE);
                w += weight;
                wx += weight * x;
                wxx += weight * x * x;
                wy += weight * y;
                wxy += weight * x * y;
            }
            let determinant = w * wxx - wx * wx;
            let gain = (w * wxy - wx * wy) / determinant;
            let floor = (wxx * wy - wx * wxy) / determinant;
            (fit.gain, fit.floor) = if determinant <= 1e-9 * w * wxx || gain < 0.0 {
                (0.0, wy / w)
            } else if floor < 0.0 {
                (wxy / wxx, 0.0)
            } else {
                (gain, floor)
            };
            if !(fit.gain.is_finite() && fit.floor.is_finite()) || level <= 0.0 {
                (fit.gain, fit.floor) = (0.0, variance);
            }
        }
        fit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fit_recovers_gain_and_floor() {
        let pairs: Vec<_> = (1..50)
            .map(|i| f64::from(i) / 50.0)
            .map(|x| [x, 0.02 * x + 0.003])
            .collect();
        let fit = ResidualTolerance::fit(&pairs);
        assert!((fit.gain - 0.02).abs() < 1e-9 && (fit.floor - 0.003).abs() < 1e-9);
        let epsilon = fit.epsilon(&[0.5; 80]);
        assert!((epsilon - (80.0f64 * 0.013).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn gain_and_floor_are_not_negative() {
        let falling: Vec<_> = (0..9).map(|i| [f64::from(i), 9.0 - f64::from(i)]).collect();
        let fit = ResidualTolerance::fit(&falling);
        assert!(fit.gain == 0.0 && fit.floor > 0.0);
        let steep: Vec<_> = (1..9).map(|i| [f64::from(i), f64::from(i) - 0.5]).collect();
        let fit = ResidualTolerance::fit(&steep);
        assert!(fit.gain > 0.0 && fit.floor == 0.0);
        let one = ResidualTolerance::fit(&[[0.5, 0.1]]);
        assert!((one.epsilon(&[0.5]) - 0.1f64.sqrt()).abs() < 1e-9);
        assert_eq!(ResidualTolerance::fit(&[]).epsilon(&[1.0; 10]), 0.0);
    }
}
