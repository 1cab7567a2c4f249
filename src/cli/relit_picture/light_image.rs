//! Lights by name, and images as lights.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::ImageReader;

use crate::relight::{BuiltinLight, Light, area_resample, srgb};
use crate::transport::Extent;

/// The built-in light of this name, or the image file at this path, decoded as sRGB, dimmed by its transparency, and
/// resampled to the light plane.
pub fn load_light(light: &str, plane: Extent) -> Result<Light> {
    if let Some(builtin) = BuiltinLight::from_name(light) {
        return Ok(builtin.render(plane));
    }
    let path = Path::new(light);
    if !path.exists() {
        let names = BuiltinLight::BY_NAME.map(|(name, _)| name).join(", ");
        bail!("--light {light}: neither a file nor one of {names}");
    }
    let read = || ImageReader::open(path)?.with_guessed_format()?.decode();
    let picture = read()
        .with_context(|| format!("--light {light}: is not a readable image"))?
        .into_rgba32f();
    let extent = Extent::new(picture.width(), picture.height());
    let linear = |image::Rgba([rgb @ .., alpha]): &image::Rgba<f32>| -> [f32; 3] {
        rgb.map(|code| srgb::srgb_decode(f64::from(code)) as f32 * alpha)
    };
    let linear: Vec<f32> = picture.pixels().flat_map(linear).collect();
    let resampled = area_resample(&linear, extent, plane);
    Ok(Light::from_linear_rgb(plane, &resampled)?)
}
