//! Lights: the vector `p` in `y = pT`, one linear RGB emission for each element of the light plane.

use std::ops::Range;

use thiserror::Error;

use super::resample::AreaResampler;
use super::{fire, platform_math, srgb};
use crate::transport::{
    ColorMatrix, Extent, Geometry, LightPosition, LightRegion, convert_color, single_precision,
};

/// The linear emission of every light element, 0 to 1 at full brightness.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    extent: Extent,
    elements: Vec<[f32; 4]>,
}

/// Position and size of a torch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorchSpot {
    /// Centre of the spot on the light plane.
    pub centre: LightPosition,
    /// Standard deviation of the spot, in light elements.
    pub radius: f64,
}

impl TorchSpot {
    /// The default radius, as a fraction of the light plane's shorter side.
    pub const DEFAULT_RADIUS: f64 = 1.0 / 7.0;

    /// The default torch, in the middle of the light plane.
    pub fn central(light: Extent) -> Self {
        let (w, h) = (f64::from(light.width), f64::from(light.height));
        Self {
            centre: LightPosition {
                u: w / 2.0,
                v: h / 2.0,
            },
            radius: w.min(h) * Self::DEFAULT_RADIUS,
        }
    }

    /// The default torch straight behind a point of the picture, given as fractions of its width and height.
    pub fn behind(geometry: &Geometry, x: f64, y: f64) -> Self {
        let Extent { width, height } = geometry.camera;
        Self {
            centre: geometry
                .correspondence
                .map(x * f64::from(width), y * f64::from(height)),
            ..Self::central(geometry.light)
        }
    }
}

/// The built-in lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltinLight {
    /// All elements at full brightness.
    Flood,
    /// A warm Gaussian spot.
    Torch,
    /// Black and white squares, eight along the shorter side.
    Checkerboard,
    /// Vertical black and white stripes, eight periods across.
    Stripes,
    /// A rainbow from left to right.
    Spectrum,
    /// Flames along the lower edge: [`Light::fire`] at time 0.
    Fire,
}

impl BuiltinLight {
    /// All built-in lights by their names in attributes and on the command line, in the order of menus.
    pub const BY_NAME: [(&str, Self); 6] = [
        ("flood", Self::Flood),
        ("torch", Self::Torch),
        ("checkerboard", Self::Checkerboard),
        ("stripes", Self::Stripes),
        ("spectrum", Self::Spectrum),
        ("fire", Self::Fire),
    ];

    /// The built-in light of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        let mut lights = Self::BY_NAME.into_iter();
        lights.find_map(|(known, light)| (known == name).then_some(light))
    }

    /// The light on a light plane, or on a part of one.
    pub fn render(self, region: impl Into<LightRegion>) -> Light {
        let region = region.into();
        let plane = region.plane;
        let (w, h) = (f64::from(plane.width), f64::from(plane.height));
        let white = |on: bool| if on { [1.0; 3] } else { [0.0; 3] };
        match self {
            Self::Flood => Light::from_fn(region, &|_| [1.0; 3]),
            Self::Torch => Light::torch(region, TorchSpot::central(plane)),
            Self::Checkerboard => {
                let cell = (w.min(h) / 8.0).max(1.0);
                Light::from_fn(region, &|p| {
                    let (i, j) = ((p.u / cell) as u32, (p.v / cell) as u32);
                    white((i + j).is_multiple_of(2))
                })
            }
            Self::Stripes => {
                let stripe = (w / 16.0).max(1.0);
                Light::from_fn(region, &|p| {
                    white(((p.u / stripe) as u32).is_multiple_of(2))
                })
            }
            Self::Spectrum => Light::from_fn(region, &|p| rainbow(p.u / w)),
            Self::Fire => Light::fire(region, 0.0),
        }
    }
}

impl Light {
    /// The light with each element's RGB multiplied by `matrix`; negative emissions become 0. See
    /// [`light_color_matrix`](crate::transport::light_color_matrix).
    pub fn converted(&self, matrix: &ColorMatrix) -> Self {
        let matrix = single_precision(matrix);
        let convert = |&[r, g, b, rest]: &[f32; 4]| {
            let [r, g, b] = convert_color(&matrix, [r, g, b]).map(|emission| emission.max(0.0));
            [r, g, b, rest]
        };
        Self {
            extent: self.extent,
            elements: self.elements.iter().map(convert).collect(),
        }
    }
}

