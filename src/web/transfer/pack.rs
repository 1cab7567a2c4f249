//! The sending side.

use super::TileHeader;
#[cfg(feature = "decoder")]
use crate::transport::Geometry;
use crate::transport::Tile;

/// Grids, window, tile side and correspondence, as `unpack_transport` reads them.
#[cfg(feature = "decoder")]
pub fn pack_geometry(geometry: &Geometry) -> Vec<f64> {
    let Geometry {
        camera,
        light,
        window,
        correspondence,
        tile_side,
    } = geometry;
    let numbers = [
        camera.width,
        camera.height,
        light.width,
        light.height,
        window.side(),
        *tile_side,
    ];
    let affine = correspondence.affine.concat();
    numbers.into_iter().map(f64::from).chain(affine).collect()
}

/// A header, the coefficients' codes and the functions' codes.
pub fn pack_tile(tile: &Tile) -> Vec<u8> {
    let codes = [&tile.coefficients.codes, &tile.functions.codes];
    let header = TileHeader {
        steps: [tile.coefficients.step, tile.functions.step],
        texels: codes.map(|codes| codes.len() as u32), // fits: a 32-bit memory
    };
    let codes = codes.map(|codes| bytemuck::cast_slice::<_, u8>(codes));
    [bytemuck::bytes_of(&header), codes[0], codes[1]].concat()
}
