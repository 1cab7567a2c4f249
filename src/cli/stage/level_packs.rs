//! The shards of coarser levels that `stage levels` makes, for the file.

use anyhow::Result;

use super::pack::Pack;
use super::pack_file::{PackKey, PackKind};
use super::shard::Shard;
use super::stage_folder::{StageFolder, is_missing};
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::recover::prepared_job::PreparedJob;
use crate::export;
use crate::format::{FormatError, ShardId};
use crate::job_executor::Executor;
use crate::pyramid::{LevelShares, PyramidLayout};

/// The shares of so many processes of the coarser levels; `None` if there is nothing to share: of a file of one level or two, and
/// where `assemble` encodes the tiles.
///
/// # Errors
/// Those of [`PyramidLayout::table`].
pub fn level_shares(
    job: &PreparedJob,
    levels: u32,
    processes: u32,
) -> Result<Option<LevelShares>, FormatError> {
    if job.coding.is_none() || levels == 1 {
        return Ok(None);
    }
    let geometry = export::file_geometry(&job.recovery);
    let table = PyramidLayout::of_levels(levels).table(&geometry)?;
    let shares = LevelShares::new(table, processes as usize);
    Ok((!shares.shards().is_empty()).then_some(shares))
}

/// The key of a process's pack of `shares`; `learned` is the id of `learned.bin`.
pub fn level_key(shard: Shard, learned: &str, shares: Option<&LevelShares>) -> PackKey {
    let share = shares.map_or(0..0, |shares| shares.share(shard.index()));
    let root_level = shares.map_or(0, LevelShares::root_level);
    let kind = PackKind::LevelShards { root_level };
    PackKey::new(learned, kind, share.start as u32..share.end as u32)
}

/// The packs of those processes that have made theirs.
pub struct LevelPacks {
    shares: LevelShares,
    packs: Vec<Pack>,
}

impl LevelPacks {
    /// Opens the packs that are there. Says which cannot be used.
    ///
    /// # Errors
    /// [`Cancelled`](crate::job_executor::Cancelled).
    pub fn open(
        stages: &StageFolder,
        learned: &str,
        shares: LevelShares,
        processes: u32,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let mut packs = Vec::new();
        for shard in Shard::all(processes) {
            cores.check_cancelled()?;
            let remedy = stages.command("levels", &format!(" --shard {shard}"));
            let key = level_key(shard, learned, Some(&shares));
            match Pack::open(&stages.levels(shard), &key, &remedy) {
                Ok(pack) => packs.push(pack),
                Err(error) if is_missing(&error) => {}
                Err(error) => {
                    eprintln!("note: {error:#}. Here its shards of coarser levels are made again");
                }
            }
        }
        Ok(Self { shares, packs })
    }

    /// The file of a shard, if it is in a pack.
    ///
    /// # Errors
    /// [`FormatError::Source`] if it cannot be read.
    pub fn read(&self, shard: ShardId) -> Result<Option<Vec<u8>>, FormatError> {
        let Some(number) = self.shares.number(shard) else {
            return Ok(None);
        };
        let file = self.packs.iter().find_map(|pack| pack.item(number));
        file.transpose().map_err(FormatError::Source)
    }
}
