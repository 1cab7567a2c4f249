//! The light transport matrix of a nearly planar object, kept as a band.
//!
//! `y = pT`: light pattern `p` on `M` light elements in, picture `y` of `N` camera pixels out.
//! Pixel `n` sees only the elements of a square window `W_n` around its correspondence, so its
//! column of `T` shrinks to a light transport function `τ_n` of `S = w²` values a channel
//! (Thanikachalam et al. 2014, section 3).
//!
//! This is the one room that `recover`, `format` and `relight` all know: where pixels, windows and
//! tiles lie ([`Geometry`]), what a tile holds ([`Tile`]), and how far two transports are
//! apart ([`TransportError`]).

mod factored;
mod functions;
mod geometry;
mod snr;
mod tile;

pub use factored::{BandTile, Basis, FactoredTile, RecoveredTile};
pub use functions::TransportFunctions;
pub(crate) use geometry::ClippedRect;
pub use geometry::{
    CameraPx, Correspondence, Element, Extent, Geometry, GeometryError, LightPx, MAX_SIDE,
    MAX_WINDOW, TileRect, Window,
};
pub use snr::{Decibels, TransportError};
pub use tile::{CHANNELS, CoefficientTile, DirectTile, QUAD, TexelCode, Tile, Transport};
