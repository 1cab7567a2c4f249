//! The methods under study.

use super::blocks;
use crate::recover::{Method, SparsityBasis};
use crate::transport::{Geometry, TileRect};

/// Every method, in the order of tables and legends.
pub(super) const METHODS: &[Method] = &[
    Method::Learned,
    Method::Nnls,
    Method::Bpdn(SparsityBasis::Identity),
    Method::Bpdn(SparsityBasis::Dct),
    Method::Bpdn(SparsityBasis::Haar),
];

/// The method that `recover` uses unless told otherwise.
pub(super) const DEFAULT: Method = Method::Learned;

/// How many times as many pixels are judged of methods that take a fraction of the time.
const MORE_OF_FAST: usize = 4;
/// How many times fewer pixels are judged of methods that take longer.
const FEWER_OF_SLOW: usize = 8;

/// The name by which tables and legends call a method; no two have the same.
pub(super) fn name(method: Method) -> &'static str {
    match method {
        Method::Bpdn(SparsityBasis::Identity) => "bpdn-identity",
        Method::Bpdn(SparsityBasis::Dct) => "bpdn-dct",
        Method::Bpdn(SparsityBasis::Haar) => "bpdn-haar",
        Method::Learned | Method::Nnls => method.name(),
    }
}

/// Whether `method` takes longer than others.
pub(super) fn slow(method: Method) -> bool {
    matches!(
        method,
        Method::Bpdn(SparsityBasis::Dct | SparsityBasis::Haar)
    )
}

/// The pixels that stand for all when `method` is judged on a sample of `pixels`. What is decided
/// tile by tile is judged by whole tiles.
pub(super) fn judged(method: Method, geometry: &Geometry, pixels: usize) -> Vec<TileRect> {
    match method {
        Method::Learned => blocks::tiles(geometry, pixels.saturating_mul(MORE_OF_FAST)),
        _ if slow(method) => blocks::sample(geometry.camera, pixels / FEWER_OF_SLOW),
        _ => blocks::sample(geometry.camera, pixels),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn methods_have_names_of_their_own_and_the_default_is_one_of_them() {
        let names: BTreeSet<_> = METHODS.iter().map(|&method| name(method)).collect();
        assert_eq!(names.len(), METHODS.len());
        assert!(METHODS.contains(&DEFAULT));
    }
}
