//! Whether photographs show the patterns they are listed with.
//!
//! What the mean light transport function makes of a pattern is, on average, what is photographed
//! under it: the slope of the one against the other is the same for all, however coarse or fine the
//! pattern (one, if the window holds all light). Under another pattern's photograph it is zero. How far
//! it may be off by chance is told by how much squares of the picture differ (clusters, as in Liang &
//! Zeger 1986); what is too noisy to tell is let pass.

use super::RecoverError;
use super::holdout::HoldoutSplit;
use super::sampling::pixels_by_window;
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::transport::{CameraPx, Element, Geometry, TileRect};

/// Share of the others' slope that a photograph of its pattern surely has.
const RIGHT: f64 = 0.4;
/// Standard errors that make sure.
const SURE: f64 = 3.0;
/// Standard errors by which the slope of all patterns must be above zero: where it is not, there is
/// nothing to be recovered.
const SEEN: f64 = 2.0;
/// Fewest squares, and fewest patterns held out, that tell anything.
const FEWEST_SQUARES: usize = 32;
const FEWEST_HELD: usize = 2;

/// Looks at `squares` of the picture. An error where patterns do not tell what their photographs
/// show: [`RecoverError::MismatchedPatterns`] if those of some, [`RecoverError::UncorrelatedPatterns`] if of all.
pub(super) fn check_patterns(
    measurements: &Measurements,
    geometry: &Geometry,
    split: &HoldoutSplit,
    mean_function: &[f64],
    squares: &[TileRect],
    executor: &impl Executor,
) -> Result<(), RecoverError> {
    if squares.len() < FEWEST_SQUARES {
        return Ok(());
    }
    let by_square = executor.map(squares.len(), |i| {
        let mut products = vec![Products::default(); split.all.len()];
        for (origin, pixels) in pixels_by_window(geometry, squares[i]) {
            let seen = (origin, &pixels[..]);
            add(
                &mut products,
                measurements,
                geometry,
                split,
                mean_function,
                seen,
            );
        }
        products
    });
    let slopes: Vec<Option<Slope>> = (0..split.all.len())
        .map(|l| Slope::of(&by_square, &[l]))
        .collect();
    // That of patterns that are right, unless more than nine in ten are wrong.
    let mut values: Vec<f64> = slopes.iter().flatten().map(|slope| slope.value).collect();
    values.sort_by(f64::total_cmp);
    let usual = values.get(values.len() * 9 / 10).copied().unwrap_or(0.0);
    let wrong = |&l: &usize| slopes[l].is_some_and(|slope| slope.is_below(RIGHT * usual));
    let astray: Vec<usize> = (0..split.all.len()).filter(wrong).collect();
    // What is held out and not known to be wrong: that alone may be all that is wrong.
    let held: Vec<usize> = split
        .held_out
        .iter()
        .copied()
        .filter(|l| !astray.contains(l))
        .collect();
    let unrelated = split.held_out.len() >= FEWEST_HELD
        && Slope::of(&by_square, &held).is_some_and(Slope::is_nothing);
    if unrelated || 2 * astray.len() > split.all.len() {
        return Err(RecoverError::UncorrelatedPatterns);
    }
    match astray.is_empty() {
        true => Ok(()),
        false => Err(RecoverError::MismatchedPatterns(astray)),
    }
}

/// Inner products, over pixels, of what the mean function shows of a pattern that differs from what it
/// shows on average, with itself and with the same of what was photographed.
#[derive(Clone, Copy, Debug, Default)]
struct Products {
    shown: f64,
    both: f64,
}

/// What is photographed for one of what is shown.
#[derive(Clone, Copy, Debug)]
struct Slope {
    value: f64,
    error: f64,
}

impl Slope {
    /// Of `patterns` together, from `[square][pattern]`; `None` where nothing is shown.
    fn of(by_square: &[Vec<Products>], patterns: &[usize]) -> Option<Self> {
        let squares: Vec<Products> = by_square
            .iter()
            .map(|square| {
                let products = patterns.iter().map(|&l| square[l]);
                products.fold(Products::default(), |a, b| Products {
                    shown: a.shown + b.shown,
                    both: a.both + b.both,
                })
            })
            .collect();
        let shown: f64 = squares.iter().map(|p| p.shown).sum();
        let value = squares.iter().map(|p| p.both).sum::<f64>() / shown;
        let off = squares.iter().map(|p| (p.both - value * p.shown).powi(2));
        let error = off.sum::<f64>().sqrt() / shown;
        (value.is_finite() && error.is_finite()).then_some(Self { value, error })
    }

    fn is_below(self, value: f64) -> bool {
        self.value + SURE * self.error < value
    }

    fn is_nothing(self) -> bool {
        self.value < SEEN * self.error
    }
}

/// Adds one window's pixels to `products`, `[pattern]`.
fn add(
    products: &mut [Products],
    measurements: &Measurements,
    geometry: &Geometry,
    split: &HoldoutSplit,
    mean_function: &[f64],
    (origin, pixels): (Element, &[(usize, CameraPx)]),
) {
    for (plane, channels) in measurements.planes() {
        let shown = |&l: &usize| {
            let pattern = measurements.patterns[l].plane(plane);
            let slots = mean_function.iter().enumerate().filter_map(|(slot, m)| {
                let element = geometry.window.element(origin, slot);
                Some(m * f64::from(pattern[element.index_in(geometry.light)?]))
            });
            slots.sum::<f64>()
        };
        let shown: Vec<f64> = split.all.iter().map(shown).collect();
        let pixels = pixels.iter().map(|&(_, pixel)| pixel);
        for (pixel, c) in pixels.flat_map(|pixel| channels.clone().map(move |c| (pixel, c))) {
            let sample = |l: usize| measurements.sample(l, pixel, c);
            let known = split.training.iter().filter(|&&l| sample(l).is_finite());
            let [level, light, count] = known.fold([0.0; 3], |[level, light, count], &l| {
                [level + shown[l], light + sample(l), count + 1.0]
            });
            if !(level > 0.0 && light > 0.0) {
                continue;
            }
            for (l, products) in products.iter_mut().enumerate() {
                let seen = sample(l) - light / count;
                if seen.is_finite() {
                    let shown = light / level * (shown[l] - level / count);
                    products.shown += shown * shown;
                    products.both += shown * seen;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(pairs: &[(f64, f64)]) -> Vec<Vec<Products>> {
        let square = |&(shown, both): &(f64, f64)| vec![Products { shown, both }];
        pairs.iter().map(square).collect()
    }

    #[test]
    fn slopes_are_judged_by_how_sure_they_are() {
        let slope = |pairs: &[(f64, f64)]| Slope::of(&squares(pairs), &[0]);
        let right = slope(&[(1.0, 0.9), (2.0, 2.1), (1.0, 1.1)]).unwrap();
        assert!((right.value - 1.025).abs() < 1e-9 && right.error < 0.1);
        assert!(!right.is_below(0.5) && !right.is_nothing());
        let wrong = slope(&[(1.0, 0.1), (2.0, -0.1), (1.0, 0.05)]).unwrap();
        assert!(wrong.is_below(0.5) && wrong.is_nothing());
        let noisy = slope(&[(1.0, 3.0), (2.0, -4.0), (1.0, 1.5)]).unwrap();
        assert!(!noisy.is_below(0.5) && noisy.is_nothing());
        assert!(slope(&[(0.0, 0.0), (0.0, 0.0)]).is_none());
    }
}
