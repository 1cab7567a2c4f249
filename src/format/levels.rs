//! The extension `LEVL`: the table of a file of several levels; and `SHRD`: where a shard lies.
//!
//! Level 0 is the picture; each further level has half the pixels and half the light elements along each axis. The last
//! one, the root, is an ordinary file, with which a file of several levels begins. The others are cut into shards, each
//! an ordinary file too, which follow it: the coarsest level first, and in each level along a Morton curve.
//!
//! ```text
//! LEVL   u32 camera width, height      of level 0, in pixels
//!        u32 light width, height       of level 0, in elements
//!        u32 levels                    with the root
//!        u32 shard side                in pixels
//!        u32 bytes [shard]             in file order
//!
//! SHRD   u32 level
//!        u32 camera column, row        of the shard's first pixel, in the level
//!        u32 light column, row         of the shard's first light element, in the level
//!        u32 light width, height       of the level, in elements
//! ```

use std::ops::Range;

use super::constants::MAX_FILE_AREA;
use super::error::{FormatError, SectionError, SectionName, damaged};
use super::extension::{FormatExtension, TABLE_TAG};
use super::fields::FieldReader;
use super::index::FileIndex;
use crate::transport::{Extent, MAX_SIDE, ShardOrigin, TileRect};

/// The name of the extension with the place of a shard.
pub(super) const PLACE_TAG: [u8; 4] = *b"SHRD";
/// Bytes of the table before the lengths.
const FIXED_BYTES: usize = 24;
/// Range of the sides of shards, which are powers of two.
const SHARD_SIDES: Range<u32> = 256..4097;
/// Maximum number of levels: those of the largest picture and the smallest shards, and one more.
const MAX_LEVELS: u32 = 14;

/// A shard: a square part of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShardId {
    /// The level; 0 is the finest.
    pub level: u32,
    /// Column, in shards.
    pub x: u32,
    /// Row, in shards.
    pub y: u32,
}

impl std::fmt::Display for ShardId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "shard {}, {} of level {}", self.x, self.y, self.level)
    }
}

/// The table of a file of several levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevelTable {
    grids: Grids,
    /// All shards but the root, in file order.
    shards: Vec<ShardId>,
    /// Where each shard begins, and where the last ends, from the end of the root on.
    offsets: Vec<u64>,
}

impl LevelTable {
    /// The table of a picture of `camera` pixels and `light` elements with `levels` levels, whose shards have no bytes yet.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`] if a number is out of range, the last level has more pixels than a shard, or there
    /// are too many shards.
    pub fn new(
        camera: Extent,
        light: Extent,
        levels: u32,
        shard_side: u32,
    ) -> Result<Self, FormatError> {
        let grids = Grids::new([camera, light], levels, shard_side);
        grids
            .map(Self::of)
            .map_err(|error| error.in_section(SectionName::Extensions))
    }

    fn of(grids: Grids) -> Self {
        let count = grids.shards;
        let mut shards = Vec::with_capacity(count);
        for level in (0..grids.levels - 1).rev() {
            let grid = grids.shard_grid(level);
            let side = grid.width.max(grid.height).next_power_of_two();
            add_quarters(&mut shards, ShardId { level, x: 0, y: 0 }, side, grid);
        }
        Self {
            grids,
            shards,
            offsets: vec![0; count + 1],
        }
    }

    /// The table of a file, if it has several levels.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`] if the table breaks a rule, or does not match the root.
    pub fn read(index: &FileIndex) -> Result<Option<Self>, FormatError> {
        let mut tables = index.extensions.iter().filter(|e| e.tag == TABLE_TAG);
        let Some(extension) = tables.next() else {
            return Ok(None);
        };
        let geometry = &index.header.geometry;
        let table = match tables.next() {
            Some(_) => Err(damaged("there are two tables of levels")),
            None if index.is_shard() => Err(damaged("a shard cannot have levels")),
            None => Self::decode(&extension.data, [geometry.camera, geometry.light]),
        };
        table
            .map(Some)
            .map_err(|error| error.in_section(SectionName::Extensions))
    }

