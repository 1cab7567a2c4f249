//! Pictures that a display showed in a session of another program: what each is, and its pattern of light elements.

use crate::calibrate::LightPlaneAxis;
use crate::simulate::GrayCodePattern;
use crate::transport::{CHANNELS, Extent};

/// Largest difference of a code from black or white that counts as either: lossy compression changes codes a little.
const TOLERANCE: u8 = 4;
/// Difference of emissions within a light element, above which the element is not one: at every other pixel for instance.
const MAX_ELEMENT_CONTRAST: f64 = 0.02;

/// What a picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplayedRole {
    /// Black: stray light.
    Dark,
    /// White.
    Flood,
    /// A bit of the Gray code of the display's columns or rows.
    GrayCode(GrayCodePattern),
    /// Anything else.
    Pattern,
}

/// A picture with a code for each pixel of the display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayedPicture {
    /// Pixels of the display.
    pub extent: Extent,
    /// `[pixel]`, red, green and blue.
    pub codes: Vec<[u8; CHANNELS]>,
}

impl DisplayedPicture {
    /// Recognises black, white and Gray code by their pixels.
    pub fn role(&self) -> DisplayedRole {
        let is_near = |wanted: u8| {
            let mut codes = self.codes.as_flattened().iter();
            codes.all(|code| code.abs_diff(wanted) <= TOLERANCE)
        };
        if is_near(0) {
            return DisplayedRole::Dark;
        }
        if is_near(u8::MAX) {
            return DisplayedRole::Flood;
        }
        let axes = [LightPlaneAxis::X, LightPlaneAxis::Y].into_iter();
        let found = axes.filter_map(|axis| self.gray_code(axis)).next();
        found.map_or(DisplayedRole::Pattern, DisplayedRole::GrayCode)
    }

    /// The Gray code's pattern along an axis that the picture is.
    fn gray_code(&self, axis: LightPlaneAxis) -> Option<GrayCodePattern> {
        let Extent { width, height } = self.extent;
        let (length, stride) = match axis {
            LightPlaneAxis::X => (width, 1),
            LightPlaneAxis::Y => (height, width as usize),
        };
        let is_bright = |[red, ..]: &[u8; CHANNELS]| *red > u8::MAX / 2;
        let profile: Vec<bool> = (0..length as usize)
            .map(|n| is_bright(&self.codes[n * stride]))
            .collect();
        let is_stripes = self.extent.cells().zip(&self.codes).all(|((u, v), code)| {
            let bright = profile[if axis == LightPlaneAxis::X { u } else { v } as usize];
            let wanted = if bright { u8::MAX } else { 0 };
            code.iter().all(|code| code.abs_diff(wanted) <= TOLERANCE)
        });
        if !is_stripes {
            return None;
        }
        let bits = 0..length.next_power_of_two().ilog2();
        let patterns = bits.flat_map(|bit| {
            [false, true].map(|inverted| GrayCodePattern {
                axis,
                bit,
                inverted,
            })
        });
        let mut matching = patterns.filter(|pattern| {
            let numbers = (0..length).zip(&profile);
            numbers
                .into_iter()
                .all(|(n, bright)| pattern.is_lit(n) == *bright)
        });
        matching.next()
    }

    /// The codes of light elements of `side` × `side` display pixels: those that emit the mean emission of their pixels,
    /// where `emission` is that of each code. `None` if the picture has detail within an element.
    pub fn element_codes(&self, side: u32, emission: &[f64; 256]) -> Option<Vec<[u8; CHANNELS]>> {
        let light = self.light_plane(side);
        let element = |(u, v): (u32, u32)| {
            let columns = u * side..((u + 1) * side).min(self.extent.width);
            let rows = v * side..((v + 1) * side).min(self.extent.height);
            let count = columns.len() as f64 * rows.len() as f64;
            let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            let mut sum = [0.0; CHANNELS];
            let (mut least, mut most) = ([f64::INFINITY; CHANNELS], [0.0f64; CHANNELS]);
            for (x, y) in pixels {
                let codes = self.codes[y as usize * self.extent.width as usize + x as usize];
                for c in 0..CHANNELS {
                    let emitted = emission[usize::from(codes[c])];
                    sum[c] += emitted;
                    (least[c], most[c]) = (least[c].min(emitted), most[c].max(emitted));
                }
            }
            let is_even = (0..CHANNELS).all(|c| most[c] - least[c] <= MAX_ELEMENT_CONTRAST);
            is_even.then(|| sum.map(|sum| nearest_code(sum / count, emission)))
        };
        light.cells().map(element).collect()
    }

