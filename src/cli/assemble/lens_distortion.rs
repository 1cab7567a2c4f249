//! Lens distortion of photographs, undone by resampling.
//!
//! The model is that of Brown (1966), with the numbers that OpenCV's `calibrateCamera` gives. An ideal lens shows a
//! direction (x, y) at the pixel (f_x x + c_x, f_y y + c_y), where the centre of the first pixel is (0, 0). With
//! r² = x² + y², this lens shows it at the pixel of the direction
//!
//! ```text
//! x' = x (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) + 2 p₁ x y + p₂ (r² + 2 x²)
//! y' = y (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) + p₁ (r² + 2 y²) + 2 p₂ x y
//! ```
//!
//! A pixel of the undistorted picture is interpolated there by cubic convolution.

use std::fmt;
use std::str::FromStr;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::linalg::cubic_convolution_weights;
use crate::transport::Extent;

/// Distances from the centre at which the model is checked, as shares of that of the farthest corner.
const CHECKED_DISTANCES: u32 = 100;

/// A lens, by focal lengths, centre and coefficients of its distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LensDistortion {
    /// f_x and f_y, in pixels.
    focal: [f64; 2],
    /// c_x and c_y, in pixels.
    centre: [f64; 2],
    /// k₁, k₂ and k₃.
    radial: [f64; 3],
    /// p₁ and p₂.
    tangential: [f64; 2],
}

/// A sample of a photograph that takes part in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tap {
    pub x: u32,
    pub y: u32,
    pub weight: f64,
}

impl Tap {
    /// The whole pixel (x, y).
    pub fn whole(x: u32, y: u32) -> Self {
        let weight = 1.0;
        Self { x, y, weight }
    }
}

impl FromStr for LensDistortion {
    type Err = String;

    /// Reads `FX,FY,CX,CY,K1[,K2[,P1[,P2[,K3]]]]`.
    fn from_str(text: &str) -> Result<Self, String> {
        const FORM: &str = "give FX,FY,CX,CY,K1,K2,P1,P2,K3 as OpenCV's calibrateCamera does; the last four may be left out";
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        let numbers = numbers.map_err(|_| FORM)?;
        if numbers.len() > 9 {
            return Err(
                "it has more than five coefficients; calibrate without OpenCV's rational model, thin prisms and tilt".to_owned(),
            );
        }
        if numbers.len() < 5 || numbers.iter().any(|n| !n.is_finite()) {
            return Err(FORM.to_owned());
        }
        let number = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
        if number(0) <= 0.0 || number(1) <= 0.0 {
            return Err("FX and FY, the focal lengths in pixels, must be above 0".to_owned());
        }
        Ok(Self {
            focal: [number(0), number(1)],
            centre: [number(2), number(3)],
            radial: [number(4), number(5), number(8)],
            tangential: [number(6), number(7)],
        })
    }
}

impl fmt::Display for LensDistortion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([fx, fy], [cx, cy]) = (self.focal, self.centre);
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        write!(f, "{fx},{fy},{cx},{cy},{k1},{k2},{p1},{p2},{k3}")
    }
}