    fn decode(data: &[u8], root: [Extent; 2]) -> Result<Self, SectionError> {
        let mut fields = FieldReader(data);
        let fixed = fields.try_bytes(FIXED_BYTES);
        let fixed = fixed.ok_or_else(|| damaged("the table of levels is cut"))?;
        let [width, height, light_width, light_height, levels, shard_side] =
            FieldReader(fixed).u32s();
        let extents = [
            Extent::new(width, height),
            Extent::new(light_width, light_height),
        ];
        let grids = Grids::new(extents, levels, shard_side)?;
        let (lengths, rest) = fields.0.as_chunks();
        if lengths.len() != grids.shards || !rest.is_empty() {
            return Err(damaged(
                "the table of levels does not have a length for each shard",
            ));
        }
        if extents.map(|extent| level_extent(extent, levels - 1)) != root {
            return Err(damaged(
                "the table of levels is not that of this picture and light plane",
            ));
        }
        let mut table = Self::of(grids);
        for (i, bytes) in lengths.iter().enumerate() {
            table.set_bytes(i, u32::from_le_bytes(*bytes));
        }
        Ok(table)
    }

    /// The extension, which readers must understand.
    pub fn extension(&self) -> FormatExtension {
        let [camera, light] =
            [self.grids.camera, self.grids.light].map(|grid| [grid.width, grid.height]);
        let fixed = [camera, light, [self.levels(), self.shard_side()]];
        let lengths = self
            .offsets
            .windows(2)
            .map(|pair| (pair[1] - pair[0]) as u32);
        let fields = fixed.into_iter().flatten().chain(lengths);
        FormatExtension {
            tag: TABLE_TAG,
            must_understand: true,
            data: fields.flat_map(u32::to_le_bytes).collect(),
        }
    }

    /// Sets the length of the shard with this number in file order; those before it have theirs.
    pub fn set_bytes(&mut self, number: usize, bytes: u32) {
        self.offsets[number + 1] = self.offsets[number] + u64::from(bytes);
    }

    /// Number of levels, with the root.
    pub fn levels(&self) -> u32 {
        self.grids.levels
    }

    /// Side of the shards, in pixels. Those at the right and bottom borders are smaller.
    pub fn shard_side(&self) -> u32 {
        self.grids.shard_side
    }

    /// Shards along a row and down a column of a level.
    pub fn shard_grid(&self, level: u32) -> Extent {
        self.grids.shard_grid(level)
    }

    /// Camera pixels of a level, 0 to [`levels`](Self::levels) - 1.
    pub fn camera(&self, level: u32) -> Extent {
        level_extent(self.grids.camera, level)
    }

    /// Light elements of a level, 0 to [`levels`](Self::levels) - 1.
    pub fn light(&self, level: u32) -> Extent {
        level_extent(self.grids.light, level)
    }

    /// All shards but the root, in file order.
    pub fn shards(&self) -> &[ShardId] {
        &self.shards
    }

    /// The shards of a level, row by row; of the root's level the root.
    pub fn shards_of(&self, level: u32) -> impl Iterator<Item = ShardId> + use<> {
        let cells = self.shard_grid(level).cells();
        cells.map(move |(x, y)| ShardId { level, x, y })
    }

    /// The pixels of a shard of the table, in its level.
    ///
    /// # Panics
    /// If the level has no such shard.
    pub fn rect(&self, shard: ShardId) -> TileRect {
        let camera = self.camera(shard.level);
        let side = self.shard_side();
        let [x, y] = [shard.x, shard.y].map(|at| at * side);
        TileRect {
            x,
            y,
            extent: Extent::new(side.min(camera.width - x), side.min(camera.height - y)),
        }
    }

    /// The number of a shard in file order; `None` if the level has no such shard, or is the root.
    pub fn number(&self, shard: ShardId) -> Option<usize> {
        let key = |shard: &ShardId| (u32::MAX - shard.level, order(shard));
        self.shards.binary_search_by_key(&key(&shard), key).ok()
    }

    /// Bytes of the shard with this number, counted from the end of the root.
    pub fn range(&self, number: usize) -> Range<u64> {
        self.offsets[number]..self.offsets[number + 1]
    }

    /// Bytes of all shards.
    pub fn bytes(&self) -> u64 {
        self.offsets[self.shards.len()]
    }
}

/// The grids of a table, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Grids {
    camera: Extent,
    light: Extent,
    levels: u32,
    shard_side: u32,
    /// Number of shards, without the root.
    shards: usize,
}

