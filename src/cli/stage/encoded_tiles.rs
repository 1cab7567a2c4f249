//! The encoded tiles of packs, as a file.

use std::borrow::Cow;
use std::io;

use super::level_packs::LevelPacks;
use super::shard_packs::ShardPacks;
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::recover::ltm_writer::{FileTiles, WriterInput};
use crate::export::{self, FileQuality};
use crate::format::{
    ChunkId, ChunkStore, CodingPlan, EncodedFile, EncodedTileHead, FormatError, Metadata, ShardId,
};
use crate::job_executor::Executor;
use crate::transport::Geometry;

/// The chunks of a file.
pub struct PackedChunks<'a> {
    packs: &'a ShardPacks,
    tiles: usize,
    /// `[scan]`.
    basis: Vec<Vec<u8>>,
    cores: &'a InterruptibleCores,
}

impl ChunkStore for PackedChunks<'_> {
    /// Only basis chunks are not in a pack.
    fn put(&mut self, number: usize, bytes: Vec<u8>) -> Result<(), FormatError> {
        self.basis
            .put(ChunkId::of_number(number, self.tiles).scan, bytes)
    }

    fn get(&self, number: usize) -> Result<Cow<'_, [u8]>, FormatError> {
        let ChunkId { scan, tile } = ChunkId::of_number(number, self.tiles);
        let Some(tile) = tile else {
            return self.basis.get(scan);
        };
        if self.cores.is_cancelled() {
            return Err(FormatError::Source(io::ErrorKind::Interrupted.into()));
        }
        let missing = || FormatError::Source(io::ErrorKind::NotFound.into());
        let (pack, head, start) = self.packs.chunks(tile).ok_or_else(missing)?;
        let before = head.entries[..scan]
            .iter()
            .map(|entry| u64::from(entry.bytes));
        let start = start + before.sum::<u64>();
        let place = start..start + u64::from(head.entries[scan].bytes);
        let bytes = pack.read(&place).map_err(FormatError::Source)?;
        Ok(Cow::Owned(bytes))
    }
}

/// Encoded tiles of a file in packs.
pub struct EncodedTiles<'a> {
    pub packs: &'a ShardPacks,
    pub plan: &'a CodingPlan,
    /// Shards of coarser levels.
    pub levels: Option<&'a LevelPacks>,
    pub cores: &'a InterruptibleCores,
}

impl<'a> EncodedTiles<'a> {
    /// The file of one level. Tiles that no pack has are dark.
    ///
    /// # Errors
    /// Those of [`EncodedFile::of_tiles`].
    pub fn partial_file(
        &self,
        geometry: Geometry,
        metadata: &Metadata,
    ) -> Result<EncodedFile<PackedChunks<'a>>, FormatError> {
        let dark = EncodedTileHead::dark(self.plan);
        let head = |i| self.packs.chunks(i).map_or(&dark, |(_, head, _)| head);
        let heads = (0..geometry.tile_grid().area()).map(head);
        self.file(geometry, heads, metadata)
    }

    /// The file of one level; `heads` are those of all tiles.
    fn file<'h>(
        &self,
        geometry: Geometry,
        heads: impl Iterator<Item = &'h EncodedTileHead>,
        metadata: &Metadata,
    ) -> Result<EncodedFile<PackedChunks<'a>>, FormatError> {
        let chunks = PackedChunks {
            packs: self.packs,
            tiles: geometry.tile_grid().area(),
            basis: Vec::new(),
            cores: self.cores,
        };
        EncodedFile::of_tiles(self.plan, geometry, heads, chunks, metadata)
    }
}

impl<'a> FileTiles for EncodedTiles<'a> {
    type Store = PackedChunks<'a>;

    fn encode(
        &self,
        input: &WriterInput<'_>,
        _: FileQuality,
    ) -> Result<EncodedFile<Self::Store>, FormatError> {
        let geometry = export::file_geometry(&input.job.recovery);
        self.file(geometry, self.packs.heads(), input.metadata)
    }

    fn level_shard(&self, shard: ShardId) -> Result<Option<Vec<u8>>, FormatError> {
        self.levels.map_or(Ok(None), |levels| levels.read(shard))
    }
}
