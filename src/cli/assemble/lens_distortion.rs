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
use std::ops::Range;
use std::str::FromStr;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::linalg::cubic_convolution_weights;
use crate::transport::{Extent, TileRect};

/// Where the centre of a lens lies, as shares of the picture's sides: that of a photograph of half or twice the size lies outside.
const CENTRE_SHARES: Range<f64> = 0.3..0.7;
/// Places along each side of a picture at which the model is checked.
const CHECKED_PLACES: u32 = 33;

/// A lens, by focal lengths, centre and coefficients of its distortion. Kept as text, from which all its numbers come back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
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

impl TryFrom<String> for LensDistortion {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<LensDistortion> for String {
    fn from(lens: LensDistortion) -> Self {
        lens.to_string()
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
    /// Refuses a model that a photograph of this size cannot have, or that folds the `kept` part of the picture.
    pub fn check(&self, photograph: Extent, kept: TileRect) -> Result<()> {
        let Extent { width, height } = photograph;
        let [cx, cy] = self.centre;
        let is_near_middle = |c: f64, side: u32| CENTRE_SHARES.contains(&(c / f64::from(side)));
        ensure!(
            is_near_middle(cx, width) && is_near_middle(cy, height),
            "has {width}x{height} pixels, but the centre of --undistort is ({cx}, {cy}), far from the middle; calibrate with photographs of \
             this size. From a size to half of it, as raw files have: half of FX and FY, (CX + 0.5) / 2 - 0.5, and so for CY"
        );
        let place = |i: u32, from: u32, side: u32| {
            f64::from(from) - 0.5 + f64::from(side) * f64::from(i) / f64::from(CHECKED_PLACES - 1)
        };
        let places = Extent::new(CHECKED_PLACES, CHECKED_PLACES).cells();
        let mut places = places.map(|(i, j)| {
            let Extent { width, height } = kept.extent;
            [place(i, kept.x, width), place(j, kept.y, height)]
        });
        ensure!(
            places.all(|pixel| self.keeps_orientation(pixel)),
            "has {width}x{height} pixels, of which --undistort folds some; focal lengths and centre must be in pixels of this photograph, \
             the coefficients in OpenCV's order, and parts that the calibration has not seen need a --crop"
        );
        Ok(())
    }

    /// Whether the derivative of the distortion keeps orientation at a place of the undistorted picture.
    fn keeps_orientation(&self, pixel: [f64; 2]) -> bool {
        let [x, y] = self.direction(pixel);
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let radial = self.radial_factor(r2);
        let slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let xx = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
        let yy = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
        let xy = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        xx + yy > 0.0 && xx * yy - xy * xy > 0.0
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
            let last = f64::from(sides[i] - 1);
            let index = |k: usize| (cell + k as f64 - 1.0).clamp(0.0, last) as u32;
            [0, 1, 2, 3].map(|k| (index(k), weights[k]))
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

    /// 1 + k₁ r² + k₂ r⁴ + k₃ r⁶.
    fn radial_factor(&self, r2: f64) -> f64 {
        let [k1, k2, k3] = self.radial;
        1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    }

    /// The place in the photograph of a place in the undistorted picture.
    fn distorted(&self, pixel: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.direction(pixel);
        let [p1, p2] = self.tangential;
        let r2 = x * x + y * y;
        let radial = self.radial_factor(r2);
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
        let text = "1234.5678901234567,1180,640,360,-0.21,0.07000000000000003,0.001,-0.002,0.01";
        assert_eq!(lens(text).to_string(), text);
        let json = serde_json::to_string(&lens(text)).unwrap();
        assert_eq!(
            serde_json::from_str::<LensDistortion>(&json).unwrap(),
            lens(text)
        );
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
    }

    #[test]
    fn lenses_of_other_photographs_are_refused() {
        let whole = TileRect {
            x: 0,
            y: 0,
            extent: PHOTOGRAPH,
        };
        assert!(
            lens("50,50,29.5,19.5,-0.2")
                .check(PHOTOGRAPH, whole)
                .is_ok()
        );
        for (text, part) in [
            ("100,100,59.5,39.5,-0.2", "this size"),
            ("25,25,14.5,9.5,-0.2", "this size"),
            ("5,5,29.5,19.5,-0.2", "folds"),
            ("50,50,29.5,19.5,-0.1,0,5", "folds"),
            ("50,50,29.5,19.5,1e300", "folds"),
        ] {
            let error = lens(text).check(PHOTOGRAPH, whole).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        // Places that a crop cuts off may be folded.
        let folded = lens("20,20,29.5,19.5,-0.2");
        assert!(folded.check(PHOTOGRAPH, whole).is_err());
        let middle = TileRect {
            x: 20,
            y: 10,
            extent: Extent::new(20, 20),
        };
        assert!(folded.check(PHOTOGRAPH, middle).is_ok());
        assert_eq!(
            lens("50,50,29.5,19.5,1e300").taps(PHOTOGRAPH, 0, 0).count(),
            0
        );
    }
}
