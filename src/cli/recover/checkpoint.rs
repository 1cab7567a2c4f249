//! The checkpoint of a recovery: the tiles recovered so far, to resume from after an interruption.
//!
//! An append-only file beside the output, little-endian:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `LTMPART\n` |
//! | 4, 4 | length and CRC-32C of the key |
//! | … | the [`RunKey`] as JSON |
//! | records | tile number, length, CRC-32C of these two and the content (4 bytes each), content |
//!
//! The first record has the number `u32::MAX` and holds the [fingerprint](super::run_key) of the prepared recovery; one
//! record for each tile follows, in the order of completion. When the process ends, only the last record can be
//! incomplete; it is then ignored.

use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use super::run_key::RunKey;

/// The first bytes of a checkpoint.
const MAGIC: [u8; 8] = *b"LTMPART\n";
/// Bytes before the key: magic, length, checksum.
const PREAMBLE_BYTES: usize = 16;
/// Bytes before the content of a record: tile number, length, checksum.
const RECORD_HEAD_BYTES: usize = 12;
/// Stands for the tile number in the record of the fingerprint.
const FINGERPRINT: u32 = u32::MAX;
/// The key names every file of the capture; thousands of shots take far less.
const MAX_KEY_BYTES: u32 = 64 << 20;

/// The checkpoint of the running recovery. Its file is deleted on drop if it holds no tile, and by
/// [`delete`](Self::delete).
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    /// Offset and length of each tile's record content.
    records: Vec<Option<(u64, u32)>>,
    /// End of the last complete record.
    end: u64,
    fingerprint: Option<Vec<u8>>,
    delete_on_drop: bool,
    existed: bool,
}

impl Checkpoint {
    /// Creates the checkpoint of the recovery to `output`, or opens an existing one if `resume` is set.
    pub fn open(output: &Path, key: &RunKey, resume: bool) -> Result<Self> {
        let mut name = OsString::from(output);
        name.push(".checkpoint");
        let path = PathBuf::from(name);
        let open = || -> Result<Self> {
            let mut options = OpenOptions::new();
            let options = options.read(true).write(true).create(true).truncate(false);
            let file = options
                .open(&path)
                .context("cannot be created; does its folder exist, and may you write there?")?;
            // A file system without locks is no reason to fail.
            if let Err(TryLockError::WouldBlock) = file.try_lock() {
                bail!("is in use: another process recovers to the same output; let it finish");
            }
            let mut checkpoint = Self {
                path: path.clone(),
                file,
                records: vec![None; key.tiles],
                end: 0,
                fingerprint: None,
                delete_on_drop: false,
                existed: false,
            };
            if !checkpoint.load(key, resume)? {
                checkpoint.begin(key)?;
            }
            Ok(checkpoint)
        };
        let checkpoint = open().with_context(|| path.display().to_string())?;
        checkpoint.announce(resume);
        Ok(checkpoint)
    }

    /// Tells the user what the recovery resumes from.
    fn announce(&self, resume: bool) {
        match (self.count(), resume, self.existed) {
            (0, false, _) => {}
            (0, true, true) => eprintln!(
                "note: the checkpoint is damaged or has no tile yet; starting from the beginning"
            ),
            (0, true, false) => {
                eprintln!(
                    "note: there is no checkpoint to resume from; starting from the beginning"
                );
            }
            (count, ..) => eprintln!("resuming with {count} of {} tiles", self.records.len()),
        }
    }

    /// Number of tiles in the checkpoint.
    pub fn count(&self) -> usize {
        self.records.iter().flatten().count()
    }

    /// Whether tile `i` is in the checkpoint.
    pub fn has(&self, i: usize) -> bool {
        self.records[i].is_some()
    }

