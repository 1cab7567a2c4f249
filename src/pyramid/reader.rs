//! Reads shards of a file of several levels.

use std::io::{self, ErrorKind};
use std::ops::Range;

use super::geometry;
use crate::format::{
    ChunkSelection, FileIndex, FormatError, HEADER_BYTES, LevelTable, Limits, LtmReader, ShardId,
    ShardPlace,
};
use crate::transport::{Extent, Geometry, TileRect, Transport};

/// A file of several levels, whose root has been read. Bytes come from a callback.
#[derive(Clone, Debug)]
pub struct PyramidReader {
    root: FileIndex,
    table: LevelTable,
    limits: Limits,
}

/// A shard by itself.
#[derive(Debug)]
pub struct Shard {
    /// Its pixels, in its level.
    pub rect: TileRect,
    /// Its light transport. Tiles that were not asked for are dark.
    pub transport: Transport,
}

impl PyramidReader {
    /// The reader of a file whose root has this index; `None` if the file has one level. The limits are those of a shard.
    ///
    /// # Errors
    /// [`FormatError::DamagedSection`] if the table of levels breaks a rule.
    pub fn new(root: FileIndex, limits: Limits) -> Result<Option<Self>, FormatError> {
        let table = LevelTable::read(&root)?;
        Ok(table.map(|table| Self {
            root,
            table,
            limits,
        }))
    }

    /// The table of levels.
    pub fn table(&self) -> &LevelTable {
        &self.table
    }

    /// The index of the root.
    pub fn root(&self) -> &FileIndex {
        &self.root
    }

    /// Bytes of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.root.header.file_bytes + self.table.bytes()
    }

    /// Where a shard is in the file; that of the root begins at 0. `None` if there is no such shard.
    pub fn range(&self, shard: ShardId) -> Option<Range<u64>> {
        let root_bytes = self.root.header.file_bytes;
        if shard.level == self.table.levels() - 1 {
            return (shard.x == 0 && shard.y == 0).then_some(0..root_bytes);
        }
        let Range { start, end } = self.table.range(self.table.number(shard)?);
        Some(root_bytes + start..root_bytes + end)
    }

    /// The shards of a level that have pixels of `rect`, row by row.
    pub fn shards_in(&self, level: u32, rect: TileRect) -> impl Iterator<Item = ShardId> + use<> {
        let side = self.table.shard_side();
        let Extent { width, height } = self.table.camera(level);
        let range = move |first: u32, count: u32, side_of_level: u32| {
            let end = first.saturating_add(count).min(side_of_level);
            first / side..end.div_ceil(side)
        };
        let columns = range(rect.x, rect.extent.width, width);
        range(rect.y, rect.extent.height, height)
            .flat_map(move |y| columns.clone().map(move |x| ShardId { level, x, y }))
    }

    /// The index of a shard. `fetch` gives bytes of the file.
    ///
    /// # Errors
    /// The errors of `fetch`, and a [`FormatError`] if the shard is damaged, belongs at another place, or does not exist.
    pub fn index<E: From<FormatError>>(
        &self,
        shard: ShardId,
        fetch: impl FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    ) -> Result<FileIndex, E> {
        let OpenedShard { reader, .. } = self.open(shard, fetch)?;
        Ok(reader.index().cloned().ok_or_else(|| reader.truncated())?)
    }

    /// The geometry of level 0. `fetch` gives bytes of the file.
    ///
    /// # Errors
    /// The errors of `fetch`, and a [`FormatError`] if a shard is damaged.
    pub fn finest_geometry<E: From<FormatError>>(
        &self,
        mut fetch: impl FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    ) -> Result<Geometry, E> {
        let (camera, light) = (self.table.camera(0), self.table.light(0));
        let whole = TileRect {
            x: 0,
            y: 0,
            extent: camera,
        };
        let shards = self.shards_in(0, whole);
        let shards = shards.map(|id| Ok(self.index(id, &mut fetch)?.header.geometry));
        let shards = shards.collect::<Result<Vec<_>, E>>()?;
        let whole = geometry::whole(camera, light, &shards);
        Ok(whole.map_err(FormatError::InvalidGeometry)?)
    }

    /// Reads the tiles of a shard that have pixels of `rect`, in its level. `fetch` gives bytes of the file.
    ///
    /// # Errors
    /// The errors of `fetch`, and a [`FormatError`] if the shard is damaged, belongs at another place, exceeds the limits, or
    /// does not exist.
    pub fn shard<E: From<FormatError>>(
        &self,
        shard: ShardId,
        rect: TileRect,
        fetch: impl FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    ) -> Result<Shard, E> {
        let mut opened = self.open(shard, fetch)?;
        let own = self.table.rect(shard);
        let local = |first: u32, count: u32, own: u32| {
            first.saturating_sub(own)..first.saturating_add(count).saturating_sub(own)
        };
        let selection = ChunkSelection {
            viewport: Some((
                local(rect.x, rect.extent.width, own.x),
                local(rect.y, rect.extent.height, own.y),
            )),
            snr: None,
        };
        opened.feed(&selection)?;
        let (transport, _) = opened.reader.finish_early()?;
        Ok(Shard {
            rect: own,
            transport,
        })
    }

    fn open<E: From<FormatError>, F: FnMut(Range<u64>) -> Result<Vec<u8>, E>>(
        &self,
        shard: ShardId,
        fetch: F,
    ) -> Result<OpenedShard<F>, E> {
        let range = self.range(shard).ok_or_else(|| {
            let reason = format!("there is no {shard}");
            FormatError::Source(io::Error::new(ErrorKind::NotFound, reason))
        })?;
        let bytes = range.end - range.start;
        let mut opened = OpenedShard {
            reader: LtmReader::new(self.limits),
            range,
            fetch,
        };
        opened.feed_index()?;
        if shard.level < self.table.levels() - 1
            && let Some(index) = opened.reader.index()
        {
            ShardPlace::check(index, &self.table, shard, bytes)?;
        }
        Ok(opened)
    }
}

