//! Serialisation of a photograph between modules, each of which has its own memory: geometry as numbers, the basis as
//! floats, and each tile as a [`TileHeader`] followed by its codes.

use super::CodedError;
#[cfg(feature = "drawing")]
use crate::transport::{
    Basis, CoefficientTile, Correspondence, DirectTile, Extent, TexelCode, TileRect, Transport,
    Window,
};
use crate::transport::{CHANNELS, Geometry, Tile};

/// The first bytes of a packed tile.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct TileHeader {
    /// Of the coefficients and of the functions.
    steps: [[f32; CHANNELS]; 2],
    /// Texels of the coefficients and of the functions.
    texels: [u32; 2],
}

/// The error for values that the other module cannot have sent.
pub fn corrupt() -> CodedError {
    CodedError::internal("a photograph was corrupted on its way from its worker")
}

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

/// A transport of dark tiles.
///
/// # Errors
/// [`corrupt`] if the values describe no transport.
#[cfg(feature = "drawing")]
pub fn unpack_transport(geometry: &[f64], basis: &[f32]) -> Result<Transport, CodedError> {
    let &[cw, ch, lw, lh, window, tile_side, a, b, c, d, e, f] = geometry else {
        return Err(corrupt());
    };
    let extent = |width: f64, height: f64| Extent::new(width as u32, height as u32);
    let geometry = Geometry {
        camera: extent(cw, ch),
        light: extent(lw, lh),
        window: Window::new(window as u32).map_err(|_| corrupt())?,
        correspondence: Correspondence {
            affine: [[a, b, c], [d, e, f]],
        },
        tile_side: tile_side as u32,
    };
    let geometry = geometry.validate().map_err(|_| corrupt())?;
    let functions = basis.chunks_exact(geometry.window.area());
    if !functions.remainder().is_empty() {
        return Err(corrupt());
    }
    Ok(Transport {
        basis: Basis {
            kernels: functions.map(<[f32]>::to_vec).collect(),
        },
        tiles: geometry.tiles().map(Tile::dark).collect(),
        geometry,
    })
}

/// A tile of `pack_tile`.
///
/// # Errors
/// [`corrupt`] if the bytes are not those of a tile with that rectangle, rank and window area; `format-limit` if there is
/// no memory.
#[cfg(feature = "drawing")]
pub fn unpack_tile(
    bytes: &[u8],
    rect: TileRect,
    rank: usize,
    area: usize,
) -> Result<Tile, CodedError> {
    let (header, codes) = bytes
        .split_at_checked(size_of::<TileHeader>())
        .ok_or_else(corrupt)?;
    let TileHeader { steps, texels } = bytemuck::pod_read_unaligned(header);
    let (codes, []) = codes.as_chunks() else {
        return Err(corrupt());
    };
    let texels = texels.map(|texels| texels as usize);
    let full = [
        CoefficientTile::texels(rect, rank),
        rect.extent.area() * area,
    ];
    let is_complete = (0..2).all(|i| texels[i] == 0 || texels[i] == full[i]);
    if !is_complete || codes.len() != texels[0] + texels[1] {
        return Err(corrupt());
    }
    let code = |bytes: &[u8; size_of::<TexelCode>()]| bytemuck::cast::<_, TexelCode>(*bytes);
    // Fallible: running out of memory must not abort the module.
    let try_copy = |codes: &[[u8; size_of::<TexelCode>()]]| {
        let mut copy = Vec::new();
        let no_memory =
            |_| CodedError::new("format-limit", "there is no memory for the photograph");
        copy.try_reserve_exact(codes.len()).map_err(no_memory)?;
        copy.extend(codes.iter().map(code));
        Ok::<_, CodedError>(copy)
    };
    let (coefficients, functions) = codes.split_at(texels[0]);
    Ok(Tile {
        coefficients: CoefficientTile {
            rect,
            step: steps[0],
            codes: try_copy(coefficients)?,
        },
        functions: DirectTile {
            rect,
            step: steps[1],
            codes: try_copy(functions)?,
        },
    })
}
