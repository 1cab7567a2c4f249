//! Packs: the tiles of a shard, as they are recovered, or as they are in the file.
//!
//! The 8 bytes `LTMPACK2`, then [records](crate::cli::records):
//!
//! | number | content |
//! |---|---|
//! | `u32::MAX` | the [`PackKey`] as JSON; the first record |
//! | index of a tile | the [recovered tile](crate::export::encode_tile), compressed by zstd, or the [encoded tile](super::encoded_record) |
//! | `u32::MAX - 1` | the [`TileCounts`] as JSON; the last record, after those of all tiles in ascending order |
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
use crate::cli::recover::tile_recovery::TileCounts;
use crate::format::EncodedTileHead;

const MAGIC: [u8; 8] = *b"LTMPACK2";
const PACK: FileSignature = FileSignature::of_own_name("a pack of tiles");
const KEY: u32 = u32::MAX;
const COUNTS: u32 = u32::MAX - 1;
const BUFFER_BYTES: usize = 1 << 18;

/// What the tiles of a pack depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackKey {
    /// Name and version of the program.
    pub program: String,
    /// [`LearnedFile::id`](super::learned_file::LearnedFile::id).
    pub learned: String,
    pub kind: TileKind,
    /// Indices of its tiles, row by row, in the picture's tiles of this kind. None if there are more shards than rows of the
    /// file's tiles.
    pub tiles: Range<u32>,
}

/// What a tile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TileKind {
    /// Of the recovery's tiling.
    Recovered,
    /// Of the file's tiling, as it is in the file.
    Encoded,
}

/// Where a tile's bytes are in a file.
pub type TilePlace = Range<u64>;

/// A fault of a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackFault {
    /// It is of another shard, or of another `learned.bin`.
    Foreign,
    Damaged,
}

/// The intact records of a pack, complete or not.
pub struct PackContent {
    /// `[tile of the shard]`: the recovered tiles, or the chunks of the encoded ones.
    pub places: Vec<Option<TilePlace>>,
    /// `[tile of the shard]`, of encoded tiles.
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
            places: vec![None; key.tiles.len()],
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

    /// Takes the record of a tile; `None` if it is not one of this pack.
    fn add(&mut self, record: Record, key: &PackKey) -> Option<()> {
        let tile = record.number.checked_sub(key.tiles.start)? as usize;
        let place = self.places.get_mut(tile)?;
        match key.kind {
            TileKind::Recovered => *place = Some(record.range),
            TileKind::Encoded => {
                // In order, so that heads and places agree.
                if self.heads.len() != tile {
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

/// Writes the pack of a shard. `tiles` gives the number and the content of each tile, in order, to the function that it is
/// called with.
///
/// # Errors
/// If it cannot be written, and those of `tiles`.
pub fn write(
    path: &Path,
    key: &PackKey,
    counts: TileCounts,
    tiles: impl FnOnce(&mut dyn FnMut(u32, &[u8]) -> Result<()>) -> Result<()>,
) -> Result<()> {
    OutputFile::create(path, &PACK)?.finish(|out| {
        out.write_all(&beginning(key)?)?;
        tiles(&mut |tile, content| Ok(out.write_all(&encode_record(tile, content)?)?))?;
        Ok(out.write_all(&encode_record(COUNTS, &serde_json::to_vec(&counts)?)?)?)
    })?;
    Ok(())
}
