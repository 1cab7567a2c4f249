//! Measurements from pictures that the page has in memory.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::measurement_input::MeasurementInput;
use crate::calibrate::{GrayCodePhotos, LightPlaneAxis};
use crate::capture::{
    CameraPixelSet, LinearPhoto, ManifestLight, Measurements, NoiseModel, Pattern, group_count,
    group_ids,
};
use crate::export::Provenance;
use crate::transport::{CHANNELS, Correspondence, Extent};
use crate::web::CodedError;

/// The emission of the codes 0 to 255.
#[wasm_bindgen(js_name = emissionOfCodes)]
pub fn emission_of_codes(gamma: f64) -> Vec<f32> {
    let emission = ManifestLight::of_gamma(gamma).emission();
    emission.map(|value| value as f32).to_vec()
}

/// Takes patterns and photographs one by one. Photographs have linear RGB, `[N, 3]`, 1 where a sample saturates at
/// exposure 1, and NaN where it is saturated.
#[wasm_bindgen]
pub struct MeasurementBuilder {
    camera: Extent,
    light: Extent,
    /// Distance of two codes of a photograph.
    quantum: f64,
    dark: Option<LinearPhoto>,
    correspondence: Option<Correspondence>,
    patterns: Vec<Pattern>,
    full_scale: Vec<f32>,
    photos: Vec<LinearPhoto>,
    gray_code: Vec<(GrayCodeBit, LinearPhoto)>,
    saturated_samples: usize,
}

/// Axis, bit and whether the pattern was inverted.
type GrayCodeBit = (LightPlaneAxis, u32, bool);

#[wasm_bindgen]
impl MeasurementBuilder {
    /// For photographs of `width` × `height` pixels and patterns of `lightWidth` × `lightHeight` elements. Codes of the
    /// photographs are `quantum` apart.
    #[wasm_bindgen(constructor)]
    pub fn new(
        width: u32,
        height: u32,
        #[wasm_bindgen(js_name = lightWidth)] light_width: u32,
        #[wasm_bindgen(js_name = lightHeight)] light_height: u32,
        quantum: f64,
    ) -> Self {
        Self {
            camera: Extent::new(width, height),
            light: Extent::new(light_width, light_height),
            quantum,
            dark: None,
            correspondence: None,
            patterns: Vec::new(),
            full_scale: Vec::new(),
            photos: Vec::new(),
            gray_code: Vec::new(),
            saturated_samples: 0,
        }
    }

    /// Sets the photograph under no light, which is subtracted from those added later.
    ///
    /// # Errors
    /// `capture-size` if it has another number of samples.
    #[wasm_bindgen(js_name = setDark)]
    pub fn set_dark(&mut self, photo: &[f32]) -> Result<(), CodedError> {
        self.dark = Some(self.photo("the dark photograph", photo, 1.0)?);
        Ok(())
    }

    /// Adds a pattern, `[M]` or `[M, 3]` with emission 0 to 1, and its photograph at a relative exposure.
    ///
    /// # Errors
    /// `capture-size` if either has another number of values.
    #[wasm_bindgen(js_name = addShot)]
    pub fn add_shot(
        &mut self,
        pattern: &[f32],
        photo: &[f32],
        exposure: f64,
    ) -> Result<(), CodedError> {
        let (i, area) = (self.photos.len(), self.light.area());
        let pattern = match pattern.len() {
            n if n == area => Pattern::Grey(pattern.to_vec()),
            n if n == CHANNELS * area => {
                let plane = |c| pattern.iter().skip(c).step_by(CHANNELS).copied().collect();
                Pattern::Rgb(std::array::from_fn(plane))
            }
            n => {
                let light = self.light;
                return Err(wrong_size(
                    &format!("pattern {i}"),
                    n,
                    "light elements",
                    light,
                ));
            }
        };
        let photo = self.photo(&format!("photograph {i}"), photo, exposure)?;
        let samples = photo.as_flattened().iter();
        self.saturated_samples += samples.filter(|sample| sample.is_nan()).count();
        self.patterns.push(pattern);
        self.full_scale.push((1.0 / exposure) as f32);
        self.photos.push(photo);
        Ok(())
    }

    /// Sets the map from camera pixels to light elements, as
    /// [`correspondence`](MeasurementInput::correspondence).
    ///
    /// # Errors
    /// `recover-correspondence` if it is not an invertible map.
    #[wasm_bindgen(js_name = setCorrespondence)]
    pub fn set_correspondence(&mut self, affine: &[f64]) -> Result<(), CodedError> {
        let invalid = || {
            let message = "the correspondence is not an invertible map of six finite numbers";
            CodedError::new("recover-correspondence", message)
        };
        let &[a, b, c, d, e, f] = affine else {
            return Err(invalid());
        };
        if !affine.iter().all(|x| x.is_finite()) || a * e - b * d == 0.0 {
            return Err(invalid());
        }
        self.correspondence = Some(Correspondence::from_affine([[a, b, c], [d, e, f]]));
        Ok(())
    }

