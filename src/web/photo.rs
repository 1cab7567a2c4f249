//! A photograph in the memory of one module.

use std::sync::Arc;

use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, photo_transfer};
#[cfg(feature = "drawing")]
use crate::relight::TorchSpot;
use crate::transport::{Geometry, Tile, Transport};

/// A photograph, with all or some of its tiles.
#[wasm_bindgen]
pub struct Photo {
    transport: Arc<Transport>,
    #[cfg(any(feature = "decoder", feature = "recovery"))]
    metadata: String,
}

impl Photo {
    /// The transport, shared with a relighter.
    #[cfg(feature = "drawing")]
    pub(super) fn transport(&self) -> Arc<Transport> {
        self.transport.clone()
    }

    pub(super) fn geometry(&self) -> &Geometry {
        &self.transport.geometry
    }

    fn transport_mut(&mut self) -> Result<&mut Transport, CodedError> {
        Arc::get_mut(&mut self.transport).ok_or_else(|| {
            CodedError::internal("a photograph in use by the CPU backend cannot give or take tiles")
        })
    }
}

#[wasm_bindgen]
impl Photo {
    /// Takes a tile out, for the same photograph in another module; the tile is dark afterwards.
    ///
    /// # Errors
    /// Code `internal` if there is no such tile, or the CPU backend uses the photograph.
    #[wasm_bindgen(js_name = takeTile)]
    pub fn take_tile(&mut self, index: usize) -> Result<Vec<u8>, CodedError> {
        let tiles = &mut self.transport_mut()?.tiles;
        let tile = tiles.get_mut(index).ok_or_else(photo_transfer::corrupt)?;
        let dark = Tile::dark(tile.rect());
        Ok(photo_transfer::pack_tile(&std::mem::replace(tile, dark)))
    }
}

/// The receiving side.
#[cfg(feature = "drawing")]
#[wasm_bindgen]
impl Photo {
    /// A photograph of another module, from its geometry and basis. All tiles are dark.
    ///
    /// # Errors
    /// Code `internal` if the values are not those of `packGeometry` and `packBasis`.
    pub fn receive(geometry: &[f64], basis: &[f32]) -> Result<Photo, CodedError> {
        let transport = photo_transfer::unpack_transport(geometry, basis)?;
        Ok(Self {
            transport: Arc::new(transport),
            #[cfg(any(feature = "decoder", feature = "recovery"))]
            metadata: String::new(),
        })
    }

    /// The position on the light plane straight behind a point of the picture, in light elements. The point is given by
    /// fractions of the picture's width and height.
    pub fn behind(&self, x: f64, y: f64) -> Vec<f64> {
        let TorchSpot { centre, .. } = TorchSpot::behind(self.geometry(), x, y);
        vec![centre.u, centre.v]
    }

    /// Puts in a tile of [`takeTile`](Self::take_tile).
    ///
    /// # Errors
    /// Code `internal` if the bytes are not those of this tile, or the CPU backend uses the photograph; `format-limit`
    /// if there is no memory.
    #[wasm_bindgen(js_name = putTile)]
    pub fn put_tile(&mut self, index: usize, bytes: &[u8]) -> Result<(), CodedError> {
        let transport = self.transport_mut()?;
        let rank = transport.basis.rank();
        let area = transport.geometry.window.area();
        let tile = transport
            .tiles
            .get_mut(index)
            .ok_or_else(photo_transfer::corrupt)?;
        *tile = photo_transfer::unpack_tile(bytes, tile.rect(), rank, area)?;
        Ok(())
    }
}

/// The sending side.
#[cfg(any(feature = "decoder", feature = "recovery"))]
impl Photo {
    /// `metadata` is text, normally a JSON object.
    pub(super) fn with_metadata(transport: Transport, metadata: String) -> Self {
        Self {
            transport: Arc::new(transport),
            metadata,
        }
    }
}

#[cfg(any(feature = "decoder", feature = "recovery"))]
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

    /// Number of tiles, counted row by row.
    #[wasm_bindgen(getter)]
    pub fn tiles(&self) -> usize {
        self.transport.tiles.len()
    }

    /// Pixels along a tile's side; tiles at the right and lower edges may be smaller.
    #[wasm_bindgen(getter, js_name = tileSide)]
    pub fn tile_side(&self) -> u32 {
        self.geometry().tile_side
    }

    /// Bytes of the tiles in memory.
    #[wasm_bindgen(getter, js_name = decodedBytes)]
    pub fn decoded_bytes(&self) -> f64 {
        let codes: usize = self.transport.tiles.iter().map(Tile::bytes).sum();
        codes as f64
    }

    /// The file's metadata: text, normally a JSON object.
    #[wasm_bindgen(getter)]
    pub fn metadata(&self) -> String {
        self.metadata.clone()
    }

    /// Grids, window and correspondence, for `Photo.receive` of another module.
    #[wasm_bindgen(js_name = packGeometry)]
    pub fn pack_geometry(&self) -> Vec<f64> {
        photo_transfer::pack_geometry(self.geometry())
    }

    /// The basis, for `Photo.receive` of another module.
    #[wasm_bindgen(js_name = packBasis)]
    pub fn pack_basis(&self) -> Vec<f32> {
        self.transport.basis.kernels.concat()
    }
}
