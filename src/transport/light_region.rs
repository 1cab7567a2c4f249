//! The part of a light plane that a picture sees.

use std::ops::Range;

use super::geometry::{Extent, LightPosition};

/// A light plane, or the part of one that a shard sees. Lights are computed on the whole plane, so that those of shards
/// side by side agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightRegion {
    /// Elements of the whole light plane.
    pub plane: Extent,
    /// Column and row of the part's first element.
    pub first: [u32; 2],
    /// Elements of the part.
    pub extent: Extent,
}

impl LightRegion {
    /// Columns of the part, on the light plane.
    pub fn columns(self) -> Range<u32> {
        self.first[0]..self.first[0] + self.extent.width
    }

    /// Rows of the part, on the light plane.
    pub fn rows(self) -> Range<u32> {
        self.first[1]..self.first[1] + self.extent.height
    }

    /// The centres of the part's elements, row by row, on the light plane.
    pub fn centres(self) -> impl Iterator<Item = LightPosition> {
        let Self { first, extent, .. } = self;
        extent.cells().map(move |(u, v)| LightPosition {
            u: f64::from(first[0] + u) + 0.5,
            v: f64::from(first[1] + v) + 0.5,
        })
    }
}

impl From<Extent> for LightRegion {
    /// A whole light plane.
    fn from(plane: Extent) -> Self {
        Self {
            plane,
            first: [0; 2],
            extent: plane,
        }
    }
}
