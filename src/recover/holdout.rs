//! Patterns held out, by which all is chosen that measurements themselves must tell.

use super::MIN_PATTERNS;
use crate::capture::{self, Measurements, Pattern};
use crate::transport::CHANNELS;

/// Every how many patterns one is held out.
const EVERY: usize = 10;

/// Patterns to learn from and patterns to choose by.
#[derive(Clone, Debug)]
pub(super) struct HoldoutSplit {
    /// All patterns.
    pub all: Vec<usize>,
    /// All but those held out.
    pub training: Vec<usize>,
    /// Patterns held out; none where that would leave too few.
    pub held_out: Vec<usize>,
}

impl HoldoutSplit {
    /// Holds out every tenth of the patterns that differ. Shots of one pattern, by several exposures,
    /// stay together: what was learned from cannot tell what was learned well.
    pub fn new(measurements: &Measurements) -> Self {
        let all: Vec<usize> = (0..measurements.patterns.len()).collect();
        let numbers = numbers(&measurements.patterns);
        let (held_out, training): (Vec<usize>, Vec<usize>) =
            all.iter().partition(|&&l| numbers[l] % EVERY == EVERY / 2);
        match training.len() >= MIN_PATTERNS && !held_out.is_empty() {
            true => Self {
                all,
                training,
                held_out,
            },
            false => Self {
                training: all.clone(),
                all,
                held_out: Vec::new(),
            },
        }
    }
}

/// Numbers patterns in the order in which they come up; the same ones alike.
pub(super) fn numbers(patterns: &[Pattern]) -> Vec<usize> {
    let bits = |pattern: &Pattern| -> Vec<u32> {
        let planes = (0..CHANNELS).map(|c| pattern.plane(c));
        planes.flatten().map(|p| p.to_bits()).collect()
    };
    capture::numbers(patterns.iter().map(bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shots_of_one_pattern_have_one_number() {
        let grey = |p: f32| Pattern::Grey(vec![p, 0.5]);
        let rgb = |p: f32| Pattern::Rgb([(); CHANNELS].map(|()| vec![p, 0.5]));
        let patterns = [
            grey(0.1),
            rgb(0.1),
            grey(0.3),
            grey(0.1),
            grey(0.4),
            rgb(0.3),
        ];
        assert_eq!(numbers(&patterns), [0, 0, 1, 0, 2, 1]);
    }
}