/// Values that are no light for this photograph.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum LightError {
    /// The number of values does not match the extent.
    #[error("the light has {got} values; {extent} elements need {need}")]
    WrongLength {
        /// Values given.
        got: usize,
        /// Values needed.
        need: usize,
        /// The extent.
        extent: Extent,
    },
    /// A light image without pixels.
    #[error("the light image has {0} pixels; width and height must be at least 1")]
    EmptyImage(Extent),
    /// A value is negative, infinite or NaN.
    #[error("the light has a value that is negative or not a finite number, at element {0}")]
    InvalidValue(usize),
}

impl Light {
    /// A light from the emission at each element's centre, which must be finite and not negative.
    ///
    /// Not generic: modules have one copy of it.
    fn from_fn(region: LightRegion, emission: &dyn Fn(LightPosition) -> [f32; 3]) -> Self {
        let mut elements = Vec::with_capacity(region.extent.area());
        for centre in region.centres() {
            elements.push(element(emission(centre)));
        }
        Self {
            extent: region.extent,
            elements,
        }
    }

    /// A light from linear RGB values, `[height, width, 3]`.
    ///
    /// # Errors
    /// [`LightError::WrongLength`] or [`LightError::InvalidValue`].
    pub fn from_linear_rgb(extent: Extent, values: &[f32]) -> Result<Self, LightError> {
        let need = extent.area() * 3;
        if values.len() != need {
            return Err(LightError::WrongLength {
                got: values.len(),
                need,
                extent,
            });
        }
        Self::from_linear_rows(extent, extent, |y, row| {
            row.copy_from_slice(&values[y * row.len()..][..row.len()]);
        })
    }

    /// A light from a light image of any extent, which covers the light plane, resampled by area. `read_row` fills rows
    /// in turn with linear RGB values: those that the light needs.
    ///
    /// # Errors
    /// [`LightError::EmptyImage`] or [`LightError::InvalidValue`].
    pub fn from_linear_rows(
        region: impl Into<LightRegion>,
        image: Extent,
        mut read_row: impl FnMut(usize, &mut [f32]),
    ) -> Result<Self, LightError> {
        Self::from_rows(region.into(), image, &mut read_row)
    }

    /// As [`from_linear_rows`](Self::from_linear_rows), from rows of sRGB codes and straight alpha; a pixel emits its
    /// alpha's share of its colour. Codes are decoded before they are averaged, as the mean of codes is darker than that
    /// of light.
    ///
    /// # Errors
    /// [`LightError::EmptyImage`].
    pub fn from_srgb_rows(
        region: impl Into<LightRegion>,
        image: Extent,
        mut read_row: impl FnMut(usize, &mut [u8]),
    ) -> Result<Self, LightError> {
        let linear = srgb::srgb8_decoded();
        let mut codes = vec![0; 4 * image.width as usize];
        Self::from_rows(region.into(), image, &mut |y, row| {
            read_row(y, &mut codes);
            let (pixels, codes) = (row.as_chunks_mut().0, codes.as_chunks().0);
            for (emission, &[r, g, b, alpha]) in pixels.iter_mut().zip(codes) {
                let alpha = f64::from(alpha) * (1.0 / 255.0);
                *emission = [r, g, b].map(|code: u8| (alpha * linear[usize::from(code)]) as f32);
            }
        })
    }

    /// Not generic: modules have one copy of it.
    fn from_rows(
        region: LightRegion,
        image: Extent,
        read_row: &mut dyn FnMut(usize, &mut [f32]),
    ) -> Result<Self, LightError> {
        check_extent(image)?;
        let mut row = vec![0.0; 3 * image.width as usize];
        let mut read_checked = |y: usize, row: &mut [f32]| {
            read_row(y, row);
            match row.iter().position(|v| !v.is_finite() || *v < 0.0) {
                Some(bad) => Err(LightError::InvalidValue(y * image.width as usize + bad / 3)),
                None => Ok(()),
            }
        };
        let extent = region.extent;
        let mut elements = Vec::with_capacity(extent.area());
        // Nothing to resample; usual where a page animates its own light.
        if image == extent && extent == region.plane {
            for y in 0..extent.height as usize {
                read_checked(y, &mut row)?;
                elements.extend(row.as_chunks().0.iter().copied().map(element));
            }
        } else {
            let mut resampler = AreaResampler::new(image, region);
            for y in resampler.rows() {
                read_checked(y, &mut row)?;
                resampler.add_row(&row);
            }
            elements.extend(resampler.finish().map(element));
        }
        Ok(Self { extent, elements })
    }

