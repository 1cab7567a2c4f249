//! Groups of equal items, for instance shots of the same pattern.

use std::collections::HashMap;
use std::hash::Hash;

/// For each item the id of its group: equal items share an id, and ids count from 0 in the order of first occurrence.
pub(crate) fn group_ids<T: Eq + Hash>(items: impl IntoIterator<Item = T>) -> Vec<usize> {
    let mut ids = HashMap::new();
    let id = |item| {
        let next = ids.len();
        *ids.entry(item).or_insert(next)
    };
    items.into_iter().map(id).collect()
}

/// Number of groups among these [`group_ids`].
pub(crate) fn group_count(ids: &[usize]) -> usize {
    ids.iter().max().map_or(0, |last| last + 1)
}
