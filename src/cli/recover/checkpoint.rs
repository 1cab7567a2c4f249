//! The checkpoint of a recovery: the tiles recovered so far, to resume from after an interruption.
//!
//! A file beside the output: the 8 bytes `LTMPART2`, then [records](crate::cli::records):
//!
//! | number | content |
//! |---|---|
//! | `u32::MAX` | the [`CheckpointKey`] as JSON; the first record |
//! | `u32::MAX - 1` | the [fingerprint](super::checkpoint_key) of the prepared recovery; the second record |
//! | index of a tile | the [tile](crate::export::encode_tile), compressed by zstd; in the order of completion |
//!
//! When the process ends, only the last record can be incomplete; it is then ignored.

use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Error, Result, bail, ensure};

use super::checkpoint_key::CheckpointKey;
use super::tile_recovery::{TileSink, decompress_tile};
use crate::cli::process_resources::Interrupted;
use crate::cli::records::{RECORD_HEAD_BYTES, RecordReader, encode_record, read_content};

const MAGIC: [u8; 8] = *b"LTMPART2";
/// What the magics of all versions begin with.
const MAGIC_OF_ANY_VERSION: &[u8] = b"LTMPART";
const DAMAGED: &str = "is damaged; delete it to start from the beginning";
const OTHER_VERSION: &str = "was written by another version of this program; use that version, or delete it to start \
                             from the beginning";
/// Maximum length of a key. Tens of thousands of photographs need a few megabytes.
const MAX_KEY_BYTES: u32 = 64 << 20;
const KEY: u32 = u32::MAX;
const FINGERPRINT: u32 = u32::MAX - 1;

/// The checkpoint of the running recovery.
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    /// The range of each tile's content.
    tiles: Vec<Option<Range<u64>>>,
    /// End of the last complete record.
    end: u64,
    fingerprint: Option<Vec<u8>>,
    /// While it holds no tile, and once the output is written.
    pub delete_on_drop: bool,
}

/// Locks a checkpoint that threads share.
pub fn lock(checkpoint: &Mutex<Checkpoint>) -> MutexGuard<'_, Checkpoint> {
    checkpoint.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Another process writes the same file.
#[derive(Debug, thiserror::Error)]
#[error("is in use: another process recovers to the same output; let it finish")]
pub struct CheckpointInUseError;

impl Checkpoint {
    /// Creates the checkpoint of the recovery to `output`, or opens an existing one if `resume` is set.
    pub fn open(output: &Path, key: &CheckpointKey, resume: bool) -> Result<Self> {
        let mut path = OsString::from(output);
        path.push(".checkpoint");
        let path = PathBuf::from(path);
        Self::create_or_load(&path, key, resume).with_context(|| path.display().to_string())
    }

