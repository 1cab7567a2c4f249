//! Names and sample sizes of the recovery methods in the study.

use super::pixel_sampling;
use crate::recover::{Method, SparsityBasis};
use crate::transport::{Geometry, TileRect};

/// The default method of `ltm-export recover`.
pub(super) const DEFAULT_METHOD: Method = Method::Learned;

const FAST_FACTOR: usize = 4;
const SLOW_DIVISOR: usize = 8;

/// Fewer tiles would give no usable standard error.
const MIN_TILES: usize = 8;
/// Side of the squares that other methods are sampled in. With two camera pixels for each light element, the pixels of a
/// square share a window, so that smaller squares would take longer for each pixel. The errors of neighbours are
/// correlated, so that larger squares would be less informative.
const BLOCK_SIDE_PX: u32 = 2;

/// The unique name of a method in tables and legends.
pub(super) fn name(method: Method) -> &'static str {
    match method {
        Method::Bpdn(SparsityBasis::Identity) => "bpdn-identity",
        Method::Bpdn(SparsityBasis::Dct) => "bpdn-dct",
        Method::Bpdn(SparsityBasis::Haar) => "bpdn-haar",
        Method::Learned | Method::Nnls => method.name(),
    }
}

/// The names of all methods, as columns of a table.
pub(super) fn names() -> String {
    let names: Vec<&str> = Method::ALL.iter().map(|&method| name(method)).collect();
    names.join(" | ")
}

/// Whether `method` takes much longer than the others.
pub(super) fn is_slow(method: Method) -> bool {
    !matches!(
        method,
        Method::Learned | Method::Nnls | Method::Bpdn(SparsityBasis::Identity)
    )
}

/// The sample of pixels for `method`, from the nominal sample size `pixels`. Learned recovery decides tile by tile
/// whether to blend, so that its sample consists of whole tiles.
pub(super) fn sample_for(method: Method, geometry: &Geometry, pixels: usize) -> Vec<TileRect> {
    let (tile_side, pixels, min_tiles) = match method {
        Method::Learned => {
            let pixels = pixels.saturating_mul(FAST_FACTOR);
            (geometry.tile_side, pixels, MIN_TILES)
        }
        _ if is_slow(method) => (BLOCK_SIDE_PX, pixels / SLOW_DIVISOR, 1),
        _ => (BLOCK_SIDE_PX, pixels, 1),
    };
    let tiles = Geometry {
        tile_side,
        ..geometry.clone()
    };
    pixel_sampling::random_tiles(&tiles, pixels, min_tiles)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn method_names_are_unique() {
        let names: BTreeSet<_> = Method::ALL.iter().map(|&method| name(method)).collect();
        assert_eq!(names.len(), Method::ALL.len());
        assert!(Method::ALL.contains(&DEFAULT_METHOD));
    }
}
