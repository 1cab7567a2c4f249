//! What a page shows of a recovery: pictures, light transport functions, and the photograph for the element.

use js_sys::Float32Array;
use wasm_bindgen::prelude::wasm_bindgen;

use super::recovery_job::Recovery;
use crate::export;
use crate::format::MetadataText;
use crate::relight::{Light, reference};
use crate::transport::{
    CHANNELS, CameraPixel, Geometry, SnrAccumulator, Tile, TileTransportFunctions, Transport,
};
use crate::web::{CodedError, Photo};

/// The recovered light transport, once every tile is recovered, rounded to the codes that browsers relight.
#[wasm_bindgen]
pub struct RecoveredTransport {
    transport: Transport,
    metadata: String,
}

#[wasm_bindgen]
impl Recovery {
    /// The recovered light transport.
    ///
    /// # Errors
    /// Code `internal` if a tile is missing.
    #[wasm_bindgen(js_name = transport)]
    pub fn transport(&self) -> Result<RecoveredTransport, CodedError> {
        let recovery = self.recovery();
        let geometry = export::file_geometry(recovery);
        let basis = recovery.basis().cloned().unwrap_or_default();
        let tile = |i| {
            let tile = export::file_tile(recovery, &|i| self.record(i), i);
            tile.map(|tile| Tile::quantise(&tile, basis.rank()))
        };
        let tiles = (0..geometry.tile_grid().area()).map(tile);
        let tiles = tiles.collect::<Result<_, _>>();
        let tiles = tiles.map_err(|e| CodedError::internal(&e.to_string()))?;
        let metadata = MetadataText::encode(&self.metadata());
        let metadata = metadata.map_err(|e| CodedError::internal(&e.to_string()))?;
        Ok(RecoveredTransport {
            transport: Transport {
                geometry,
                basis,
                tiles,
            },
            metadata: metadata.text().to_owned(),
        })
    }
}

#[wasm_bindgen]
impl RecoveredTransport {
    /// A photograph that the element shows.
    pub fn photo(&self) -> Photo {
        Photo::with_metadata(self.transport.clone(), self.metadata.clone())
    }

    /// The picture under a light, `[N, 3]` in units of the measurement; `light` has linear RGB, `[M, 3]`.
    ///
    /// # Errors
    /// Codes that begin with `light-`.
    pub fn relight(&self, light: &[f32]) -> Result<Vec<f32>, CodedError> {
        Ok(self
            .picture(light)?
            .into_flattened()
            .into_iter()
            .map(|y| y as f32)
            .collect())
    }

    /// Energy of a true picture, and of the difference of the picture under its light: their ratio is the SNR. Samples
    /// that are not finite are left out.
    ///
    /// # Errors
    /// Codes that begin with `light-`; `capture-size` if the picture has another number of samples.
    #[wasm_bindgen(js_name = pictureError)]
    pub fn picture_error(&self, light: &[f32], truth: &[f32]) -> Result<Vec<f64>, CodedError> {
        let picture = self.picture(light)?;
        if truth.len() != CHANNELS * picture.len() {
            let message = "a picture to compare with has another number of samples";
            return Err(CodedError::new("capture-size", message));
        }
        let mut sum = SnrAccumulator::default();
        for (truth, estimate) in truth.iter().zip(picture.as_flattened()) {
            if truth.is_finite() {
                sum.add(f64::from(*truth), *estimate);
            }
        }
        Ok(vec![sum.signal, sum.error])
    }

    /// Columns of the light plane.
    #[wasm_bindgen(getter, js_name = lightWidth)]
    pub fn light_width(&self) -> u32 {
        self.transport.geometry.light.width
    }

    /// Rows of the light plane.
    #[wasm_bindgen(getter, js_name = lightHeight)]
    pub fn light_height(&self) -> u32 {
        self.transport.geometry.light.height
    }

    /// The light transport function of a camera pixel, `[S, 3]`, S = window², row by row.
    ///
    /// # Errors
    /// Code `internal` if there is no such pixel.
    #[wasm_bindgen(js_name = transportFunction)]
    pub fn transport_function(&self, x: u32, y: u32) -> Result<Float32Array, CodedError> {
        let Geometry {
            camera, tile_side, ..
        } = self.transport.geometry;
        if x >= camera.width || y >= camera.height {
            return Err(CodedError::internal("the picture has no such pixel"));
        }
        let tile = (y / tile_side) * self.transport.geometry.tile_grid().width + x / tile_side;
        let functions = self.functions(tile as usize);
        let (rect, area) = (functions.rect, self.transport.geometry.window.area());
        let pixel = CameraPixel {
            x: x - rect.x,
            y: y - rect.y,
        };
        let n = rect.extent.index(pixel);
        let function = &functions.tau[n * area..(n + 1) * area];
        Ok(Float32Array::from(function.as_flattened()))
    }

    /// Column and row of the light element at the first slot of a pixel's window; they may lie off the light plane.
    #[wasm_bindgen(js_name = windowOrigin)]
    pub fn window_origin(&self, x: u32, y: u32) -> Vec<i32> {
        let origin = self.transport.geometry.window_origin(CameraPixel { x, y });
        vec![origin.u, origin.v]
    }

    /// Column and row of the first pixel of a tile, its width and its height; nothing if there is no such tile.
    #[wasm_bindgen(js_name = tileRect)]
    pub fn tile_rect(&self, index: usize) -> Option<Vec<u32>> {
        let rect = self.transport.tiles.get(index)?.rect();
        Some(vec![rect.x, rect.y, rect.extent.width, rect.extent.height])
    }

    /// The light transport functions of a tile, `[pixel, S, 3]`.
    ///
    /// # Errors
    /// Code `internal` if there is no such tile.
    #[wasm_bindgen(js_name = tileFunctions)]
    pub fn tile_functions(&self, index: usize) -> Result<Float32Array, CodedError> {
        if index >= self.transport.tiles.len() {
            return Err(CodedError::internal("the photograph has no such tile"));
        }
        let functions = self.functions(index);
        Ok(Float32Array::from(functions.tau.as_flattened()))
    }

    /// The point scattering function of a light element: the picture, `[N, 3]`, when it alone is on.
    ///
    /// # Errors
    /// Code `internal` if there is no such element.
    #[wasm_bindgen(js_name = pointScatteringFunction)]
    pub fn point_scattering_function(&self, u: u32, v: u32) -> Result<Vec<f32>, CodedError> {
        let light = self.transport.geometry.light;
        if u >= light.width || v >= light.height {
            return Err(CodedError::internal("the light has no such element"));
        }
        let mut values = vec![0.0; CHANNELS * light.area()];
        let m = (v * light.width + u) as usize;
        values[CHANNELS * m..CHANNELS * (m + 1)].fill(1.0);
        self.relight(&values)
    }
}

impl RecoveredTransport {
    fn picture(&self, light: &[f32]) -> Result<Vec<[f64; CHANNELS]>, CodedError> {
        let light = Light::from_linear_rgb(self.transport.geometry.light, light)?;
        Ok(reference::relight(&self.transport, &light))
    }

    fn functions(&self, tile: usize) -> TileTransportFunctions {
        let Transport {
            geometry,
            basis,
            tiles,
        } = &self.transport;
        tiles[tile].functions(geometry, basis)
    }
}
