//! Colour axes in which most of a pixel lies on the first.

use crate::linalg::symmetric_eigen;
use crate::transport::CHANNELS;

/// Red, green, blue, or shares of other axes.
pub type Pixel = [f32; CHANNELS];

/// One in a table of colours.
const UNIT: f32 = 16384.0;

/// Axes of a tile's first component: its principal colours, in units of 2⁻¹⁴, the strongest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette(pub [[i16; CHANNELS]; CHANNELS]);

impl Palette {
    /// Bytes in a file.
    pub const BYTES: usize = 2 * CHANNELS * CHANNELS;

    /// Principal axes of the colours of `pixels`.
    pub fn principal(pixels: impl Iterator<Item = Pixel>) -> Self {
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

    /// As in a file.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        for (bytes, entry) in bytes.chunks_exact_mut(2).zip(self.0.iter().flatten()) {
            bytes.copy_from_slice(&entry.to_le_bytes());
        }
        bytes
    }

    /// From a file's bytes.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut palette = [[0; CHANNELS]; CHANNELS];
        let entries = palette.iter_mut().flatten();
        for (entry, bytes) in entries.zip(bytes.chunks_exact(2)) {
            *entry = i16::from_le_bytes([bytes[0], bytes[1]]);
        }
        Self(palette)
    }

    fn axes(&self) -> [Pixel; CHANNELS] {
        self.0.map(|axis| axis.map(|c| f32::from(c) / UNIT))
    }

    /// A colour's shares of the axes.
    pub fn turn(&self, rgb: Pixel) -> Pixel {
        self.axes().map(|axis| dot(axis, rgb))
    }

    /// The colour of these shares.
    pub fn turn_back(&self, shares: Pixel) -> Pixel {
        let [a, b, d] = self.axes();
        std::array::from_fn(|c| shares[0] * a[c] + shares[1] * b[c] + shares[2] * d[c])
    }
}

/// The reflection (Householder 1958) that takes a colour to the first axis, and back.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    normal: Pixel,
    /// `2 / ‖normal‖²`, or 0 where nothing is to be mirrored.
    factor: f32,
}

impl Mirror {
    /// The mirror of a pixel whose first component has this colour.
    pub fn of(colour: Pixel) -> Self {
        let length = dot(colour, colour).sqrt();
        let normal = [colour[0] - length, colour[1], colour[2]];
        let square = dot(normal, normal);
        match square.is_normal() {
            true => Self {
                normal,
                factor: 2.0 / square,
            },
            false => Self {
                normal: [0.0; CHANNELS],
                factor: 0.0,
            },
        }
    }

    /// Mirrors a pixel; twice gives the pixel itself.
    pub fn apply(&self, pixel: Pixel) -> Pixel {
        let share = self.factor * dot(self.normal, pixel);
        std::array::from_fn(|c| pixel[c] - share * self.normal[c])
    }
}

fn dot(a: Pixel, b: Pixel) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Luma and two differences of colours, in whole numbers (YCoCg-R; Malvar and Sullivan 2003).
pub fn luma_chroma([red, green, blue]: [i32; CHANNELS]) -> [i32; CHANNELS] {
    let orange = red - blue;
    let middle = blue + (orange >> 1);
    let greenish = green - middle;
    [middle + (greenish >> 1), orange, greenish]
}

/// The colours that [`luma_chroma`] made these of.
pub fn red_green_blue([luma, orange, greenish]: [i32; CHANNELS]) -> [i32; CHANNELS] {
    let middle = luma - (greenish >> 1);
    let blue = middle - (orange >> 1);
    [blue + orange, greenish + middle, blue]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_come_back() {
        for red in [-70, -1, 0, 3, 32767] {
            for green in [-5, 0, 8, 32767] {
                for blue in [-9, 0, 1, 500] {
                    let rgb = [red, green, blue];
                    assert_eq!(red_green_blue(luma_chroma(rgb)), rgb);
                }
            }
        }
    }

    #[test]
    fn a_mirror_takes_its_colour_to_the_first_axis_and_back() {
        let near = |a: Pixel, b: Pixel| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        for colour in [[0.3, 0.9, 0.1], [1.0, 0.0, 0.0], [-1.0, 0.2, 0.1], [0.0; 3]] {
            let mirror = Mirror::of(colour);
            let length = dot(colour, colour).sqrt();
            assert!(near(mirror.apply(colour), [length, 0.0, 0.0]), "{colour:?}");
            let other = [0.2, -0.4, 0.7];
            assert!(near(mirror.apply(mirror.apply(other)), other));
        }
        // Colours that overflow or vanish mirror nothing, and are numbers all the same.
        for colour in [[f32::MAX; 3], [1e-30; 3]] {
            assert!(
                Mirror::of(colour)
                    .apply([1.0; 3])
                    .iter()
                    .all(|c| c.is_finite())
            );
        }
    }

    #[test]
    fn a_palette_turns_there_and_back() {
        let colours = [[0.9, 0.2, 0.1], [0.1, 0.3, 0.8], [0.5, 0.5, 0.45]];
        let palette = Palette::principal(colours.into_iter());
        assert_eq!(Palette::from_bytes(&palette.to_bytes()), palette);
        for colour in colours {
            let back = palette.turn_back(palette.turn(colour));
            assert!(back.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-3));
        }
    }
}
