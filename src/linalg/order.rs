//! Sorting. All lists of recovery go through one function: each other comparison would add two kilobytes to its module.

/// The indices of the keys in ascending order. Equal keys keep their order.
pub(crate) fn ascending_order(keys: impl IntoIterator<Item = f64>) -> Vec<usize> {
    let keys = keys.into_iter().zip(0..).collect();
    sorted_pairs(keys).into_iter().map(|(_, i)| i).collect()
}

/// Sorts values in ascending order.
pub(crate) fn sort(values: &mut [f64]) {
    let pairs = values.iter().map(|value| (*value, 0)).collect();
    for (value, (sorted, _)) in values.iter_mut().zip(sorted_pairs(pairs)) {
        *value = sorted;
    }
}

/// The middle one of the values in ascending order; of an even number, the larger of two.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sort(&mut sorted);
    sorted[sorted.len() / 2]
}

#[inline(never)]
fn sorted_pairs(mut pairs: Vec<(f64, usize)>) -> Vec<(f64, usize)> {
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_keys_keep_their_order() {
        let keys = [3.0, -1.0, 3.0, f64::INFINITY, -1.0];
        assert_eq!(ascending_order(keys), [1, 4, 0, 2, 3]);
        let mut values = keys;
        sort(&mut values);
        assert_eq!(values, [-1.0, -1.0, 3.0, 3.0, f64::INFINITY]);
    }
}
