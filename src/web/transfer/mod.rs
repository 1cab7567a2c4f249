//! Serialisation of a photograph between modules, each of which has its own memory: geometry as numbers, the basis as
//! floats, and each tile as a [`TileHeader`] followed by its codes.

mod pack;
#[cfg(feature = "drawing")]
mod unpack;

use super::CodedError;
use crate::transport::CHANNELS;

#[cfg(feature = "decoder")]
pub use pack::pack_geometry;
pub use pack::pack_tile;
#[cfg(feature = "drawing")]
pub use unpack::{unpack_tile, unpack_transport};

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
    CodedError::new(
        "internal",
        "a photograph was corrupted on its way from its worker",
    )
}
