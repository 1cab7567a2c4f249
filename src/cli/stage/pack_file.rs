//! Packs: what one of several processes makes of a file. The tiles of a shard, as they are recovered, or as they are in the
//! file; and shards of coarser levels.
//!
//! The 8 bytes `LTMPACK3`, then [records](crate::cli::records):
//!
//! | number | content |
//! |---|---|
//! | `u32::MAX` | the [`PackKey`] as JSON; the first record |
//! | number of an item | the [recovered tile](crate::export::encode_tile), compressed by zstd; the [encoded tile](super::encoded_record); or the file of the shard |
//! | `u32::MAX - 1` | the [`TileCounts`] as JSON; the last record, after those of all items in ascending order |
//!
//! A [partial](super::partial_shards) pack has recovered tiles in any order, and lacks the last record.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::ops::Range;
use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::encoded_record;
use crate::cli::output_file::{FileSignature, OutputFile};
use crate::cli::records::{Record, RecordReader, encode_record};
use crate::cli::recover::checkpoint_key::PROGRAM;
use crate::cli::recover::tile_recovery::TileCounts;
use crate::format::EncodedTileHead;

const MAGIC: [u8; 8] = *b"LTMPACK3";
const PACK: FileSignature = FileSignature::of_own_name("a pack of a stage");
const KEY: u32 = u32::MAX;
const COUNTS: u32 = u32::MAX - 1;
const BUFFER_BYTES: usize = 1 << 18;

/// What the items of a pack depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackKey {
    /// Name and version of the program.
    pub program: String,
    /// [`LearnedFile::id`](super::learned_file::LearnedFile::id).
    pub learned: String,
    pub kind: PackKind,
    /// Numbers of its items among those of this kind: of tiles, row by row; of shards of coarser levels, in their
    /// [`LevelShares`](crate::pyramid::LevelShares). Empty if there are more processes than items, or nothing to share.
    pub items: Range<u32>,
}

impl PackKey {
    /// A key of this program; `learned` is the id of `learned.bin`.
    pub fn new(learned: &str, kind: PackKind, items: Range<u32>) -> Self {
        Self {
            program: PROGRAM.to_owned(),
            learned: learned.to_owned(),
            kind,
            items,
        }
    }
}

/// What an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PackKind {
    /// A tile of the recovery's tiling.
    RecoveredTiles,
    /// A tile of the file's tiling, as it is in the file.
    EncodedTiles,
    /// A shard of a coarser level, in subtrees whose roots are of this level.
    LevelShards { root_level: u32 },
}

/// Where an item's bytes are in a file.
pub type ItemPlace = Range<u64>;

/// A fault of a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackFault {
    /// It is of another shard, or of another `learned.bin`.
    Foreign,
    Damaged,
}

/// The intact records of a pack, complete or not.
pub struct PackContent {
    /// `[item of the pack]`; of encoded tiles the chunks.
    pub places: Vec<Option<ItemPlace>>,
    /// `[item of the pack]`, of encoded tiles.
    pub heads: Vec<EncodedTileHead>,
    /// If the pack is complete.
    pub counts: Option<TileCounts>,
}

impl PackContent {
    /// Reads the records of `file` to the first that is not intact.
    ///
    /// # Errors
    /// If the file cannot be read. Faults of its content are in the result.
    pub fn read(file: &File, key: &PackKey) -> io::Result<Result<Self, PackFault>> {
        let bytes = file.metadata()?.len();
        let mut reader = BufReader::with_capacity(BUFFER_BYTES, file);
        let mut magic = Vec::new();
        reader
            .by_ref()
            .take(MAGIC.len() as u64)
            .read_to_end(&mut magic)?;
        if magic != MAGIC {
            return Ok(Err(PackFault::Damaged));
        }
        let mut records = RecordReader::new(reader, MAGIC.len() as u64, bytes);
        let first = records.next()?.filter(|r| r.is_intact && r.number == KEY);
        let recorded = first.and_then(|first| serde_json::from_slice(&first.content).ok());
        match recorded {
            None => return Ok(Err(PackFault::Damaged)),
            Some(recorded) if *key != recorded => return Ok(Err(PackFault::Foreign)),
            Some(_) => {}
        }
        let mut content = Self {
            places: vec![None; key.items.len()],
            heads: Vec::new(),
            counts: None,
        };
        while let Some(record) = records.next()?.filter(|record| record.is_intact) {
            if record.number == COUNTS {
                let is_last =
                    record.range.end == bytes && content.places.iter().all(Option::is_some);
                content.counts = serde_json::from_slice(&record.content)
                    .ok()
                    .filter(|_| is_last);
                break;
            }
            if content.add(record, key).is_none() {
                break;
            }
        }
        Ok(Ok(content))
    }

    /// Takes the record of an item; `None` if it is not one of this pack.
    fn add(&mut self, record: Record, key: &PackKey) -> Option<()> {
        let item = record.number.checked_sub(key.items.start)? as usize;
        let place = self.places.get_mut(item)?;
        match key.kind {
            PackKind::RecoveredTiles | PackKind::LevelShards { .. } => *place = Some(record.range),
            PackKind::EncodedTiles => {
                // In order, so that heads and places agree.
                if self.heads.len() != item {
                    return None;
                }
                let (head, start) = encoded_record::decode_head(&record.content)?;
                *place = Some(record.range.start + start as u64..record.range.end);
                self.heads.push(head);
            }
        }
        Some(())
    }
}

/// What a pack begins with.
pub fn beginning(key: &PackKey) -> Result<Vec<u8>> {
    let key = encode_record(KEY, &serde_json::to_vec(key)?)?;
    Ok([&MAGIC[..], &key].concat())
}

/// Writes a pack. `items` gives the number and the content of each item, in order, to the function that it is called with.
///
/// # Errors
/// If it cannot be written, and those of `items`.
pub fn write(
    path: &Path,
    key: &PackKey,
    counts: TileCounts,
    items: impl FnOnce(&mut dyn FnMut(u32, &[u8]) -> Result<()>) -> Result<()>,
) -> Result<()> {
    OutputFile::create(path, &PACK)?.finish(|out| {
        out.write_all(&beginning(key)?)?;
        items(&mut |item, content| Ok(out.write_all(&encode_record(item, content)?)?))?;
        Ok(out.write_all(&encode_record(COUNTS, &serde_json::to_vec(&counts)?)?)?)
    })?;
    Ok(())
}
