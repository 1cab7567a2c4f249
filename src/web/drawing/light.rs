//! Lights made for a photograph.

use js_sys::{Float32Array, Uint8ClampedArray};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::relight::{self, BuiltinLight, LightError, TorchPose};
use crate::transport::{CHANNELS, Extent};
use crate::web::{CodedError, Photo};

/// What each element of a photograph's light plane emits.
#[wasm_bindgen]
pub struct Light(relight::Light);

impl Light {
    pub(in crate::web) fn inner(&self) -> &relight::Light {
        &self.0
    }
}

#[wasm_bindgen]
impl Light {
    /// The built-in light of that name.
    pub fn builtin(photo: &Photo, name: &str) -> Result<Light, CodedError> {
        let light = BuiltinLight::from_name(name).ok_or_else(|| {
            let names = BuiltinLight::ALL.map(BuiltinLight::name).join(", ");
            CodedError::new(
                "light-name",
                format!("there is no built-in light '{name}'; there are {names}"),
            )
        })?;
        Ok(Self(light.render(photo.geometry().light)))
    }

    /// A torch straight behind the point (`x`, `y`) of the picture, which may lie outside it: 0..1
    /// from left to right and from top to bottom. `size` is its radius as a fraction of the light
    /// plane's shorter side.
    pub fn torch(photo: &Photo, x: f64, y: f64, size: Option<f64>) -> Result<Light, CodedError> {
        let size = size.unwrap_or(TorchPose::RADIUS);
        // Any larger, and squares of distances could overflow.
        const FAR: f64 = 1e6;
        if !(x.abs() <= FAR && y.abs() <= FAR && size > 0.0 && size <= FAR) {
            // Without them: printing such numbers takes more of the module than torches do.
            return Err(CodedError::new(
                "light-value",
                "such a torch cannot be: positions are fractions of the picture, and the size a \
                 positive fraction of the light plane",
            ));
        }
        let geometry = photo.geometry();
        let side = f64::from(geometry.light.width.min(geometry.light.height));
        let pose = TorchPose {
            radius: size * side,
            ..TorchPose::behind(geometry, x, y)
        };
        Ok(Self(relight::Light::torch(geometry.light, pose)))
    }

    /// A fire that burns along the lower edge, `seconds` after it was first looked at: always the
    /// same at the same time. The built-in light `fire` is its first moment.
    pub fn fire(photo: &Photo, seconds: f64) -> Result<Light, CodedError> {
        if !seconds.is_finite() {
            return Err(CodedError::new(
                "light-value",
                "the time of a fire must be a finite number of seconds",
            ));
        }
        Ok(Self(relight::Light::fire(photo.geometry().light, seconds)))
    }

    /// A picture as light: linear RGB values, 0 dark to 1 full brightness, row by row. Each element
    /// of the light emits the mean of what it covers.
    #[wasm_bindgen(js_name = fromLinear)]
    pub fn from_linear(
        photo: &Photo,
        values: &Float32Array,
        width: u32,
        height: u32,
    ) -> Result<Light, CodedError> {
        let picture = picture(values.length(), 3, width, height)?;
        let light = relight::Light::from_linear_rows(photo.geometry().light, picture, |y, row| {
            let (first, end) = (y * row.len(), (y + 1) * row.len());
            values.subarray(first as u32, end as u32).copy_to(row);
        })?;
        Ok(Self(light))
    }

    /// A picture in sRGB as light: RGBA, row by row, colours not multiplied by alpha, which is the
    /// share of a pixel that shines. Each element of the light emits the mean of what it covers.
    #[wasm_bindgen(js_name = fromSrgb)]
    pub fn from_srgb(
        photo: &Photo,
        rgba: &Uint8ClampedArray,
        width: u32,
        height: u32,
    ) -> Result<Light, CodedError> {
        let picture = picture(rgba.length(), 4, width, height)?;
        let light = relight::Light::from_srgb_rows(photo.geometry().light, picture, |y, row| {
            let (first, end) = (y * row.len(), (y + 1) * row.len());
            rgba.subarray(first as u32, end as u32).copy_to(row);
        })?;
        Ok(Self(light))
    }

    /// Linear RGB values of the rows from `first` up to `end`, row by row.
    #[wasm_bindgen(js_name = linearRgb)]
    pub fn linear_rgb(&self, first: usize, end: usize) -> Float32Array {
        let Extent { width, height } = self.0.extent();
        let (width, end) = (width as usize, end.min(height as usize));
        let first = first.min(end);
        let length = CHANNELS * width;
        let values = Float32Array::new_with_length((length * (end - first)) as u32);
        // Row by row: this memory never shrinks.
        let mut row = vec![[0.0; CHANNELS]; width];
        let elements = &self.0.elements()[first * width..end * width];
        for (i, elements) in elements.chunks_exact(width.max(1)).enumerate() {
            for (value, [r, g, b, _]) in row.iter_mut().zip(elements) {
                *value = [*r, *g, *b];
            }
            let (start, end) = (i * length, (i + 1) * length);
            let place = values.subarray(start as u32, end as u32);
            place.copy_from(row.as_flattened());
        }
        values
    }
}

/// The size of a picture that a script gave, which stays where it is but for a row at a time: this
/// memory never shrinks.
fn picture(length: u32, channels: u64, width: u32, height: u32) -> Result<Extent, LightError> {
    let extent = Extent { width, height };
    let need = (u64::from(width) * u64::from(height)).saturating_mul(channels);
    if u64::from(length) != need {
        return Err(LightError::Length {
            got: length as usize,
            need: usize::try_from(need).unwrap_or(usize::MAX),
            extent,
        });
    }
    Ok(extent)
}
