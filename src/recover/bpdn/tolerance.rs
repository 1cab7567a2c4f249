//! How far a light transport function may stay from its measurements.

/// The constraint's ε, for pixels of any brightness.
///
/// What keeps measurements from an exact fit is noise, of variance `gain · ȳ + floor` (photons, and
/// all that does not depend on light). `ε² = L σ²` would be the residual of the *true* function; a
/// fitted one has spent degrees of freedom on noise and comes to about `(L − dof) σ²`, so that
/// asking for `L σ²` smooths too much. How much is spent depends on pattern, scene and basis:
/// the share of `L σ²` is chosen on patterns held out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Variance a unit of measurement adds.
    pub gain: f64,
    /// Variance without light.
    pub floor: f64,
    /// `ε² / (L σ²)`.
    pub share: f64,
}

impl Tolerance {
    /// Shares to choose from. At zero nothing satisfies the constraint and what is left is least
    /// squares, so that a prior that only harms does none.
    pub const SHARES: [f64; 7] = [1.0, 0.6, 0.35, 0.2, 0.1, 0.04, 0.0];

    /// ε for `rows` measurements of this mean.
    pub fn epsilon(self, rows: usize, mean: f64) -> f64 {
        let variance = (self.gain * mean.max(0.0) + self.floor).max(0.0);
        (self.share * rows as f64 * variance).sqrt()
    }

    /// Fits gain and floor, both at least zero, to pairs of mean and variance, by least squares
    /// relative to the variance expected: a bright pixel's variance is as uncertain as it is large.
    pub fn fit(pairs: &[(f64, f64)]) -> Self {
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| {
            pairs.iter().map(f).sum::<f64>() / pairs.len().max(1) as f64
        };
        let (level, variance) = (mean(&|p| p.0), mean(&|p| p.1));
        let mut fit = Self {
            gain: 0.0,
            floor: variance,
            share: 1.0,
        };
        // Weights follow from the fit: a few rounds settle both.
        for _ in 0..ROUNDS {
            let [mut w, mut wx, mut wxx, mut wy, mut wxy] = [0.0; 5];
            for &(x, y) in pairs {
                // No pixel counts for more than one a tenth as noisy as the mean.
                let expected = (fit.gain * x + fit.floor).max(0.1 * variance);
                let weight = 1.0 / (expected * expected).max(f64::MIN_POSITIVE);
                w += weight;
                wx += weight * x;
                wxx += weight * x * x;
                wy += weight * y;
                wxy += weight * x * y;
            }
            let determinant = w * wxx - wx * wx;
            let (gain, floor) = (
                (w * wxy - wx * wy) / determinant,
                (wxx * wy - wx * wxy) / determinant,
            );
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

const ROUNDS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gain_and_floor_are_found() {
        let pairs: Vec<_> = (1..50)
            .map(|i| f64::from(i) / 50.0)
            .map(|x| (x, 0.02 * x + 0.003))
            .collect();
        let fit = Tolerance::fit(&pairs);
        assert!((fit.gain - 0.02).abs() < 1e-9 && (fit.floor - 0.003).abs() < 1e-9);
        let epsilon = fit.epsilon(80, 0.5);
        assert!((epsilon - (80.0f64 * 0.013).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn neither_is_negative() {
        let falling: Vec<_> = (0..9).map(|i| (f64::from(i), 9.0 - f64::from(i))).collect();
        let fit = Tolerance::fit(&falling);
        assert!(fit.gain == 0.0 && fit.floor > 0.0);
        let steep: Vec<_> = (1..9).map(|i| (f64::from(i), f64::from(i) - 0.5)).collect();
        let fit = Tolerance::fit(&steep);
        assert!(fit.gain > 0.0 && fit.floor == 0.0);
        let one = Tolerance::fit(&[(0.5, 0.1)]);
        assert!((one.epsilon(1, 0.5) - 0.1f64.sqrt()).abs() < 1e-9);
        assert_eq!(Tolerance::fit(&[]).epsilon(10, 1.0), 0.0);
    }
}
