//! The encoder's input: light transport, target and distortion metric.

use std::fmt;
use std::io;

use crate::format::extension::FormatExtension;
use crate::format::metadata::Metadata;
use crate::transport::{Basis, Decibels, FloatTile, Geometry, TileTransportFunctions};

/// The light transport of a file.
pub struct EncoderInput<'a> {
    /// Grids, window, correspondence and the file's tiling.
    pub geometry: Geometry,
    /// The basis of the coefficients, if a tile has any.
    pub basis: Option<&'a Basis>,
    /// Returns a tile by its number. The encoder calls it several times for each tile.
    pub tile: &'a (dyn Fn(usize) -> io::Result<FloatTile> + Sync),
    /// Origin of the file.
    pub metadata: Metadata,
    /// Extensions of the file.
    pub extensions: Vec<FormatExtension>,
}

/// Measures how much accuracy of light transport a file loses. Recovered light transport contains noise,
/// so that SNR against it overestimates the loss.
pub trait DistortionMetric: Sync {
    /// The tiles that the metric compares, at any position and of any size. Their coefficients are over the
    /// source's basis.
    fn tiles(&self) -> Vec<FloatTile>;

    /// Estimated loss of SNR against the object's light transport if `functions` replace the tiles.
    fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels;
}

/// The target of the rate control.
#[derive(Clone, Copy, Debug)]
pub enum EncodingTarget<'a> {
    /// The smallest file whose loss, by a metric, is at most this.
    Loss(Decibels, &'a dyn DistortionMetric),
    /// The smallest file with this SNR against the source.
    Snr(Decibels),
    /// The best file of at most this many bytes.
    Bytes(u64),
    /// Eleven bits of every value, for archives.
    Lossless,
}

impl fmt::Debug for dyn DistortionMetric + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a distortion metric")
    }
}
