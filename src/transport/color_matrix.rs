//! The colours of a camera: its channels mix the primaries of a display.

use super::CHANNELS;

/// From linear RGB to linear RGB, row by row.
pub type ColorMatrix = [[f64; CHANNELS]; CHANNELS];

/// The matrix in single precision, in which pictures and lights are.
pub fn single_precision(matrix: &ColorMatrix) -> [[f32; CHANNELS]; CHANNELS] {
    matrix.map(|row| row.map(|factor| factor as f32))
}

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

/// The inverse, by cofactors; `None` if there is none.
pub fn inverse_color_matrix(matrix: &ColorMatrix) -> Option<ColorMatrix> {
    let cofactor = |row: usize, column: usize| {
        let [r0, r1] = [1, 2].map(|i| (row + i) % CHANNELS);
        let [c0, c1] = [1, 2].map(|i| (column + i) % CHANNELS);
        matrix[r0][c0] * matrix[r1][c1] - matrix[r0][c1] * matrix[r1][c0]
    };
    let determinant: f64 = (0..CHANNELS).map(|c| matrix[0][c] * cofactor(0, c)).sum();
    let is_regular = determinant.abs() > f64::MIN_POSITIVE;
    is_regular
        .then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant)))
}

/// The matrix from a light's linear sRGB to the brightness of each channel of the camera, relative to white light: `diag(1/w) M⁻¹`,
/// where `M` is the photograph's colour matrix and `w = M⁻¹ (1, 1, 1)`. White stays white, and a neutral object has the light's
/// colour; on coloured objects it is an approximation. `None` if the colour matrix has no inverse, or a component of `w` is not above 0.
pub fn light_color_matrix(color_matrix: &ColorMatrix) -> Option<ColorMatrix> {
    let inverse = inverse_color_matrix(color_matrix)?;
    let white = inverse.map(|row| row.iter().sum::<f64>());
    let is_mixture = white.iter().all(|w| *w > 0.0);
    is_mixture.then(|| std::array::from_fn(|c| inverse[c].map(|factor| factor / white[c])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neutral_object_has_the_colour_of_its_light() {
        let matrix = [[4.0, -0.6, -0.2], [-0.4, 1.5, -0.5], [0.0, -0.4, 1.6]];
        let apply = |matrix: &ColorMatrix, rgb: [f64; CHANNELS]| {
            matrix.map(|row| (0..CHANNELS).map(|c| row[c] * rgb[c]).sum::<f64>())
        };
        let white = apply(&inverse_color_matrix(&matrix).unwrap(), [1.0; CHANNELS]);
        let light_matrix = light_color_matrix(&matrix).unwrap();
        for light in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.2, 0.9, 0.4]] {
            let channels = apply(&light_matrix, light);
            let picture = apply(&matrix, std::array::from_fn(|c| white[c] * channels[c]));
            for (shown, wanted) in picture.into_iter().zip(light) {
                assert!((shown - wanted).abs() < 1e-12, "{light:?}: {picture:?}");
            }
        }
        assert_eq!(light_color_matrix(&[[1.0; CHANNELS]; CHANNELS]), None);
    }
}
