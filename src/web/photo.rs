//! A decoded photograph.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::CodedError;
use crate::format::{FormatError, Metadata};
use crate::transport::{Geometry, Tile, Transport};

/// A relightable photograph in memory.
#[wasm_bindgen]
pub struct Photo {
    transport: Arc<Transport>,
    metadata: String,
}

impl Photo {
    pub(super) fn new(transport: Transport, metadata: &Metadata) -> Result<Self, CodedError> {
        Ok(Self {
            transport: Arc::new(transport),
            metadata: serde_json::to_string(metadata).map_err(FormatError::Metadata)?,
        })
    }

    pub(super) fn transport(&self) -> Arc<Transport> {
        self.transport.clone()
    }

    pub(super) fn geometry(&self) -> &Geometry {
        &self.transport.geometry
    }
}

#[wasm_bindgen]
impl Photo {
    /// Columns of the picture.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.geometry().camera.width
    }

    /// Rows of the picture.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.geometry().camera.height
    }

    /// Columns of the light.
    #[wasm_bindgen(getter, js_name = lightWidth)]
    pub fn light_width(&self) -> u32 {
        self.geometry().light.width
    }

    /// Rows of the light.
    #[wasm_bindgen(getter, js_name = lightHeight)]
    pub fn light_height(&self) -> u32 {
        self.geometry().light.height
    }

    /// What the file says about where it came from, as JSON.
    #[wasm_bindgen(getter)]
    pub fn metadata(&self) -> String {
        self.metadata.clone()
    }

    /// Bytes the photograph takes in memory.
    #[wasm_bindgen(getter, js_name = decodedBytes)]
    pub fn decoded_bytes(&self) -> f64 {
        let codes: usize = self.transport.tiles.iter().map(Tile::bytes).sum();
        codes as f64
    }
}
