//! The measurements that a page recovers from.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use crate::capture::Measurements;
use crate::export::Provenance;
use crate::web::CodedError;
use crate::web::photo_transfer::corrupt;
use crate::web::recovery_error::out_of_memory;

/// The measurements of a recovery, and what its file says of their origin.
#[wasm_bindgen]
#[derive(Clone)]
pub struct MeasurementInput {
    pub(super) measurements: Arc<Measurements>,
    pub(super) provenance: Arc<Provenance>,
    pub(super) saturated_samples: usize,
}

#[wasm_bindgen]
impl MeasurementInput {
    /// Bytes for [`unpack`](Self::unpack) in another worker of a group.
    ///
    /// # Errors
    /// `recover-memory` if memory is missing.
    pub fn pack(&self) -> Result<Vec<u8>, CodedError> {
        postcard::to_allocvec(&*self.measurements).map_err(|_| out_of_memory())
    }

    /// The measurements alone, without what their file says of their origin.
    ///
    /// # Errors
    /// Code `internal` if the bytes are not those of [`pack`](Self::pack).
    pub fn unpack(packed: &[u8]) -> Result<Self, CodedError> {
        let measurements: Measurements = postcard::from_bytes(packed).map_err(|_| corrupt())?;
        Ok(Self {
            measurements: Arc::new(measurements),
            provenance: Arc::default(),
            saturated_samples: 0,
        })
    }

    /// Columns of the camera.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.measurements.camera.width
    }

    /// Rows of the camera.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.measurements.camera.height
    }

    /// Indices of the shots that are recovered from.
    #[wasm_bindgen(getter, js_name = shotsUsed)]
    pub fn shots_used(&self) -> Vec<usize> {
        self.provenance.shots.clone()
    }

    /// The map from camera pixels to light elements: `a, b, c, d, e, f` with `u = a(x+½) + b(y+½) + c` and
    /// `v = d(x+½) + e(y+½) + f`.
    #[wasm_bindgen(getter)]
    pub fn correspondence(&self) -> Vec<f64> {
        self.measurements.correspondence.affine.concat()
    }
}
