//! Bisection.

/// Halves `[low, high]` `halvings` times. If `is_low` holds at `low` and not at `high`, it still does afterwards.
/// Ends with the first error of `is_low`.
pub(crate) fn bisect<E>(
    [mut low, mut high]: [f64; 2],
    halvings: usize,
    mut is_low: impl FnMut(f64) -> Result<bool, E>,
) -> Result<[f64; 2], E> {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        match is_low(middle)? {
            true => low = middle,
            false => high = middle,
        }
    }
    Ok([low, high])
}
