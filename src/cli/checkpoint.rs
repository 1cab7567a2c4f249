//! What is kept of a recovery while it runs, so that it can go on after an end that was none.
//!
//! A file beside the output, named after it: a head that says what the recovery was asked for and
//! of which files, then a record that tells what was learned, then one a tile, in the order in which
//! they came, each with a checksum. It is only ever appended to. Whatever ends the process, at worst the last record is torn, and left
//! out by the next.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

/// How every checkpoint begins.
const MAGIC: [u8; 8] = *b"LTMPART\n";
/// Tile number, bytes and checksum before each record.
const RECORD_HEAD: usize = 12;
/// In place of a tile's number: what was learned or chosen before the first tile.
const PREPARED: u32 = u32::MAX;
/// The head names every file of the capture; thousands of shots are well below this.
const MOST_HEAD_BYTES: u32 = 64 << 20;

/// Length and crc32c of a file's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Contents {
    bytes: u64,
    crc: u32,
}

impl Contents {
    /// Reads the whole file.
    pub fn of(path: &Path) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let mut piece = vec![0; 1 << 18];
        let mut contents = Self { bytes: 0, crc: 0 };
        loop {
            match file.read(&mut piece) {
                Ok(0) => return Ok(contents),
                Ok(n) => {
                    contents.bytes += n as u64;
                    contents.crc = crc32c::crc32c_append(contents.crc, &piece[..n]);
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    }
}

/// All that decides what the tiles are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipe {
    /// Program and version.
    pub program: String,
    /// What the options come to, by their names.
    pub options: BTreeMap<String, String>,
    /// The capture's files by name.
    pub files: BTreeMap<String, Contents>,
    /// Number of tiles.
    pub tiles: usize,
}

impl Recipe {
    /// In what `self`, by which a recovery began, is not `now`; `None` where they are the same.
    fn difference(&self, now: &Self) -> Option<String> {
        if self.program != now.program {
            return Some(format!(
                "it is by {}, this is {}",
                self.program, now.program
            ));
        }
        let none = || "not given".to_owned();
        let names = self.options.keys().chain(now.options.keys());
        for name in names {
            let [was, is] = [self, now].map(|r| r.options.get(name).cloned());
            if was != is {
                let (was, is) = (was.unwrap_or_else(none), is.unwrap_or_else(none));
                return Some(format!("{name} was {was}, and is {is} now"));
            }
        }
        let mut names = self.files.keys().chain(now.files.keys());
        let changed = names.find(|name| self.files.get(*name) != now.files.get(*name));
        let other = (self.tiles != now.tiles).then(|| "it has other tiles".to_owned());
        changed
            .map(|name| format!("{name} in the capture has changed since"))
            .or(other)
    }
}

/// The checkpoint of a recovery at work. Where it goes away without a tile, or [`done`](Self::done),
/// so does its file.
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    /// Where each tile's record lies, and how long it is.
    records: Vec<Option<(u64, u32)>>,
    end: u64,
    /// What tells the preparation that the tiles are of.
    prepared: Option<Vec<u8>>,
    /// Whether the file goes when this does.
    remove: bool,
    /// Whether there was one already.
    found: bool,
}

impl Checkpoint {
    /// Where the checkpoint of the recovery to `output` lies.
    pub fn path(output: &Path) -> PathBuf {
        let mut name = OsString::from(output);
        name.push(".checkpoint");
        name.into()
    }

    /// Begins a checkpoint for `output`, or goes on with the one that is there if `resume` says so.
    pub fn open(output: &Path, recipe: &Recipe, resume: bool) -> Result<Self> {
        let path = Self::path(output);
        let open = || -> Result<Self> {
            let mut options = OpenOptions::new();
            let options = options.read(true).write(true).create(true).truncate(false);
            let file = options
                .open(&path)
                .context("cannot be created; does its folder exist, and may you write there?")?;
            if let Err(TryLockError::WouldBlock) = file.try_lock() {
                bail!("is in use: another process recovers the same file; let it finish");
            } // A file system without locks is no reason not to work.
            let mut checkpoint = Self {
                path: path.clone(),
                file,
                records: vec![None; recipe.tiles],
                end: 0,
                prepared: None,
                remove: false,
                found: false,
            };
            if !checkpoint.load(recipe, resume)? {
                checkpoint.begin(recipe)?;
            }
            Ok(checkpoint)
        };
        open().with_context(|| path.display().to_string())
    }

