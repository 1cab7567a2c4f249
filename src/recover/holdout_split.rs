//! Divides the patterns into training patterns, which recoveries use, and held-out ones, which choose between recoveries.

use serde::{Deserialize, Serialize};

use super::sampling::MIN_PATTERNS;
use crate::capture::{self, Pattern};
use crate::transport::CHANNELS;

/// One in so many distinct patterns is held out.
const HELD_OUT_EVERY: usize = 10;

/// A division of the patterns, by their indices in the measurements.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct HoldoutSplit {
    /// All patterns that may be used.
    pub all: Vec<usize>,
    /// All but those held out.
    pub training: Vec<usize>,
    /// The patterns held out; none if that left fewer than [`MIN_PATTERNS`].
    pub held_out: Vec<usize>,
}

impl HoldoutSplit {
    /// Holds out every tenth distinct pattern. Shots of one pattern at several exposures stay together: a pattern that
    /// is in both parts would measure memory, not prediction.
    pub fn new(patterns: &[Pattern]) -> Self {
        Self::without(patterns, |_| false)
    }

    /// The same without the patterns that are `left_out`.
    pub fn without(patterns: &[Pattern], left_out: impl Fn(usize) -> bool) -> Self {
        let all: Vec<usize> = (0..patterns.len()).filter(|&l| !left_out(l)).collect();
        // Of those that may be used, so that every tenth of them is held out.
        let ids = pattern_ids(all.iter().map(|&l| &patterns[l]));
        let numbered = all.iter().copied().zip(ids);
        let (held, rest): (Vec<_>, Vec<_>) =
            numbered.partition(|(_, id)| id % HELD_OUT_EVERY == HELD_OUT_EVERY / 2);
        let [mut held_out, mut training] =
            [held, rest].map(|list| list.into_iter().map(|(l, _)| l).collect::<Vec<usize>>());
        if training.len() < MIN_PATTERNS || held_out.is_empty() {
            (held_out, training) = (Vec::new(), all.clone());
        }
        Self {
            all,
            training,
            held_out,
        }
    }
}

/// Ids of the patterns, from 0 in order of appearance; equal patterns have one id.
pub(super) fn pattern_ids<'a>(patterns: impl IntoIterator<Item = &'a Pattern>) -> Vec<usize> {
    capture::group_ids(patterns.into_iter().map(Planes))
}

/// A pattern, equal to another if all planes are, grey or not.
struct Planes<'a>(&'a Pattern);

impl PartialEq for Planes<'_> {
    fn eq(&self, other: &Self) -> bool {
        (0..CHANNELS).all(|c| self.0.plane(c) == other.0.plane(c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(p: f32) -> Pattern {
        Pattern::Grey(vec![p, 0.5])
    }

    #[test]
    fn equal_patterns_have_one_id() {
        let rgb = |p: f32| Pattern::Rgb([(); CHANNELS].map(|()| vec![p, 0.5]));
        let patterns = [
            grey(0.1),
            rgb(0.1),
            grey(0.3),
            grey(0.1),
            grey(0.4),
            rgb(0.3),
        ];
        assert_eq!(pattern_ids(&patterns), [0, 0, 1, 0, 2, 1]);
    }

    #[test]
    fn every_tenth_distinct_pattern_is_held_out() {
        let distinct: Vec<Pattern> = (0..25u8).map(|i| grey(f32::from(i))).collect();
        let split = HoldoutSplit::new(&distinct);
        assert_eq!(split.held_out, [5, 15]);
        assert_eq!(split.training.len(), 23);
        assert!(!split.training.contains(&5) && !split.training.contains(&15));
        assert!(split.all.iter().copied().eq(0..25));
    }

    #[test]
    fn every_tenth_of_the_remaining_patterns_is_held_out() {
        let patterns: Vec<Pattern> = (0..40u8).map(|i| grey(f32::from(i))).collect();
        let split = HoldoutSplit::without(&patterns, |l| (10..30).contains(&l));
        assert_eq!(split.held_out, [5, 35]);
        assert_eq!(split.all.len(), 20);
        assert!(!split.training.iter().any(|l| (10..30).contains(l)));
    }

    #[test]
    fn exposures_of_a_pattern_stay_together() {
        // Each pattern twice, once after the other.
        let twice: Vec<Pattern> = (0..24u8).map(|i| grey(f32::from(i / 2))).collect();
        let split = HoldoutSplit::new(&twice);
        assert_eq!(split.held_out, [10, 11]);
        let ids = pattern_ids(&twice);
        for l in &split.training {
            assert!(split.held_out.iter().all(|h| ids[*h] != ids[*l]));
        }
    }

    #[test]
    fn few_patterns_are_all_for_training() {
        for count in [0u8, 4, 5] {
            let patterns: Vec<Pattern> = (0..count).map(|i| grey(f32::from(i))).collect();
            let split = HoldoutSplit::new(&patterns);
            assert!(split.held_out.is_empty());
            assert_eq!(
                (split.training.len(), split.all.len()),
                (patterns.len(), patterns.len())
            );
        }
        // Six patterns are the fewest of which one can be held out.
        let six: Vec<Pattern> = (0..6u8).map(|i| grey(f32::from(i))).collect();
        assert_eq!(HoldoutSplit::new(&six).held_out, [5]);
    }
}
