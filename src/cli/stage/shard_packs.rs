//! The packs of all shards: a recovery's tiles, for the file.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Error, Result};

use super::pack_file::{PackContent, PackFault, PackKey, TilePlace};
use super::shard::Shard;
use super::stage_folder::{StageFileProblem, StageFolder};
use crate::cli::output_file::InputError;
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::records::read_content;
use crate::cli::recover::ltm_writer::{FileTiles, WriterInput};
use crate::cli::recover::prepared_job::PreparedJob;
use crate::cli::recover::tile_recovery::{TileCounts, decompress_tile};
use crate::export::{self, FileQuality};
use crate::format::{ChunkId, ChunkStore, CodingPlan, EncodedFile, EncodedTileHead, FormatError};
use crate::job_executor::Executor;

/// A complete pack.
pub struct ShardPack {
    path: PathBuf,
    first_tile: u32,
    places: Vec<TilePlace>,
    heads: Vec<EncodedTileHead>,
    counts: TileCounts,
    file: Mutex<File>,
}

impl ShardPack {
    /// Opens the pack at `path`, which must have this key; `remedy` is the command that writes it.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) if it is missing, incomplete or of something else.
    pub fn open(path: &Path, key: &PackKey, remedy: &str) -> Result<Self> {
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
                heads,
                counts: Some(counts),
            }) => {
                return Ok(Self {
                    path: path.to_owned(),
                    first_tile: key.tiles.start,
                    places: places.into_iter().flatten().collect(),
                    heads,
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

    /// The bytes at a place.
    fn read(&self, place: &TilePlace) -> io::Result<Vec<u8>> {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        read_content(&file, place).map_err(|error| self.input_error(error))
    }

    fn input_error(&self, error: io::Error) -> io::Error {
        let error = Error::new(error).context(self.path.display().to_string());
        io::Error::other(InputError(error))
    }
}

/// The packs of all shards of a recovery.
pub struct ShardPacks(Vec<ShardPack>);

impl ShardPacks {
    /// Opens the packs of so many shards of what `learned` identifies.
    ///
    /// # Errors
    /// [`StageFileError`](super::StageFileError) of the first that is missing, incomplete or of something else, and
    /// [`Cancelled`](crate::job_executor::Cancelled).
    pub fn open(
        stages: &StageFolder,
        learned: &str,
        job: &PreparedJob,
        count: u32,
        cores: &InterruptibleCores,
    ) -> Result<Self> {
        let open = |shard: Shard| {
            cores.check_cancelled()?;
            let remedy = stages.command("tiles", &format!(" --shard {shard}"));
            let path = stages.pack(shard);
            let pack = ShardPack::open(&path, &shard.pack_key(learned, job), &remedy)?;
            let is_of = |plan| pack.heads.iter().all(|head| head.is_of(plan));
            match job.coding.as_ref().is_none_or(is_of) {
                true => Ok(pack),
                false => Err(StageFileProblem::Damaged(remedy).of(&path).into()),
            }
        };
        Shard::all(count).map(open).collect::<Result<_>>().map(Self)
    }

    /// The sums of the counts of all shards.
    pub fn counts(&self) -> TileCounts {
        let mut counts = TileCounts::default();
        self.0.iter().for_each(|pack| counts += pack.counts);
        counts
    }

    /// The record of recovered tile `i`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, i: usize) -> io::Result<Vec<u8>> {
        let (pack, tile) = self.pack_of(i).ok_or(io::ErrorKind::NotFound)?;
        let content = pack.read(&pack.places[tile])?;
        decompress_tile(&content).map_err(|error| pack.input_error(error))
    }

    /// The pack that has tile `i`, and the tile's number in its shard.
    fn pack_of(&self, i: usize) -> Option<(&ShardPack, usize)> {
        // The last that begins at or before the tile, after those without tiles.
        let pack = self.0.partition_point(|pack| pack.first_tile as usize <= i);
        let pack = &self.0[pack.checked_sub(1)?];
        let tile = i - pack.first_tile as usize;
        (tile < pack.places.len()).then_some((pack, tile))
    }
}

/// The encoded tiles of packs, as the chunks of a file.
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
        let (pack, tile) = self.packs.pack_of(tile).ok_or_else(missing)?;
        let entries = &pack.heads[tile].entries;
        let before = entries[..scan].iter().map(|entry| u64::from(entry.bytes));
        let start = pack.places[tile].start + before.sum::<u64>();
        let place = start..start + u64::from(entries[scan].bytes);
        let bytes = pack.read(&place).map_err(FormatError::Source)?;
        Ok(Cow::Owned(bytes))
    }
}

/// The encoded tiles of packs, as a file.
pub struct EncodedTiles<'a> {
    pub packs: &'a ShardPacks,
    pub plan: &'a CodingPlan,
    pub cores: &'a InterruptibleCores,
}

impl<'a> FileTiles for EncodedTiles<'a> {
    type Store = PackedChunks<'a>;

    fn encode(
        &self,
        input: &WriterInput<'_>,
        _: FileQuality,
    ) -> Result<EncodedFile<Self::Store>, FormatError> {
        let geometry = export::file_geometry(&input.job.recovery);
        let store = PackedChunks {
            packs: self.packs,
            tiles: geometry.tile_grid().area(),
            basis: Vec::new(),
            cores: self.cores,
        };
        let heads = self.packs.0.iter().flat_map(|pack| &pack.heads);
        EncodedFile::of_tiles(self.plan, geometry, heads, store, input.metadata)
    }
}
