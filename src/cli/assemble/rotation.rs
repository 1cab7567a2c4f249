//! Rotation of photographs by quarters.

use serde::{Deserialize, Serialize};

use crate::transport::Extent;

/// A rotation by quarters, clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rotation {
    quarters: u8,
}

impl Rotation {
    /// As the file has it.
    pub const NONE: Self = Self { quarters: 0 };

    /// By 0, 90, 180 or 270 degrees.
    pub fn from_degrees(degrees: u32) -> Option<Self> {
        let is_quarters = degrees.is_multiple_of(90) && degrees < 360;
        is_quarters.then_some(Self {
            quarters: (degrees / 90) as u8,
        })
    }

    /// 0, 90, 180 or 270.
    pub fn degrees(self) -> u32 {
        90 * u32::from(self.quarters)
    }

    /// Size of a turned picture.
    pub fn extent(self, Extent { width, height }: Extent) -> Extent {
        match self.quarters % 2 {
            0 => Extent::new(width, height),
            _ => Extent::new(height, width),
        }
    }

    /// The pixel of a picture of size `extent` that is at `(x, y)` after the rotation.
    pub fn source(self, Extent { width, height }: Extent, x: u32, y: u32) -> (u32, u32) {
        match self.quarters {
            0 => (x, y),
            1 => (y, height - 1 - x),
            2 => (width - 1 - x, height - 1 - y),
            _ => (width - 1 - y, x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_turn_clockwise() {
        // 0 1 2
        // 3 4 5
        let extent = Extent::new(3, 2);
        for (degrees, expected) in [
            (0, [0, 1, 2, 3, 4, 5]),
            (90, [3, 0, 4, 1, 5, 2]),
            (180, [5, 4, 3, 2, 1, 0]),
            (270, [2, 5, 1, 4, 0, 3]),
        ] {
            let rotation = Rotation::from_degrees(degrees).unwrap();
            let turned = rotation.extent(extent).cells().map(|(x, y)| {
                let (x, y) = rotation.source(extent, x, y);
                3 * y + x
            });
            assert!(turned.eq(expected), "{degrees}");
        }
        assert_eq!(Rotation::from_degrees(45), None);
        assert_eq!(Rotation::from_degrees(360), None);
    }
}