    /// Number of tiles kept.
    pub fn count(&self) -> usize {
        self.records.iter().flatten().count()
    }

    /// Whether there was one already, of any tiles or none.
    pub fn found(&self) -> bool {
        self.found
    }

    /// Number of tiles there will be.
    pub fn tiles(&self) -> usize {
        self.records.len()
    }

    /// Makes sure that what is kept is on the disk. Returns what there is to say of a recovery that
    /// goes no further.
    pub fn interrupted(&self) -> Result<String> {
        let (count, tiles, path) = (self.count(), self.tiles(), self.path.display());
        if count == 0 {
            return Ok("interrupted before the first tile: nothing is kept".to_owned());
        }
        let synced = self.file.sync_data();
        synced.with_context(|| format!("{path}: cannot be written"))?;
        Ok(format!(
            "interrupted: {count} of {tiles} tiles are kept in {path}; give the same command with \
             --resume to go on, or delete that file"
        ))
    }

    /// Whether tile `i` is kept.
    pub fn has(&self, i: usize) -> bool {
        self.records[i].is_some()
    }

    /// Takes what tells the preparation that tiles will be of. An error if tiles are kept that are of
    /// another: the same photographs may teach another build, or another machine, something else.
    pub fn prepared(&mut self, by: u32) -> Result<()> {
        let by = by.to_le_bytes();
        match &self.prepared {
            Some(kept) if *kept == by => Ok(()),
            _ if self.count() > 0 => bail!(
                "{}: does not fit: another build of this program, or another machine, began it; go \
                 on with that one, or delete it to start anew",
                self.path.display()
            ),
            _ => {
                self.append(PREPARED, &by)?;
                self.prepared = Some(by.to_vec());
                Ok(())
            }
        }
    }

    /// Keeps tile `i`, of which [`tile_record::encode`] made `record`.
    pub fn add(&mut self, i: usize, record: &[u8]) -> Result<()> {
        self.records[i] = Some(self.append(i as u32, record)?);
        self.remove = false;
        Ok(())
    }

    /// Writes a record; where it lies, and how long it is.
    fn append(&mut self, number: u32, record: &[u8]) -> Result<(u64, u32)> {
        let mut append = || -> Result<(u64, u32)> {
            let mut bytes = Vec::with_capacity(RECORD_HEAD + record.len());
            let length = u32::try_from(record.len()).context("a tile is too large")?;
            bytes.extend(number.to_le_bytes());
            bytes.extend(length.to_le_bytes());
            let crc = crc32c::crc32c_append(crc32c::crc32c(&bytes), record);
            bytes.extend(crc.to_le_bytes());
            bytes.extend(record);
            self.file.seek(SeekFrom::Start(self.end))?;
            self.file.write_all(&bytes)?;
            let start = self.end + RECORD_HEAD as u64;
            self.end += bytes.len() as u64;
            Ok((start, length))
        };
        append().with_context(|| format!("{}: cannot be written", self.path.display()))
    }

    /// Reads the record of tile `i` back.
    pub fn record(&mut self, i: usize) -> io::Result<Vec<u8>> {
        let missing = || io::Error::from(ErrorKind::NotFound);
        let (start, length) = self.records[i].ok_or_else(missing)?;
        let mut record = vec![0; length as usize];
        self.file.seek(SeekFrom::Start(start))?;
        self.file.read_exact(&mut record)?;
        Ok(record)
    }

    /// Removes the checkpoint: it is no longer needed.
    pub fn done(mut self) {
        self.remove = true;
    }

