//! Partial packs: the tiles of a shard that is not finished, to continue from after a process or its machine is lost.
//!
//! Every process appends to a partial pack of its own, and reads those that others left. So two processes may recover one
//! shard at the same time, as happens after a node is lost for the scheduler only, without locks, which network file
//! systems may not have.

use std::fs::File;
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Error, Result};

use super::pack_file::{ItemPlace, PackContent, PackKey, beginning};
use super::shard::Shard;
use super::stage_folder::StageFolder;
use crate::cli::output_file::{temporary_beside, without_path};
use crate::cli::process_resources::Interrupted;
use crate::cli::records::{RECORD_HEAD_BYTES, encode_record, read_content};
use crate::cli::recover::tile_recovery::TileSink;
use crate::job_executor::Cancelled;

/// Digits of what was learned in the names of partial packs.
const ID_DIGITS: usize = 8;

/// The tiles of a shard so far.
pub struct PartialShard {
    /// What the names of its partial packs begin with.
    stem: String,
    shards: PathBuf,
    key: PackKey,
    tiles: Mutex<PartialTiles>,
}

struct PartialTiles {
    /// Those of other processes.
    others: Vec<(PathBuf, File)>,
    /// That of this process, once it has a tile.
    own: Option<OwnPack>,
    /// `[tile of the shard]`.
    places: Vec<Option<(PackOf, ItemPlace)>>,
}

#[derive(Clone, Copy)]
enum PackOf {
    Other(usize),
    This,
}

struct OwnPack {
    path: PathBuf,
    file: File,
    /// End of the last record.
    end: u64,
}

impl PartialShard {
    /// Reads the tiles that other processes left with the same key.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn open(stages: &StageFolder, shard: Shard, key: &PackKey) -> Result<Self> {
        let learned: String = key.learned.chars().take(ID_DIGITS).collect();
        let (stem, shards) = (format!("{}.{learned}.", shard.file_stem()), stages.shards());
        let mut others = Vec::new();
        let mut places = vec![None; key.items.len()];
        for path in partial_packs(&shards, &stem)? {
            let file = match File::open(&path) {
                // Another process may have finished the shard, and removed it.
                Err(e) if e.kind() == ErrorKind::NotFound => continue,
                file => file.with_context(|| path.display().to_string())?,
            };
            let content = PackContent::read(&file, key);
            let Ok(content) = content.with_context(|| path.display().to_string())? else {
                continue;
            };
            let pack = PackOf::Other(others.len());
            for (known, place) in places.iter_mut().zip(content.places) {
                *known = known.take().or(place.map(|place| (pack, place)));
            }
            others.push((path, file));
        }
        let tiles = PartialTiles {
            others,
            own: None,
            places,
        };
        Ok(Self {
            stem,
            shards,
            key: key.clone(),
            tiles: Mutex::new(tiles),
        })
    }

    /// Tells how many tiles are there already.
    pub fn print_count(&self) {
        if self.count() > 0 {
            let (count, all) = (self.count(), self.key.items.len());
            eprintln!("resuming with {count} of {all} tiles");
        }
    }

    /// Reads what [`add`](TileSink::add) was given.
    ///
    /// # Errors
    /// If the tile is missing or cannot be read.
    pub fn read(&self, tile: u32) -> Result<Vec<u8>> {
        let tiles = self.lock();
        let place = tiles.places[self.index(tile)].as_ref();
        let (pack, place) = place.context("a tile is missing")?;
        let (path, file) = match (pack, &tiles.own) {
            (PackOf::Other(i), _) => (&tiles.others[*i].0, &tiles.others[*i].1),
            (PackOf::This, own) => {
                let own = own.as_ref().context("a tile is missing")?;
                (&own.path, &own.file)
            }
        };
        read_content(file, place).with_context(|| path.display().to_string())
    }

    /// Removes the partial packs of the shard, once its pack is written.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn remove(&self) -> Result<()> {
        for path in partial_packs(&self.shards, &self.stem)? {
            // Another process may have removed it, and a file that stays does no harm.
            let _ = std::fs::remove_file(path);
        }
        Ok(())
    }

    /// The error of a recovery that failed. After an interruption the tiles are flushed to disk.
    pub fn explain(&self, error: Error) -> Error {
        if !error.is::<Cancelled>() {
            return error;
        }
        let (count, tiles) = (self.count(), self.lock());
        let synced = tiles
            .own
            .as_ref()
            .map(|own| (&own.path, own.file.sync_data()));
        if let Some((path, Err(e))) = synced {
            return Error::new(e).context(format!("{}: cannot be written", path.display()));
        }
        let all = tiles.places.len();
        let kept =
            format!("interrupted: {count} of {all} tiles are kept; the same command continues");
        Interrupted(kept).into()
    }

    fn lock(&self) -> MutexGuard<'_, PartialTiles> {
        self.tiles.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Index of a tile in the shard.
    fn index(&self, tile: u32) -> usize {
        (tile - self.key.items.start) as usize
    }
}

impl TileSink for PartialShard {
    fn count(&self) -> usize {
        self.lock().places.iter().flatten().count()
    }

    fn has(&self, i: usize) -> bool {
        self.lock().places[self.index(i as u32)].is_some()
    }

    fn add(&self, i: usize, content: &[u8]) -> Result<()> {
        let record = encode_record(i as u32, content)?;
        let mut tiles = self.lock();
        let mut own = match tiles.own.take() {
            Some(own) => own,
            None => OwnPack::create(&self.shards, &self.stem, &self.key)?,
        };
        let start = own.end + RECORD_HEAD_BYTES as u64;
        let written = own.append(&record);
        let place = start..own.end;
        tiles.own = Some(own);
        written?;
        tiles.places[self.index(i as u32)] = Some((PackOf::This, place));
        Ok(())
    }
}

impl OwnPack {
    /// Creates a partial pack with this key, under a name of its own that begins with `stem`.
    fn create(shards: &Path, stem: &str, key: &PackKey) -> Result<Self> {
        let beside = shards.join(stem);
        let (mut builder, folder) = temporary_beside(&beside, 0o666);
        let file = builder.prefix(stem).suffix(".partial").tempfile_in(folder);
        let (file, path) = file
            .and_then(|file| Ok(file.keep()?))
            .map_err(without_path)
            .context("cannot be created; may you write there?")
            .with_context(|| format!("{}*.partial", beside.display()))?;
        let mut own = Self { path, file, end: 0 };
        own.append(&beginning(key)?)?;
        Ok(own)
    }

    fn append(&mut self, bytes: &[u8]) -> Result<()> {
        let place = self.file.seek(SeekFrom::Start(self.end));
        place
            .and_then(|_| self.file.write_all(bytes))
            .with_context(|| format!("{}: cannot be written", self.path.display()))?;
        self.end += bytes.len() as u64;
        Ok(())
    }
}

/// Paths of the partial packs whose names begin with `stem`.
fn partial_packs(shards: &Path, stem: &str) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(shards).with_context(|| shards.display().to_string())? {
        let entry = entry.with_context(|| shards.display().to_string())?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(stem) && name.ends_with(".partial") {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}
