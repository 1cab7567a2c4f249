//! The colour matrix of a camera: from its linear RGB to linear sRGB.
//!
//! Seen by the camera, light of a display is `camera = A·p`, where `p` has the display's primaries, those of sRGB or nearly so, and
//! the columns of `A` are the camera's colours of each primary. The colour matrix is `A⁻¹`: it separates what the channels of a
//! camera mix.

use crate::transport::{CHANNELS, ColorMatrix};

/// Three rows of three numbers.
pub type Matrix3 = [[f64; CHANNELS]; CHANNELS];

/// Determinant of the primaries' directions, below which the camera hardly tells them apart.
const MIN_DETERMINANT: f64 = 0.05;

/// The camera's colours of the primaries of sRGB, as columns, from a matrix from its RGB to linear sRGB, of any unit. `None` if that
/// has no inverse.
pub fn primaries_from_matrix(camera_to_srgb: &Matrix3) -> Option<Matrix3> {
    inverse(camera_to_srgb, f64::MIN_POSITIVE)
}

/// The camera's colours of the primaries, as columns, from the light of its photographs of a display that shows each: `lights[k]`
/// is the camera's RGB of primary `k`, less that of the dark photograph, in any unit and through an object of any colour.
///
/// An object changes the brightness of a primary and hardly its direction in the camera's space, as primaries are narrow. The
/// columns' lengths are therefore chosen so that they sum to `white`, the camera's colour of white light. `None` if the camera
/// does not tell the primaries apart, if they are exchanged, or if white is none of their mixtures.
pub fn primaries_from_photographs(
    lights: &[[f64; CHANNELS]; CHANNELS],
    white: [f64; CHANNELS],
) -> Option<Matrix3> {
    let length = |light: &[f64; CHANNELS]| light.iter().map(|y| y * y).sum::<f64>().sqrt();
    // Relative to white, a primary is brightest in its own channel.
    let is_own = |k: usize| {
        let share = |c: usize| lights[k][c] / white[c];
        (0..CHANNELS).all(|c| share(k) >= share(c))
    };
    if !(0..CHANNELS).all(is_own) {
        return None;
    }
    let directions = lights.map(|light| light.map(|y| y / length(&light)));
    let columns: Matrix3 = std::array::from_fn(|c| directions.map(|direction| direction[c]));
    let inverse = inverse(&columns, MIN_DETERMINANT)?;
    let lengths = inverse.map(|row| (0..CHANNELS).map(|c| row[c] * white[c]).sum::<f64>());
    lengths
        .iter()
        .all(|length| *length > 0.0)
        .then(|| columns.map(|row| std::array::from_fn(|k| row[k] * lengths[k])))
}

/// The camera's colour of white light from its colours of the primaries.
pub fn white_of(primaries: &Matrix3) -> [f64; CHANNELS] {
    primaries.map(|row| row.iter().sum())
}

/// The matrix from the camera's RGB to linear sRGB. White at which the camera's most sensitive channel is 1 becomes 1. `None` if
/// the primaries are not independent.
pub fn color_matrix(primaries: &Matrix3) -> Option<ColorMatrix> {
    let most_sensitive = white_of(primaries).into_iter().fold(0.0, f64::max);
    let inverse = inverse(primaries, f64::MIN_POSITIVE)?;
    // Four decimals are more than cameras of one model have in common.
    let rounded = |factor: f64| (factor * most_sensitive * 1e4).round() / 1e4;
    Some(inverse.map(|row| row.map(rounded)))
}

/// The inverse by cofactors; `None` if the determinant's magnitude is not above `least`.
fn inverse(matrix: &Matrix3, least: f64) -> Option<Matrix3> {
    let cofactor = |row: usize, column: usize| {
        let [r0, r1] = [1, 2].map(|i| (row + i) % CHANNELS);
        let [c0, c1] = [1, 2].map(|i| (column + i) % CHANNELS);
        matrix[r0][c0] * matrix[r1][c1] - matrix[r0][c1] * matrix[r1][c0]
    };
    let determinant: f64 = (0..CHANNELS).map(|c| matrix[0][c] * cofactor(0, c)).sum();
    let is_regular = determinant.abs() > least;
    is_regular
        .then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant)))
}

#[cfg(test)]
mod tests {
    use super::*;
    /// From the RGB of a camera to linear sRGB.
    const CAMERA: Matrix3 = [
        [3.7396, -0.5693, -0.1845],
        [-0.3644, 1.5270, -0.5174],
        [0.0479, -0.4141, 1.5610],
    ];

    fn primaries() -> Matrix3 {
        primaries_from_matrix(&CAMERA).unwrap()
    }

    fn assert_near(found: [f64; CHANNELS], expected: [f64; CHANNELS], tolerance: f64) {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() <= tolerance, "{found} {expected}");
        }
    }

    fn converted(matrix: &ColorMatrix, rgb: [f64; CHANNELS]) -> [f64; CHANNELS] {
        matrix.map(|row| (0..CHANNELS).map(|c| row[c] * rgb[c]).sum())
    }

    #[test]
    fn white_and_primaries_of_the_display_become_those_of_srgb() {
        let primaries = primaries();
        let matrix = color_matrix(&primaries).unwrap();
        let white = white_of(&primaries);
        let brightest = white.into_iter().fold(0.0, f64::max);
        assert_near(
            converted(&matrix, white.map(|y| y / brightest)),
            [1.0; 3],
            3e-4,
        );
        let red = primaries.map(|row| row[0] / brightest);
        assert_near(converted(&matrix, red), [1.0, 0.0, 0.0], 3e-4);
        // The same matrix in another unit.
        let unit = matrix[0][0] / CAMERA[0][0];
        for (row, expected) in matrix.into_iter().zip(CAMERA) {
            assert_near(row, expected.map(|factor| unit * factor), 1e-3);
        }
    }

    #[test]
    fn photographs_of_the_primaries_through_coloured_glass_give_the_same_matrix() {
        let primaries = primaries();
        // Yellow glass: each primary's own transmission.
        let transmission = [0.8, 0.6, 0.1];
        let lights: [[f64; CHANNELS]; CHANNELS] =
            std::array::from_fn(|k| primaries.map(|row| row[k] * transmission[k]));
        let found = primaries_from_photographs(&lights, white_of(&primaries)).unwrap();
        let (found, expected) = (color_matrix(&found), color_matrix(&primaries));
        for (row, expected) in found.unwrap().into_iter().zip(expected.unwrap()) {
            assert_near(row, expected, 2e-4);
        }
    }

    #[test]
    fn a_camera_without_colours_has_no_matrix() {
        let grey = [[0.2; CHANNELS], [0.7; CHANNELS], [0.1; CHANNELS]];
        assert_eq!(primaries_from_photographs(&grey, [1.0; CHANNELS]), None);
        let exchanged = [[0.1, 0.8, 0.1], [0.8, 0.1, 0.1], [0.1, 0.1, 0.8]];
        assert_eq!(
            primaries_from_photographs(&exchanged, [1.0; CHANNELS]),
            None
        );
        let dark = [[0.0; CHANNELS]; CHANNELS];
        assert_eq!(primaries_from_photographs(&dark, [1.0; CHANNELS]), None);
        assert_eq!(color_matrix(&dark), None);
    }
}
