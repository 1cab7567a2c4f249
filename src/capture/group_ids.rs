//! Groups of equal items, for instance shots of the same pattern.

/// For each item the id of its group: equal items share an id, and ids count from 0 in the order of first occurrence.
/// Items are compared in pairs: they are few.
pub(crate) fn group_ids<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<usize> {
    let mut firsts: Vec<T> = Vec::new();
    let id = |item| {
        let known = firsts.iter().position(|first| *first == item);
        known.unwrap_or_else(|| {
            firsts.push(item);
            firsts.len() - 1
        })
    };
    items.into_iter().map(id).collect()
}

/// Number of groups among these [`group_ids`].
pub(crate) fn group_count(ids: &[usize]) -> usize {
    ids.iter().max().map_or(0, |last| last + 1)
}
