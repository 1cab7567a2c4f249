//! A decoded photograph.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, parcel};
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
    /// What a photograph that was decoded by another module has besides tiles: all dark as yet.
    pub fn receive(geometry: &[f64], basis: &[f32], metadata: String) -> Result<Photo, CodedError> {
        let transport = parcel::unpack(geometry, basis)?;
        Ok(Self {
            transport: Arc::new(transport),
            metadata,
        })
    }

    /// Takes a tile that [`takeTile`](Self::take_tile) gave. Not while a CPU is at the photograph.
    #[wasm_bindgen(js_name = putTile)]
    pub fn put_tile(&mut self, index: usize, bytes: &[u8]) -> Result<(), CodedError> {
        let transport = self.unshared()?;
        let rank = transport.basis.rank();
        let area = transport.geometry.window.area();
        let tile = transport.tiles.get_mut(index).ok_or_else(parcel::wrong)?;
        *tile = parcel::unpack_tile(bytes, tile.rect(), rank, area)?;
        Ok(())
    }

    /// A tile, for a photograph in another module; it is dark afterwards. Not while a CPU is at the
    /// photograph.
    #[wasm_bindgen(js_name = takeTile)]
    pub fn take_tile(&mut self, index: usize) -> Result<Vec<u8>, CodedError> {
        let tiles = &mut self.unshared()?.tiles;
        let tile = tiles.get_mut(index).ok_or_else(parcel::wrong)?;
        let dark = Tile::dark(tile.rect());
        Ok(parcel::pack_tile(&std::mem::replace(tile, dark)))
    }

    /// Number of tiles.
    #[wasm_bindgen(getter)]
    pub fn tiles(&self) -> usize {
        self.transport.tiles.len()
    }

    /// Pixels along a tile's side; those at the right and lower edges may be smaller.
    #[wasm_bindgen(getter, js_name = tileSide)]
    pub fn tile_side(&self) -> u32 {
        self.geometry().tile_side
    }

    /// Grids, window and correspondence, for [`receive`](Self::receive).
    #[wasm_bindgen(js_name = geometryParcel)]
    pub fn geometry_parcel(&self) -> Vec<f64> {
        parcel::pack_geometry(self.geometry())
    }

    /// The basis, for [`receive`](Self::receive).
    #[wasm_bindgen(js_name = basisParcel)]
    pub fn basis_parcel(&self) -> Vec<f32> {
        self.transport.basis.kernels.concat()
    }

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

impl Photo {
    fn unshared(&mut self) -> Result<&mut Transport, CodedError> {
        Arc::get_mut(&mut self.transport)
            .ok_or_else(|| CodedError::new("internal", "tiles of a photograph in use stay"))
    }
}
