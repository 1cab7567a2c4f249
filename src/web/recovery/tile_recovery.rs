//! Recovery of tiles in another worker than the one that prepared it.

use wasm_bindgen::prelude::wasm_bindgen;

use super::recovery_job::encoded_tile;
use crate::capture::{CameraPixelSet, LinearPhoto, Measurements};
use crate::recover::PreparedRecovery;
use crate::web::CodedError;
use crate::web::photo_transfer::corrupt;

/// Recovers tiles of a strip of tile rows.
#[wasm_bindgen]
pub struct TileRecovery {
    recovery: PreparedRecovery,
    measurements: Measurements,
}

#[wasm_bindgen]
impl TileRecovery {
    /// Of `packed`, from [`pack`](super::Recovery::pack). It has no photographs yet.
    ///
    /// # Errors
    /// Code `internal` if the bytes are not those of a recovery.
    #[wasm_bindgen(constructor)]
    pub fn new(packed: &[u8]) -> Result<Self, CodedError> {
        let unpacked = postcard::from_bytes(packed).map_err(|_| corrupt())?;
        let (recovery, patterns, full_scale, noise): (PreparedRecovery, _, Vec<f32>, _) = unpacked;
        let geometry = recovery.geometry();
        let measurements = Measurements {
            camera: geometry.camera,
            light: geometry.light,
            correspondence: geometry.correspondence.clone(),
            patterns,
            loaded: CameraPixelSet::row_range(0..0, geometry.camera.width),
            photos: vec![LinearPhoto::new(); full_scale.len()],
            flood: None,
            full_scale,
            noise,
        };
        Ok(Self {
            recovery,
            measurements,
        })
    }

    /// Sets the photographs' rows from `first` on, from [`packRows`](super::Recovery::pack_rows).
    ///
    /// # Errors
    /// Code `internal` if they are not whole rows of all photographs.
    #[wasm_bindgen(js_name = setRows)]
    pub fn set_rows(&mut self, first: u32, samples: &[f32]) -> Result<(), CodedError> {
        let Measurements {
            camera,
            photos,
            loaded,
            ..
        } = &mut self.measurements;
        let (pixels, _) = samples.as_chunks();
        let per_photo = pixels.len() / photos.len();
        let count = (per_photo / camera.width as usize) as u32;
        if pixels.len() != photos.len() * (count * camera.width) as usize
            || first
                .checked_add(count)
                .is_none_or(|end| end > camera.height)
        {
            return Err(corrupt());
        }
        for (photo, pixels) in photos.iter_mut().zip(pixels.chunks_exact(per_photo.max(1))) {
            *photo = pixels.to_vec();
        }
        *loaded = CameraPixelSet::row_range(first..first + count, camera.width);
        Ok(())
    }

    /// Recovers a tile, for [`putTile`](super::Recovery::put_tile).
    ///
    /// # Errors
    /// Code `internal` if there is no such tile or its rows are not set; `recover-memory` if memory is missing.
    #[wasm_bindgen(js_name = recoverTile)]
    pub fn recover_tile(&self, index: usize) -> Result<Vec<u8>, CodedError> {
        encoded_tile(&self.recovery, &self.measurements, index)
    }
}
