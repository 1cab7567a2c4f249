//! The receiving side.

use super::{TileHeader, corrupt};
use crate::transport::{
    Basis, CoefficientTile, Correspondence, DirectTile, Extent, Geometry, TexelCode, Tile,
    TileRect, Transport, Window,
};
use crate::web::CodedError;

/// A transport of dark tiles.
///
/// # Errors
/// [`corrupt`] if the values describe no transport.
pub fn unpack_transport(geometry: &[f64], basis: &[f32]) -> Result<Transport, CodedError> {
    let &[cw, ch, lw, lh, window, tile_side, a, b, c, d, e, f] = geometry else {
        return Err(corrupt());
    };
    let extent = |width: f64, height: f64| Extent {
        width: width as u32,
        height: height as u32,
    };
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
