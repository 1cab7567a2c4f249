//! The colour matrix of a camera: from its linear RGB to linear sRGB.
//!
//! Seen by the camera, light of a display is `camera = A·p`, where `p` has the display's primaries, those of sRGB or nearly so, and
//! the columns of `A` are the camera's colours of each primary. The colour matrix is `A⁻¹`: it separates what the channels of a
//! camera mix.

use crate::transport::{CHANNELS, ColorMatrix, inverse_color_matrix};

/// Least light of a primary, as a share of that of all three.
const MIN_LIGHT_SHARE: f64 = 0.02;
/// Least length of a primary's column, relative to the longest, at which it is a plausible part of white.
const MIN_LENGTH_RATIO: f64 = 0.1;
/// Largest factor of a matrix that is plausible: a camera that needs more hardly tells the primaries apart.
const MAX_FACTOR: f64 = 20.0;

/// The camera's colours of the primaries, as columns, from the light of its photographs of a display that shows each: `lights[k]`
/// is the camera's RGB of primary `k`, less that of the dark photograph, in any unit and through an object of any colour.
///
/// An object changes the brightness of a primary and hardly its direction in the camera's space, as primaries are narrow. The
/// columns' lengths are therefore chosen so that they sum to `white`, the camera's colour of white light. `None` if the camera
/// does not tell the primaries apart, if hardly any light of one comes through the object, if two photographs are exchanged, or if
/// white is none of the primaries' mixtures.
pub fn primaries_from_photographs(
    lights: &[[f64; CHANNELS]; CHANNELS],
    white: [f64; CHANNELS],
) -> Option<ColorMatrix> {
    let brightness = lights.map(|light| light.iter().sum::<f64>());
    let total: f64 = brightness.iter().sum();
    // Drift and stray light have another direction than the primary.
    let is_bright = |k: usize| brightness[k] > MIN_LIGHT_SHARE * total;
    // Relative to white, a primary is brightest in its own channel.
    let is_brightest_in_own_channel = |k: usize| {
        let share = |c: usize| lights[k][c] / white[c];
        (0..CHANNELS).all(|c| share(k) >= share(c))
    };
    if !(0..CHANNELS).all(|k| is_bright(k) && is_brightest_in_own_channel(k)) {
        return None;
    }
    let length = |light: &[f64; CHANNELS]| light.iter().map(|y| y * y).sum::<f64>().sqrt();
    let directions = lights.map(|light| light.map(|y| y / length(&light)));
    let columns: ColorMatrix = std::array::from_fn(|c| directions.map(|direction| direction[c]));
    let inverse = inverse_color_matrix(&columns)?;
    let lengths = inverse.map(|row| (0..CHANNELS).map(|c| row[c] * white[c]).sum::<f64>());
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    lengths
        .iter()
        .all(|length| *length > MIN_LENGTH_RATIO * longest)
        .then(|| columns.map(|row| std::array::from_fn(|k| row[k] * lengths[k])))
}

/// The camera's colour of white light from its colours of the primaries.
pub fn white_of(primaries: &ColorMatrix) -> [f64; CHANNELS] {
    primaries.map(|row| row.iter().sum())
}

/// The matrix from the camera's RGB to linear sRGB. White at which the camera's most sensitive channel is 1 becomes 1. `None` if
/// the primaries are hardly independent.
pub fn color_matrix(primaries: &ColorMatrix) -> Option<ColorMatrix> {
    let most_sensitive = white_of(primaries).into_iter().fold(0.0, f64::max);
    let inverse = inverse_color_matrix(primaries)?;
    // Four decimals are more than cameras of one model have in common.
    let rounded = |factor: f64| (factor * most_sensitive * 1e4).round() / 1e4;
    let matrix = inverse.map(|row| row.map(rounded));
    let is_plausible = matrix
        .as_flattened()
        .iter()
        .all(|factor| factor.abs() <= MAX_FACTOR);
    is_plausible.then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the RGB of a camera to linear sRGB.
    const CAMERA: ColorMatrix = [
        [3.7396, -0.5693, -0.1845],
        [-0.3644, 1.5270, -0.5174],
        [0.0479, -0.4141, 1.5610],
    ];

    fn primaries() -> ColorMatrix {
        inverse_color_matrix(&CAMERA).unwrap()
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
        // Hardly any blue comes through, so that stray light of a thousandth decides.
        let mut weak: [[f64; CHANNELS]; CHANNELS] =
            std::array::from_fn(|k| primaries().map(|row| row[k] * [0.8, 0.6, 0.002][k]));
        weak[2].iter_mut().for_each(|y| *y += 0.001);
        assert_eq!(
            primaries_from_photographs(&weak, white_of(&primaries())),
            None
        );
        let dark = [[0.0; CHANNELS]; CHANNELS];
        assert_eq!(primaries_from_photographs(&dark, [1.0; CHANNELS]), None);
        assert_eq!(color_matrix(&dark), None);
    }
}
