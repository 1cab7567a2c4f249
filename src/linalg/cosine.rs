//! Cosines of rational parts of π.

use std::f64::consts::PI;

/// Terms of the Taylor series: the first one left out is below 1e-19 at π/2.
const TERMS: u32 = 13;

/// `cos(π · numerator / denominator)`. Whole numbers reduce the angle, without the tables of a general cosine.
pub(crate) fn cos_pi(numerator: usize, denominator: usize) -> f64 {
    let mut angle = numerator % (2 * denominator);
    if angle > denominator {
        angle = 2 * denominator - angle;
    }
    let is_obtuse = 2 * angle > denominator;
    if is_obtuse {
        angle = denominator - angle;
    }
    let x = PI * angle as f64 / denominator as f64;
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..=TERMS {
        term *= -x * x / f64::from(2 * k * (2 * k - 1));
        sum += term;
    }
    if is_obtuse { -sum } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_are_those_of_libm() {
        for denominator in [1, 2, 7, 30] {
            for numerator in 0..5 * denominator {
                let expected = libm::cos(PI * numerator as f64 / denominator as f64);
                let cosine = cos_pi(numerator, denominator);
                assert!(
                    (cosine - expected).abs() < 2e-15,
                    "{numerator} of {denominator}"
                );
            }
        }
    }
}
