//! Cubic convolution (Keys 1981).

/// The weights of the samples at -1, 0, 1 and 2 in a value interpolated at `fraction`, from 0 to 1. Their sum is 1.
pub(crate) fn cubic_convolution_weights(fraction: f64) -> [f64; 4] {
    [-1.0, 0.0, 1.0, 2.0].map(|k| cubic_convolution(fraction - k))
}

/// The weight of a sample at a distance of `x` samples.
pub(crate) fn cubic_convolution(x: f64) -> f64 {
    match x.abs() {
        x if x < 1.0 => 1.5 * x.powi(3) - 2.5 * x * x + 1.0,
        x if x < 2.0 => -0.5 * x.powi(3) + 2.5 * x * x - 4.0 * x + 2.0,
        _ => 0.0,
    }
}
