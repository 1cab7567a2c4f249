//! Sorting. All lists of recovery and of the encoder go through one function: each other comparison would add to its module.

use std::collections::BinaryHeap;

/// The indices of the keys in ascending order. Equal keys keep their order.
pub(crate) fn ascending_order(keys: impl IntoIterator<Item = f64>) -> Vec<usize> {
    order_of(keys.into_iter().map(to_ordered_bits).collect())
}

/// Apart, as each caller has an iterator of its own.
#[inline(never)]
fn order_of(keys: Vec<i64>) -> Vec<usize> {
    let pairs = keys.into_iter().zip(0..).collect();
    sorted_pairs(pairs).into_iter().map(|(_, i)| i).collect()
}

/// Sorts values in ascending order.
pub(crate) fn sort(values: &mut [f64]) {
    let pairs = values
        .iter()
        .map(|value| (to_ordered_bits(*value), 0))
        .collect();
    for (value, (sorted, _)) in values.iter_mut().zip(sorted_pairs(pairs)) {
        *value = f64::from_bits(flip_negative(sorted) as u64);
    }
}

/// An integer that is ordered as the number, by [`f64::total_cmp`].
fn to_ordered_bits(value: f64) -> i64 {
    flip_negative(value.to_bits() as i64)
}

/// Inverts all bits of a negative number but the sign.
fn flip_negative(bits: i64) -> i64 {
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// The middle one of the values in ascending order; of an even number, the larger of two.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sort(&mut sorted);
    sorted[sorted.len() / 2]
}

#[inline(never)]
fn sorted_pairs(mut pairs: Vec<(i64, usize)>) -> Vec<(i64, usize)> {
    // A heap's code is a quarter of a sort's.
    if cfg!(target_arch = "wasm32") {
        return BinaryHeap::from(pairs).into_sorted_vec();
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(target_arch = "wasm32", wasm_bindgen_test::wasm_bindgen_test)]
    fn equal_keys_keep_their_order() {
        let keys = [3.0, -1.0, 3.0, f64::INFINITY, -1.0, -2.5];
        assert_eq!(ascending_order(keys), [5, 1, 4, 0, 2, 3]);
        let mut values = keys;
        sort(&mut values);
        assert_eq!(values, [-2.5, -1.0, -1.0, 3.0, 3.0, f64::INFINITY]);
    }
}