    /// A warm Gaussian spot, placed on the whole light plane.
    pub fn torch(region: impl Into<LightRegion>, pose: TorchSpot) -> Self {
        const WARM_WHITE: [f64; 3] = [1.0, 0.93, 0.80];
        let scale = 0.5 / (pose.radius * pose.radius).max(1e-6);
        // Separable: one exponential for each column and row, not for each element.
        let profile = |elements: Range<u32>, centre: f64| -> Vec<f64> {
            let offsets = elements.map(|i| f64::from(i) + 0.5 - centre);
            offsets.map(|d| (-d * d * scale).exp()).collect()
        };
        let region = region.into();
        let columns = profile(region.columns(), pose.centre.u);
        let rows = profile(region.rows(), pose.centre.v);
        let mut elements = Vec::with_capacity(region.extent.area());
        for row in &rows {
            let spots = columns.iter().map(|column| column * row);
            elements.extend(spots.map(|spot| element(WARM_WHITE.map(|c| (c * spot) as f32))));
        }
        Self {
            extent: region.extent,
            elements,
        }
    }

    /// Flames along the lower edge at a time in seconds, which do not repeat. A time that is not finite counts as 0.
    pub fn fire(region: impl Into<LightRegion>, seconds: f64) -> Self {
        let region = region.into();
        Self {
            extent: region.extent,
            elements: fire::fire_emission(region, seconds),
        }
    }

    /// The part that a region of this light's plane has.
    ///
    /// # Panics
    /// If the region is of another plane.
    pub fn part(&self, region: LightRegion) -> Self {
        assert_eq!(self.extent, region.plane, "plane of the region");
        let width = self.extent.width as usize;
        let rows = region.rows().map(|v| v as usize * width);
        let [first, count] = [region.first[0], region.extent.width].map(|u| u as usize);
        let rows = rows.flat_map(|row| &self.elements[row + first..][..count]);
        Self {
            extent: region.extent,
            elements: rows.copied().collect(),
        }
    }

    /// Extent of the light plane, or of the part of it.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Emission of each element, row by row: R, G, B and an unused fourth value.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }
}

fn check_extent(image: Extent) -> Result<(), LightError> {
    if image.width == 0 || image.height == 0 {
        return Err(LightError::EmptyImage(image));
    }
    Ok(())
}

fn element([r, g, b]: [f32; 3]) -> [f32; 4] {
    [r, g, b, 0.0]
}

/// A rainbow over 0..=1, red to violet, in linear RGB: a cosine lobe for each channel.
fn rainbow(x: f64) -> [f32; 3] {
    let lobe = |centre: f64| {
        let d = ((x - centre).abs() / 0.36).min(1.0);
        (0.5 + 0.5 * platform_math::cos(std::f64::consts::PI * d)) as f32
    };
    // Violet is blue with a little red coming back.
    [lobe(0.12) + 0.35 * lobe(1.0), lobe(0.48), lobe(0.82)]
}

#[cfg(test)]
mod tests {
    use super::super::area_resample;
    use super::*;

    const PLANE: Extent = Extent::new(32, 16);

    #[test]
    fn conversion_keeps_white_and_replaces_negative_emissions_by_0() {
        let light = Light::from_linear_rgb(Extent::new(2, 1), &[1.0, 1.0, 1.0, 0.0, 0.5, 0.0]);
        let matrix = [[1.5, -0.5, 0.0], [0.0, 1.0, 0.0], [0.25, 0.25, 0.5]];
        let converted = light.unwrap().converted(&matrix);
        let [white, green] = converted.elements() else {
            panic!("two elements");
        };
        assert_eq!(white[..3], [1.0, 1.0, 1.0]);
        assert_eq!(green[..3], [0.0, 0.5, 0.125]);
    }

    #[test]
    fn built_in_lights_have_names_and_stay_in_range() {
        for (name, light) in BuiltinLight::BY_NAME {
            assert_eq!(BuiltinLight::from_name(name), Some(light));
            let lit = light.render(PLANE);
            assert_eq!(lit.elements().len(), PLANE.area());
            for e in lit.elements().iter().flatten() {
                assert!((0.0..=1.0).contains(e), "{name} emits {e}");
            }
        }
        assert_eq!(BuiltinLight::from_name("moon"), None);
    }

