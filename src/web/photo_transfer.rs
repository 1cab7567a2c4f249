//! Serialisation of a photograph between modules, each of which has its own memory: geometry as numbers, the basis as
//! floats, and each tile as a [`PackedTileHeader`] followed by the coefficients' codes and the functions' entries.

use super::CodedError;
#[cfg(feature = "drawing")]
use crate::transport::{Basis, Correspondence, ShardOrigin, TexelCodes, TileRect, Transport};
use crate::transport::{CHANNELS, Geometry, Tile};

/// The first bytes of a packed tile.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct PackedTileHeader {
    /// Of the coefficients and of the functions.
    steps: [[f32; CHANNELS]; 2],
    /// Texels of the coefficients, and entries of the functions.
    lengths: [u32; 2],
}

/// The error for values that another worker or module cannot have sent.
pub fn corrupt() -> CodedError {
    CodedError::internal("data was corrupted on its way from another worker or module")
}

/// Grids, window, tile side, shard origin and correspondence, as `unpack_transport` reads them.
#[cfg(any(feature = "decoder", feature = "recovery"))]
pub fn pack_geometry(geometry: &Geometry) -> Vec<f64> {
    let origin = geometry.correspondence.origin.to_numbers();
    let grids: [u32; 12] = bytemuck::cast([bytemuck::cast(geometry.sides()), origin]);
    let mut numbers = grids.map(f64::from).to_vec();
    numbers.extend(geometry.correspondence.to_numbers());
    numbers
}

/// The bytes of a tile.
pub fn pack_tile(tile: &Tile) -> Vec<u8> {
    let codes = [&tile.coefficients.codes, &tile.functions.entries];
    let header = PackedTileHeader {
        steps: [tile.coefficients.step, tile.functions.step],
        lengths: codes.map(|codes| codes.len() as u32), // fits: a 32-bit memory
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
    let (grids, correspondence) = geometry.split_first_chunk().ok_or_else(corrupt)?;
    let mut correspondence = Correspondence::from_numbers(correspondence).ok_or_else(corrupt)?;
    let [sides, origin]: [[u32; 6]; 2] =
        bytemuck::cast::<[u32; 12], _>(grids.map(|n: f64| n as u32));
    correspondence.origin = ShardOrigin::from_numbers(origin);
    let geometry = Geometry::from_sides(bytemuck::cast(sides), correspondence);
    let geometry = geometry.map_err(|_| corrupt())?;
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
        .split_at_checked(size_of::<PackedTileHeader>())
        .ok_or_else(corrupt)?;
    let PackedTileHeader { steps, lengths } = bytemuck::pod_read_unaligned(header);
    let [texels, entries] = lengths.map(|length| length as usize);
    let (codes, []) = codes.as_chunks() else {
        return Err(corrupt());
    };
    let has_length = texels.checked_add(entries) == Some(codes.len());
    if !has_length || (texels != 0 && texels != Tile::texels(rect, rank)) {
        return Err(corrupt());
    }
    let (coefficients, entries) = codes.split_at(texels);
    let mut tile = Tile::dark(rect);
    (tile.coefficients.step, tile.coefficients.codes) = (steps[0], try_copy(coefficients)?);
    (tile.functions.step, tile.functions.entries) = (steps[1], try_copy(entries)?);
    match tile.functions.is_valid(area) {
        true => Ok(tile),
        false => Err(corrupt()),
    }
}

/// Fallible: running out of memory must not abort the module.
#[cfg(feature = "drawing")]
fn try_copy(codes: &[[u8; size_of::<TexelCodes>()]]) -> Result<Vec<TexelCodes>, CodedError> {
    let mut copy = Vec::new();
    let no_memory = |_| CodedError::new("format-limit", "there is no memory for the photograph");
    copy.try_reserve_exact(codes.len()).map_err(no_memory)?;
    copy.extend(
        codes
            .iter()
            .map(|bytes| bytemuck::cast::<_, TexelCodes>(*bytes)),
    );
    Ok(copy)
}