impl Grids {
    fn new(
        [camera, light]: [Extent; 2],
        levels: u32,
        shard_side: u32,
    ) -> Result<Self, SectionError> {
        let sides = [camera.width, camera.height, light.width, light.height];
        let is_valid = sides.iter().all(|side| (1..=MAX_SIDE).contains(side))
            && camera.area_u64().max(light.area_u64()) <= MAX_FILE_AREA
            && (2..=MAX_LEVELS).contains(&levels)
            && SHARD_SIDES.contains(&shard_side)
            && shard_side.is_power_of_two();
        if !is_valid {
            return Err(damaged("the table of levels has a number out of range"));
        }
        let mut grids = Self {
            camera,
            light,
            levels,
            shard_side,
            shards: 0,
        };
        if grids.shard_grid(levels - 1).area() != 1 {
            return Err(damaged("the last level has more than one shard"));
        }
        // At most 4/3 of 2^20 shards, and a few more of long pictures.
        grids.shards = (0..levels - 1)
            .map(|level| grids.shard_grid(level).area())
            .sum();
        Ok(grids)
    }

    fn shard_grid(&self, level: u32) -> Extent {
        let Extent { width, height } = level_extent(self.camera, level);
        Extent::new(
            width.div_ceil(self.shard_side),
            height.div_ceil(self.shard_side),
        )
    }
}

/// The place of a shard: its level, and where it begins there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardPlace {
    /// The level.
    pub level: u32,
    /// The first pixel and light element, in the level.
    pub origin: ShardOrigin,
}

impl ShardPlace {
    /// The extension of a shard, which readers must understand: it moves windows.
    pub fn extension(&self) -> FormatExtension {
        let fields = [[self.level].as_slice(), &self.origin.to_numbers()].concat();
        FormatExtension {
            tag: PLACE_TAG,
            must_understand: true,
            data: fields.into_iter().flat_map(u32::to_le_bytes).collect(),
        }
    }

    /// The place of the shard with these extensions and a light plane of `light`, if it is one.
    ///
    /// # Errors
    /// If the extension breaks a rule, or there are two.
    pub(super) fn decode(
        extensions: &[FormatExtension],
        light: Extent,
    ) -> Result<Option<Self>, SectionError> {
        let mut places = extensions.iter().filter(|e| e.tag == PLACE_TAG);
        let Some(extension) = places.next() else {
            return Ok(None);
        };
        let invalid = || damaged("the place of the shard is invalid");
        let (fields, rest) = extension.data.as_chunks();
        let (&[level, ref numbers @ ..], true, None) = (fields, rest.is_empty(), places.next())
        else {
            return Err(invalid());
        };
        let numbers = <[[u8; 4]; 6]>::try_from(numbers).map_err(|_| invalid())?;
        let origin = ShardOrigin::from_numbers(numbers.map(u32::from_le_bytes));
        match origin.is_valid(light) {
            true => Ok(Some(Self {
                level: u32::from_le_bytes(level),
                origin,
            })),
            false => Err(damaged(
                "the light plane of the shard is not within that of its level",
            )),
        }
    }

    /// Checks that a file of so many bytes is the shard of `table` with this name.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`] if the file does not say its place, belongs at another, or has another length.
    pub fn check(
        index: &FileIndex,
        table: &LevelTable,
        shard: ShardId,
        bytes: u64,
    ) -> Result<(), FormatError> {
        let rect = table.rect(shard);
        let light = table.light(shard.level);
        let geometry = &index.header.geometry;
        let agrees = |place: &Self| {
            place.level == shard.level
                && index.header.file_bytes == bytes
                && place.origin.camera == [rect.x, rect.y]
                && place.origin.plane == [light.width, light.height]
                && geometry.camera == rect.extent
        };
        let place = Self::decode(&index.extensions, geometry.light);
        let place = place.and_then(|place| {
            place
                .filter(agrees)
                .ok_or_else(|| damaged(format!("it is not that of {shard}")))
        });
        place
            .map(drop)
            .map_err(|error| error.in_section(SectionName::Extensions))
    }
}

impl FileIndex {
    /// Whether the file is a shard of a larger picture.
    pub fn is_shard(&self) -> bool {
        self.has_extension(PLACE_TAG)
    }
}

/// The extent after halving `level` times; a last odd column or row counts as one.
fn level_extent(Extent { width, height }: Extent, level: u32) -> Extent {
    let side = |side: u32| side.div_ceil(1 << level);
    Extent::new(side(width), side(height))
}