    #[test]
    fn the_torch_peaks_at_its_centre() {
        let centre = LightPosition { u: 4.5, v: 9.5 };
        let light = Light::torch(
            PLANE,
            TorchSpot {
                centre,
                radius: 2.0,
            },
        );
        let brightest = light
            .elements()
            .iter()
            .enumerate()
            .max_by(|a, b| a.1[0].total_cmp(&b.1[0]))
            .unwrap();
        assert_eq!(brightest.0, 9 * 32 + 4);
    }

    #[test]
    fn fire_is_brightest_below_and_red_and_moves() {
        let fire = Light::fire(PLANE, 0.0);
        let row = |v: usize| -> f32 { fire.elements[v * 32..][..32].iter().map(|e| e[0]).sum() };
        assert!(
            row(15) > 8.0 && row(0) < 0.1 * row(15),
            "{}, {}",
            row(15),
            row(0)
        );
        for [r, g, b, _] in &fire.elements {
            assert!(r >= g && g >= b);
        }
        assert_eq!(Light::fire(PLANE, 0.0), fire);
        assert_ne!(Light::fire(PLANE, 0.1), fire);
    }

    #[test]
    fn wrong_lengths_and_invalid_values_are_errors() {
        assert!(matches!(
            Light::from_linear_rgb(PLANE, &[0.0; 5]),
            Err(LightError::WrongLength {
                got: 5,
                need: 1536,
                ..
            })
        ));
        let mut values = vec![0.5; 1536];
        values[7] = f32::NAN;
        assert_eq!(
            Light::from_linear_rgb(PLANE, &values),
            Err(LightError::InvalidValue(2))
        );
    }

    #[test]
    fn light_images_of_any_extent_become_lights() {
        let extent = |width, height| Extent { width, height };
        let linear = |image: Extent, values: &[f32]| {
            Light::from_linear_rows(PLANE, image, |y, row| {
                row.copy_from_slice(&values[y * row.len()..][..row.len()]);
            })
        };
        let values: Vec<f32> = (0..1536).map(|i| i as f32).collect();
        assert_eq!(
            linear(PLANE, &values),
            Light::from_linear_rgb(PLANE, &values)
        );
        let flood = BuiltinLight::Flood.render(PLANE);
        assert_eq!(linear(extent(1, 1), &[1.0; 3]), Ok(flood.clone()));
        let white = |image| Light::from_srgb_rows(PLANE, image, |_, row| row.fill(255));
        assert_eq!(white(extent(70, 3)), Ok(flood));
        assert_eq!(
            white(extent(0, 2)),
            Err(LightError::EmptyImage(extent(0, 2)))
        );
        let mut values = vec![1.0; 12];
        values[10] = -1.0;
        assert_eq!(
            linear(extent(2, 2), &values),
            Err(LightError::InvalidValue(3))
        );
    }

    #[test]
    fn srgb_codes_are_decoded_before_they_are_averaged() {
        let image = Extent::new(7, 5);
        let rgba: Vec<u8> = (0..140).map(|i| (i * 89 % 256) as u8).collect();
        let linear: Vec<f32> = rgba
            .chunks(4)
            .flat_map(|p| {
                let linear = |code: u8| srgb::srgb_decode(f64::from(code) / 255.0);
                [0, 1, 2].map(|c| (linear(p[c]) * f64::from(p[3]) / 255.0) as f32)
            })
            .collect();
        for (width, height) in [(3, 2), (7, 5), (20, 11), (1, 1), (2, 9)] {
            let plane = Extent::new(width, height);
            let want = area_resample(&linear, image, plane);
            let light = Light::from_srgb_rows(plane, image, |y, row| {
                row.copy_from_slice(&rgba[28 * y..][..28]);
            });
            let elements = light.unwrap().elements;
            for ([rgb @ .., _], want) in elements.iter().zip(want.as_chunks::<3>().0) {
                for (got, want) in rgb.iter().zip(want) {
                    assert!(
                        (got - want).abs() <= 1e-6 * want,
                        "{plane}: {got}, not {want}"
                    );
                }
            }
        }
    }
}
