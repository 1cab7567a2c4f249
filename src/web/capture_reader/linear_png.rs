//! Patterns and photographs that the page has as PNG, without a manifest.

use js_sys::Float32Array;
use wasm_bindgen::prelude::wasm_bindgen;

use super::page_files::PageFiles;
use crate::capture::{
    ManifestCamera, ManifestLight, Pattern, read_unlisted_pattern, read_unlisted_photo,
};
use crate::transport::Extent;
use crate::web::CodedError;

/// A PNG as linear values.
#[wasm_bindgen]
pub struct LinearPng {
    extent: Extent,
    data: Vec<f32>,
}

#[wasm_bindgen]
impl LinearPng {
    /// Columns of the picture.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.extent.width
    }

    /// Rows of the picture.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.extent.height
    }

    /// Three values for each pixel of a photograph; one or three for each element of a pattern.
    #[wasm_bindgen(getter)]
    pub fn data(&self) -> Float32Array {
        Float32Array::from(&self.data[..])
    }
}

/// Reads a 16-bit photograph: 1 at the code `white`, 0 at `black`, NaN where it is saturated.
///
/// # Errors
/// `capture-file` or `capture-photograph`; the message names the file.
#[wasm_bindgen(js_name = readPhotograph)]
pub fn read_photograph(
    files: PageFiles,
    name: &str,
    black: f64,
    white: f64,
) -> Result<LinearPng, CodedError> {
    let (extent, codes) = read_unlisted_photo(&files, name)?;
    let camera = ManifestCamera {
        width: extent.width,
        height: extent.height,
        black,
        white,
        ..ManifestCamera::default()
    };
    let linear = |code: u16| match f64::from(code) >= white {
        true => f32::NAN,
        false => camera.linear(code, 1.0),
    };
    let data = codes.into_iter().flatten().map(linear).collect();
    Ok(LinearPng { extent, data })
}

/// Reads an 8-bit pattern: the emission of its codes.
///
/// # Errors
/// `capture-file` or `capture-pattern`; the message names the file.
#[wasm_bindgen(js_name = readPattern)]
pub fn read_pattern(files: PageFiles, name: &str, gamma: f64) -> Result<LinearPng, CodedError> {
    let emission = ManifestLight::of_gamma(gamma).emission();
    let (extent, pattern) = read_unlisted_pattern(&files, name, &emission)?;
    let data = match &pattern {
        Pattern::Grey(values) => values.clone(),
        Pattern::Rgb(_) => pattern.rgb(),
    };
    Ok(LinearPng { extent, data })
}