    /// Adds a photograph of one bit, 0 the least significant, of the Gray code of columns or of rows.
    ///
    /// # Errors
    /// `capture-size` if it has another number of samples.
    #[wasm_bindgen(js_name = addGrayCode)]
    pub fn add_gray_code(
        &mut self,
        #[wasm_bindgen(js_name = isOfRows)] is_of_rows: bool,
        bit: u32,
        inverted: bool,
        photo: &[f32],
    ) -> Result<(), CodedError> {
        let axis = match is_of_rows {
            true => LightPlaneAxis::Y,
            false => LightPlaneAxis::X,
        };
        let name = format!("the Gray code photograph of axis {axis}, bit {bit}");
        let photo = self.photo(&name, photo, 1.0)?;
        self.gray_code.push(((axis, bit, inverted), photo));
        Ok(())
    }

    /// The measurements. Title, creator and rights are copied into the file.
    ///
    /// # Errors
    /// `recover-correspondence` if there is neither a correspondence nor clear Gray code.
    pub fn finish(
        self,
        title: String,
        creator: String,
        rights: String,
    ) -> Result<MeasurementInput, CodedError> {
        let correspondence = match self.correspondence {
            Some(correspondence) => correspondence,
            None => self.decode_gray_code()?,
        };
        let black = vec![[0.0; CHANNELS]; self.camera.area()];
        let dark = self.dark.as_ref().unwrap_or(&black);
        let mut measurements = Measurements {
            camera: self.camera,
            light: self.light,
            correspondence,
            patterns: self.patterns,
            full_scale: self.full_scale,
            loaded: CameraPixelSet::all(self.camera),
            photos: self.photos,
            flood: None,
            noise: NoiseModel::from_dark(dark, self.camera.width, self.quantum),
        };
        measurements.noise = NoiseModel::with_gain_from(&measurements);
        let shots = measurements.photos.len();
        // Shots of one pattern at several exposures count once.
        let patterns = &measurements.patterns;
        let first = |pattern: &Pattern| patterns.iter().position(|other| other == pattern);
        let provenance = Provenance {
            color_matrix: None,
            title,
            creator,
            rights,
            shots: (0..shots).collect(),
            photographs: vec![String::new(); shots],
            patterns: group_count(&group_ids(patterns.iter().map(first))),
        };
        Ok(MeasurementInput {
            measurements: Arc::new(measurements),
            provenance: Arc::new(provenance),
            saturated_samples: self.saturated_samples,
        })
    }

    fn decode_gray_code(&self) -> Result<Correspondence, CodedError> {
        let rows = (0..self.camera.height).collect();
        let photos = GrayCodePhotos::collect(self.light, rows, |axis, bit, inverted| {
            let mut photos = self.gray_code.iter();
            let found = photos.find(|(found, _)| *found == (axis, bit, inverted));
            found.map(|(_, photo)| photo.clone()).ok_or_else(|| {
                let message = format!(
                    "the Gray code lacks axis {axis}, bit {bit}, inverted {inverted}; give all bits, \
                     or the correspondence"
                );
                CodedError::new("recover-correspondence", message)
            })
        })?;
        Ok(photos.fit_affine(self.camera)?)
    }

    /// A photograph in units of the measurement, less the dark one.
    fn photo(&self, name: &str, samples: &[f32], exposure: f64) -> Result<LinearPhoto, CodedError> {
        let (pixels, rest) = samples.as_chunks::<CHANNELS>();
        if !rest.is_empty() || pixels.len() != self.camera.area() {
            let (n, camera) = (samples.len(), self.camera);
            return Err(wrong_size(name, n, "pixels of three samples", camera));
        }
        let dark = |n: usize| self.dark.as_ref().map_or([0.0; CHANNELS], |dark| dark[n]);
        let linear = |(n, pixel): (usize, &[f32; CHANNELS])| {
            let dark = dark(n);
            std::array::from_fn(|c| (f64::from(pixel[c]) / exposure) as f32 - dark[c])
        };
        Ok(pixels.iter().enumerate().map(linear).collect())
    }
}

fn wrong_size(name: &str, found: usize, unit: &str, expected: Extent) -> CodedError {
    let message = format!("{name} has {found} values, not those of {expected} {unit}");
    CodedError::new("capture-size", message)
}
