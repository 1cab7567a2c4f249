//! What goes from one module to another: a photograph is decoded by a worker and drawn by the page,
//! and both have a memory of their own.

use super::CodedError;
use crate::transport::{
    Basis, CHANNELS, CoefficientTile, Correspondence, DirectTile, Extent, Geometry, TexelCode,
    Tile, TileRect, Transport, Window,
};

/// What a tile begins with.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Label {
    /// Of coefficients, and of functions.
    steps: [[f32; CHANNELS]; 2],
    /// Texels of each.
    texels: [u32; 2],
}

/// A photograph that is not what the other module sent.
pub fn wrong() -> CodedError {
    CodedError::new(
        "internal",
        "a photograph arrived from its worker otherwise than it was sent",
    )
}

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

/// A label, then codes of coefficients, then of functions.
pub fn pack_tile(tile: &Tile) -> Vec<u8> {
    let codes = [&tile.coefficients.codes, &tile.functions.codes];
    let label = Label {
        steps: [tile.coefficients.step, tile.functions.step],
        texels: codes.map(|codes| codes.len() as u32), // of a tile, in a memory of 4 GiB
    };
    let codes = codes.map(|codes| bytemuck::cast_slice::<_, u8>(codes));
    [bytemuck::bytes_of(&label), codes[0], codes[1]].concat()
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
