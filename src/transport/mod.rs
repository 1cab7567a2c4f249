//! The light transport matrix of a nearly planar object in memory, as a band.
//!
//! `T` is M × N for each channel: a light `p` on `M` light elements gives the picture `y = pT` of `N` camera pixels.
//! Column `n` is zero outside a square window `W_n` of `S = w²` elements around the correspondence of pixel `n`; inside
//! it is the light transport function `τ_n` (Thanikachalam et al. 2014, section 3).
//!
//! `recover`, `format` and `relight` share this module: the positions of pixels, windows and tiles ([`Geometry`]), the
//! values of a tile as real numbers ([`FloatTile`]) and as codes ([`Tile`]), the distance of two transports
//! ([`SnrAccumulator`]), and their singular values ([`SingularValueAnalysis`]).

mod color_matrix;
mod correspondence;
#[cfg_attr(
    all(target_arch = "wasm32", feature = "recovery", not(feature = "drawing")),
    path = "no_displacement.rs"
)]
mod displacement_grid;
mod float_tile;
mod function_codes;
mod geometry;
mod known_transport;
mod light_region;
mod quantisation;
#[cfg_attr(
    all(target_arch = "wasm32", feature = "recovery", not(feature = "drawing")),
    path = "no_shard_origin.rs"
)]
mod shard_origin;
mod singular_values;
mod snr;
mod tile;

pub use color_matrix::{
    ColorMatrix, MAX_COLOR_FACTOR, convert_color, inverse_color_matrix, is_valid_color_matrix,
    light_color_matrix, single_precision,
};
pub use correspondence::Correspondence;
pub use displacement_grid::{DisplacementGrid, SharedGrid};
pub use float_tile::{Basis, FloatTile, TileTransportFunctions};
pub(crate) use function_codes::end_pixel;
pub use function_codes::{FunctionCodes, FunctionEntry, entries_by_pixel, entry_slot};
pub(crate) use geometry::ClippedRect;
pub use geometry::{
    CHANNELS, CameraPixel, Extent, Geometry, GeometryError, LightElement, LightPosition, MAX_AREA,
    MAX_SIDE, MAX_WINDOW, TileRect, Window,
};
pub use known_transport::{KnownTransport, transport_error};
pub use light_region::LightRegion;
pub(crate) use quantisation::ChannelPeaks;
pub use shard_origin::ShardOrigin;
pub use singular_values::SingularValueAnalysis;
pub use snr::{Decibels, SnrAccumulator};
pub use tile::{CoefficientCodes, TEXEL_COMPONENTS, TexelCodes, Tile, Transport};
