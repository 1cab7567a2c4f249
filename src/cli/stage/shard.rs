//! Shards of a recovery: bands of whole rows of the file's tiles.

use std::fmt;
use std::ops::Range;

use super::pack_file::{PackKey, PackKind};
use crate::cli::recover::prepared_job::PreparedJob;
use crate::export::{self, FILE_TILE_SIDE};
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
        let hint = || {
            format!(
                "give the number of a shard, from 1, and of all shards, {MAX_SHARDS} at most, as in 3/16"
            )
        };
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

    /// From 0.
    pub fn index(self) -> usize {
        self.number as usize - 1
    }

    /// How many there are.
    pub fn count(self) -> u32 {
        self.count
    }

    /// `3-of-16`.
    pub fn file_stem(self) -> String {
        format!("{}-of-{}", self.number, self.count)
    }

    /// Its rows of recovered tiles.
    pub fn tile_rows(self, geometry: &Geometry) -> Range<u32> {
        let [start, end] = self
            .file_tile_rows(geometry)
            .map(|row| (row * tiles_per_row(geometry)).min(geometry.tile_grid().height));
        start..end
    }

    /// Whether it has any of these rows of pixels.
    pub fn has_rows(self, rows: &Range<u32>, geometry: &Geometry) -> bool {
        let [start, end] = self
            .file_tile_rows(geometry)
            .map(|row| row * FILE_TILE_SIDE);
        start.max(rows.start) < end.min(rows.end)
    }

    /// The first of its rows of the file's tiles, and the first of the next shard.
    fn file_tile_rows(self, geometry: &Geometry) -> [u32; 2] {
        let rows = geometry.tile_grid().height;
        let rows = u64::from(rows.div_ceil(tiles_per_row(geometry)));
        let row = |number: u32| (u64::from(number) * rows / u64::from(self.count)) as u32;
        [row(self.number - 1), row(self.number)]
    }

    /// The key of its recovered tiles; `learned` is the id of `learned.bin`.
    pub fn recovered_key(self, learned: &str, geometry: &Geometry) -> PackKey {
        let (rows, columns) = (self.tile_rows(geometry), geometry.tile_grid().width);
        let tiles = rows.start * columns..rows.end * columns;
        PackKey::new(learned, PackKind::RecoveredTiles, tiles)
    }

    /// The key of its pack: of encoded tiles, if the job has a coding plan.
    pub fn pack_key(self, learned: &str, job: &PreparedJob) -> PackKey {
        let geometry = job.recovery.geometry();
        if job.coding.is_none() {
            return self.recovered_key(learned, geometry);
        }
        let columns = export::file_geometry(&job.recovery).tile_grid().width;
        let [start, end] = self.file_tile_rows(geometry);
        PackKey::new(
            learned,
            PackKind::EncodedTiles,
            start * columns..end * columns,
        )
    }
}

/// Rows of recovered tiles in a row of the file's tiles.
fn tiles_per_row(geometry: &Geometry) -> u32 {
    FILE_TILE_SIDE / geometry.tile_side
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
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
                let key = shard.recovered_key("", &geometry);
                assert_eq!(key.items.start, next);
                let rows = shard.tile_rows(&geometry);
                assert_eq!(rows.start % 4, 0);
                assert_eq!(rows.len() as u32 * grid.width, key.items.len() as u32);
                next = key.items.end;
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
