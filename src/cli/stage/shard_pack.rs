//! Packs: the recovered tiles of a shard.
//!
//! The 8 bytes `LTMPACK1`, then [records](crate::cli::records):
//!
//! | number | content |
//! |---|---|
//! | `u32::MAX` | the [`ShardKey`] as JSON; the first record |
//! | index of a tile | the [tile](crate::export::encode_tile), compressed by zstd |
//! | `u32::MAX - 1` | the [`TileCounts`] as JSON; the last record, after those of all tiles in ascending order |
//!
//! A [partial](super::partial_shards) pack lacks the last record, and has its tiles in any order.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Error, Result};

use super::shard::{Shard, ShardKey};
use super::stage_folder::{StageFileProblem, StageFolder};
use crate::cli::output_file::{FileSignature, InputError, OutputFile};
use crate::cli::records::{RecordReader, encode_record, read_content};
use crate::cli::recover::tile_recovery::{TileCounts, decompress_tile};
use crate::transport::Geometry;

pub const MAGIC: [u8; 8] = *b"LTMPACK1";
const PACK: FileSignature = FileSignature::of_own_name("a pack of tiles");
pub const KEY: u32 = u32::MAX;
const COUNTS: u32 = u32::MAX - 1;
const BUFFER_BYTES: usize = 1 << 18;

/// Where a tile's content is in a file.
pub type TilePlace = Range<u64>;

/// What is wrong with a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackFault {
    /// It is of another shard or of what was learned otherwise.
    Foreign,
    Damaged,
}

/// The intact records of a pack, complete or not.
pub struct PackContent {
    /// `[tile of the shard]`.
    pub places: Vec<Option<TilePlace>>,
    /// If the pack is complete.
    pub counts: Option<TileCounts>,
}

impl PackContent {
    /// Reads the records of `file` to the first that is not intact.
    ///
    /// # Errors
    /// If the file cannot be read. What is wrong with its content is in the result.
    pub fn read(file: &File, key: &ShardKey) -> io::Result<Result<Self, PackFault>> {
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
            let tile = record.number.checked_sub(key.tiles.start);
            match tile.and_then(|tile| content.places.get_mut(tile as usize)) {
                Some(place) => *place = Some(record.range),
                None => break,
            }
        }
        Ok(Ok(content))
    }
}

/// A complete pack.
struct ShardPack {
    path: PathBuf,
    first_tile: u32,
    places: Vec<TilePlace>,
    counts: TileCounts,
    file: Mutex<File>,
}

impl ShardPack {
    /// Opens the pack at `path`, which must have this key; `remedy` is the command that writes it.
    fn open(path: &Path, key: &ShardKey, remedy: &str) -> Result<Self> {
        let remedy = remedy.to_owned();
        let file = match File::open(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                return Err(StageFileProblem::Missing(remedy).of(path).into());
            }
            file => file.with_context(|| path.display().to_string())?,
        };
        let content = PackContent::read(&file, key).with_context(|| path.display().to_string())?;
        let problem = match content {
            Ok(PackContent {
                places,
                counts: Some(counts),
            }) => {
                return Ok(Self {
                    path: path.to_owned(),
                    first_tile: key.tiles.start,
                    places: places.into_iter().flatten().collect(),
                    counts,
                    file: Mutex::new(file),
                });
            }
            Ok(_) | Err(PackFault::Damaged) => StageFileProblem::Damaged(remedy),
            Err(PackFault::Foreign) => StageFileProblem::Foreign {
                made_from: "learned.bin and shard",
                remedy,
            },
        };
        Err(problem.of(path).into())
    }

    /// The record of a tile in its place.
    fn read(&self, place: &TilePlace) -> io::Result<Vec<u8>> {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let content = read_content(&file, place);
        drop(file);
        content
            .and_then(|content| decompress_tile(&content))
            .map_err(|error| {
                let error = Error::new(error).context(self.path.display().to_string());
                io::Error::other(InputError(error))
            })
    }
}

/// Whether the pack at `path` is complete and has this key.
///
/// # Errors
/// If it is not.
pub fn verify(path: &Path, key: &ShardKey) -> Result<()> {
    ShardPack::open(path, key, "").map(drop)
}

/// Writes the pack of a shard; `content` gives that of each tile.
///
/// # Errors
/// If it cannot be written, or a tile not be read.
pub fn write(
    path: &Path,
    key: &ShardKey,
    counts: TileCounts,
    content: impl Fn(u32) -> Result<Vec<u8>>,
) -> Result<()> {
    OutputFile::create(path, &PACK)?.finish(|out| {
        out.write_all(&MAGIC)?;
        out.write_all(&encode_record(KEY, &serde_json::to_vec(key)?)?)?;
        for tile in key.tiles.clone() {
            out.write_all(&encode_record(tile, &content(tile)?)?)?;
        }
        Ok(out.write_all(&encode_record(COUNTS, &serde_json::to_vec(&counts)?)?)?)
    })?;
    Ok(())
}

/// The packs of all shards of a recovery.
pub struct ShardPacks(Vec<ShardPack>);

impl ShardPacks {
    /// Opens the packs of so many shards of what `learned` identifies.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) of the first that is missing, incomplete or of something else.
    pub fn open(
        stages: &StageFolder,
        learned: &str,
        geometry: &Geometry,
        count: u32,
    ) -> Result<Self> {
        let open = |shard: Shard| {
            let remedy = stages.command("tiles", &format!(" --shard {shard}"));
            ShardPack::open(&stages.pack(shard), &shard.key(learned, geometry), &remedy)
        };
        Shard::all(count).map(open).collect::<Result<_>>().map(Self)
    }

    /// What was counted in all shards.
    pub fn counts(&self) -> TileCounts {
        let mut counts = TileCounts::default();
        self.0.iter().for_each(|pack| counts += pack.counts);
        counts
    }

    /// The record of tile `i`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, i: usize) -> io::Result<Vec<u8>> {
        // The last that begins at or before the tile, after those without tiles.
        let pack = self.0.partition_point(|pack| pack.first_tile as usize <= i);
        let pack = pack.checked_sub(1).map(|pack| &self.0[pack]);
        let place =
            pack.and_then(|pack| Some((pack, pack.places.get(i - pack.first_tile as usize)?)));
        let (pack, place) = place.ok_or(io::ErrorKind::NotFound)?;
        pack.read(place)
    }
}
