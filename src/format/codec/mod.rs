//! The codec: basis chunks and tile chunks to bytes and back.
//!
//! ```text
//! coefficients -> transform (colour, dct)                   -> tokens      -> zstd_frame   coding 1
//! functions    -> direct_functions (sum_rounding, YCoCg-R)  -> tokens      -> zstd_frame   coding 3
//! either       -> half_float_codec                          -> byte_planes -> zstd_frame   codings 2, 4
//! basis        -> basis_chunk                               -> byte_planes -> zstd_frame
//! ```

pub(super) mod basis_chunk;
pub(super) mod byte_planes;
mod colour;
mod dct;
pub(super) mod direct_functions;
pub(super) mod half_float_codec;
pub(super) mod scan_functions;
mod sum_rounding;
pub(super) mod tokens;
pub(super) mod transform;
pub(super) mod transform_encoder;
pub(super) mod zstd_frame;
