//! Measurements from a capture folder, which the module `capture_reader` reads.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::measurement_input::MeasurementInput;
use crate::capture::{CameraPixelSet, Measurements, NoiseModel};
use crate::export::Provenance;
use crate::web::CodedError;
use crate::web::photo_transfer::corrupt;

/// Takes the photographs of a capture folder one by one.
#[wasm_bindgen]
pub struct CaptureBuilder {
    measurements: Measurements,
    provenance: Provenance,
    /// Photographs taken so far.
    count: usize,
    saturated_samples: usize,
}

#[wasm_bindgen]
impl CaptureBuilder {
    /// `calibration` is that of `CaptureReader`.
    ///
    /// # Errors
    /// Code `internal` if it is not.
    #[wasm_bindgen(constructor)]
    pub fn new(calibration: &[u8]) -> Result<Self, CodedError> {
        let read = postcard::from_bytes(calibration).map_err(|_| corrupt())?;
        let (measurements, provenance): (Measurements, Provenance) = read;
        Ok(Self {
            measurements,
            provenance,
            count: 0,
            saturated_samples: 0,
        })
    }

    /// Indices of the shots whose photographs to add, in this order.
    #[wasm_bindgen(getter)]
    pub fn shots(&self) -> Vec<usize> {
        self.provenance.shots.clone()
    }

    /// Adds the photograph of the next shot, `[N, 3]`, from `CaptureReader`.
    ///
    /// # Errors
    /// Code `internal` if it has another number of samples, or there are no more shots.
    #[wasm_bindgen(js_name = addPhotograph)]
    pub fn add_photograph(&mut self, samples: &[f32]) -> Result<(), CodedError> {
        let area = self.measurements.camera.area();
        let photos = &mut self.measurements.photos;
        let photo = photos.get_mut(self.count).ok_or_else(corrupt)?;
        let (pixels, rest) = samples.as_chunks();
        if pixels.len() != area || !rest.is_empty() {
            return Err(corrupt());
        }
        *photo = pixels.to_vec();
        self.count += 1;
        self.saturated_samples += samples.iter().filter(|sample| sample.is_nan()).count();
        Ok(())
    }

    /// The measurements.
    ///
    /// # Errors
    /// Code `internal` if photographs are missing.
    pub fn finish(self) -> Result<MeasurementInput, CodedError> {
        let mut measurements = self.measurements;
        if self.count < measurements.photos.len() {
            return Err(corrupt());
        }
        measurements.loaded = CameraPixelSet::all(measurements.camera);
        measurements.noise = NoiseModel::with_gain_from(&measurements);
        Ok(MeasurementInput {
            measurements: Arc::new(measurements),
            provenance: Arc::new(self.provenance),
            saturated_samples: self.saturated_samples,
        })
    }
}
