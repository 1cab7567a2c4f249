//! Lights: what each element of the light plane emits.

use thiserror::Error;

use super::resample::AreaMeans;
use super::{Tint, fire, math};
use crate::transport::{Extent, Geometry, LightPx};

/// Linear emission of every light element, 0 dark to 1 full brightness: R, G, B and an unused
/// fourth, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    extent: Extent,
    elements: Vec<[f32; 4]>,
}

/// Where a torch shines and how wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorchPose {
    /// Centre of the spot, on the light plane.
    pub centre: LightPx,
    /// Distance, in light elements, at which the spot has fallen to 1/√e.
    pub radius: f64,
}

impl TorchPose {
    /// A torch's usual radius, as a fraction of the light plane's shorter side.
    pub const RADIUS: f64 = 1.0 / 7.0;

    /// A torch of the usual radius over the middle of the light plane.
    pub fn central(light: Extent) -> Self {
        let (w, h) = (f64::from(light.width), f64::from(light.height));
        Self {
            centre: LightPx {
                u: w / 2.0,
                v: h / 2.0,
            },
            radius: w.min(h) * Self::RADIUS,
        }
    }

    /// A torch of the usual radius straight behind a point of the picture, given as fractions of
    /// its width and height.
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

/// The lights every relightable photograph comes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltinLight {
    /// All elements at full brightness.
    Flood,
    /// A round warm spot.
    Torch,
    /// Black and white squares, eight along the shorter side.
    Checkerboard,
    /// Vertical black and white stripes, eight periods across.
    Stripes,
    /// The rainbow from left to right.
    Spectrum,
    /// One moment of a fire that burns along the lower edge: the first of [`Light::fire`].
    Fire,
}

impl BuiltinLight {
    /// All of them, in the order menus show them.
    pub const ALL: [Self; 6] = [
        Self::Flood,
        Self::Torch,
        Self::Checkerboard,
        Self::Stripes,
        Self::Spectrum,
        Self::Fire,
    ];

    /// The name by which attributes and commands call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flood => "flood",
            Self::Torch => "torch",
            Self::Checkerboard => "checkerboard",
            Self::Stripes => "stripes",
            Self::Spectrum => "spectrum",
            Self::Fire => "fire",
        }
    }

    /// The light of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|l| l.name() == name)
    }

    /// This light on a plane of the given extent; a torch stands in the middle.
    pub fn render(self, extent: Extent) -> Light {
        let (w, h) = (f64::from(extent.width), f64::from(extent.height));
        let white = |on: bool| if on { [1.0; 3] } else { [0.0; 3] };
        match self {
            Self::Flood => Light::from_fn(extent, |_| [1.0; 3]),
            Self::Torch => Light::torch(extent, TorchPose::central(extent)),
            Self::Checkerboard => {
                let square = (w.min(h) / 8.0).max(1.0);
                Light::from_fn(extent, |p| {
                    let (i, j) = ((p.u / square) as u32, (p.v / square) as u32);
                    white((i + j).is_multiple_of(2))
                })
            }
            Self::Stripes => {
                let stripe = (w / 16.0).max(1.0);
                Light::from_fn(extent, |p| white(((p.u / stripe) as u32).is_multiple_of(2)))
            }
            Self::Spectrum => Light::from_fn(extent, |p| rainbow(p.u / w)),
            Self::Fire => Light::fire(extent, 0.0),
        }
    }
}

/// A light that does not fit the photograph.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum LightError {
    /// Wrong number of values.
    #[error("the light has {got} values; a light of {extent} elements needs {need}")]
    Length {
        /// Values given.
        got: usize,
        /// Values needed.
        need: usize,
        /// The light.
        extent: Extent,
    },
    /// A picture of no pixels.
    #[error("the light is a picture of {0} pixels; it needs one at least each way")]
    Empty(Extent),
    /// Lights cannot be negative, infinite or NaN.
    #[error("the light has a value that is negative or not a finite number, at element {0}")]
    Value(usize),
}

impl Light {
    /// Builds a light from the emission at each element's centre. Values must be finite and >= 0.
    fn from_fn(extent: Extent, mut emission: impl FnMut(LightPx) -> [f32; 3]) -> Self {
        let mut elements = Vec::with_capacity(extent.area());
        for v in 0..extent.height {
            for u in 0..extent.width {
                let [r, g, b] = emission(LightPx {
                    u: f64::from(u) + 0.5,
                    v: f64::from(v) + 0.5,
                });
                elements.push([r, g, b, 0.0]);
            }
        }
        Self { extent, elements }
    }

    /// A light from linear RGB values, `[height, width, 3]`.
    pub fn from_linear_rgb(extent: Extent, values: &[f32]) -> Result<Self, LightError> {
        let need = extent.area() * 3;
        if values.len() != need {
            return Err(LightError::Length {
                got: values.len(),
                need,
                extent,
            });
        }
        check_values(values, 0)?;
        Ok(Self::from_checked(extent, values))
    }

