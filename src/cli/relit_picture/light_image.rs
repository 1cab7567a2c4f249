//! Lights by name, and images as lights.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::ImageReader;

use crate::relight::{BuiltinLight, Light, srgb};
use crate::transport::{CHANNELS, Extent, LightRegion};

/// A light before it is put on a light plane.
pub enum LightSource {
    /// A built-in light.
    Builtin(BuiltinLight),
    /// An image, which covers the light plane.
    Image {
        /// Its pixels.
        extent: Extent,
        /// Linear RGB, row by row.
        values: Vec<f32>,
    },
}

impl LightSource {
    /// The built-in light of this name, or the image file at this path, decoded as sRGB and dimmed by its transparency.
    pub fn load(light: &str) -> Result<Self> {
        if let Some(builtin) = BuiltinLight::from_name(light) {
            return Ok(Self::Builtin(builtin));
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
        let linear = |image::Rgba([rgb @ .., alpha]): &image::Rgba<f32>| -> [f32; 3] {
            rgb.map(|code| srgb::srgb_decode(f64::from(code)) as f32 * alpha)
        };
        Ok(Self::Image {
            extent: Extent::new(picture.width(), picture.height()),
            values: picture.pixels().flat_map(linear).collect(),
        })
    }

    /// The light on a light plane, or on a part of one; an image is resampled.
    pub fn on(&self, region: LightRegion) -> Result<Light> {
        match self {
            Self::Builtin(builtin) => Ok(builtin.render(region)),
            Self::Image { extent, values } => {
                let row_values = CHANNELS * extent.width as usize;
                let light = Light::from_linear_rows(region, *extent, |y, row| {
                    row.copy_from_slice(&values[y * row_values..][..row_values]);
                });
                Ok(light?)
            }
        }
    }
}
