//! What stands for a displacement in the module with which pages recover: there is none, and correspondences are affine. A
//! shared grid in every geometry would take that module past its size limit.
#![allow(missing_docs)] // `displacement_grid.rs` has them

use serde::{Deserialize, Serialize};

use super::geometry::{Extent, GeometryError};

/// A value that cannot be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplacementGrid(Never);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Never {}

/// As geometries hold it.
pub type SharedGrid = DisplacementGrid;

impl DisplacementGrid {
    pub const MIN_SPACING: u32 = 8;
    pub const MAX_SPACING: u32 = 4096;
    pub const MAX_POINTS: usize = 0;

    pub fn new(_: u32, _: f32, _: Extent, _: Vec<[i16; 2]>) -> Result<Self, GeometryError> {
        Err(GeometryError::Displacement)
    }

    pub fn points_over(_: Extent, _: u32) -> Extent {
        Extent::new(1, 1) // more than `MAX_POINTS`
    }

    pub fn fits(&self, _: Extent) -> bool {
        match self.0 {}
    }

    pub fn spacing(&self) -> u32 {
        match self.0 {}
    }

    pub fn step(&self) -> f32 {
        match self.0 {}
    }

    pub fn points(&self) -> Extent {
        match self.0 {}
    }

    pub fn codes(&self) -> &[[i16; 2]] {
        match self.0 {}
    }

    pub fn at(&self, _: f64, _: f64) -> [f64; 2] {
        match self.0 {}
    }

    pub(super) fn turned(&self, _: bool, _: [bool; 2]) -> Self {
        match self.0 {}
    }

    pub(super) fn shifted(&self, _: [i32; 2]) -> Self {
        match self.0 {}
    }
}
