//! Which of several processes makes which shards of the coarser levels.
//!
//! A shard is made from the up to four below it. So a process has whole subtrees, whose roots are the shards of one level,
//! and needs nothing of other processes but tiles of level 0. One process makes the shards above the subtrees afterwards. The
//! level is the one with which this and the largest share take the least work.

use std::collections::HashMap;
use std::ops::Range;

use crate::format::{LevelTable, ShardId};
use crate::transport::TileRect;

/// The shards of the coarser levels, but the root, that several processes make.
#[derive(Clone, Debug)]
pub struct LevelShares {
    table: LevelTable,
    processes: usize,
    /// Level of the subtrees' roots; 0 if there are none.
    root_level: u32,
    /// Subtree by subtree, each from level 1 up.
    shards: Vec<ShardId>,
    /// Where each subtree begins in `shards`, and where the last ends.
    starts: Vec<usize>,
    numbers: HashMap<ShardId, usize>,
}

impl LevelShares {
    /// The shares of so many `processes` in the file with this table. The root is nobody's, so that there is nothing to share of
    /// a file of two levels.
    pub fn new(table: LevelTable, processes: usize) -> Self {
        let levels = 1..table.levels() - 1;
        // Of equal ones the coarsest.
        let level = levels
            .rev()
            .min_by_key(|level| longest_work(&table, *level, processes));
        let root_level = level.unwrap_or(0);
        let (mut shards, mut starts) = (Vec::new(), vec![0]);
        if root_level > 0 {
            for root in table.shards_of(root_level) {
                shards.extend((1..=root_level).flat_map(|level| below(&table, root, level)));
                starts.push(shards.len());
            }
        }
        let numbers = shards.iter().enumerate();
        Self {
            numbers: numbers.map(|(number, id)| (*id, number)).collect(),
            table,
            processes,
            root_level,
            shards,
            starts,
        }
    }

    /// The table of the file.
    pub fn table(&self) -> &LevelTable {
        &self.table
    }

    /// All shards that are shared, by their numbers.
    pub fn shards(&self) -> &[ShardId] {
        &self.shards
    }

    /// The number of a shard; `None` if it is not shared.
    pub fn number(&self, shard: ShardId) -> Option<usize> {
        self.numbers.get(&shard).copied()
    }

    /// Level of the subtrees' roots; 0 if nothing is shared.
    pub fn root_level(&self) -> u32 {
        self.root_level
    }

    /// Numbers of the shards of a process, from 0.
    pub fn share(&self, process: usize) -> Range<usize> {
        let Range { start, end } = self.subtree_range(process);
        self.starts[start]..self.starts[end]
    }

    /// Rows of pixels of level 0 that are below the shards of a process.
    pub fn rows(&self, process: usize) -> Range<u32> {
        let height = self.table.camera(0).height;
        let rects = self.subtrees(process).map(|root| self.table.rect(root));
        let pixels = |at: u32| (u64::from(at) << self.root_level).min(height.into()) as u32;
        let rows = rects.map(|TileRect { y, extent, .. }| pixels(y)..pixels(y + extent.height));
        let both = rows.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        both.unwrap_or(0..0)
    }

    /// Roots of the subtrees of a process.
    pub(super) fn subtrees(&self, process: usize) -> impl Iterator<Item = ShardId> {
        let (roots, range) = (self.starts.len() - 1, self.subtree_range(process));
        let roots = (roots > 0).then(|| self.table.shards_of(self.root_level));
        roots
            .into_iter()
            .flatten()
            .skip(range.start)
            .take(range.len())
    }

    /// The shards of a level in the subtree of `root`, row by row.
    pub(super) fn below(&self, root: ShardId, level: u32) -> impl Iterator<Item = ShardId> + use<> {
        below(&self.table, root, level)
    }

    fn subtree_range(&self, process: usize) -> Range<usize> {
        let subtrees = self.starts.len() - 1;
        let start = |process: usize| process.min(self.processes) * subtrees / self.processes;
        start(process)..start(process + 1)
    }
}

/// The number of shards that are made one after the other if the subtrees' roots are of this level: the largest share, and
/// the shards above.
fn longest_work(table: &LevelTable, root_level: u32, processes: usize) -> usize {
    let shards = |level: u32| table.shard_grid(level).area();
    let subtree: usize = (0..root_level).map(|depth| 1 << (2 * depth)).sum();
    let above: usize = (root_level + 1..table.levels()).map(shards).sum();
    shards(root_level).div_ceil(processes) * subtree + above
}

/// The shards of a level in the subtree of `root`, row by row.
fn below(table: &LevelTable, root: ShardId, level: u32) -> impl Iterator<Item = ShardId> + use<> {
    let grid = table.shard_grid(level);
    let depth = root.level - level;
    let range = move |at: u32, count: u32| (at << depth)..((at + 1) << depth).min(count);
    range(root.y, grid.height).flat_map(move |y| {
        let columns = range(root.x, grid.width);
        columns.map(move |x| ShardId { level, x, y })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Extent;

    #[test]
    fn every_coarser_shard_below_the_root_has_one_process() {
        for (width, height, levels, processes, root_level) in [
            (2048, 2048, 3, 2, 1),
            (2048, 1500, 3, 7, 1),
            (5000, 3100, 5, 2, 2),
            (16384, 16384, 6, 16, 3),
            (16384, 16384, 6, 1, 4),
            (900, 700, 2, 3, 0),
        ] {
            let camera = Extent::new(width, height);
            let table = LevelTable::new(camera, Extent::new(64, 64), levels, 512).unwrap();
            let shares = LevelShares::new(table.clone(), processes);
            assert_eq!(shares.root_level(), root_level);
            let mut next = 0;
            for process in 0..processes {
                let share = shares.share(process);
                assert_eq!(share.start, next);
                next = share.end;
                let rows = shares.rows(process);
                for number in share {
                    let id = shares.shards()[number];
                    assert_eq!(shares.number(id), Some(number));
                    let TileRect { y, extent, .. } = table.rect(id);
                    let end = ((y + extent.height) << id.level).min(height);
                    assert!(rows.start <= y << id.level && end <= rows.end);
                }
            }
            assert_eq!(next, shares.shards().len());
            let of_levels = (1..=root_level).map(|level| table.shard_grid(level).area());
            assert_eq!(next, of_levels.sum::<usize>());
            let all = (1..=root_level).flat_map(|level| table.shards_of(level));
            assert!(all.into_iter().all(|id| shares.number(id).is_some()));
        }
    }
}
