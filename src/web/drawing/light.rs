//! Lights for a photograph of this module.

use js_sys::{Float32Array, Uint8ClampedArray};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::relight::{BuiltinLight, Light, LightError, TorchSpot};
use crate::transport::{CHANNELS, Extent, LightPosition};
use crate::web::{CodedError, Photo};

/// The emission of each element of a photograph's light plane.
#[wasm_bindgen(js_name = Light)]
pub struct WebLight(pub(in crate::web) Light);

#[wasm_bindgen(js_class = Light)]
impl WebLight {
    /// The built-in light of that name.
    ///
    /// # Errors
    /// Code `light-name` for other names.
    pub fn builtin(photo: &Photo, name: &str) -> Result<WebLight, CodedError> {
        let light = BuiltinLight::from_name(name).ok_or_else(|| {
            let names = "use one of flood, torch, checkerboard, stripes, spectrum, fire";
            let message = ["unknown built-in light '", name, "'; ", names].concat();
            CodedError::new("light-name", message)
        })?;
        Ok(Self(light.render(photo.geometry().light_region())))
    }

    /// A torch at a position on the light plane, in light elements from its top left corner, or outside it. `size` is the
    /// radius as a fraction of the light plane's shorter side.
    ///
    /// # Errors
    /// Code `light-value` for values that are out of range.
    pub fn torch(photo: &Photo, u: f64, v: f64, size: Option<f64>) -> Result<WebLight, CodedError> {
        let size = size.unwrap_or(TorchSpot::DEFAULT_RADIUS);
        // Squares of larger distances could overflow.
        const MAX_DISTANCE: f64 = 1e12;
        const MAX_SIZE: f64 = 1e6;
        if !(u.abs() <= MAX_DISTANCE && v.abs() <= MAX_DISTANCE && size > 0.0 && size <= MAX_SIZE) {
            // Without the values: code that prints floats would add more to the module than the torch.
            return Err(CodedError::new(
                "light-value",
                "the torch is out of range: its position must be in fractions of the picture, and its size a \
                 positive fraction of the light plane",
            ));
        }
        let region = photo.geometry().light_region();
        let side = f64::from(region.plane.width.min(region.plane.height));
        let pose = TorchSpot {
            centre: LightPosition { u, v },
            radius: size * side,
        };
        Ok(Self(Light::torch(region, pose)))
    }

    /// Flames along the lower edge at a time in seconds. The built-in light `fire` is time 0.
    ///
    /// # Errors
    /// Code `light-value` for a time that is not finite.
    pub fn fire(photo: &Photo, seconds: f64) -> Result<WebLight, CodedError> {
        if !seconds.is_finite() {
            return Err(CodedError::new(
                "light-value",
                "the time of the fire must be a finite number of seconds",
            ));
        }
        Ok(Self(Light::fire(photo.geometry().light_region(), seconds)))
    }

    /// A light image in linear RGB, 0 to 1 at full brightness, row by row. It covers the light plane and is resampled by
    /// area; with `elements` it has the photograph's elements, which of a shard are a part of its light plane.
    ///
    /// # Errors
    /// Code `light-size` for another number of values, `light-value` for negative or infinite values.
    #[wasm_bindgen(js_name = fromLinear)]
    pub fn from_linear(
        photo: &Photo,
        values: &Float32Array,
        width: u32,
        height: u32,
        elements: Option<bool>,
    ) -> Result<WebLight, CodedError> {
        let image = image_extent(values.length(), 3, width, height)?;
        let region = match elements {
            Some(true) => photo.geometry().light.into(),
            _ => photo.geometry().light_region(),
        };
        let light = Light::from_linear_rows(region, image, |y, row| {
            let (first, end) = (y * row.len(), (y + 1) * row.len());
            values.subarray(first as u32, end as u32).copy_to(row);
        })?;
        Ok(Self(light))
    }

    /// A light image in sRGB with straight alpha, RGBA, row by row. A pixel emits its alpha's share of its colour. The
    /// image is resampled by area.
    ///
    /// # Errors
    /// Code `light-size` for another number of values.
    #[wasm_bindgen(js_name = fromSrgb)]
    pub fn from_srgb(
        photo: &Photo,
        rgba: &Uint8ClampedArray,
        width: u32,
        height: u32,
    ) -> Result<WebLight, CodedError> {
        let image = image_extent(rgba.length(), 4, width, height)?;
        let light = Light::from_srgb_rows(photo.geometry().light_region(), image, |y, row| {
            let (first, end) = (y * row.len(), (y + 1) * row.len());
            rgba.subarray(first as u32, end as u32).copy_to(row);
        })?;
        Ok(Self(light))
    }

    /// Linear RGB of the rows from `first` up to `end`, row by row.
    #[wasm_bindgen(js_name = linearRgb)]
    pub fn linear_rgb(&self, first: usize, end: usize) -> Float32Array {
        let Extent { width, height } = self.0.extent();
        let (width, end) = (width as usize, end.min(height as usize));
        let first = first.min(end);
        let length = CHANNELS * width;
        let values = Float32Array::new_with_length((length * (end - first)) as u32);
        // Row by row: the module's memory never shrinks.
        let mut row = vec![[0.0; CHANNELS]; width];
        let elements = &self.0.elements()[first * width..end * width];
        for (i, elements) in elements.chunks_exact(width.max(1)).enumerate() {
            for (value, [r, g, b, _]) in row.iter_mut().zip(elements) {
                *value = [*r, *g, *b];
            }
            let (start, end) = (i * length, (i + 1) * length);
            let target = values.subarray(start as u32, end as u32);
            target.copy_from(row.as_flattened());
        }
        values
    }
}

/// The extent of a light image with that many values.
fn image_extent(length: u32, channels: u64, width: u32, height: u32) -> Result<Extent, LightError> {
    let extent = Extent { width, height };
    let need = (u64::from(width) * u64::from(height)).saturating_mul(channels);
    if u64::from(length) != need {
        return Err(LightError::WrongLength {
            got: length as usize,
            need: usize::try_from(need).unwrap_or(usize::MAX),
            extent,
        });
    }
    Ok(extent)
}