    fn create_or_load(path: &Path, key: &CheckpointKey, resume: bool) -> Result<Self> {
        let mut options = File::options();
        let options = options.read(true).write(true).create(true).truncate(false);
        let file = options
            .open(path)
            .context("cannot be created; does its folder exist, and may you write there?")?;
        // A file system without locks is no reason to fail.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            bail!(CheckpointInUseError);
        }
        let bytes = file.metadata()?.len();
        let mut checkpoint = Self {
            path: path.to_owned(),
            file,
            tiles: vec![None; key.tiles],
            end: 0,
            fingerprint: None,
            delete_on_drop: false,
        };
        if checkpoint.load(key, resume, bytes)? {
            let (count, tiles) = (checkpoint.count(), key.tiles);
            eprintln!("resuming with {count} of {tiles} tiles");
            return Ok(checkpoint);
        }
        if resume {
            let reason = match bytes {
                0 => "there is no checkpoint to resume from",
                _ => "the checkpoint is damaged or has no tile yet",
            };
            eprintln!("note: {reason}; starting from the beginning");
        }
        checkpoint.tiles = vec![None; key.tiles];
        checkpoint.fingerprint = None;
        let bytes = [&MAGIC[..], &encode_record(KEY, &serde_json::to_vec(key)?)?].concat();
        checkpoint.file.set_len(0)?;
        checkpoint.file.rewind()?;
        checkpoint.file.write_all(&bytes)?;
        checkpoint.end = bytes.len() as u64;
        checkpoint.delete_on_drop = true;
        Ok(checkpoint)
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.tiles.iter().flatten().count()
    }

    /// Flushes the tiles to disk, and returns the error of a recovery that was interrupted.
    pub fn interrupted(&self) -> Error {
        let (count, tiles, path) = (self.count(), self.tiles.len(), self.path.display());
        let message = match (count, self.file.sync_data()) {
            (0, _) => "interrupted before the first tile: nothing is kept".to_owned(),
            (_, Ok(())) => format!(
                "interrupted: {count} of {tiles} tiles are kept in {path}; to continue, give the same \
                 command with --resume; to discard them, delete that file"
            ),
            (_, Err(e)) => return Error::new(e).context(format!("{path}: cannot be written")),
        };
        Interrupted(message).into()
    }

    /// Records the fingerprint of the prepared recovery, or compares it with that of the tiles in the checkpoint, which
    /// must be equal.
    pub fn set_fingerprint(&mut self, fingerprint: u32) -> Result<()> {
        let fingerprint = fingerprint.to_le_bytes();
        match &self.fingerprint {
            Some(recorded) if *recorded == fingerprint => Ok(()),
            _ if self.count() > 0 => bail!(
                "{}: does not match: another build of this program or another machine began it; resume \
                 there, or delete it to start from the beginning",
                self.path.display()
            ),
            _ => self.append(FINGERPRINT, &fingerprint).map(drop),
        }
    }

    /// Reads tile `i`'s record, decompressed.
    pub fn read(&self, i: usize) -> io::Result<Vec<u8>> {
        let range = self.tiles[i].clone().ok_or(ErrorKind::NotFound)?;
        decompress_tile(&read_content(&self.file, &range)?)
    }

    /// Appends a record; returns the range of its content.
    fn append(&mut self, number: u32, content: &[u8]) -> Result<Range<u64>> {
        let bytes = encode_record(number, content)?;
        let start = self.end;
        let written = self.file.seek(SeekFrom::Start(start));
        written
            .and_then(|_| self.file.write_all(&bytes))
            .with_context(|| format!("{}: cannot be written", self.path.display()))?;
        self.end += bytes.len() as u64;
        Ok(start + RECORD_HEAD_BYTES as u64..self.end)
    }

    /// Loads the records of an existing checkpoint of so many bytes. Returns false if it holds no tile.
    fn load(&mut self, key: &CheckpointKey, resume: bool, bytes: u64) -> Result<bool> {
        let mut reader = BufReader::with_capacity(1 << 18, self.file.try_clone()?);
        let mut magic = Vec::new();
        let mut start = reader.by_ref().take(MAGIC.len() as u64);
        start.read_to_end(&mut magic)?;
        ensure!(
            MAGIC.starts_with(&magic) || !magic.starts_with(MAGIC_OF_ANY_VERSION),
            OTHER_VERSION
        );
        ensure!(
            MAGIC.starts_with(&magic),
            "exists and is not a checkpoint; move it away"
        );
        self.end = MAGIC.len() as u64;
        let mut records = RecordReader::new(reader, self.end, bytes);
        let Some(head) = records.head()? else {
            return Ok(false);
        };
        // A key whose length is damaged must not look cut off: tiles may follow it.
        ensure!(head.number == KEY && head.length <= MAX_KEY_BYTES, DAMAGED);
        let first = records.record(head)?.filter(|first| first.is_intact);
        let first = first.context(DAMAGED)?;
        let recorded: CheckpointKey =
            serde_json::from_slice(&first.content).context(OTHER_VERSION)?;
        self.end = first.range.end;
        self.tiles = vec![None; recorded.tiles];
        while let Some(record) = records.next()? {
            if !record.is_intact {
                // A crash may leave a last record of the right length without its bytes.
                if record.range.end < bytes {
                    let (path, count) = (self.path.display(), self.count());
                    eprintln!(
                        "warning: {path} is damaged after {count} tiles; the others are recovered again"
                    );
                }
                break;
            }
            let end = record.range.end;
            match record.number {
                FINGERPRINT => self.fingerprint = Some(record.content),
                tile if (tile as usize) < recorded.tiles => {
                    self.tiles[tile as usize] = Some(record.range);
                }
                _ => break,
            }
            self.end = end;
        }
        let (count, tiles) = (self.count(), recorded.tiles);
        if count == 0 {
            return Ok(false);
        }
        ensure!(
            resume,
            "holds {count} of {tiles} tiles of an unfinished recovery; add --resume to continue it, or \
             delete it to start from the beginning"
        );
        if let Some(difference) = recorded.difference(key) {
            bail!(
                "does not match: {difference}; give --resume with the original options and files, or \
                 delete it to start from the beginning"
            );
        }
        // Removes an incomplete last record.
        self.file.set_len(self.end)?;
        Ok(true)
    }
}

/// Of threads that share it.
impl TileSink for Mutex<Checkpoint> {
    fn count(&self) -> usize {
        lock(self).count()
    }

    fn has(&self, i: usize) -> bool {
        lock(self).tiles[i].is_some()
    }

    fn add(&self, i: usize, content: &[u8]) -> Result<()> {
        let mut checkpoint = lock(self);
        checkpoint.tiles[i] = Some(checkpoint.append(i as u32, content)?);
        checkpoint.delete_on_drop = false;
        Ok(())
    }
}

impl Drop for Checkpoint {
    fn drop(&mut self) {
        if self.delete_on_drop {
            // A file that stays does no harm.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
