//! Names and sample sizes of the recovery methods in the study.

use super::pixel_sampling;
use crate::recover::{Method, SparsityBasis};
use crate::transport::{Geometry, TileRect};

/// The default method of `ltm-export recover`.
pub(super) const DEFAULT_METHOD: Method = Method::Learned;

/// Factor on the sample size of fast methods.
const FAST_FACTOR: usize = 4;
/// Divisor of the sample size of slow methods.
const SLOW_DIVISOR: usize = 8;

/// The unique name of a method in tables and legends.
pub(super) fn name(method: Method) -> &'static str {
    match method {
        Method::Bpdn(SparsityBasis::Identity) => "bpdn-identity",
        Method::Bpdn(SparsityBasis::Dct) => "bpdn-dct",
        Method::Bpdn(SparsityBasis::Haar) => "bpdn-haar",
        Method::Learned | Method::Nnls => method.name(),
    }
}

/// Whether `method` takes much longer than the others.
pub(super) fn is_slow(method: Method) -> bool {
    matches!(
        method,
        Method::Bpdn(SparsityBasis::Dct | SparsityBasis::Haar)
    )
}

/// The sample of pixels for `method`, from the nominal sample size `pixels`. Learned recovery decides tile by
/// tile whether to blend, so that its sample consists of whole tiles.
pub(super) fn sample_for(method: Method, geometry: &Geometry, pixels: usize) -> Vec<TileRect> {
    match method {
        Method::Learned => {
            pixel_sampling::random_tiles(geometry, pixels.saturating_mul(FAST_FACTOR))
        }
        _ if is_slow(method) => {
            pixel_sampling::random_blocks(geometry.camera, pixels / SLOW_DIVISOR)
        }
        _ => pixel_sampling::random_blocks(geometry.camera, pixels),
    }
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
