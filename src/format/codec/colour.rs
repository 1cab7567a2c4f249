//! Colour transforms of three values, which concentrate energy in the first.
//!
//! | transform | of | reference |
//! |---|---|---|
//! | [`ColourKlt`] | component 0 of a tile | Karhunen 1947, Loève 1948 |
//! | [`HouseholderReflection`] | other components, by the pixel's own colour | Householder 1958 |
//! | [`ycocg_forward`] | quantised direct functions | Malvar and Sullivan 2003 |

use crate::linalg::symmetric_eigen;
use crate::transport::CHANNELS;

/// Red, green and blue, or the coordinates on other axes.
pub type ColourVector = [f32; CHANNELS];

/// The integer that stands for 1 in a stored matrix.
const UNIT: f32 = 16384.0;

/// The colour KLT of a tile's component 0: its principal axes in units of 2⁻¹⁴, the strongest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourKlt(pub [[i16; CHANNELS]; CHANNELS]);

impl ColourKlt {
    /// Bytes in a file.
    pub const BYTES: usize = 2 * CHANNELS * CHANNELS;

    /// The principal axes of `pixels`.
    pub fn of_pixels(pixels: impl Iterator<Item = ColourVector>) -> Self {
        let mut moment = vec![0.0f64; CHANNELS * CHANNELS];
        for pixel in pixels {
            for i in 0..CHANNELS {
                for j in 0..CHANNELS {
                    moment[i * CHANNELS + j] += f64::from(pixel[i]) * f64::from(pixel[j]);
                }
            }
        }
        let (_, axes) = symmetric_eigen(moment, CHANNELS);
        Self(std::array::from_fn(|axis| {
            std::array::from_fn(|c| (axes[axis * CHANNELS + c] as f32 * UNIT).round() as i16)
        }))
    }

    /// The bytes in a file.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let entries = self.0.as_flattened();
        std::array::from_fn(|i| entries[i / 2].to_le_bytes()[i % 2])
    }

    /// Reads [`BYTES`](Self::BYTES) bytes.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let (entries, _) = bytes.as_chunks();
        Self(std::array::from_fn(|axis| {
            std::array::from_fn(|c| i16::from_le_bytes(entries[axis * CHANNELS + c]))
        }))
    }

    fn axes(&self) -> [ColourVector; CHANNELS] {
        self.0.map(|axis| axis.map(|c| f32::from(c) / UNIT))
    }

    /// A colour's coordinates on the axes.
    pub fn forward(&self, rgb: ColourVector) -> ColourVector {
        self.axes().map(|axis| dot(axis, rgb))
    }

    /// The colour with these coordinates.
    pub fn inverse(&self, coordinates: ColourVector) -> ColourVector {
        let [a, b, d] = self.axes();
        std::array::from_fn(|c| {
            coordinates[0] * a[c] + coordinates[1] * b[c] + coordinates[2] * d[c]
        })
    }
}

/// The reflection that maps a colour to the first axis, and back.
#[derive(Clone, Copy, Debug)]
pub struct HouseholderReflection {
    normal: ColourVector,
    /// `2 / ‖normal‖²`, or 0 for the identity.
    factor: f32,
}

impl HouseholderReflection {
    /// The reflection of a pixel whose component 0 has this colour.
    pub fn of_colour(colour: ColourVector) -> Self {
        let length = dot(colour, colour).sqrt();
        let normal = [colour[0] - length, colour[1], colour[2]];
        let square = dot(normal, normal);
        let (normal, factor) = match square.is_normal() {
            true => (normal, 2.0 / square),
            false => ([0.0; CHANNELS], 0.0),
        };
        Self { normal, factor }
    }

    /// Reflects a pixel. The reflection is its own inverse.
    pub fn apply(&self, pixel: ColourVector) -> ColourVector {
        let scale = self.factor * dot(self.normal, pixel);
        std::array::from_fn(|c| pixel[c] - scale * self.normal[c])
    }
}

/// The pixel with 0 for values that are not finite.
pub fn finite(pixel: ColourVector) -> ColourVector {
    pixel.map(|c| if c.is_finite() { c } else { 0.0 })
}

fn dot(a: ColourVector, b: ColourVector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Integer RGB to Y, Co, Cg (YCoCg-R).
pub fn ycocg_forward([red, green, blue]: [i32; CHANNELS]) -> [i32; CHANNELS] {
    let co = red - blue;
    let middle = blue + (co >> 1);
    let cg = green - middle;
    [middle + (cg >> 1), co, cg]
}

/// The inverse of [`ycocg_forward`].
pub fn ycocg_inverse([luma, co, cg]: [i32; CHANNELS]) -> [i32; CHANNELS] {
    let middle = luma - (cg >> 1);
    let blue = middle - (co >> 1);
    [blue + co, cg + middle, blue]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ycocg_is_invertible() {
        for red in [-70, -1, 0, 3, 32767] {
            for green in [-5, 0, 8, 32767] {
                for blue in [-9, 0, 1, 500] {
                    let rgb = [red, green, blue];
                    assert_eq!(ycocg_inverse(ycocg_forward(rgb)), rgb);
                }
            }
        }
    }

    #[test]
    fn a_reflection_maps_its_colour_to_the_first_axis_and_back() {
        let near =
            |a: ColourVector, b: ColourVector| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        for colour in [[0.3, 0.9, 0.1], [1.0, 0.0, 0.0], [-1.0, 0.2, 0.1], [0.0; 3]] {
            let reflection = HouseholderReflection::of_colour(colour);
            let length = dot(colour, colour).sqrt();
            assert!(
                near(reflection.apply(colour), [length, 0.0, 0.0]),
                "{colour:?}"
            );
            let other = [0.2, -0.4, 0.7];
            assert!(near(reflection.apply(reflection.apply(other)), other));
        }
        // Colours that overflow or vanish give the identity.
        for colour in [[f32::MAX; 3], [1e-30; 3]] {
            assert!(
                HouseholderReflection::of_colour(colour)
                    .apply([1.0; 3])
                    .iter()
                    .all(|c| c.is_finite())
            );
        }
    }

    #[test]
    fn the_klt_is_invertible() {
        let colours = [[0.9, 0.2, 0.1], [0.1, 0.3, 0.8], [0.5, 0.5, 0.45]];
        let klt = ColourKlt::of_pixels(colours.into_iter());
        assert_eq!(ColourKlt::from_bytes(&klt.to_bytes()), klt);
        for colour in colours {
            let back = klt.inverse(klt.forward(colour));
            assert!(back.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-3));
        }
    }
}