    /// Flushes the tiles to disk, and returns a message for a recovery that was interrupted.
    pub fn sync_after_interruption(&self) -> Result<String> {
        let (count, tiles, path) = (self.count(), self.records.len(), self.path.display());
        if count == 0 {
            return Ok("interrupted before the first tile: nothing is kept".to_owned());
        }
        let synced = self.file.sync_data();
        synced.with_context(|| format!("{path}: cannot be written"))?;
        Ok(format!(
            "interrupted: {count} of {tiles} tiles are kept in {path}; to continue, give the same command \
             with --resume; to discard them, delete that file"
        ))
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
            _ => {
                self.append(FINGERPRINT, &fingerprint)?;
                self.fingerprint = Some(fingerprint.to_vec());
                Ok(())
            }
        }
    }

    /// Appends tile `i` with `content`, encoded by [`tile_record`](super::tile_record).
    pub fn add(&mut self, i: usize, content: &[u8]) -> Result<()> {
        self.records[i] = Some(self.append(i as u32, content)?);
        self.delete_on_drop = false;
        Ok(())
    }

    /// Reads the content of tile `i`'s record.
    pub fn read(&mut self, i: usize) -> io::Result<Vec<u8>> {
        let (start, length) = self.records[i].ok_or(ErrorKind::NotFound)?;
        let mut content = vec![0; length as usize];
        self.file.seek(SeekFrom::Start(start))?;
        self.file.read_exact(&mut content)?;
        Ok(content)
    }

    /// Deletes the checkpoint, once the output is written.
    pub fn delete(mut self) {
        self.delete_on_drop = true;
    }

    /// Appends a record; returns the offset and length of its content.
    fn append(&mut self, number: u32, content: &[u8]) -> Result<(u64, u32)> {
        let mut append = || -> Result<(u64, u32)> {
            let mut bytes = Vec::with_capacity(RECORD_HEAD_BYTES + content.len());
            let length = u32::try_from(content.len()).context("a tile is too large")?;
            bytes.extend(number.to_le_bytes());
            bytes.extend(length.to_le_bytes());
            let crc = crc32c::crc32c_append(crc32c::crc32c(&bytes), content);
            bytes.extend(crc.to_le_bytes());
            bytes.extend(content);
            self.file.seek(SeekFrom::Start(self.end))?;
            self.file.write_all(&bytes)?;
            let start = self.end + RECORD_HEAD_BYTES as u64;
            self.end += bytes.len() as u64;
            Ok((start, length))
        };
        append().with_context(|| format!("{}: cannot be written", self.path.display()))
    }

    /// Loads the records of an existing checkpoint. Returns false if it holds no tile.
    fn load(&mut self, key: &RunKey, resume: bool) -> Result<bool> {
        let bytes = self.file.metadata()?.len();
        self.existed = bytes > 0;
        let Some(recorded) = self.read_key(bytes)? else {
            return Ok(false);
        };
        self.records = self.read_records(bytes, recorded.tiles)?;
        let (count, tiles) = (self.count(), recorded.tiles);
        if count == 0 {
            self.records = vec![None; key.tiles];
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

    /// Reads the key; `None` if the file ends before its end.
    fn read_key(&mut self, bytes: u64) -> Result<Option<RunKey>> {
        let mut preamble = [0; PREAMBLE_BYTES];
        let present = bytes.min(PREAMBLE_BYTES as u64) as usize;
        self.file.read_exact(&mut preamble[..present])?;
        let magic = present.min(MAGIC.len());
        if preamble[..magic] != MAGIC[..magic] {
            bail!("exists and is not a checkpoint; move it away");
        }
        let [length, crc] = [8, 12].map(|at| u32_at(&preamble, at));
        self.end = PREAMBLE_BYTES as u64 + u64::from(length);
        if present < PREAMBLE_BYTES || (length <= MAX_KEY_BYTES && bytes < self.end) {
            return Ok(None);
        }
        let mut json = vec![0; length.min(MAX_KEY_BYTES) as usize];
        self.file.read_exact(&mut json)?;
        ensure!(
            length <= MAX_KEY_BYTES && crc32c::crc32c(&json) == crc,
            "is damaged; delete it to start from the beginning"
        );
        let key = serde_json::from_slice(&json).context(
            "was written by another version of this program; use that version, or delete it to start from \
             the beginning",
        )?;
        Ok(Some(key))
    }

    /// Reads all complete records, from the end of the key.
    fn read_records(&mut self, bytes: u64, tiles: usize) -> Result<Vec<Option<(u64, u32)>>> {
        let mut records = vec![None; tiles];
        let mut reader = BufReader::with_capacity(1 << 18, &self.file);
        loop {
            let mut head = [0; RECORD_HEAD_BYTES];
            if bytes.saturating_sub(self.end) < RECORD_HEAD_BYTES as u64 {
                break;
            }
            reader.read_exact(&mut head)?;
            let [number, length, crc] = [0, 4, 8].map(|at| u32_at(&head, at));
            let start = self.end + RECORD_HEAD_BYTES as u64;
            if bytes - start < u64::from(length) {
                break;
            }
            let mut content = vec![0; length as usize];
            reader.read_exact(&mut content)?;
            let end = start + u64::from(length);
            if crc32c::crc32c_append(crc32c::crc32c(&head[..8]), &content) != crc {
                // A crash may leave a last record of the right length without its bytes.
                if end < bytes {
                    eprintln!(
                        "warning: {} is damaged after {} tiles; the others are recovered again",
                        self.path.display(),
                        records.iter().flatten().count()
                    );
                }
                break;
            }
            match number {
                FINGERPRINT => self.fingerprint = Some(content),
                tile if (tile as usize) < tiles => records[tile as usize] = Some((start, length)),
                _ => break,
            }
            self.end = end;
        }
        Ok(records)
    }

    /// Writes the key of a new checkpoint.
    fn begin(&mut self, key: &RunKey) -> Result<()> {
        let json = serde_json::to_vec(key)?;
        let length = u32::try_from(json.len()).ok();
        let length = length.filter(|length| *length <= MAX_KEY_BYTES);
        let length = length.context("the capture has too many files")?;
        self.fingerprint = None;
        self.file.set_len(0)?;
        self.file.rewind()?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(crc32c::crc32c(&json).to_le_bytes());
        bytes.extend(json);
        self.file.write_all(&bytes)?;
        self.end = bytes.len() as u64;
        self.delete_on_drop = true;
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

/// The little-endian number at offset `at`.
fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}