    /// Takes in what is kept. False where nothing is: a new file, or one that never got a tile.
    fn load(&mut self, recipe: &Recipe, resume: bool) -> Result<bool> {
        let bytes = self.file.metadata()?.len();
        self.found = bytes > 0;
        let Some(kept) = self.read_head(bytes)? else {
            return Ok(false);
        };
        let records = self.read_records(bytes, kept.tiles)?;
        let count = records.iter().flatten().count();
        if count == 0 {
            return Ok(false);
        }
        let (tiles, way_out) = (kept.tiles, "delete it to start anew");
        self.records = records;
        ensure!(
            resume,
            "holds {count} of {tiles} tiles of a recovery that did not come to its end; add --resume to \
             go on with it, or {way_out}"
        );
        if let Some(difference) = kept.difference(recipe) {
            bail!(
                "does not fit: {difference}; give --resume with what it was begun with, or {way_out}"
            );
        }
        // A torn last record goes.
        self.file.set_len(self.end)?;
        Ok(true)
    }

    /// The head; `None` of a file that is empty or ends within it.
    fn read_head(&mut self, bytes: u64) -> Result<Option<Recipe>> {
        let mut start = [0; 16];
        let present = bytes.min(16) as usize;
        self.file.read_exact(&mut start[..present])?;
        let magic = present.min(MAGIC.len());
        if start[..magic] != MAGIC[..magic] {
            bail!("is there already and is not a checkpoint; move it away");
        }
        let [length, crc] = [8, 12]
            .map(|at| u32::from_le_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]));
        self.end = 16 + u64::from(length);
        if present < 16 || (length <= MOST_HEAD_BYTES && bytes < self.end) {
            return Ok(None);
        }
        let mut json = vec![0; length.min(MOST_HEAD_BYTES) as usize];
        self.file.read_exact(&mut json)?;
        ensure!(
            length <= MOST_HEAD_BYTES && crc32c::crc32c(&json) == crc,
            "is damaged; delete it to start anew"
        );
        let head = serde_json::from_slice(&json);
        Ok(Some(head.context(
            "is by another version of this program; use that one, or delete it to start anew",
        )?))
    }

    /// The records from here to the first that is torn, which only the last can be.
    fn read_records(&mut self, bytes: u64, tiles: usize) -> Result<Vec<Option<(u64, u32)>>> {
        let mut records = vec![None; tiles];
        let mut reader = io::BufReader::with_capacity(1 << 18, &self.file);
        loop {
            let mut head = [0; RECORD_HEAD];
            if bytes.saturating_sub(self.end) < RECORD_HEAD as u64 {
                break;
            }
            reader.read_exact(&mut head)?;
            let [tile, length, crc] = [0, 4, 8]
                .map(|at| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]));
            let start = self.end + RECORD_HEAD as u64;
            if bytes - start < u64::from(length) {
                break;
            }
            let mut record = vec![0; length as usize];
            reader.read_exact(&mut record)?;
            let end = start + u64::from(length);
            if crc32c::crc32c_append(crc32c::crc32c(&head[..8]), &record) != crc {
                // A crash may leave a last record of the right length whose bytes never came.
                if end < bytes {
                    eprintln!(
                        "warning: {} is damaged after {} tiles; the others are recovered anew",
                        self.path.display(),
                        records.iter().flatten().count()
                    );
                }
                break;
            }
            match tile {
                PREPARED => self.prepared = Some(record),
                tile if (tile as usize) < tiles => records[tile as usize] = Some((start, length)),
                _ => break,
            }
            self.end = end;
        }
        Ok(records)
    }

    fn begin(&mut self, recipe: &Recipe) -> Result<()> {
        let json = serde_json::to_vec(recipe)?;
        let length = u32::try_from(json.len()).ok();
        let length = length.filter(|length| *length <= MOST_HEAD_BYTES);
        let length = length.context("the capture has too many files")?;
        self.prepared = None;
        self.file.set_len(0)?;
        self.file.rewind()?;
        let mut head = MAGIC.to_vec();
        head.extend(length.to_le_bytes());
        head.extend(crc32c::crc32c(&json).to_le_bytes());
        head.extend(json);
        self.file.write_all(&head)?;
        self.end = head.len() as u64;
        self.remove = true;
        Ok(())
    }
}

impl Drop for Checkpoint {
    fn drop(&mut self) {
        if self.remove {
            // Of no tiles, or of tiles that are in the output: no harm, should it stay.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
