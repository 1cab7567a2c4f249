//! A photograph in one module's memory.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, parcel};
use crate::transport::{Geometry, Tile, Transport};

/// A relightable photograph, or as many of its tiles as this module has.
#[wasm_bindgen]
pub struct Photo {
    transport: Arc<Transport>,
    #[cfg(feature = "decoder")]
    metadata: String,
}

impl Photo {
    /// For what relights it.
    #[cfg(feature = "drawing")]
    pub(super) fn transport(&self) -> Arc<Transport> {
        self.transport.clone()
    }

    pub(super) fn geometry(&self) -> &Geometry {
        &self.transport.geometry
    }

    fn unshared(&mut self) -> Result<&mut Transport, CodedError> {
        Arc::get_mut(&mut self.transport)
            .ok_or_else(|| CodedError::new("internal", "tiles of a photograph in use stay"))
    }
}

#[wasm_bindgen]
impl Photo {
    /// A tile, for a photograph in another module; it is dark afterwards. Not while a CPU is at the
    /// photograph.
    #[wasm_bindgen(js_name = takeTile)]
    pub fn take_tile(&mut self, index: usize) -> Result<Vec<u8>, CodedError> {
        let tiles = &mut self.unshared()?.tiles;
        let tile = tiles.get_mut(index).ok_or_else(parcel::wrong)?;
        let dark = Tile::dark(tile.rect());
        Ok(parcel::pack_tile(&std::mem::replace(tile, dark)))
    }
}

/// Those that are drawn.
#[cfg(feature = "drawing")]
#[wasm_bindgen]
impl Photo {
    /// What a photograph that was decoded by another module has besides tiles: all dark as yet.
    pub fn receive(geometry: &[f64], basis: &[f32]) -> Result<Photo, CodedError> {
        let transport = parcel::unpack(geometry, basis)?;
        Ok(Self {
            transport: Arc::new(transport),
            #[cfg(feature = "decoder")]
            metadata: String::new(),
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
}

/// Those that were decoded.
#[cfg(feature = "decoder")]
impl Photo {
    pub(super) fn new(transport: Transport, metadata: &crate::format::MetadataJson) -> Self {
        Self {
            transport: Arc::new(transport),
            metadata: metadata.text().to_owned(),
        }
    }
}

#[cfg(feature = "decoder")]
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

    /// Number of tiles, which lie row by row.
    #[wasm_bindgen(getter)]
    pub fn tiles(&self) -> usize {
        self.transport.tiles.len()
    }

    /// Pixels along a tile's side; those at the right and lower edges may be smaller.
    #[wasm_bindgen(getter, js_name = tileSide)]
    pub fn tile_side(&self) -> u32 {
        self.geometry().tile_side
    }

    /// Bytes the photograph takes in memory.
    #[wasm_bindgen(getter, js_name = decodedBytes)]
    pub fn decoded_bytes(&self) -> f64 {
        let codes: usize = self.transport.tiles.iter().map(Tile::bytes).sum();
        codes as f64
    }

    /// What the file says about where it came from: text that should be a JSON object.
    #[wasm_bindgen(getter)]
    pub fn metadata(&self) -> String {
        self.metadata.clone()
    }

    /// Grids, window and correspondence, for `Photo.receive` of another module.
    #[wasm_bindgen(js_name = geometryParcel)]
    pub fn geometry_parcel(&self) -> Vec<f64> {
        parcel::pack_geometry(self.geometry())
    }

    /// The basis, for `Photo.receive` of another module.
    #[wasm_bindgen(js_name = basisParcel)]
    pub fn basis_parcel(&self) -> Vec<f32> {
        self.transport.basis.kernels.concat()
    }
}