impl LensDistortion {
    /// Refuses a model that a photograph of this size cannot have.
    pub fn check(&self, photograph: Extent) -> Result<()> {
        let Extent { width, height } = photograph;
        let [cx, cy] = self.centre;
        let contains = |c: f64, side: u32| (0.0..f64::from(side)).contains(&c);
        ensure!(
            contains(cx, width) && contains(cy, height),
            "has {width}x{height} pixels, but the centre of --undistort is ({cx}, {cy}); the numbers are those of photographs of \
             another size"
        );
        let corners = [0, width].map(|x| [0, height].map(|y| [f64::from(x), f64::from(y)]));
        let squares = corners.as_flattened().iter().map(|corner| {
            let [x, y] = self.direction(*corner);
            x * x + y * y
        });
        let farthest = squares.fold(0.0, f64::max).sqrt();
        let [k1, k2, k3] = self.radial;
        // The derivative of the distance from the centre.
        let rises = |distance: f64| {
            let r2 = distance * distance;
            1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) > 0.0
        };
        let distances =
            (0..=CHECKED_DISTANCES).map(|i| f64::from(i) / f64::from(CHECKED_DISTANCES));
        ensure!(
            distances.map(|share| share * farthest).all(rises),
            "has {width}x{height} pixels, over which --undistort folds the picture; focal lengths and centre must be in pixels of this \
             photograph, and the coefficients in OpenCV's order"
        );
        Ok(())
    }

    /// The samples of a photograph that pixel (x, y) of the undistorted picture is interpolated from: none, if it lies outside.
    pub fn taps(&self, photograph: Extent, x: u32, y: u32) -> impl Iterator<Item = Tap> {
        let at = self.distorted([f64::from(x), f64::from(y)]);
        let sides = [photograph.width, photograph.height];
        let is_inside = (0..2).all(|i| at[i] >= -0.5 && at[i] < f64::from(sides[i]) - 0.5);
        let axes = [0, 1].map(|i| {
            let cell = at[i].floor();
            let weights = cubic_convolution_weights(at[i] - cell);
            // The border repeats.
            let index = |k: usize| (cell as i64 + k as i64 - 1).clamp(0, i64::from(sides[i]) - 1);
            [0, 1, 2, 3].map(|k| (index(k) as u32, weights[k]))
        });
        let [columns, rows] = axes;
        let rows = rows.into_iter().take(if is_inside { 4 } else { 0 });
        let taps = rows.flat_map(move |(y, row)| {
            columns.into_iter().map(move |(x, column)| Tap {
                x,
                y,
                weight: row * column,
            })
        });
        taps.filter(|tap| tap.weight != 0.0)
    }

    fn direction(&self, pixel: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| (pixel[i] - self.centre[i]) / self.focal[i])
    }

    /// The place in the photograph of a place in the undistorted picture.
    fn distorted(&self, pixel: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.direction(pixel);
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let direction = [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ];
        [0, 1].map(|i| direction[i] * self.focal[i] + self.centre[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHOTOGRAPH: Extent = Extent::new(60, 40);

    fn lens(text: &str) -> LensDistortion {
        text.parse().unwrap()
    }

    #[test]
    fn a_lens_that_does_not_distort_leaves_pixels() {
        let lens = lens("50,50,29.5,19.5,0");
        for (x, y) in PHOTOGRAPH.cells() {
            let taps: Vec<Tap> = lens.taps(PHOTOGRAPH, x, y).collect();
            let main = taps
                .iter()
                .max_by(|a, b| a.weight.total_cmp(&b.weight))
                .unwrap();
            assert_eq!((main.x, main.y), (x, y));
            assert!((main.weight - 1.0).abs() < 1e-9, "{taps:?}");
        }
    }

    /// The expected places are those of OpenCV 5.0's `projectPoints`.
    #[test]
    fn places_are_those_of_opencv() {
        let lens = lens("1200, 1180, 640, 360, -0.21, 0.07, 0.001, -0.002, 0.01");
        for (pixel, expected) in [
            ([640.0, 360.0], [640.0, 360.0]),
            ([100.0, 50.0], [126.555400745, 65.939248583]),
            ([1279.0, 700.0], [1234.261807584, 677.096322302]),
        ] {
            let at = lens.distorted(pixel);
            for i in 0..2 {
                assert!((at[i] - expected[i]).abs() < 1e-6, "{pixel:?} {at:?}");
            }
        }
    }

    #[test]
    fn a_distorted_picture_becomes_straight() {
        let lens = lens("50,48,31,18,-0.2,0.05,0.01,-0.02");
        let scene = |[x, y]: [f64; 2]| 2.0 + (0.21 * x).sin() + (0.17 * y).cos();
        // Of the scene, each pixel of the photograph shows the place that the lens takes there.
        let undistorted = |pixel: [f64; 2]| {
            let mut place = pixel;
            for _ in 0..50 {
                let at = lens.distorted(place);
                place = [0, 1].map(|i| place[i] + pixel[i] - at[i]);
            }
            place
        };
        let photograph = |x: u32, y: u32| scene(undistorted([f64::from(x), f64::from(y)]));
        let mut inside = 0;
        for (x, y) in PHOTOGRAPH.cells() {
            let taps: Vec<Tap> = lens.taps(PHOTOGRAPH, x, y).collect();
            let is_near_border = taps.iter().any(|tap| {
                [0, PHOTOGRAPH.width - 1].contains(&tap.x)
                    || [0, PHOTOGRAPH.height - 1].contains(&tap.y)
            });
            if taps.is_empty() || is_near_border {
                continue;
            }
            inside += 1;
            let value: f64 = taps
                .iter()
                .map(|tap| tap.weight * photograph(tap.x, tap.y))
                .sum();
            let expected = scene([f64::from(x), f64::from(y)]);
            assert!(
                (value - expected).abs() < 2e-3,
                "({x}, {y}): {value} {expected}"
            );
        }
        assert!(inside > PHOTOGRAPH.area() / 2, "{inside}");
    }

    #[test]
    fn pixels_outside_the_photograph_have_no_taps() {
        // A pincushion needs more than there is.
        let lens = lens("50,50,29.5,19.5,0.4");
        assert_eq!(lens.taps(PHOTOGRAPH, 0, 0).count(), 0);
        assert!(lens.taps(PHOTOGRAPH, 30, 20).count() > 0);
    }

    #[test]
    fn numbers_are_read_as_they_are_written() {
        let text = "1200,1180,640,360,-0.21,0.07,0.001,-0.002,0.01";
        assert_eq!(lens(text).to_string(), text);
    }

    #[test]
    fn other_numbers_are_refused() {
        for text in [
            "",
            "1,2,3,4",
            "1,2,3,4,x",
            "1,2,3,4,inf",
            "0,2,3,4,5",
            "1,-2,3,4,5",
            "1,2,3,4,5,6,7,8,9,10",
        ] {
            assert!(text.parse::<LensDistortion>().is_err(), "{text}");
        }
        assert!(lens("50,50,29.5,19.5,-0.2").check(PHOTOGRAPH).is_ok());
        for (text, part) in [
            ("50,50,290,190,-0.2", "another size"),
            ("5,5,29.5,19.5,-0.2", "folds"),
        ] {
            let error = lens(text).check(PHOTOGRAPH).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
