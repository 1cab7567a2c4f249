//! Where a shard begins in the level that it is a part of.

use super::displacement_grid::DisplacementGrid;
use super::geometry::{Extent, LightPosition, TileRect};
use super::light_region::LightRegion;

/// The first pixel and light element of a shard, in its level; zero for a whole picture.
///
/// Positions are computed in the level and then moved by whole elements, so that a shard has the window origins of its
/// level to the bit, also where a position falls on a border of elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShardOrigin {
    /// Column and row of the first pixel.
    pub camera: [u32; 2],
    /// Column and row of the first light element.
    pub light: [u32; 2],
    /// Columns and rows of the level's light plane; zero for a whole picture.
    pub plane: [u32; 2],
}

impl ShardOrigin {
    /// That of a whole picture.
    pub const ZERO: Self = Self {
        camera: [0; 2],
        light: [0; 2],
        plane: [0; 2],
    };

    /// The part of its level's light plane that a shard with a light plane of `extent` sees.
    pub(super) fn light_region(self, extent: Extent) -> LightRegion {
        match self.plane {
            [0, 0] => extent.into(),
            [width, height] => LightRegion {
                plane: Extent::new(width, height),
                first: self.light,
                extent,
            },
        }
    }

    /// Whether the light plane of a shard, of `extent`, lies within that of its level.
    pub fn is_valid(self, extent: Extent) -> bool {
        let ([x, y], [width, height]) = (self.light, self.plane);
        let seen = TileRect { x, y, extent };
        self == Self::ZERO || seen.is_within(Extent::new(width, height))
    }

    /// The fields one after another.
    pub fn to_numbers(self) -> [u32; 6] {
        bytemuck::cast([self.camera, self.light, self.plane])
    }

    /// The inverse of [`to_numbers`](Self::to_numbers).
    pub fn from_numbers(numbers: [u32; 6]) -> Self {
        let [camera, light, plane] = bytemuck::cast(numbers);
        Self {
            camera,
            light,
            plane,
        }
    }

    /// A camera position of the shard in its level.
    pub(super) fn to_level(self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.camera.map(f64::from);
        [at[0] + x, at[1] + y]
    }

    /// A light plane position of the level in the shard.
    pub(super) fn to_shard(self, at: LightPosition) -> LightPosition {
        let [u, v] = self.light.map(f64::from);
        LightPosition {
            u: at.u - u,
            v: at.v - v,
        }
    }

    /// The displacement at a camera position of the shard, whose control points begin at the one at or before its first
    /// pixel.
    pub(super) fn displacement(self, grid: &DisplacementGrid, at: [f64; 2]) -> [f64; 2] {
        let first = self.camera.map(|first| first / grid.spacing());
        grid.at_from(self.to_level(at), first)
    }

    /// The pixels of a shard of size `camera`, and those between it and the control point at or before its first pixel.
    pub fn covered(self, camera: Extent, spacing: u32) -> Extent {
        let [x, y] = self.camera.map(|first| first % spacing);
        Extent::new(
            camera.width.saturating_add(x),
            camera.height.saturating_add(y),
        )
    }
}
