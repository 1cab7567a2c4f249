//! Lights made for a photograph.

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo};
use crate::relight::{self, BuiltinLight, TorchPose};

/// What each element of a photograph's light plane emits.
#[wasm_bindgen]
pub struct Light(relight::Light);

impl Light {
    pub(super) fn inner(&self) -> &relight::Light {
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
            return Err(CodedError::new(
                "light-value",
                format!(
                    "a torch of size {size} at ({x}, {y}) cannot be: positions are fractions of \
                     the picture, and the size a positive fraction of the light plane"
                ),
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

    /// A light from linear RGB values, 0 dark to 1 full brightness, row by row.
    #[wasm_bindgen(js_name = fromLinearRgb)]
    pub fn from_linear_rgb(photo: &Photo, values: &[f32]) -> Result<Light, CodedError> {
        let extent = photo.geometry().light;
        Ok(Self(relight::Light::from_linear_rgb(extent, values)?))
    }
}