/// The index of a trusted shard that is whole in memory.
///
/// # Errors
/// A [`FormatError`] if it is damaged.
pub(super) fn read_index(file: &[u8]) -> Result<FileIndex, FormatError> {
    let mut opened = OpenedShard {
        reader: LtmReader::new(Limits {
            decoded_bytes: u64::MAX,
        }),
        range: 0..file.len() as u64,
        fetch: |range: Range<u64>| Ok(file[range.start as usize..range.end as usize].to_vec()),
    };
    opened.feed_index::<FormatError>()?;
    let OpenedShard { reader, .. } = opened;
    reader.index().cloned().ok_or_else(|| reader.truncated())
}

/// A shard whose index has been read.
struct OpenedShard<F> {
    reader: LtmReader,
    /// In the file.
    range: Range<u64>,
    fetch: F,
}

impl<F> OpenedShard<F> {
    /// Reads the index, and not more.
    fn feed_index<E: From<FormatError>>(&mut self) -> Result<(), E>
    where
        F: FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    {
        while self.reader.index().is_none() {
            let have = self.reader.progress().bytes;
            let end = self.reader.index_bytes().unwrap_or(HEADER_BYTES as u64);
            self.feed_range(have..end)?;
        }
        Ok(())
    }

    /// Reads all chunks of a selection.
    fn feed<E: From<FormatError>>(&mut self, selection: &ChunkSelection) -> Result<(), E>
    where
        F: FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    {
        loop {
            let ranges = self.reader.wants(selection);
            if ranges.is_empty() {
                return Ok(());
            }
            for range in ranges {
                self.feed_range(range)?;
            }
        }
    }

    fn feed_range<E: From<FormatError>>(&mut self, range: Range<u64>) -> Result<(), E>
    where
        F: FnMut(Range<u64>) -> Result<Vec<u8>, E>,
    {
        let in_file =
            self.range.start + range.start..self.range.end.min(self.range.start + range.end);
        let bytes = match in_file.is_empty() {
            true => Vec::new(),
            false => (self.fetch)(in_file)?,
        };
        if bytes.is_empty() {
            return Err(self.reader.truncated().into());
        }
        Ok(self.reader.feed(range.start, &bytes)?)
    }
}