    /// Light elements of `side` × `side` display pixels; those at the right and bottom borders may have fewer.
    pub fn light_plane(&self, side: u32) -> Extent {
        let Extent { width, height } = self.extent;
        Extent::new(width.div_ceil(side), height.div_ceil(side))
    }
}

/// The code whose emission, which rises with the code, is nearest to `emitted`.
fn nearest_code(emitted: f64, emission: &[f64; 256]) -> u8 {
    let above = emission.partition_point(|e| *e < emitted).clamp(1, 255);
    let is_nearer_below = emitted - emission[above - 1] < emission[above] - emitted;
    (above - usize::from(is_nearer_below)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::PatternImage;

    const DISPLAY: Extent = Extent::new(20, 12);

    fn picture(code: impl Fn(u32, u32) -> u8) -> DisplayedPicture {
        DisplayedPicture {
            extent: DISPLAY,
            codes: DISPLAY
                .cells()
                .map(|(x, y)| [code(x, y); CHANNELS])
                .collect(),
        }
    }

    fn linear() -> [f64; 256] {
        std::array::from_fn(|code| code as f64 / 255.0)
    }

    #[test]
    fn black_white_and_every_bit_of_the_gray_code_are_recognised() {
        assert_eq!(picture(|_, _| 2).role(), DisplayedRole::Dark);
        assert_eq!(picture(|_, _| 255).role(), DisplayedRole::Flood);
        for pattern in GrayCodePattern::all(DISPLAY) {
            let PatternImage::Grey(codes) = pattern.codes(DISPLAY) else {
                panic!("Gray code is grey");
            };
            let shown = picture(|x, y| codes[(y * DISPLAY.width + x) as usize]);
            assert_eq!(shown.role(), DisplayedRole::GrayCode(pattern));
        }
        for other in [
            picture(|x, y| if (x / 3 + y) % 2 == 0 { 255 } else { 0 }),
            picture(|x, _| if x % 3 == 0 { 255 } else { 0 }),
            picture(|_, _| 128),
        ] {
            assert_eq!(other.role(), DisplayedRole::Pattern);
        }
    }

    #[test]
    fn elements_emit_the_mean_of_their_pixels() {
        let blocks = picture(|x, y| if (x / 4 + y / 4) % 2 == 0 { 252 } else { 255 });
        let codes = blocks.element_codes(4, &linear()).unwrap();
        assert_eq!(blocks.light_plane(4), Extent::new(5, 3));
        assert_eq!(
            (codes[0], codes[1], codes[5]),
            ([252; 3], [255; 3], [255; 3])
        );
        // At the border an element has fewer pixels.
        assert_eq!(blocks.light_plane(8), Extent::new(3, 2));
        let mixed = blocks.element_codes(8, &linear()).unwrap();
        assert_eq!(mixed.len(), 6);
        assert!([253, 254].contains(&mixed[0][0]), "{mixed:?}");
        let stripes = picture(|x, _| if x % 2 == 0 { 0 } else { 255 });
        assert_eq!(stripes.element_codes(2, &linear()), None);
        assert_eq!(stripes.element_codes(1, &linear()).unwrap()[1], [255; 3]);
    }

    #[test]
    fn codes_of_emissions_are_the_nearest() {
        let squared: [f64; 256] = std::array::from_fn(|code| (code as f64 / 255.0).powi(2));
        for code in [0u8, 1, 100, 254, 255] {
            let emitted = squared[usize::from(code)];
            assert_eq!(nearest_code(emitted, &squared), code);
        }
        assert_eq!(nearest_code(2.0, &squared), 255);
    }
}