    /// A light from a picture of any size, of which `read` gives linear RGB values row by row: each
    /// element emits the mean of what it covers.
    pub fn from_linear_rows(
        extent: Extent,
        picture: Extent,
        mut read: impl FnMut(usize, &mut [f32]),
    ) -> Result<Self, LightError> {
        check_picture(picture)?;
        let mut row = vec![0.0; 3 * picture.width as usize];
        let mut read_checked = |y: usize, row: &mut [f32]| {
            read(y, row);
            check_values(row, y * picture.width as usize)
        };
        // Of the light's own size, as a page that animates it has it, elements are what they cover.
        if picture == extent {
            let mut elements = Vec::with_capacity(extent.area());
            for y in 0..extent.height as usize {
                read_checked(y, &mut row)?;
                elements.extend(row.as_chunks().0.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]));
            }
            return Ok(Self { extent, elements });
        }
        let mut means = AreaMeans::new(picture, extent);
        for y in 0..picture.height as usize {
            read_checked(y, &mut row)?;
            means.add_linear(&row);
        }
        Ok(Self::from_checked(extent, &means.finish()))
    }

    /// A light from a picture of any size, of which `read` gives sRGB codes and alpha row by row: each
    /// element emits the mean of what it covers. Colours are not multiplied by alpha, which is the
    /// share of a pixel that shines.
    pub fn from_srgb_rows(
        extent: Extent,
        picture: Extent,
        mut read: impl FnMut(usize, &mut [u8]),
    ) -> Result<Self, LightError> {
        check_picture(picture)?;
        let mut means = AreaMeans::new(picture, extent);
        let mut row = vec![0; 4 * picture.width as usize];
        for y in 0..picture.height as usize {
            read(y, &mut row);
            means.add_srgb(&row);
        }
        Ok(Self::from_checked(extent, &means.finish()))
    }

    fn from_checked(extent: Extent, values: &[f32]) -> Self {
        let elements = values.chunks_exact(3).map(|p| [p[0], p[1], p[2], 0.0]);
        Self {
            extent,
            elements: elements.collect(),
        }
    }

    /// A warm Gaussian spot.
    pub fn torch(extent: Extent, pose: TorchPose) -> Self {
        const WARM_WHITE: [f64; 3] = [1.0, 0.93, 0.80];
        let scale = 0.5 / (pose.radius * pose.radius).max(1e-6);
        // A Gaussian is one across times one down: few exponentials for many elements.
        let profile = |length: u32, centre: f64| -> Vec<f64> {
            let offsets = (0..length).map(|i| f64::from(i) + 0.5 - centre);
            offsets.map(|d| (-d * d * scale).exp()).collect()
        };
        let across = profile(extent.width, pose.centre.u);
        let down = profile(extent.height, pose.centre.v);
        Self::from_fn(extent, |p| {
            let spot = across[p.u as usize] * down[p.v as usize];
            WARM_WHITE.map(|c| (c * spot) as f32)
        })
    }

    /// A fire that burns along the lower edge, `seconds` after it was first looked at: always the
    /// same at the same time, and never twice the same. Times that are not finite are taken as none.
    pub fn fire(extent: Extent, seconds: f64) -> Self {
        Self {
            extent,
            elements: fire::burning(extent, seconds),
        }
    }

    /// What its channels have in common.
    pub fn tint(&self) -> Tint {
        Tint::of(std::iter::once(&self.elements[..]))
    }

    /// Light plane.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Emission of each element, row by row.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }
}

fn check_picture(picture: Extent) -> Result<(), LightError> {
    if picture.width == 0 || picture.height == 0 {
        return Err(LightError::Empty(picture));
    }
    Ok(())
}

/// Values of elements from the one of number `first` on.
fn check_values(values: &[f32], first: usize) -> Result<(), LightError> {
    match values.iter().position(|v| !v.is_finite() || *v < 0.0) {
        Some(bad) => Err(LightError::Value(first + bad / 3)),
        None => Ok(()),
    }
}

/// A rainbow over 0..=1, red to violet, as linear RGB: three overlapping cosine lobes.
fn rainbow(x: f64) -> [f32; 3] {
    let lobe = |centre: f64| {
        let d = ((x - centre).abs() / 0.36).min(1.0);
        (0.5 + 0.5 * math::cos(std::f64::consts::PI * d)) as f32
    };
    // Violet is blue with a little red coming back.
    [lobe(0.12) + 0.35 * lobe(1.0), lobe(0.48), lobe(0.82)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: Extent = Extent {
        width: 32,
        height: 16,
    };

    #[test]
    fn built_in_lights_have_names_and_stay_in_range() {
        for light in BuiltinLight::ALL {
            assert_eq!(BuiltinLight::from_name(light.name()), Some(light));
            let lit = light.render(PLANE);
            assert_eq!(lit.elements().len(), PLANE.area());
            for e in lit.elements().iter().flatten() {
                assert!((0.0..=1.0).contains(e), "{} emits {e}", light.name());
            }
        }
        assert_eq!(BuiltinLight::from_name("moon"), None);
    }

    #[test]
    fn torch_peaks_where_it_points() {
        let centre = LightPx { u: 4.5, v: 9.5 };
        let light = Light::torch(
            PLANE,
            TorchPose {
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
    fn fire_burns_below_glows_red_and_moves() {
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
    fn a_light_of_the_wrong_size_or_with_nan_is_refused() {
        assert!(matches!(
            Light::from_linear_rgb(PLANE, &[0.0; 5]),
            Err(LightError::Length {
                got: 5,
                need: 1536,
                ..
            })
        ));
        let mut values = vec![0.5; 1536];
        values[7] = f32::NAN;
        assert_eq!(
            Light::from_linear_rgb(PLANE, &values),
            Err(LightError::Value(2))
        );
    }

    #[test]
    fn a_picture_is_a_light_whatever_its_size() {
        let extent = |width, height| Extent { width, height };
        let linear = |picture: Extent, values: &[f32]| {
            Light::from_linear_rows(PLANE, picture, |y, row| {
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
        let white = |picture| Light::from_srgb_rows(PLANE, picture, |_, row| row.fill(255));
        assert_eq!(white(extent(70, 3)), Ok(flood));
        assert_eq!(white(extent(0, 2)), Err(LightError::Empty(extent(0, 2))));
        let mut values = vec![1.0; 12];
        values[10] = -1.0;
        assert_eq!(linear(extent(2, 2), &values), Err(LightError::Value(3)));
    }
}
