//! What goes from one module to another: a photograph is decoded by one and drawn by others, and each has
//! a memory of its own.

mod pack;
#[cfg(feature = "drawing")]
mod unpack;

use super::CodedError;
use crate::transport::CHANNELS;

#[cfg(feature = "decoder")]
pub use pack::pack_geometry;
pub use pack::pack_tile;
#[cfg(feature = "drawing")]
pub use unpack::{unpack, unpack_tile};

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
