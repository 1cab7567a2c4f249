//! The colours of a camera: its channels mix the primaries of a display.

use super::CHANNELS;

/// From linear RGB to linear RGB, row by row.
pub type ColorMatrix = [[f64; CHANNELS]; CHANNELS];

/// The product of `matrix` and linear RGB.
#[inline]
pub fn convert_color(
    matrix: &[[f32; CHANNELS]; CHANNELS],
    [r, g, b]: [f32; CHANNELS],
) -> [f32; CHANNELS] {
    matrix.map(|row| row[0] * r + row[1] * g + row[2] * b)
}

/// The largest factor of a photograph's colour matrix.
pub const MAX_COLOR_FACTOR: f64 = 1000.0;

/// Whether all factors are numbers up to [`MAX_COLOR_FACTOR`].
pub fn is_valid_color_matrix(matrix: &ColorMatrix) -> bool {
    let factors = matrix.as_flattened().iter();
    factors
        .copied()
        .all(|factor| factor.abs() <= MAX_COLOR_FACTOR)
}
