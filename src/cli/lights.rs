//! The argument `--light`: a built-in light or an image file.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::ImageReader;

use crate::relight::{BuiltinLight, Light, area_resample, srgb};
use crate::transport::Extent;

/// The built-in light of this name, or the image file at this path, decoded as sRGB and resampled to the light plane.
pub fn load(light: &str, plane: Extent) -> Result<Light> {
    if let Some(builtin) = BuiltinLight::from_name(light) {
        return Ok(builtin.render(plane));
    }
    let path = Path::new(light);
    if !path.exists() {
        let names = BuiltinLight::ALL.map(BuiltinLight::name).join(", ");
        bail!("--light {light}: neither a file nor one of {names}");
    }
    let picture = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(anyhow::Error::from)
        .and_then(|reader| Ok(reader.decode()?))
        .with_context(|| format!("--light {light}: is not a readable image"))?
        .into_rgb32f();
    let extent = Extent::new(picture.width(), picture.height());
    let linear: Vec<f32> = picture
        .into_raw()
        .into_iter()
        .map(|code| srgb::srgb_decode(f64::from(code)) as f32)
        .collect();
    Ok(Light::from_linear_rgb(
        plane,
        &area_resample(&linear, extent, plane),
    )?)
}
