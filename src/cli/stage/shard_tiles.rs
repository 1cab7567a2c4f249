//! The tiles of a shard that is recovered, for its pack.

use std::io;

use anyhow::{Context, Result};

use super::encoded_record;
use super::pack_file::PackKey;
use super::partial_shards::PartialShard;
use crate::cli::output_file::InputError;
use crate::cli::process_resources::{InterruptibleCores, cancelled_or};
use crate::cli::recover::prepared_job::PreparedJob;
use crate::cli::recover::tile_recovery::decompress_tile;
use crate::export;

pub struct ShardTiles<'a> {
    pub job: &'a PreparedJob,
    pub recovered: &'a PartialShard,
    pub cores: &'a InterruptibleCores,
}

impl ShardTiles<'_> {
    /// Gives all tiles of a pack to `add`: encoded, if the job has a plan.
    ///
    /// # Errors
    /// If a tile cannot be read, those of `add`, and [`Cancelled`](crate::job_executor::Cancelled).
    pub fn write(
        &self,
        key: &PackKey,
        add: &mut dyn FnMut(u32, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some(plan) = &self.job.coding else {
            let mut tiles = key.items.clone();
            return tiles.try_for_each(|tile| add(tile, &self.recovered.read(tile)?));
        };
        let record = |i: usize| {
            let content = self.recovered.read(i as u32);
            let record = content.and_then(|content| {
                decompress_tile(&content).context("a tile of a partial pack is damaged")
            });
            record.map_err(|error| io::Error::other(InputError(error)))
        };
        let tiles = key.items.start as usize..key.items.end as usize;
        let recovery = &self.job.recovery;
        let encoded =
            export::for_encoded_tiles(recovery, plan, &record, tiles, self.cores, |i, tile| {
                add(i as u32, &encoded_record::encode(&tile)?)
            });
        encoded.map_err(cancelled_or)
    }
}
