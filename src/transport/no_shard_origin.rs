//! What stands for a shard's origin in the module of recovery, where all pictures are whole: no bytes and no code.
#![allow(missing_docs)] // `shard_origin.rs` has them

use super::displacement_grid::DisplacementGrid;
use super::geometry::{Extent, LightPosition};
use super::light_region::LightRegion;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShardOrigin;

impl ShardOrigin {
    pub const ZERO: Self = Self;

    pub(super) fn light_region(self, extent: Extent) -> LightRegion {
        extent.into()
    }

    pub fn is_valid(self, _: Extent) -> bool {
        true
    }

    pub fn to_numbers(self) -> [u32; 6] {
        [0; 6]
    }

    pub(super) fn to_level(self, at: [f64; 2]) -> [f64; 2] {
        at
    }

    pub(super) fn to_shard(self, at: LightPosition) -> LightPosition {
        at
    }

    pub(super) fn displacement(self, grid: &DisplacementGrid, [x, y]: [f64; 2]) -> [f64; 2] {
        grid.at(x, y)
    }

    pub fn covered(self, camera: Extent, _: u32) -> Extent {
        camera
    }
}
