//! Out of parcels.

use super::{Label, wrong};
use crate::transport::{
    Basis, CoefficientTile, Correspondence, DirectTile, Extent, Geometry, TexelCode, Tile,
    TileRect, Transport, Window,
};
use crate::web::CodedError;

/// A transport of dark tiles.
pub fn unpack(geometry: &[f64], basis: &[f32]) -> Result<Transport, CodedError> {
    let &[cw, ch, lw, lh, window, tile_side, a, b, c, d, e, f] = geometry else {
        return Err(wrong());
    };
    let extent = |width: f64, height: f64| Extent {
        width: width as u32,
        height: height as u32,
    };
    let geometry = Geometry {
        camera: extent(cw, ch),
        light: extent(lw, lh),
        window: Window::new(window as u32).map_err(|_| wrong())?,
        correspondence: Correspondence {
            affine: [[a, b, c], [d, e, f]],
        },
        tile_side: tile_side as u32,
    };
    let geometry = geometry.validate().map_err(|_| wrong())?;
    let functions = basis.chunks_exact(geometry.window.area());
    if !functions.remainder().is_empty() {
        return Err(wrong());
    }
    Ok(Transport {
        basis: Basis {
            kernels: functions.map(<[f32]>::to_vec).collect(),
        },
        tiles: geometry.tiles().map(Tile::dark).collect(),
        geometry,
    })
}

pub fn unpack_tile(
    bytes: &[u8],
    rect: TileRect,
    rank: usize,
    area: usize,
) -> Result<Tile, CodedError> {
    let (label, codes) = bytes
        .split_at_checked(size_of::<Label>())
        .ok_or_else(wrong)?;
    let Label { steps, texels } = bytemuck::pod_read_unaligned(label);
    let (codes, []) = codes.as_chunks() else {
        return Err(wrong());
    };
    let texels = texels.map(|texels| texels as usize);
    let most = [
        CoefficientTile::texels(rect, rank),
        rect.extent.area() * area,
    ];
    let as_many = (0..2).all(|i| texels[i] == 0 || texels[i] == most[i]);
    if !as_many || codes.len() != texels[0] + texels[1] {
        return Err(wrong());
    }
    let code = |bytes: &[u8; size_of::<TexelCode>()]| bytemuck::cast::<_, TexelCode>(*bytes);
    // No memory is an error, not the end of the page.
    let taken = |codes: &[[u8; size_of::<TexelCode>()]]| {
        let mut taken = Vec::new();
        let full = |_| CodedError::new("format-limit", "there is no memory for the photograph");
        taken.try_reserve_exact(codes.len()).map_err(full)?;
        taken.extend(codes.iter().map(code));
        Ok::<_, CodedError>(taken)
    };
    let (coefficients, functions) = codes.split_at(texels[0]);
    Ok(Tile {
        coefficients: CoefficientTile {
            rect,
            step: steps[0],
            codes: taken(coefficients)?,
        },
        functions: DirectTile {
            rect,
            step: steps[1],
            codes: taken(functions)?,
        },
    })
}
