//! What is the same among several.

use std::collections::HashMap;
use std::hash::Hash;

/// Numbers `items` in the order in which they come up; the same ones alike.
pub(crate) fn numbers<T: Eq + Hash>(items: impl IntoIterator<Item = T>) -> Vec<usize> {
    let mut known = HashMap::new();
    let number = |item| {
        let next = known.len();
        *known.entry(item).or_insert(next)
    };
    items.into_iter().map(number).collect()
}

/// How many of so [numbered](numbers) items differ.
pub(crate) fn distinct(numbers: &[usize]) -> usize {
    numbers.iter().max().map_or(0, |last| last + 1)
}