/// Adds the shards of a square of `side` from `first` on that are on the grid, along a Morton curve: quarter by quarter.
fn add_quarters(shards: &mut Vec<ShardId>, first: ShardId, side: u32, grid: Extent) {
    if first.x >= grid.width || first.y >= grid.height {
        return;
    }
    if side == 1 {
        shards.push(first);
        return;
    }
    let half = side / 2;
    for (x, y) in [(0, 0), (half, 0), (0, half), (half, half)] {
        let quarter = ShardId {
            x: first.x + x,
            y: first.y + y,
            ..first
        };
        add_quarters(shards, quarter, half, grid);
    }
}

/// A shard's place on the Morton curve: bits of column and row alternate.
fn order(shard: &ShardId) -> u64 {
    let spread = |value: u32| -> u64 {
        (0..u32::BITS)
            .map(|bit| u64::from(value >> bit & 1) << (2 * bit))
            .sum()
    };
    spread(shard.x) | spread(shard.y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> LevelTable {
        let mut table =
            LevelTable::new(Extent::new(1500, 900), Extent::new(751, 450), 3, 512).unwrap();
        for (i, bytes) in (0..8).zip([100, 7, 1, 2, 3, 4, 5, 6]) {
            table.set_bytes(i, bytes);
        }
        table
    }

    #[test]
    fn shards_follow_level_by_level_along_a_morton_curve() {
        let table = table();
        let places: Vec<_> = table.shards().iter().map(|b| (b.level, b.x, b.y)).collect();
        let finest = [
            (0, 0, 0),
            (0, 1, 0),
            (0, 0, 1),
            (0, 1, 1),
            (0, 2, 0),
            (0, 2, 1),
        ];
        assert_eq!(places, [&[(1, 0, 0), (1, 1, 0)], &finest[..]].concat());
        for (number, shard) in table.shards().iter().enumerate() {
            assert_eq!(table.number(*shard), Some(number));
        }
        let root = ShardId {
            level: 2,
            x: 0,
            y: 0,
        };
        assert_eq!(table.number(root), None);
        assert_eq!(table.camera(2), Extent::new(375, 225));
        assert_eq!(table.light(2), Extent::new(188, 113));
        let [first, last] = [table.shards()[0], table.shards()[7]].map(|b| table.rect(b));
        assert_eq!((first.x, first.extent), (0, Extent::new(512, 450)));
        assert_eq!(
            (last.x, last.y, last.extent),
            (1024, 512, Extent::new(476, 388))
        );
        assert_eq!((table.range(1), table.bytes()), (100..107, 128));
    }

    #[test]
    fn a_table_survives_and_a_wrong_one_is_refused() {
        let (table, root) = (table(), [Extent::new(375, 225), Extent::new(188, 113)]);
        let data = table.extension().data;
        assert_eq!(LevelTable::decode(&data, root).unwrap(), table);
        let decode = |data: &[u8]| LevelTable::decode(data, root).err();
        let refused = |edit: &dyn Fn(&mut Vec<u8>)| {
            let mut data = data.clone();
            edit(&mut data);
            assert!(decode(&data).is_some());
        };
        refused(&|data| data.truncate(20));
        refused(&|data| data.push(0));
        refused(&|data| data.truncate(data.len() - 4));
        for (at, value) in [
            (0, 0),            // no pixels
            (0, MAX_SIDE + 1), // too many
            (0, 1504),         // another root
            (8, 1),            // another light plane
            (16, 1),           // one level
            (16, 2),           // a last level of more than one shard
            (16, MAX_LEVELS + 1),
            (16, u32::MAX),
            (20, 0),   // shards without pixels
            (20, 500), // no power of two
            (20, 8192),
        ] {
            refused(&|data| data[at..at + 4].copy_from_slice(&u32::to_le_bytes(value)));
        }
        // The most shards that a table can claim take no memory.
        let claim = [MAX_SIDE, 1 << 16, 1, 1, 13, 256].map(u32::to_le_bytes);
        assert!(decode(claim.as_flattened()).is_some());
        let claim = [MAX_SIDE, (1 << 16) + 1, 1, 1, 13, 256].map(u32::to_le_bytes);
        let error = format!("{:?}", decode(claim.as_flattened()));
        assert!(error.contains("out of range"), "{error}");
    }
}
