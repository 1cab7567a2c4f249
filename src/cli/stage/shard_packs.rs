//! The packs of tiles of several shards.

use std::io;

use anyhow::Result;

use super::pack::Pack;
use super::shard::Shard;
use super::stage_folder::{StageFileProblem, StageFolder, is_missing};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::recover::prepared_job::PreparedJob;
use crate::cli::recover::tile_recovery::{TileCounts, decompress_tile};
use crate::format::EncodedTileHead;
use crate::job_executor::Executor;

/// The packs of neighbouring shards of a recovery, in order.
pub struct ShardPacks(Vec<Pack>);

impl ShardPacks {
    /// Opens the packs of `shards` of what `learned` identifies.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) of the first that is missing, incomplete or of something else, and
    /// [`Cancelled`](crate::job_executor::Cancelled).
    pub fn open(
        stages: &StageFolder,
        learned: &str,
        job: &PreparedJob,
        shards: impl Iterator<Item = Shard>,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let open = |shard: Shard| {
            cores.check_cancelled()?;
            let remedy = stages.command("tiles", &format!(" --shard {shard}"));
            let path = stages.pack(shard);
            let pack = Pack::open(&path, &shard.pack_key(learned, job), &remedy);
            let pack = pack.map_err(|error| match stages.other_count(shard) {
                Some(found) if is_missing(&error) => {
                    let remedy = remedy.clone();
                    StageFileProblem::OtherCount { found, remedy }
                        .of(&path)
                        .into()
                }
                _ => error,
            })?;
            let is_of = |plan| pack.heads().iter().all(|head| head.is_of(plan));
            match job.coding.as_ref().is_none_or(is_of) {
                true => Ok(pack),
                false => Err(StageFileProblem::Damaged(remedy).of(&path).into()),
            }
        };
        shards.map(open).collect::<Result<_>>().map(Self)
    }

    /// The sums of the counts of all shards.
    pub fn counts(&self) -> TileCounts {
        let mut counts = TileCounts::default();
        self.0.iter().for_each(|pack| counts += pack.counts());
        counts
    }

    /// The record of recovered tile `i`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, i: usize) -> io::Result<Vec<u8>> {
        let pack = self.pack_of(i).ok_or(io::ErrorKind::NotFound)?;
        let content = pack.item(i).ok_or(io::ErrorKind::NotFound)??;
        decompress_tile(&content).map_err(|error| pack.input_error(error))
    }

    /// The pack of encoded tile `i`, its head, and where its chunks begin; `None` if no pack has it.
    pub fn chunks(&self, i: usize) -> Option<(&Pack, &EncodedTileHead, u64)> {
        let pack = self.pack_of(i)?;
        let (head, start) = pack.chunks(i)?;
        Some((pack, head, start))
    }

    /// The heads of all encoded tiles, in order.
    pub fn heads(&self) -> impl Iterator<Item = &EncodedTileHead> {
        self.0.iter().flat_map(Pack::heads)
    }

    /// The pack that has tile `i`, if one has.
    fn pack_of(&self, i: usize) -> Option<&Pack> {
        // The last that begins at or before the tile, after those without tiles.
        let pack = self.0.partition_point(|pack| pack.first() <= i);
        Some(&self.0[pack.checked_sub(1)?])
    }
}
