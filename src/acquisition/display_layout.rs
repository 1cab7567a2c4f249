//! The light plane on a display: every light element is a square of whole display pixels.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::transport::Extent;

/// Where the light elements are on a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DisplayLayout {
    /// Size of the display in pixels.
    pub display: Extent,
    /// Size of the light plane in elements.
    pub light: Extent,
    /// Side of an element in display pixels.
    pub element_side: u32,
}

/// Why a light plane has no place on a display.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum DisplayLayoutError {
    /// There are more elements than pixels.
    #[error(
        "a display of {display} pixels has no place for {light} light elements; use at most {display}"
    )]
    TooManyElements {
        /// Size of the display in pixels.
        display: Extent,
        /// Size of the light plane in elements.
        light: Extent,
    },
    /// Elements are too large.
    #[error(
        "{light} light elements of {element_side} x {element_side} pixels do not fit on a display of {display} pixels; use at \
         most {largest} x {largest} pixels"
    )]
    TooLargeElements {
        /// Size of the display in pixels.
        display: Extent,
        /// Size of the light plane in elements.
        light: Extent,
        /// Side of an element in pixels.
        element_side: u32,
        /// The largest side that fits.
        largest: u32,
    },
}

impl DisplayLayout {
    /// The light plane in the middle of the display, with elements of `element_side` pixels, or the largest that fit.
    ///
    /// # Errors
    /// If the elements do not fit.
    pub fn new(
        display: Extent,
        light: Extent,
        element_side: Option<u32>,
    ) -> Result<Self, DisplayLayoutError> {
        let largest = (display.width / light.width).min(display.height / light.height);
        if largest == 0 {
            return Err(DisplayLayoutError::TooManyElements { display, light });
        }
        let element_side = element_side.unwrap_or(largest);
        match (1..=largest).contains(&element_side) {
            true => Ok(Self {
                display,
                light,
                element_side,
            }),
            false => Err(DisplayLayoutError::TooLargeElements {
                display,
                light,
                element_side,
                largest,
            }),
        }
    }

    /// Black pixels to the left of the light plane and above it; as many, or one more, are on the other sides.
    pub fn margin(&self) -> [u32; 2] {
        let free = |display: u32, light: u32| (display - light * self.element_side) / 2;
        [
            free(self.display.width, self.light.width),
            free(self.display.height, self.light.height),
        ]
    }

    /// The display pixel in the middle of the element in column `u` and row `v`.
    pub fn centre(&self, u: u32, v: u32) -> [u32; 2] {
        let [left, top] = self.margin();
        let at = |n: u32| n * self.element_side + self.element_side / 2;
        [left + at(u), top + at(v)]
    }

    /// The display's picture, `[display]`, of a code for each light element, `[M]`.
    pub fn picture<T: Copy + Default>(&self, codes: &[T]) -> Vec<T> {
        let [left, top] = self.margin().map(|margin| margin as usize);
        let (width, side) = (self.display.width as usize, self.element_side as usize);
        let mut picture = vec![T::default(); self.display.area()];
        let elements = codes.chunks_exact(self.light.width as usize);
        let rows = picture.chunks_exact_mut(width).skip(top);
        for (line, codes) in rows.zip(elements.flat_map(|row| std::iter::repeat_n(row, side))) {
            let squares = line[left..].chunks_exact_mut(side);
            squares
                .zip(codes)
                .for_each(|(square, code)| square.fill(*code));
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_squares_in_the_middle_of_the_display() {
        let layout = DisplayLayout::new(Extent::new(11, 7), Extent::new(3, 2), None).unwrap();
        assert_eq!((layout.element_side, layout.margin()), (3, [1, 0]));
        let picture = layout.picture(&[10, 20, 30, 40, 50, 60]);
        let rows: Vec<&[u8]> = picture.chunks_exact(11).collect();
        let row = |codes: [u8; 3]| -> Vec<u8> {
            let squares = codes.iter().flat_map(|&code| [code; 3]);
            [0].into_iter().chain(squares).chain([0]).collect()
        };
        assert_eq!(rows[0], row([10, 20, 30]));
        assert_eq!(rows[2], rows[0]);
        assert_eq!(rows[3], row([40, 50, 60]));
        assert_eq!(rows[6], [0; 11]);
        let [x, y] = layout.centre(2, 1);
        assert_eq!(rows[y as usize][x as usize], 60);
        let small = DisplayLayout::new(Extent::new(11, 7), Extent::new(3, 2), Some(2)).unwrap();
        assert_eq!(small.margin(), [2, 1]);
    }

    #[test]
    fn elements_that_do_not_fit_are_refused_with_the_largest_that_do() {
        for (light, element, part) in [
            ((12, 2), None, "use at most 11x7"),
            ((3, 2), Some(4), "use at most 3 x 3 pixels"),
        ] {
            let light = Extent::new(light.0, light.1);
            let error = DisplayLayout::new(Extent::new(11, 7), light, element).unwrap_err();
            assert!(error.to_string().ends_with(part), "{error}");
        }
    }
}
