//! Shards of a recovery: bands of whole rows of the file's tiles.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::cli::recover::checkpoint_key::PROGRAM;
use crate::export::FILE_TILE_SIDE;
use crate::transport::Geometry;

/// Most shards of a recovery.
pub const MAX_SHARDS: u32 = 256;

/// One of several shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    number: u32,
    count: u32,
}

impl Shard {
    /// Parses `3/16`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let hint =
            || format!("give the number of a shard and of all, as in 3/16; at most {MAX_SHARDS}");
        let (number, count) = text.split_once('/').ok_or_else(hint)?;
        let [number, count] = [number, count].map(|text| text.parse::<u32>().map_err(|_| hint()));
        let shard = Self {
            number: number?,
            count: count?,
        };
        match (1..=shard.count).contains(&shard.number) && shard.count <= MAX_SHARDS {
            true => Ok(shard),
            false => Err(hint()),
        }
    }

    /// All of so many shards.
    pub fn all(count: u32) -> impl Iterator<Item = Self> {
        (1..=count).map(move |number| Self { number, count })
    }

    /// Those of some items that this shard has: every n-th.
    pub fn share<T>(self, items: impl Iterator<Item = T>) -> impl Iterator<Item = T> {
        let (number, count) = (self.number as usize, self.count as usize);
        items.skip(number - 1).step_by(count)
    }

    /// `3-of-16`.
    pub fn file_stem(self) -> String {
        format!("{}-of-{}", self.number, self.count)
    }

    /// What its tiles depend on, if `learned` identifies what was learned.
    pub fn key(self, learned: &str, geometry: &Geometry) -> ShardKey {
        let grid = geometry.tile_grid();
        let tiles_per_row = FILE_TILE_SIDE / geometry.tile_side;
        let file_rows = u64::from(grid.height.div_ceil(tiles_per_row));
        let row = |number: u32| {
            let file_row = u64::from(number) * file_rows / u64::from(self.count);
            (file_row as u32 * tiles_per_row).min(grid.height)
        };
        let [start, end] = [row(self.number - 1), row(self.number)];
        ShardKey {
            program: PROGRAM.to_owned(),
            learned: learned.to_owned(),
            tiles: start * grid.width..end * grid.width,
            columns: grid.width,
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

/// What the tiles of a shard depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardKey {
    /// Name and version of the program.
    pub program: String,
    /// SHA-256 of what was learned.
    pub learned: String,
    /// Indices of its tiles, row by row. None if there are more shards than rows of the file's tiles.
    pub tiles: Range<u32>,
    /// Tiles in a row.
    columns: u32,
}

impl ShardKey {
    /// Its rows of tiles.
    pub fn tile_rows(&self) -> Range<u32> {
        self.tiles.start / self.columns..self.tiles.end / self.columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{Correspondence, Extent, Window};

    #[test]
    fn shards_cover_every_row_once() {
        let geometry = Geometry {
            camera: Extent::new(200, 700),
            light: Extent::new(64, 64),
            window: Window::new(9).unwrap(),
            correspondence: Correspondence::from_affine([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]),
            tile_side: 32,
        };
        let grid = geometry.tile_grid();
        for count in [1, 2, 3, 5, 6, 7, 256] {
            let mut next = 0;
            for shard in Shard::all(count) {
                let key = shard.key("", &geometry);
                assert_eq!(key.tiles.start, next);
                let rows = key.tile_rows();
                assert_eq!(rows.start % 4, 0);
                assert_eq!(rows.len() as u32 * grid.width, key.tiles.len() as u32);
                next = key.tiles.end;
            }
            assert_eq!(next, grid.area() as u32);
        }
    }

    #[test]
    fn shards_are_parsed() {
        assert_eq!(
            Shard::parse("3/16"),
            Ok(Shard {
                number: 3,
                count: 16
            })
        );
        for text in ["0/3", "4/3", "3", "a/b", "1/257", "-1/2", "1/0", ""] {
            assert!(Shard::parse(text).is_err(), "{text}");
        }
    }
}
